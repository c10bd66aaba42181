"""Gears, path of contact and contact lines in extended precision."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from types import SimpleNamespace as Namespace

import mpmath as mp
import numpy as np

from gearbench.contact.coarse_solution import scene_lines
from gearbench.geometry.action import NEGLIGIBLE_WIDTH
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
    """Segments of the contact lines at phase τ: tooth pair k, u, y, length along the line, their half in y [mm].

    How many segments each panel has, and whether they are cells, is the program's choice and read from its lines.
    """
    G = geometry(scene.pair)
    tan_b, lines = mp.tan(G.beta_b), scene_lines(scene, np.array([tau]))
    found = []
    for k in range(-int(mp.ceil(G.b * tan_b / G.pitch)) - 1, int((G.u_e - G.u_a) / G.pitch) + 2):
        start = G.u_a + (mp.mpf(tau) + k) * G.pitch
        if tan_b > 0:
            low, *inside, high = (
                min(max((u - start) / tan_b, mp.mpf(0)), G.b) for u in (G.u_a, *relief_starts(scene), G.u_e)
            )
        else:
            low, inside, high = mp.mpf(0), [], G.b if G.u_a <= start <= G.u_e else mp.mpf(0)
        shortest = mp.mpf(NEGLIGIBLE_WIDTH) * G.b
        if high - low <= shortest:
            continue
        edges = [low, *(y for y in inside if low < y < high), high]
        if sum(b - a > shortest for a, b in pairwise(edges)) > scene.resolution.segments:
            edges = [low, high]
        nodes = lines.y[0, list(lines.index).index(k)]
        for a, b in pairwise(edges):
            n = int(np.sum((nodes > float(a)) & (nodes < float(b))))
            if lines.cells:
                rule = [(mp.mpf(2 * i + 1) / n - 1, mp.mpf(2) / n) for i in range(n)]
            else:
                rule = [(mp.mpf(x), mp.mpf(w)) for x, w in zip(*np.polynomial.legendre.leggauss(n), strict=True)]
            for x, w in rule if n else []:
                y, half = (a + b) / 2 + (b - a) / 2 * x, (b - a) / 4 * w
                found.append(Namespace(pair=k, u=start + y * tan_b, y=y, length=2 * half / mp.cos(G.beta_b), half=half))
    return found


def relief_starts(scene: Scene) -> list[Number]:
    """Positions u where a tip relief begins, ascending [mm]."""
    G, relief, found = geometry(scene.pair), scene.effect("tip_relief"), []
    if relief is None or relief.amount == 0 or relief.length == 0:
        return found
    for i in {"both": (0, 1), "pinion": (0,), "wheel": (1,)}[relief.gear]:
        rho = mp.sqrt((G.gears[i].r_a - mp.mpf(relief.length)) ** 2 - G.gears[i].r_b ** 2)
        found.append(G.T - rho if i else rho)
    return sorted(found)


def moved(scene: Scene, s: Namespace, share: Number) -> Namespace:
    """A segment with its node moved by ``share`` of its half."""
    dy = share * s.half
    return Namespace(pair=s.pair, u=s.u + dy * mp.tan(geometry(scene.pair).beta_b), y=s.y + dy)
