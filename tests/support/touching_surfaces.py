"""First touch of two flanks by brute-force search over points in polar coordinates, without tangents or normals."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

from gearbench.geometry.gear import Gear
from gearbench.geometry.pair import Pair
from gearbench.geometry.profile import Modification

_POINTS = 600
_PRECISE = {"xatol": 1e-13}


@dataclass(frozen=True)
class Flank:
    """Flank as a curve of points, with the roll length as parameter."""

    gear: Gear
    modifications: tuple[Modification, ...]

    def missing(self, roll: NDArray) -> NDArray:
        """Missing material [mm]."""
        total = np.zeros_like(roll)
        for m in self.modifications:
            x = np.hypot(roll, self.gear.base_radius) if m.along == "radius" else roll
            t = (x - m.start) / m.length
            total = total + m.amount * (np.maximum(t, 0.0) if m.one_sided else t) ** m.power
        return total + self.rounded_off(roll)

    def rounded_off(self, roll: NDArray) -> NDArray:
        """Material that a tip rounding removes along each tangent, from the involute to the circle of the rounding."""
        r_b, radius = self.gear.base_radius, self.gear.tip_rounding
        if not radius:
            return np.zeros_like(roll)
        start = math.sqrt(self.gear.tip_form_radius**2 - r_b**2)
        begin, turn = start / r_b, roll / r_b
        centre = (start - radius) * np.exp(1j * begin) + 1j * r_b * np.exp(1j * begin)
        # position of the centre relative to the tangent point on the base circle, along the tangent and across it
        seen = centre * np.exp(-1j * turn) - 1j * r_b
        end = seen.real + np.sqrt(np.maximum(radius**2 - seen.imag**2, 0.0))
        return np.where(roll > start, roll - end, 0.0)

    def polar(self, roll: NDArray) -> tuple[NDArray, NDArray]:
        """Radius, and polar angle from the start of the involute on the base circle."""
        r_b = self.gear.base_radius
        length = roll - self.missing(roll)
        return np.hypot(length, r_b), roll / r_b - np.arctan2(length, r_b)

    def range(self) -> tuple[float, float]:
        """Roll lengths at the form circle, and at the point where the flank or its rounding meets the tip circle."""
        r_b, r_a = self.gear.base_radius, self.gear.tip_radius
        low, high = (math.sqrt(max(r**2 - r_b**2, 0.0)) for r in (self.gear.form_radius, r_a))
        if self.gear.tip_rounding:  # its last point is on the tip circle, on the ray through its centre
            start = math.sqrt(self.gear.tip_form_radius**2 - r_b**2)
            inner = start - self.gear.tip_rounding
            return low, start + r_b * (math.atan2(high, r_b) - math.atan2(inner, r_b))
        return low, brentq(lambda x: self.polar(np.array(x))[0] - r_a, high - 0.2, high + 0.2, xtol=1e-15)

    def kinks(self) -> list[float]:
        """Roll lengths at which modifications and the rounding begin."""
        r_b, tip = self.gear.base_radius, self.gear.tip_form_radius
        rounding = [math.sqrt(tip**2 - r_b**2)] if self.gear.tip_rounding else []
        return [*rounding, *(k for m in self.modifications if (k := m.kink(r_b)) is not None)]


def first_touch(pair: Pair, modifications: tuple[Modification, ...], v: float) -> tuple[float, float]:
    """Nominal coordinate u and separation g [mm] at first touch, with the pinion at v and the wheel turned against it.

    The separation is infinite if no point of the pinion's flank meets the wheel's flank.
    """
    own, mate = (Flank(g, tuple(m for m in modifications if m.gear == k)) for k, g in enumerate(pair.gears))
    T, (r_1, r_2) = pair.meshing.tangent_length, (g.base_radius for g in pair.gears)
    low, high = own.range()
    least, most = mate.range()

    def wheel_radius(roll: NDArray) -> tuple[NDArray, NDArray]:
        R, angle = own.polar(np.asarray(roll, dtype=float))
        angle = angle + math.pi / 2 - v / r_1
        x, y = T - R * np.cos(angle), r_1 - R * np.sin(angle)  # seen from T2, towards T1
        return np.hypot(x, y + r_2), np.arctan2(y + r_2, x)

    def separation(roll: NDArray) -> NDArray:
        R, angle = wheel_radius(roll)
        other = np.sqrt(np.maximum(R**2 - r_2**2, 0.0))
        for _ in range(60):  # ℓ − e(ℓ) = tangent length: a contraction, e′ is small
            new = np.sqrt(np.maximum(R**2 - r_2**2, 0.0)) + mate.missing(other)
            done = np.all(np.abs(new - other) < 1e-15 * T)
            other = new
            if done:
                break
        outside = (other < least - 1e-9) | (other > most + 1e-9) | (r_2 > R)
        found = v + r_2 * (math.pi / 2 + mate.polar(other)[1] - angle) - T
        return np.where(outside, np.inf, found)

    # points of the pinion that meet an end or a kink of the wheel's flank
    grid = np.linspace(low, high, _POINTS)
    marks = [x for x in own.kinks() if low < x < high]
    for limit in (least, most, *mate.kinks()):
        R = float(mate.polar(np.array(limit))[0])
        f = wheel_radius(grid)[0] - R
        marks += [
            brentq(lambda x, R=R: float(wheel_radius(x)[0]) - R, grid[i], grid[i + 1], xtol=1e-15)
            for i in np.flatnonzero(f[:-1] * f[1:] < 0)
        ]
    grid = np.unique([*grid, *marks])
    values = separation(grid)
    if not np.isfinite(values).any():
        return v, math.inf
    best = float(values.min())
    padded = np.concatenate([[np.inf], values, [np.inf]])
    for i in np.flatnonzero((values <= padded[:-2]) & (values <= padded[2:]) & (values < best + 1e-3)):
        left, right = grid[max(i - 1, 0)], grid[min(i + 1, len(grid) - 1)]
        for a, b in ((left, grid[i]), (grid[i], right), (left, right)):
            if a == b:
                continue
            found = minimize_scalar(
                lambda x: min(float(separation(np.array(x))), 1e3), bounds=(a, b), method="bounded", options=_PRECISE
            )
            best = min(best, float(found.fun))
    return v - best / 2, best
