"""The whole chain once more in extended precision: geometry, plate, contact law, gaps, contact, for one mesh phase.

Written from the equations in ``mpmath`` with ``DIGITS`` decimal digits: monomials instead of Legendre polynomials,
tanh-sinh instead of Gauss quadrature, plain Newton steps instead of a line search. A scene's numbers are taken as they
stand in double precision.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from types import SimpleNamespace as Namespace
from typing import Any

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

from gearbench.contact.problem import ContactProblem
from gearbench.geometry.gear import Gear
from gearbench.geometry.pair import Pair
from gearbench.scene import Scene
from tests.stability import long_plate

DIGITS = 40
#: Functions of a field above which the plate is solved in long doubles.
LARGE = 16
Number = Any  # mpmath.mpf, which has no types


@dataclass(frozen=True)
class Answer:
    """Forces [N] of the segments, δ_n [mm] and ∂F_n/∂δ_n [N/mm] of one mesh phase; least gap of a separated segment."""

    force: list[Number]
    approach: Number
    stiffness: Number


# -- geometry ---------------------------------------------------------------------------------------------------------
def inv(t: Number) -> Number:
    return mp.tan(t) - t


def gear(pair: Pair, double: Gear, shift: Number) -> Namespace:
    """Sizes of one gear [mm]."""
    g = Namespace()
    m, z = mp.mpf(pair.normal_module), double.teeth
    g.alpha_n, g.beta = mp.radians(mp.mpf(pair.pressure_angle)), mp.radians(mp.mpf(pair.helix_angle))
    g.alpha_t = mp.atan(mp.tan(g.alpha_n) / mp.cos(g.beta))
    g.r = m * z / (2 * mp.cos(g.beta))
    g.r_b = g.r * mp.cos(g.alpha_t)
    g.r_a, g.r_f = g.r + m * (double.addendum + shift), g.r - m * (double.dedendum - shift)
    g.half = (mp.pi / 2 + 2 * shift * mp.tan(g.alpha_n)) / z + inv(g.alpha_t)
    g.form = form_radius(g, m, z, shift, double)
    return g


def half_angle(g: Namespace, radius: Number) -> Number:
    """ψ of the involute; below the base circle its value there."""
    return g.half if radius <= g.r_b else g.half - inv(mp.acos(g.r_b / radius))


def form_radius(g: Namespace, m: Number, z: int, shift: Number, double: Gear) -> Number:
    """Junction of involute and generated fillet: end of the rounding, or with undercut where the two curves cross."""
    rho, dedendum = m * mp.mpf(double.fillet_radius), m * mp.mpf(double.dedendum)
    a, cos_b = g.alpha_n, mp.cos(g.beta)
    xi0 = mp.pi * m / 4 - dedendum * mp.tan(a) - rho * (1 - mp.sin(a)) / mp.cos(a)

    def point(phi: Number) -> tuple[Number, Number]:
        """R and ψ of the fillet point φ."""
        eta = shift * m - (dedendum - rho) - rho * mp.cos(phi)
        x, y = -eta * cos_b * mp.tan(phi), g.r + eta
        xi = (max(xi0, 0) + rho * mp.sin(phi)) / cos_b
        return mp.hypot(x, y), mp.pi / z - mp.atan2(x, y) - (xi - x) / g.r

    end = mp.pi / 2 - a
    flank_end = shift * m - (dedendum - rho * (1 - mp.sin(a)))
    if flank_end >= -g.r * mp.sin(g.alpha_t) ** 2:
        return max(point(end)[0], g.r_b)

    def excess(phi: Number) -> Number:
        radius, psi = point(phi)
        return psi - half_angle(g, radius)

    start = mp.mpf(double._fillet_end)
    phi = mp.findroot(
        excess, (start, start * (1 - mp.mpf(10) ** -9)), solver="secant", tol=mp.mpf(10) ** (8 - 2 * DIGITS)
    )
    return max(point(phi)[0], g.r_b)


@lru_cache(maxsize=256)
def geometry(pair: Pair) -> Namespace:
    """Path of contact and gears."""
    G = Namespace()
    alpha_n, beta = mp.radians(mp.mpf(pair.pressure_angle)), mp.radians(mp.mpf(pair.helix_angle))
    alpha_t = mp.atan(mp.tan(alpha_n) / mp.cos(beta))
    z1, z2 = pair.pinion.teeth, pair.wheel.teeth
    m_t, a = mp.mpf(pair.normal_module) / mp.cos(beta), mp.mpf(pair.centre_distance)
    alpha_wt = mp.acos(m_t * (z1 + z2) / 2 * mp.cos(alpha_t) / a)
    total = (z1 + z2) * (inv(alpha_wt) - inv(alpha_t)) / (2 * mp.tan(alpha_n))
    total -= (z1 + z2) * mp.mpf(pair.backlash or 0) / (4 * a * mp.tan(alpha_n))
    x1, x2 = pair.pinion.profile_shift, pair.wheel.profile_shift
    if x1 is None and x2 is None:
        shifts = (total / 2, total / 2)
    elif x1 is None:
        shifts = (total - x2, mp.mpf(x2))
    else:
        shifts = (mp.mpf(x1), total - x1 if x2 is None else mp.mpf(x2))
    g1, g2 = (gear(pair, d, x) for d, x in zip(pair.gears, shifts, strict=True))
    G.gears, G.alpha_wt = (g1, g2), alpha_wt
    G.beta_b = mp.atan(mp.tan(beta) * mp.cos(alpha_t))
    G.pitch = 2 * mp.pi * g1.r_b / z1
    G.T = a * mp.sin(alpha_wt)
    G.u_a = max(G.T - mp.sqrt(g2.r_a**2 - g2.r_b**2), mp.sqrt(g1.form**2 - g1.r_b**2))
    G.u_e = min(mp.sqrt(g1.r_a**2 - g1.r_b**2), G.T - mp.sqrt(g2.form**2 - g2.r_b**2))
    G.b = mp.mpf(pair.face_width)
    return G


def segments_at(scene: Scene, tau: float) -> list[Namespace]:
    """Segments of the contact lines at phase τ: tooth pair k, u, y, length along the line [mm]."""
    G = geometry(scene.pair)
    tan_b, n = mp.tan(G.beta_b), scene.resolution.segments
    found = []
    first = -int(mp.ceil(G.b * tan_b / G.pitch)) - 1
    for k in range(first, int((G.u_e - G.u_a) / G.pitch) + 2):
        start = G.u_a + (mp.mpf(tau) + k) * G.pitch
        if tan_b > 0:
            low, high = (min(max((u - start) / tan_b, mp.mpf(0)), G.b) for u in (G.u_a, G.u_e))
        else:
            low, high = mp.mpf(0), G.b if G.u_a <= start <= G.u_e else mp.mpf(0)
        if high - low <= mp.mpf(1e-13) * G.b:
            continue
        for i in range(n):
            y = low + (high - low) * (i + mp.mpf(1) / 2) / n
            u = start + y * tan_b
            found.append(Namespace(pair=k, u=u, y=y, length=(high - low) / n / mp.cos(G.beta_b)))
    return found


# -- effects ----------------------------------------------------------------------------------------------------------
def gap(scene: Scene, s: Namespace) -> Number:
    """Sum of the gaps at a segment [mm]."""
    G, total = geometry(scene.pair), mp.mpf(0)
    radii = [mp.hypot(G.gears[0].r_b, s.u), mp.hypot(G.gears[1].r_b, G.T - s.u)]
    for effect in scene.effects:
        if effect.name == "crowning":
            total += mp.mpf(effect.amount) * (2 * s.y / G.b - 1) ** 2
        elif effect.name == "helix_slope":
            total += (mp.mpf(effect.pinion) + mp.mpf(effect.wheel)) * s.y / G.b
        elif effect.name == "tip_relief" and effect.length > 0:
            for i in {"both": (0, 1), "pinion": (0,), "wheel": (1,)}[effect.gear]:
                length = mp.mpf(effect.length)
                depth = max((length - (G.gears[i].r_a - radii[i])) / length, 0)
                total += mp.mpf(effect.amount) * depth ** (2 if effect.shape == "parabolic" else 1)
        elif effect.name not in ("tooth_bending", "hertz"):
            raise NotImplementedError(effect.name)
    return total / 1000


def line_law(scene: Scene, s: Namespace) -> tuple[Number, Number]:
    """a, h of g = q (a − h ln q) [mm²/N] of the scene's contact law."""
    G, pair = geometry(scene.pair), scene.pair
    nu, E = mp.mpf(pair.material.poisson_ratio), 1000 * mp.mpf(pair.material.youngs_modulus)
    c = 4 * (1 - nu**2) / (mp.pi * E)
    if scene.effect("hertz").law == "yang_sun":
        return c, mp.mpf(0)
    cos_b = mp.cos(G.beta_b)
    rho = s.u * (G.T - s.u) / G.T / cos_b
    depths = []
    for g, u in zip(G.gears, (s.u, G.T - s.u), strict=True):
        radius = mp.hypot(g.r_b, u)
        psi = half_angle(g, radius)
        depths.append(radius * mp.sin(psi) / mp.cos(mp.acos(g.r_b / radius) - psi) * cos_b)
    a = c * (mp.log(2 * depths[0] * depths[1] / (c * rho)) / 2 - nu / (2 * (1 - nu)))
    return a, c / 2


def tanh_sinh(step: Number) -> list[tuple[Number, Number, Number]]:
    """Nodes t, 1 − t and weights on (0, 1): end points may be singular."""
    nodes = []
    k = 0
    while True:
        x = mp.pi / 2 * mp.sinh(k * step)
        weight = step * mp.pi / 4 * mp.cosh(k * step) / mp.cosh(x) ** 2
        if weight < mp.mpf(10) ** (-DIGITS - 5):
            return nodes
        small = 1 / (1 + mp.exp(2 * x))  # distance from the end
        nodes.append((1 - small, small, weight))
        if k > 0:
            nodes.append((small, 1 - small, weight))
        k += 1


@lru_cache(maxsize=256)
def plate(pair: Pair, index: int, basis: Any) -> tuple[list[tuple[int, int]], Any]:
    """Exponents (i, j) of ξ^{i+1} η^j and the factor W with φᵀ W Wᵀ φ the compliance of the plate."""
    G = geometry(pair)
    g = G.gears[index]
    nu, E = mp.mpf(pair.material.poisson_ratio), 1000 * mp.mpf(pair.material.youngs_modulus)
    height, b = g.r_a - g.r_f, G.b
    terms = [(0, 0), (0, 1), (1, 0)] if basis == "paper" else [(i, j) for i in range(basis[0]) for j in range(basis[1])]
    most = max(i for i, _ in terms)
    edges = [mp.mpf(0), *([(g.r_b - g.r_f) / height] if g.r_f < g.r_b < g.r_a else []), mp.mpf(1)]
    D, S = [mp.mpf(0)] * (2 * most + 3), [mp.mpf(0)] * (2 * most + 3)
    for low, high in pairwise(edges):
        for t, _, weight in tanh_sinh(mp.mpf(1) / 16):
            xi = low + (high - low) * t
            R = g.r_f + xi * height
            h = 2 * R * half_angle(g, R) / mp.sqrt(1 + (R * mp.tan(g.beta) / g.r) ** 2)
            d = weight * (high - low) * E * h**3 / (12 * (1 - nu**2))
            s = weight * (high - low) * 5 * E * h / (12 * (1 + nu))
            power = mp.mpf(1)
            for n in range(len(D)):
                D[n] += d * power
                S[n] += s * power
                power *= xi
    n = len(terms)
    K = mp.matrix(3 * n)
    for p, (i, j) in enumerate(terms):
        for q, (k, l) in enumerate(terms):

            def yy(a: int, c: int, j: int = j, l: int = l) -> Number:
                """∫ η derivatives of order a, c."""
                power = j + l - a - c
                return (j if a else 1) * (l if c else 1) * b ** (1 - a - c) / (power + 1) if power >= 0 else mp.mpf(0)

            def xx(M: list, a: int, c: int, i: int = i, k: int = k) -> Number:
                """∫ ξ derivatives of order a, c with the weight of the moments M."""
                factor = (i + 1 if a else 1) * (k + 1 if c else 1)
                return factor * M[i + k + 2 - a - c] * height ** (1 - a - c)

            K[p, q] = xx(D, 0, 0) * yy(1, 1) + (1 - nu) / 2 * xx(D, 1, 1) * yy(0, 0) + xx(S, 0, 0) * yy(0, 0)
            K[n + p, n + q] = xx(D, 1, 1) * yy(0, 0) + (1 - nu) / 2 * xx(D, 0, 0) * yy(1, 1) + xx(S, 0, 0) * yy(0, 0)
            K[2 * n + p, 2 * n + q] = xx(S, 1, 1) * yy(0, 0) + xx(S, 0, 0) * yy(1, 1)
            # θ_x (p) with θ_y (q): −ν θ_x,y θ_y,x − (1−ν)/2 θ_x,x θ_y,y; θ_x with w: −θ_x w,y; θ_y with w: θ_y w,x
            K[p, n + q] = -nu * xx(D, 0, 1) * yy(1, 0) - (1 - nu) / 2 * xx(D, 1, 0) * yy(0, 1)
            K[p, 2 * n + q] = -xx(S, 0, 0) * yy(0, 1)
            K[n + p, 2 * n + q] = xx(S, 0, 1) * yy(0, 0)
    for p in range(3 * n):
        for q in range(p):
            K[p, q] = K[q, p]
    L = cholesky(K)
    # trailing triangle of L: the w–w block of K⁻¹ is its inverse, transposed, times its inverse
    triangle = [[L[2 * n + p][2 * n + q] for q in range(p + 1)] for p in range(n)]
    return terms, triangle


def cholesky(K: Any) -> list[list[Number]]:
    """Rows of the lower Cholesky factor; columns of a semi-definite matrix that depend on earlier ones are zero."""
    L: list[list[Number]] = []
    for i in range(K.rows):
        row: list[Number] = []
        for j in range(i + 1):
            t = K[i, j] - mp.fdot(zip(row, L[j] if j < i else row, strict=False)) if j else K[i, j]
            if i == j:
                row.append(mp.sqrt(t) if t > mp.mpf(10) ** (10 - DIGITS) * K[i, i] else mp.mpf(0))
            else:
                row.append(t / L[j][j] if L[j][j] else mp.mpf(0))
        L.append(row)
    return L


def forward(triangle: list[list[Number]], right: list[Number]) -> list[Number]:
    """L⁻¹ right."""
    x: list[Number] = []
    for row, r in zip(triangle, right, strict=True):
        x.append((r - mp.fdot(zip(row, x, strict=False))) / row[-1])
    return x


@lru_cache(maxsize=8)
def long_factor(pair: Pair, index: int, order: tuple[int, int]) -> Any:
    """ψ of one tooth as a function of (ξ, η), in long doubles."""
    G = geometry(pair)
    nu, E = mp.mpf(pair.material.poisson_ratio), 1000 * mp.mpf(pair.material.youngs_modulus)
    return long_plate.plate(G.gears[index], G.b, E, nu, order)[0]


def tooth_factor(scene: Scene, s: Namespace) -> list[Number]:
    """ψ of both teeth at a segment [√(mm/N)]."""
    bending = scene.effect("tooth_bending")
    if bending is None:
        return []
    if bending.fillet or bending.load != "full" or bending.model != "plate":
        raise NotImplementedError("plate without fillet only")
    G, psi = geometry(scene.pair), []
    for index, u in enumerate((s.u, G.T - s.u)):
        g = G.gears[index]
        xi, eta = (mp.hypot(g.r_b, u) - g.r_f) / (g.r_a - g.r_f), s.y / G.b
        if bending.order is not None and math.prod(bending.order) > LARGE:
            psi += [
                mp.mpf(x.astype(float)) + mp.mpf(float(x - x.astype(float)))
                for x in long_factor(scene.pair, index, bending.order)(xi, eta)
            ]
            continue
        terms, triangle = plate(scene.pair, index, bending.order or "paper")
        psi += forward(triangle, [xi ** (i + 1) * eta**j for i, j in terms])
    return psi


# -- contact ----------------------------------------------------------------------------------------------------------
def law(s: Number, a: Number, h: Number) -> tuple[Number, Number]:
    """P and dP/ds of P (a − h ln P) = s, continued by its tangent where a/h − ln P < 2."""
    if s <= 0:
        return mp.mpf(0), mp.mpf(0)
    if h == 0:
        return s / a, 1 / a
    edge = mp.exp(a / h - 2)
    if s >= 2 * h * edge:
        return edge + (s - 2 * h * edge) / h, 1 / h
    level = a / h + mp.log(h) - mp.log(s)
    big = level + mp.log(level) + mp.mpf(1) / 2
    for _ in range(60):
        step = (big - mp.log(big) - level) * big / (big - 1)
        big -= step
        if abs(step) < mp.mpf(10) ** (-DIGITS // 2 - 3) * big:
            break
    return s / (h * big), 1 / (h * (big - 1))


def reduced(block: list[int], psi: list[list[Number]]) -> list[list[Number]]:
    """Another square root of Ψ Ψᵀ where a tooth has more amplitudes than its contact line has segments."""
    members = {k: [i for i, b in enumerate(block) if b == k] for k in set(block)}
    most = max(map(len, members.values()))
    if len(psi[0]) <= most:
        return psi
    small: list[list[Number]] = [[]] * len(psi)
    for mine in members.values():
        gram = mp.matrix(len(mine))
        for a, i in enumerate(mine):
            for c, j in enumerate(mine[: a + 1]):
                gram[a, c] = gram[c, a] = mp.fdot(zip(psi[i], psi[j], strict=True))
        for i, row in zip(mine, cholesky(gram), strict=True):
            small[i] = row + [mp.mpf(0)] * (most - len(row))
    return small


def contact(
    block: list[int],
    psi: list[list[Number]],
    a: list[Number],
    h: list[Number],
    e: list[Number],
    start: tuple[list[float], float],
) -> tuple[list[Number], Number, Number]:
    """Forces, δ and ∂F/∂δ for ΣP = 1, by Newton's method on (q, δ) from the forces and δ of ``start``."""
    psi = reduced(block, psi)
    blocks, rank, n = sorted(set(block)), len(psi[0]), len(e)
    q = {k: [mp.fsum(start[0][i] * psi[i][c] for i in range(n) if block[i] == k) for c in range(rank)] for k in blocks}
    delta, residual = mp.mpf(start[1]), mp.inf
    for _ in range(80):
        pairs = [law(delta - e[i] - mp.fdot(zip(psi[i], q[block[i]], strict=True)), a[i], h[i]) for i in range(n)]
        total, slope = 1 - mp.fsum(p for p, _ in pairs), mp.fsum(w for _, w in pairs)
        steps = {}
        residual = abs(total)
        for k in blocks:
            mine = [i for i in range(n) if block[i] == k and pairs[i][0] > 0]
            grad = [q[k][c] - mp.fsum(pairs[i][0] * psi[i][c] for i in mine) for c in range(rank)]
            cross = [mp.fsum(pairs[i][1] * psi[i][c] for i in mine) for c in range(rank)]
            hess = mp.eye(rank) if rank else mp.matrix(0)
            for c in range(rank):
                for d in range(c + 1):
                    hess[c, d] = (c == d) + mp.fsum(pairs[i][1] * psi[i][c] * psi[i][d] for i in mine)
            L = cholesky(hess)
            y, x = forward(L, cross), forward(L, grad)
            slope -= mp.fdot(zip(y, y, strict=True))
            total -= mp.fdot(zip(y, x, strict=True))
            steps[k] = (L, y, x)
            residual = max([residual, *map(abs, grad)])
        if residual < mp.mpf(10) ** (8 - DIGITS):
            return [p for p, _ in pairs], delta, slope
        step = total / slope
        for k, (L, y, x) in steps.items():
            right = [yc * step - xc for yc, xc in zip(y, x, strict=True)]
            for c in reversed(range(rank)):  # L⁻ᵀ
                right[c] = (right[c] - mp.fsum(L[d][c] * right[d] for d in range(c + 1, rank))) / L[c][c]
            q[k] = [old + new for old, new in zip(q[k], right, strict=True)]
        delta += step
    raise ArithmeticError(f"extended contact not solved: residual {mp.nstr(residual, 3)}")


def equal_approach(psi: list[list[Number]], e: list[Number], loaded: list[int]) -> Answer:
    """Without a law: the ``loaded`` segments brought to one approach, checked to be the right ones."""
    H = mp.matrix(len(loaded))
    for a, i in enumerate(loaded):
        for c, j in enumerate(loaded):
            H[a, c] = mp.fdot(zip(psi[i], psi[j], strict=True))
    ones, gaps = mp.matrix([1] * len(loaded)), mp.matrix([e[i] for i in loaded])
    x, z = mp.lu_solve(H, ones), mp.lu_solve(H, gaps)
    k = mp.fsum(x)
    delta = (1 + mp.fsum(z)) / k
    force = [mp.mpf(0)] * len(e)
    for a, i in enumerate(loaded):
        force[i] = delta * x[a] - z[a]
    q = [mp.fsum(force[i] * psi[i][c] for i in loaded) for c in range(len(psi[0]))]
    rest = [mp.fdot(zip(p, q, strict=True)) + g - delta for p, g in zip(psi, e, strict=True)]
    if min(force) < 0 or min(rest) < -(mp.mpf(10) ** (8 - DIGITS)):
        raise ArithmeticError("another set of segments carries")
    return Answer(force, delta, k)


def solve_scene(scene: Scene, tau: float, start: tuple[NDArray, float]) -> Answer:
    """Answer of ``scene`` at phase ``tau``; ``start``: forces [N] of the existing segments and δ_n [mm]."""
    with mp.workdps(DIGITS):
        G = geometry(scene.pair)
        found = segments_at(scene, tau)
        F = 1000 * mp.mpf(scene.load.torque) / G.gears[0].r_b / mp.cos(G.beta_b)
        if len(found) != len(start[0]):
            raise LookupError(f"{len(found)} segments, not {len(start[0])}")
        laws = [line_law(scene, s) for s in found]
        # unit of force F, of displacement 1 mm: P' = P/F, ψ' = ψ √F, g = P'(a' − h' ln P')
        root = mp.sqrt(F)  # of the force, since forces are in units of F
        psi = [[root * x for x in tooth_factor(scene, s)] for s in found]
        h = [F / s.length * h for s, (_, h) in zip(found, laws, strict=True)]
        a = [F / s.length * (a + h * mp.log(s.length / F)) for s, (a, h) in zip(found, laws, strict=True)]
        e = [gap(scene, s) for s in found]
        begin = ([float(p / float(F)) for p in start[0]], start[1])
        P, delta, k = contact([s.pair for s in found], psi, a, h, e, begin)
        return Answer([F * p for p in P], delta, F * k)


def solve_problem(problem: ContactProblem, position: int, start: tuple[NDArray, float]) -> Answer:
    """Answer of one position of a dimensionless problem, its numbers taken as exact; ``start`` in its units."""
    with mp.workdps(DIGITS):
        active = np.flatnonzero(problem.active[position])
        psi = [[mp.mpf(x) for x in problem.factor[position, i]] for i in active]
        a, h, e = ([mp.mpf(x) for x in v[position, active]] for v in (problem.a, problem.h, problem.gap))
        block = [int(problem.block[i]) for i in active]
        if not (problem.a[position].any() or problem.h[position].any()):
            return equal_approach(psi, e, [i for i, p in enumerate(start[0]) if p > 0])
        P, delta, k = contact(block, psi, a, h, e, ([float(p) for p in start[0]], start[1]))
        return Answer(P, delta, k)


def digits(value: float, exact: Number, scale: Number | None = None) -> float:
    """Correct decimal digits of ``value`` relative to ``scale`` (to itself by default); at most 17."""
    with mp.workdps(DIGITS):
        error = abs(mp.mpf(float(value)) - exact) / abs(exact if scale is None else scale)
        return 17.0 if error == 0 else min(17.0, float(-mp.log10(error)))
