"""Outline of a tooth for quadrature: generated fillet and involute, each in a parameter in which it is analytic.

Over R a fillet has a branch point √(R − r_f) at the root circle, and an involute (R − r_b)^{3/2} at the base circle.
Over tan(φ/2), with φ of ``geometry.fillet``, and over the roll angle t = tan α_R they have none, so Gauss quadrature
converges exponentially. Towards a pointed tip the integrands grow like 1/ψ, so panels shrink towards it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.bases import gauss
from gearbench.geometry.gear import Gear

#: Positions x = R − r_f, weights dx, half-widths e = R ψ and slopes e′ along the height of a tooth.
Outline = tuple[NDArray, NDArray, NDArray, NDArray]

#: Largest reach of a panel as a fraction of the way to the radius where the tooth is pointed.
_REACH = 7 / 8


def tooth_outline(gear: Gear, points: int) -> Outline:
    """Quadrature from root to tip, ``points`` on a panel: one panel for the fillet, one or several for the involute."""
    parts = [_fillet(gear, points), *_involute(gear, points)]
    x, weight, e, slope = (np.concatenate(part) for part in zip(*parts, strict=True))
    return x, weight, e, slope


def roll_angles(gear: Gear) -> tuple[float, float]:
    """t = tan α_R at the form circle and at the tip circle."""
    r_b = gear.base_radius
    form, tip = (math.sqrt(max((R - r_b) * (R + r_b), 0.0)) / abs(r_b) for R in (gear.form_radius, gear.tip_radius))
    return form, tip


def _fillet(gear: Gear, points: int) -> Outline:
    """Panel of the fillet."""
    end = float(gear.fillet.parameter(np.array(gear.form_radius)))
    tau, weight = gauss(points, 0.0, math.tan(end / 2))
    x, dR, psi, d_psi = gear.fillet.along(2 * np.arctan(tau))
    R = gear.root_radius + x
    return x, weight * dR * 2 / (1 + tau**2), R * psi, psi + R * d_psi / dR


def _involute(gear: Gear, points: int) -> Iterator[Outline]:
    """Panels of the involute: one, or several that shrink towards a pointed tip."""
    r_b = gear.base_radius
    form, tip = roll_angles(gear)
    if gear.pointed_radius is None:
        t, weight = gauss(points, form, tip)
        R = r_b * np.sqrt(1 + t**2)
        psi = gear.involute_half_angle(R)
        yield R - gear.root_radius, weight * r_b**2 * t / R, R * psi, psi - t
        return
    pointed = math.sqrt((gear.pointed_radius - r_b) * (gear.pointed_radius + r_b)) / abs(r_b)
    # integrated over δ = t_p − t, because ψ = δ − (arctan t_p − arctan t) keeps its digits however thin the tooth is
    edges = [pointed - form]
    while edges[-1] / (pointed - tip or math.inf) * (1 - _REACH) > 1:
        edges.append(edges[-1] * (1 - _REACH))
    for high, low in pairwise([*edges, pointed - tip]):
        delta, weight = gauss(points, low, high)
        t = pointed - delta
        root = np.sqrt(1 + t**2)
        R = r_b * root
        psi = delta - np.arctan(delta / (1 + t * pointed))
        yield R - gear.root_radius, weight * r_b * t / root, R * psi, psi - t
