"""Gears, path of contact and contact lines in extended precision."""

from __future__ import annotations

from functools import lru_cache
from types import SimpleNamespace as Namespace

import mpmath as mp

from gearbench.geometry.gear import Gear
from gearbench.geometry.pair import Pair
from gearbench.scene import Scene
from tests.stability.extended.numbers import DIGITS, Number


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
    g.z, g.beta_b = z, mp.atan(mp.tan(g.beta) * mp.cos(g.alpha_t))
    g.rack = rack(g, m, shift, double)
    g.form = form_radius(g, double)
    return g


def rack(g: Namespace, m: Number, shift: Number, double: Gear) -> Namespace:
    """Rounding of the rack tip: radius ρ, centre (corner; depth below the pitch circle), end φ where it meets."""
    rho, dedendum, a = m * mp.mpf(double.fillet_radius), m * mp.mpf(double.dedendum), g.alpha_n
    corner = mp.pi * m / 4 - dedendum * mp.tan(a) - rho * (1 - mp.sin(a)) / mp.cos(a)
    return Namespace(rho=rho, corner=max(corner, mp.mpf(0)), depth=dedendum - rho - shift * m, end=mp.pi / 2 - a)


def half_angle(g: Namespace, radius: Number) -> Number:
    """ψ of the involute; below the base circle its value there."""
    return g.half if radius <= g.r_b else g.half - inv(mp.acos(g.r_b / radius))


def form_radius(g: Namespace, double: Gear) -> Number:
    """Junction of involute and generated fillet: end of the rounding, or with undercut where the two curves cross.

    Sets ``g.rack.end`` to the parameter φ there.
    """
    rho, cos_b = g.rack.rho, mp.cos(g.beta)

    def point(phi: Number) -> tuple[Number, Number]:
        """R and ψ of the fillet point φ."""
        eta = -g.rack.depth - rho * mp.cos(phi)
        x, y = -eta * cos_b * mp.tan(phi), g.r + eta
        xi = (g.rack.corner + rho * mp.sin(phi)) / cos_b
        return mp.hypot(x, y), mp.pi / g.z - mp.atan2(x, y) - (xi - x) / g.r

    flank_end = -g.rack.depth - rho * mp.sin(g.alpha_n)
    if flank_end >= -g.r * mp.sin(g.alpha_t) ** 2:
        return max(point(g.rack.end)[0], g.r_b)

    def excess(phi: Number) -> Number:
        radius, psi = point(phi)
        return psi - half_angle(g, radius)

    start = mp.mpf(double.fillet_end)
    guess = (start, start * (1 - mp.mpf(10) ** -9))
    g.rack.end = mp.findroot(excess, guess, solver="secant", tol=mp.mpf(10) ** (8 - 2 * DIGITS))
    return max(point(g.rack.end)[0], g.r_b)


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
