"""The solid tooth in extended precision, from the strains in cylindrical coordinates, with one dense stiffness matrix.

Monomials s^k ξ^(i+1) ζ^j instead of Legendre polynomials; Gauss points in the parameters that make the section
analytic, the fillet's φ and the involute's roll angle, instead of √x and x; slopes of the section from the equations
of its curves instead of numerical differentiation; no symmetry classes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from types import SimpleNamespace as Namespace

import flint
import mpmath as mp

from tests.stability.extended.balls import Ball, Matrix, ball, entries, gauss, legendre, powers, solve

#: Gauss points of each of the two panels of the section, fillet and involute.
POINTS = 36


@dataclass(frozen=True)
class Station:
    """A point of the section's outline: R, half-angle ψ, dψ/dR, weight dR of quadrature."""

    R: Ball
    psi: Ball
    slope: Ball
    weight: Ball


@dataclass(frozen=True)
class Tooth:
    """Tooth of a gear ``g`` of ``extended.geometry``: width, Young's modulus, Poisson's ratio, numbers of functions.

    With ``moving`` functions across the root moves as well, as polynomials of the angle and of z.
    """

    g: Namespace
    width: Ball
    E: Ball
    nu: Ball
    order: tuple[int, int, int]
    points: int = POINTS

    # -- section ------------------------------------------------------------------------------------------------------
    @cached_property
    def r_f(self) -> Ball:
        return ball(self.g.r_f)

    @cached_property
    def height(self) -> Ball:
        return ball(self.g.r_a) - self.r_f

    @cached_property
    def involute(self) -> list[Station]:
        """Stations of the flank: in the roll angle t, or in ln(t_p − t) where the tooth is all but pointed at t_p."""
        g, r_b = self.g, ball(self.g.r_b)
        low, high = (ball(mp.sqrt((x - g.r_b) * (x + g.r_b)) / g.r_b) for x in (g.form, g.r_a))
        pointed = ball(mp.findroot(lambda t: t - mp.atan(t) - g.half, mp.cbrt(3 * g.half)))
        if pointed - high > (pointed - low) / 6:
            nodes = gauss(self.points, low, high)
        else:
            start, stop = (pointed - high).log(), (pointed - low).log()
            count = int(float(stop - start)) + 1
            edges = [start + (stop - start) * i / count for i in range(count + 1)]
            logs = [x for panel in pairwise(edges) for x in gauss(self.points, *panel)]
            nodes = [(pointed - v.exp(), w * v.exp()) for v, w in logs]
        found = []
        for t, w in nodes:
            root = (1 + t * t).sqrt()
            psi = ball(g.half) - (t - t.atan())
            found.append(Station(r_b * root, psi, -t / (r_b * root), w * r_b * t / root))
        return found

    @cached_property
    def fillet(self) -> list[Station]:
        """Stations of the trochoid of the rounded rack tip."""
        g = self.g
        r, rho, cos_b = ball(g.r), ball(g.rack.rho), ball(mp.cos(g.beta))
        corner, depth = ball(g.rack.corner), ball(g.rack.depth)
        pitch = flint.arb.pi() / g.z
        found = []
        for phi, w in gauss(self.points, flint.arb(0), ball(g.rack.end)):
            sin, cos = phi.sin(), phi.cos()
            tan = sin / cos
            eta, deta = -depth - rho * cos, rho * sin
            x, dx = -eta * cos_b * tan, -cos_b * (deta * tan + eta * (1 + tan * tan))
            y, dy = r + eta, deta
            R = (x * x + y * y).sqrt()
            dR = (x * dx + y * dy) / R
            xi, dxi = (corner + rho * sin) / cos_b, rho * cos / cos_b
            psi = pitch - (x / y).atan() - (xi - x) / r
            dpsi = -(dx * y - x * dy) / (R * R) - (dxi - dx) / r
            found.append(Station(R, psi, dpsi / dR, w * dR))
        return found

    @cached_property
    def root_angle(self) -> Ball:
        """ψ at the root circle, φ = 0."""
        g = self.g
        return flint.arb.pi() / g.z - ball(g.rack.corner) / ball(mp.cos(g.beta)) / ball(g.r)

    @cached_property
    def screw(self) -> Ball:
        """κ = dθ/dz at constant s and R."""
        return ball(mp.tan(self.g.beta)) / ball(self.g.r)

    # -- stiffness ----------------------------------------------------------------------------------------------------
    def shapes(self, at: Station, s: Ball, moving: int) -> list[tuple[Ball, Ball, Ball]]:
        """Functions of the section with ∂/∂θ and ∂/∂R at constant θ; moving ones first."""
        found = []
        # θ = s ψ(R) + κ z: at constant θ and z, ∂s/∂R = −s ψ′/ψ; at constant R and z, ∂s/∂θ = 1/ψ
        spread = at.psi / self.root_angle
        turned = powers(spread * s, max(moving, 1))
        for k in range(moving):
            slope = k * turned[k - 1] / self.root_angle if k else flint.arb(0)
            found.append((turned[k], slope, flint.arb(0)))  # (θ/ψ_f)^k: constant along R
        across, inward = powers(s, self.order[0]), powers((at.R - self.r_f) / self.height, self.order[1] + 1)
        for k in range(self.order[0]):
            ds = k * across[k - 1] if k else flint.arb(0)
            for i in range(1, self.order[1] + 1):
                value = across[k] * inward[i]
                along_R = across[k] * i * inward[i - 1] / self.height - s * at.slope / at.psi * ds * inward[i]
                found.append((value, ds * inward[i] / at.psi, along_R))
        return found

    def section(self, moving: int) -> list[list[Matrix]]:
        """S[a][b] between functions of the section whose a-th and b-th derivative in z is taken, (3 n, 3 n)."""
        lam, mu = self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu)), self.E / (2 * (1 + self.nu))
        plain, slopes, stresses, stress_slopes = [], [], [], []
        for at in (*self.fillet, *self.involute):
            # exact in s: the integrand is a polynomial of degree 2 n
            for s, w in gauss(self.order[0] + 2, flint.arb(-1), flint.arb(1)):
                strain, slope = self.strains(at, self.shapes(at, s, moving))
                plain += strain
                slopes += slope
                volume = w * at.weight * at.R * at.psi
                stresses += stress(strain, lam * volume, mu * volume)
                stress_slopes += stress(slope, lam * volume, mu * volume)
        B, C = [entries(plain), entries(slopes)], [entries(stresses), entries(stress_slopes)]
        return [[B[a].transpose() * C[b] for b in range(2)] for a in range(2)]

    def strains(self, at: Station, shapes: list[tuple[Ball, Ball, Ball]]) -> tuple[list[list[Ball]], list[list[Ball]]]:
        """ε_θθ, ε_RR, ε_zz, γ_θR, γ_θz, γ_Rz (6, 3 n) of u_θ, u_R, u_z: factors of h(z), and of h′(z)."""
        zero, n = flint.arb(0), len(shapes)
        f = [v for v, _, _ in shapes]
        around = [t / at.R for _, t, _ in shapes]  # ∂_θ / R
        along = [r for _, _, r in shapes]
        twist = [-self.screw * t for _, t, _ in shapes]  # ∂_z at constant θ of what does not depend on z
        none = [zero] * n
        shear = [r - v / at.R for r, v in zip(along, f, strict=True)]
        strain = [
            around + [v / at.R for v in f] + none,
            none + along + none,
            none + none + twist,
            shear + around + none,
            twist + none + around,
            none + twist + along,
        ]
        slope = [none * 3, none * 3, none + none + f, none * 3, f + none + none, none + f + none]
        return strain, slope

    def stiffness(self, moving: int = 0) -> Matrix:
        """K of the amplitudes (field, function of the section, power of ζ = z/b)."""
        S, q, b = self.section(moving), self.order[2], self.width
        n = S[0][0].nrows()
        zero = flint.arb(0)
        Z = {
            (0, 0): [[b / (j + l + 1) for l in range(q)] for j in range(q)],
            (0, 1): [[flint.arb(l) / (j + l) if l else zero for l in range(q)] for j in range(q)],
            (1, 0): [[flint.arb(j) / (j + l) if j else zero for l in range(q)] for j in range(q)],
            (1, 1): [[j * l / (b * (j + l - 1)) if j and l else zero for l in range(q)] for j in range(q)],
        }
        rows = []
        for m in range(n):
            four = [[S[a][c][m, k] for a, c in Z] for k in range(n)]
            for j in range(q):
                weights = [[z[j][l] for z in Z.values()] for l in range(q)]
                rows.append([x[0] * w[0] + x[1] * w[1] + x[2] * w[2] + x[3] * w[3] for x in four for w in weights])
        return entries(rows)

    # -- flank --------------------------------------------------------------------------------------------------------
    def flank(self, p: int, q: int, moving: int = 0) -> Matrix:
        """∫∫ φ_a(R) φ_c(y) n·u dR dy on s = 1 of polynomials orthonormal on the flank, (p q, amplitudes)."""
        g = self.g
        r_b, form, tip = ball(g.r_b), ball(g.form), ball(g.r_a)
        cos_bb = ball(mp.cos(g.beta_b))
        sin_bb = ball(mp.sin(g.beta_b))
        n = moving + self.order[0] * self.order[1]
        rows = [[flint.arb(0)] * (3 * n) for _ in range(p)]
        for at in self.involute:
            cos = r_b / at.R
            sin = ((at.R - r_b) * (at.R + r_b)).sqrt() / at.R
            values = [v for v, _, _ in self.shapes(at, flint.arb(1), moving)]
            polynomials = legendre(p, 2 * (at.R - form) / (tip - form) - 1)
            for a, phi in enumerate(polynomials):
                for field, part in enumerate((-cos * cos_bb, -sin * cos_bb, sin_bb)):
                    factor = phi * at.weight * part / (tip - form).sqrt()
                    for m, v in enumerate(values):
                        rows[a][field * n + m] += factor * v
        axis = axis_projection(q, self.order[2])
        root = self.width.sqrt()
        return entries([[x * y * root for x in row for y in z] for row in rows for z in axis])

    def compliance(self, p: int, q: int) -> Matrix:
        """Between the polynomials of the flank, root held: what ``SolidTooth.matrix`` is, measured at the flank."""
        F = self.flank(p, q)
        return F * solve(self.stiffness(), F.transpose())


def stress(strain: list[list[Ball]], lam: Ball, mu: Ball) -> list[list[Ball]]:
    """Hooke's law."""
    trace = [lam * (a + b + c) for a, b, c in zip(*strain[:3], strict=True)]
    direct = [[t + 2 * mu * e for t, e in zip(trace, row, strict=True)] for row in strain[:3]]
    return direct + [[mu * e for e in row] for row in strain[3:]]


def axis_projection(count: int, order: int) -> list[list[Ball]]:
    """∫₀¹ P̂_c(2ζ − 1) ζ^j dζ."""
    table = [[flint.arb(0)] * order for _ in range(count)]
    for zeta, w in gauss(count + order, flint.arb(0), flint.arb(1)):
        monomials = powers(zeta, order)
        for c, v in enumerate(legendre(count, 2 * zeta - 1)):
            for j in range(order):
                table[c][j] += w * v * monomials[j]
    return table
