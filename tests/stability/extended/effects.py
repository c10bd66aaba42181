"""Gaps and contact laws of the segments in extended precision."""

from __future__ import annotations

from types import SimpleNamespace as Namespace

import mpmath as mp

from gearbench.scene import Scene
from tests.stability.extended.geometry import geometry, half_angle
from tests.stability.extended.numbers import Number


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
