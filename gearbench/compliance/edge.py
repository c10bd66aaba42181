"""Free edge of a tooth tip in the contact law, which is softer than a half-space.

A contact law contains the compression of a half-space; the tooth's compliance contains the rest, projected by Π onto a
few polynomials of R. Near the tip the tooth is a wedge: a unit line load at the distance r₀ from the edge moves its
surface at r further than that of a half-space, by W(r, r₀). At the edge W has a logarithm that the polynomials cannot
represent. The tooth contains Π W Π, so the law adds W − Π W Π (E4 of docs/theory.md). Smooth parts, such as the distant
support of the wedge, cancel.
"""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from gearbench.compliance.bases import gauss
from gearbench.compliance.local import flank_functions
from gearbench.compliance.wedge import softness, spread_table, strip_softening
from gearbench.geometry.gear import Gear

#: Number of Gauss points along the flank, which cluster at the edge.
_POINTS = 40


def tip_angle(gear: Gear) -> float:
    """Angle [rad] of the tooth between its flank and its tip land, or between flank and chamfer (45°)."""
    if gear.tip_chamfer:
        return math.radians(135.0)
    return math.pi / 2 + math.acos(gear.base_radius / gear.tip_radius)


def edge_distance(gear: Gear, roll: NDArray) -> NDArray:
    """Length [mm] of the flank from the roll length ℓ to the edge, without the rounding of a rounded tip."""
    end = gear.tip_radius if gear.tip_rounding else gear.tip_form_radius
    # an involute of roll length ℓ = √(R² − r_b²) has the arc length ℓ²/(2 r_b)
    return np.maximum((end**2 - gear.base_radius**2 - roll**2) / (2 * gear.base_radius), 0.0)


@lru_cache(maxsize=64)
def held_by_polynomials(gear: Gear, count: int) -> NDArray:
    """W (E1) projected onto ``count`` polynomials φ of R, ∬ φ_a W φ_b dR dR₀ divided by c₁, (count, count)."""
    r_b, angle = gear.base_radius, tip_angle(gear)
    low, high = gear.form_radius, gear.tip_radius
    length = float(edge_distance(gear, gear.roll_length(low)))
    t, weight = gauss(_POINTS)
    r = length * t**3
    R = gear.sign * np.sqrt(gear.tip_form_radius**2 - 2 * r_b * r)
    functions = flank_functions(count, R, low, high) * (weight * length * 3 * t**2 * r_b / R)[:, None]
    W = spread_table(angle, np.log(r[:, None] / r)) - softness(angle) * (np.log(r)[:, None] + np.log(r))
    return functions.T @ W @ functions


@lru_cache(maxsize=64)
def _held_at(gear: Gear, count: int) -> NDArray:
    """Diagonal of the projected W, Σ φ_a φ_b ∬ φ_a W φ_b, as a Legendre series in R on −1 … 1."""
    W = held_by_polynomials(gear, count)
    scale = np.sqrt((2 * np.arange(count) + 1) / (gear.tip_radius - gear.form_radius))
    return np.einsum("ab,abn->n", W * np.outer(scale, scale), _products(count))


@lru_cache(maxsize=4)
def _products(count: int) -> NDArray:
    """Legendre series of the products of ``count`` Legendre polynomials, (count, count, 2·count − 1)."""
    unit, products = np.eye(count), np.zeros((count, count, 2 * count - 1))
    for a, b in product(range(count), range(count)):
        series = legendre.legmul(unit[a], unit[b])
        products[a, b, : len(series)] = series[: 2 * count - 1]
    return products


def edge_softening(
    gear: Gear, c: float, mean: float, count: int, roll: NDArray, tilt: NDArray, rho: NDArray, line_load: float
) -> tuple[NDArray, NDArray]:
    """Additions to a, h [mm²/N] of the law q (a − h ln q) near the tip of ``gear``.

    Parameters
    ----------
    gear
        The gear with the tip.
    c
        c₁ = (1−ν²)/(πE) [mm²/N].
    mean
        Mean of c₁ of both gears, which determines the width of the strip.
    count
        Number of polynomials of R in the compliance of the tooth.
    roll
        Roll length of the touching point [mm].
    tilt
        Angle [rad] between the flank at its edge and the mate's flank; zero if the flank touches.
    rho
        Relative radius of curvature [mm].
    line_load
        q [N/mm] at which value and slope of the law are exact.
    """
    angle = tip_angle(gear)
    B, r = softness(angle), edge_distance(gear, roll)
    low, high = gear.form_radius, gear.tip_radius
    R = np.clip(gear.radius_at(roll), low, high)
    in_tooth = legendre.legval((2 * R - low - high) / (high - low), _held_at(gear, count))
    if gear.tip_rounding:
        # the strip lies on the rounding: distance to the edge without the rounding
        return c * (-2 * B * np.log(np.maximum(r, 1e-6 * abs(gear.tip_radius))) - in_tooth), np.zeros_like(r)
    half_width = np.sqrt(8 * mean * rho * line_load)
    offset = np.where(tilt > 0, rho * tilt, -r) / half_width
    value, slope = strip_softening(angle, offset)
    per_load = c * (value - 2 * B * np.log(half_width) - in_tooth)
    # ln q enters through the half-width, σ ~ q^{-1/2}
    h = c * (B + offset * slope / 2)
    return per_load + h * math.log(line_load), h
