"""Ring and gear body in extended precision: complex amplitudes of e^{inθ}, teeth as in ``solid``, one wave at a time.

The functions are those of ``gearbench.compliance.ring``, as monomials; neither the real form that half-turn symmetry
allows nor any other symmetry is used, and harmonics of both signs are solved. The interpolation between the harmonics
computed, and that between the waves, are taken by their weights.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import flint
import mpmath as mp
import numpy as np

from gearbench.compliance.gear_body import FINEST, wave_weights, waves_computed
from gearbench.compliance.ring import GRADING, LAYER, harmonic_weights
from tests.stability.extended.balls import Ball, Matrix, ball, entries, gauss, legendre, powers, solve
from tests.stability.extended.solid import Tooth, axis_projection

#: Gauss points along the radius.
POINTS = 26


@dataclass(frozen=True)
class Ring:
    """Annulus held at its bore; ``order``: numbers of functions along R and along z."""

    bore: Ball
    radius: Ball
    width: Ball
    screw: Ball
    E: Ball
    nu: Ball
    order: tuple[int, int]

    def harmonic(self, n: int) -> Matrix:
        """Amplitudes (u_θ, u_R, u_z) × ĝ_j/√b of e^{inθ} on the rim per unit traction × 1/r_o, (3 q, 3 q) complex."""
        K, q = self.stiffness(n), self.order[1]
        p = self.order[0]
        # ∫ t · v̄ dA over the rim, t = ĝ_j/√b: every function of R is 1 there
        axis = axis_projection(q, q)
        load = flint.acb_mat(3 * p * q, 3 * q)
        for field in range(3):
            for i in range(p):
                for j in range(q):
                    for c in range(q):
                        load[(field * p + i) * q + j, field * q + c] = axis[c][j] * self.width.sqrt()
        return load.transpose() * K.solve(load, algorithm="approx")

    def stiffness(self, n: int) -> Matrix:
        """K per radian, (field, power of R, power of ζ) complex Hermitian."""
        q = self.order[1]
        lam, mu = self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu)), self.E / (2 * (1 + self.nu))
        rows, stresses = [], []
        zero, turn = flint.acb(0), flint.acb(0, n)
        axial = gauss(q + 1, flint.arb(0), flint.arb(1))
        for R, f, df, w in self.along(n):
            for zeta, v in axial:
                h = powers(zeta, q)
                dh = [j * h[j - 1] / self.width if j else flint.arb(0) for j in range(q)]
                value = [a * c for a in f for c in h]
                radial = [a * c for a in df for c in h]
                # θ = θ′ + κz: ∂_z at constant θ is ∂_z − iκn
                axis = [a * (d - self.screw * turn * c) for a in f for c, d in zip(h, dh, strict=True)]
                around = [turn * x / R for x in value]
                none = [zero] * len(value)
                strain = [
                    around + [x / R for x in value] + none,
                    none + radial + none,
                    none + none + axis,
                    [x - y / R for x, y in zip(radial, value, strict=True)] + around + none,
                    axis + none + around,
                    none + axis + radial,
                ]
                trace = [sum(x, zero) for x in zip(*strain[:3], strict=True)]
                volume = w * R * v * self.width
                for k, row in enumerate(strain):
                    rows.append([flint.acb(x) for x in row])
                    if k < 3:
                        stresses.append([volume * (lam * t + 2 * mu * x) for t, x in zip(trace, row, strict=True)])
                    else:
                        stresses.append([volume * mu * x for x in row])
        return flint.acb_mat(rows).conjugate().transpose() * flint.acb_mat(stresses)

    def along(self, n: int) -> list[tuple[Ball, list[Ball], list[Ball], Ball]]:
        """R, functions of R that vanish at the inner end of the layer and are 1 on the rim, slopes, weights."""
        p, found = self.order[0], []
        thickness = self.radius - self.bore
        layer = min(thickness, LAYER * self.radius / abs(n), key=float) if n else thickness
        span, grading = -(1 - layer / self.radius).log(), ball(GRADING)
        scale = grading.exp() - 1
        for w, weight in gauss(POINTS, flint.arb(0), flint.arb(1)):
            R = self.radius * (-span * ((grading * w).exp() - 1) / scale).exp()
            slope = R * span * grading * (grading * w).exp() / scale  # −dR/dw
            power = powers(1 - w, p + 1)
            found.append((R, power[1:], [(i + 1) * power[i] / slope for i in range(p)], weight * slope))
        return found


@dataclass(frozen=True)
class Body:
    """A gear's body with its teeth: ``gearbench.compliance.gear_body``."""

    tooth: Tooth
    bore: Ball
    heights: int
    widths: int
    order: int = 6

    @property
    def axis_order(self) -> int:
        return min(self.tooth.order[2], 6)

    @cached_property
    def tooth_parts(self) -> tuple[Matrix, Matrix]:
        """S of the tooth against orthonormal motions of its root (field, across, axis), and its flank under them."""
        tooth = self.tooth
        m, q, count = tooth.order[0], tooth.order[2], self.axis_order
        n = m + m * tooth.order[1]
        K = tooth.stiffness(moving=m)
        F = tooth.flank(self.heights, self.widths, moving=m)
        inner = [(f * n + k) * q + j for f in range(3) for k in range(m, n) for j in range(q)]
        root = [(f * n + k) * q + j for f in range(3) for k in range(m) for j in range(count)]
        # orthonormal Legendre functions of the root in monomials of s and ζ
        area = (2 * tooth.root_angle * tooth.r_f * tooth.width).sqrt()
        across, axis = coefficients(m, -1), coefficients(count, 0)
        T = flint.arb_mat(len(root), len(root))
        for f in range(3):
            for k in range(m):
                for j in range(count):
                    for k2 in range(k + 1):
                        for j2 in range(j + 1):
                            row, column = (f * m + k2) * count + j2, (f * m + k) * count + j
                            T[row, column] = across[k][k2] * axis[j][j2] / area
        K_ii, K_ir, K_rr = (pick(K, a, b) for a, b in ((inner, inner), (inner, root), (root, root)))
        follow = solve(K_ii, K_ir)
        S = K_rr - K_ir.transpose() * follow
        every = list(range(F.nrows()))
        phi = pick(F, every, root) - pick(F, every, inner) * follow
        return T.transpose() * S * T, phi * T

    def blocks(self, neighbours: int) -> list[Matrix]:
        """Deflection of the flank of tooth d due to the body, loads on tooth 0, d = −n … n."""
        tooth = self.tooth
        z, psi = tooth.g.z, tooth.root_angle
        S, phi = self.tooth_parts
        S, phi = flint.acb_mat(S), flint.acb_mat(phi)
        turns = int(np.ceil(FINEST / float(psi) / z))
        harmonics = self.harmonics(z // 2 + z * turns)
        total = [flint.arb_mat(phi.nrows(), phi.nrows()) for _ in range(2 * neighbours + 1)]
        weights = wave_weights(z)
        for i, m in enumerate(int(m) for m in waves_computed(z)):
            B = flint.acb_mat(S.nrows(), S.nrows())
            for n in range(m - z * turns, m + z * turns + 1, z):
                B += self.joined(harmonics[n], n)
            # per radian of the ring: ∮ e^{inθ} e^{−inθ} dθ = 2π
            B *= flint.acb(z / (2 * flint.arb.pi()))
            eye = flint.acb_mat([[int(i == j) for j in range(B.nrows())] for i in range(B.nrows())])
            wave = phi * (eye + B * S).solve(B, algorithm="approx") * phi.transpose()
            even, odd = ([flint.arb(float(w)) for w in each[:, i]] for each in weights)
            for d in range(-neighbours, neighbours + 1):
                cos, sin = flint.arb(0), flint.arb(0)
                for k in range(z // 2 + 1):
                    angle = 2 * flint.arb.pi() * k * d / z
                    share = flint.arb(1 if k == 0 or 2 * k == z else 2) / z
                    cos, sin = cos + share * angle.cos() * even[k], sin + share * angle.sin() * odd[k]
                # wave z − k is the conjugate of k
                total[d + neighbours] += wave.real * cos - wave.imag * sin
        return total

    def joined(self, c: Matrix, n: int) -> Matrix:
        """Motion of the root under tractions on it through harmonic n: (field, across, axis) complex."""
        m, q = self.tooth.order[0], self.axis_order
        arc = 2 * self.tooth.root_angle * self.tooth.r_f
        # ∫ P̂_k(s) e^{−inψs} over the root, P̂ orthonormal along the arc
        x = n * self.tooth.root_angle
        b = [flint.acb(0) for _ in range(m)]
        for s, w in gauss(40 + int(abs(float(x))), flint.arb(-1), flint.arb(1)):
            for k, v in enumerate(legendre(m, s)):
                b[k] += w / 2 * v * flint.acb((x * s).cos(), -(x * s).sin()) * arc.sqrt()
        result = flint.acb_mat(3 * m * q, 3 * m * q)
        for f in range(3):
            for g in range(3):
                for k in range(m):
                    for l in range(m):
                        factor = b[k].conjugate() * b[l]
                        for j in range(q):
                            for i in range(q):
                                result[(f * m + k) * q + j, (g * m + l) * q + i] = factor * c[f * q + j, g * q + i]
        return result

    def harmonics(self, most: int) -> dict[int, Matrix]:
        """Of all n from −most to most, by their weights from those computed."""
        tooth = self.tooth
        ring = Ring(self.bore, tooth.r_f, tooth.width, tooth.screw, tooth.E, tooth.nu, (self.order, self.axis_order))
        some, weights = harmonic_weights(most)
        found = {n: ring.harmonic(n) for k in some.astype(int).tolist() for n in {k, -k}}
        result = {}
        for n, row in enumerate(weights):
            for sign in (1, -1) if n else (1,):
                total = flint.acb_mat(found[0].nrows(), found[0].ncols())
                for k in np.flatnonzero(row):
                    total += found[sign * int(some[k])] * flint.acb(float(row[k]))
                result[sign * n] = total
        return result


def pick(matrix: Matrix, rows: list[int], columns: list[int]) -> Matrix:
    return entries([[matrix[i, j] for j in columns] for i in rows])


def coefficients(count: int, low: int) -> list[list[Ball]]:
    """Monomials of Legendre functions on [low, 1], orthonormal to the measure of unit length: (k, power)."""
    result = []
    for k in range(count):
        table = mp.taylor(lambda x, k=k: mp.legendre(k, x if low else 2 * x - 1), 0, k)
        # the coefficients are integers over a power of two
        exact = [flint.arb(int(mp.nint(c * 2**k))) / 2**k for c in table]
        result.append([flint.arb(2 * k + 1).sqrt() * c for c in exact])
    return result
