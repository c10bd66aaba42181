"""Transverse profile of a flank in its roll length: involute, modifications, tip edge or tip rounding.

A point of the involute has the roll length ℓ: the length of the tangent from the base circle to it. Missing material
e(ℓ) moves it along that tangent, so that the modified flank is the curve ℓ ↦ (ℓ − e, r_b) on tangents that turn by
dℓ/r_b (T1 of docs/theory.md). The arc of a tip rounding can also be written so. On an internal gear ℓ and r_b are
negative; ℓ grows from root to tip there too.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.gear import Gear

#: e, e′ and e″ [mm, –, 1/mm] at roll lengths [mm].
Deviation = tuple[NDArray, NDArray, NDArray]


@dataclass(frozen=True, kw_only=True)
class Modification:
    """Missing material that is the same all over the face: e = amount · t^power, t = (x − start)/length.

    Parameters
    ----------
    gear
        Gear: 0 the driver, 1 the driven gear.
    amount
        Material missing at t = 1 [mm].
    start, length
        Start and length of t [mm]; a negative length counts from the tip side towards the root.
    power
        1, 2, …
    arc
        κ = length/radius of an arc, (1 − √(1 − κ²t²))/(1 − √(1 − κ²)), which replaces the power; 0 for a power.
    along
        x is the radius or the roll length.
    one_sided
        Whether e = 0 for t < 0.
    """

    gear: int
    amount: float
    start: float
    length: float
    power: int = 1
    arc: float = 0.0
    along: Literal["radius", "roll"] = "radius"
    one_sided: bool = True

    def kink(self, base_radius: float) -> float | None:
        """Roll length of its start; None if it is not one-sided."""
        if not self.one_sided:
            return None
        if self.along == "roll":
            return self.start
        return math.copysign(math.sqrt(max(self.start**2 - base_radius**2, 0.0)), base_radius)

    def is_on(self, roll: float, base_radius: float) -> bool:
        """Whether a roll length lies within the modification: always, unless it is one-sided."""
        x = roll if self.along == "roll" else math.copysign(math.hypot(roll, base_radius), base_radius)
        return not self.one_sided or (x - self.start) / self.length > 0

    def deviation(self, roll: NDArray, base_radius: float) -> Deviation:
        """e, e′, e″, continued analytically beyond the start."""
        if self.along == "roll":
            x, dx, ddx = roll, np.ones_like(roll), np.zeros_like(roll)
        else:
            x = math.copysign(1.0, base_radius) * np.hypot(roll, base_radius)
            dx, ddx = roll / x, base_radius**2 / x**3
        t, dt, ddt = (x - self.start) / self.length, dx / self.length, ddx / self.length
        f, df, ddf = self._shape(t)
        return self.amount * f, self.amount * df * dt, self.amount * (ddf * dt**2 + df * ddt)

    def _shape(self, t: NDArray) -> Deviation:
        """f, f′, f″ of t."""
        n = self.power
        if self.arc:
            # κ²t² reaches 1 only where the arc has turned by 90°, far beyond the flank: 1e-3 keeps the root real
            w = np.sqrt(np.maximum(1 - (self.arc * t) ** 2, 1e-3))
            scale = 1 + math.sqrt(1 - self.arc**2)
            return scale * t**2 / (1 + w), scale * t / w, scale / w**3
        return t**n, n * t ** (n - 1), n * (n - 1) * t ** max(n - 2, 0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """A smooth part of a profile between the roll lengths ``low`` and ``high``; ``parts`` give its deviations."""

    low: float
    high: float
    base_radius: float
    parts: tuple[Callable[[NDArray, float], Deviation], ...]
    is_rounding: bool = False

    @property
    def is_involute(self) -> bool:
        """Whether it is the unmodified involute."""
        return not self.parts

    def deviation(self, roll: NDArray) -> Deviation:
        """e, e′, e″ at roll lengths; continued analytically beyond the piece."""
        zero = np.zeros_like(roll)
        e, de, dde = zero, zero, zero
        for part in self.parts:
            a, b, c = part(roll, self.base_radius)
            e, de, dde = e + a, de + b, dde + c
        return e, de, dde

    def at_tangent_length(self, length: NDArray) -> NDArray:
        """Roll length ℓ of the point ℓ − e(ℓ) = ``length`` along its tangent, by Newton's method."""
        roll = np.array(length, dtype=float)
        if self.is_involute:
            return roll
        for _ in range(30):
            e, de, _ = self.deviation(roll)
            step = (roll - e - length) / (1 - de)
            roll -= step
            if not np.any(np.abs(step) > 1e-15 * np.abs(length).max()):
                break
        return roll

    def normal(self, roll: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray, NDArray]:
        """Normal line at ℓ in the frame of its tangent (T2).

        Returns its angle ε to the tangent, the radius of curvature ρ of the modified profile, the distances c along the
        normal and d across it from the gear's centre to the point, and the derivatives of c and d by ℓ.
        """
        r_b, sign = self.base_radius, math.copysign(1.0, self.base_radius)
        e, de, dde = self.deviation(roll)
        length = roll - e
        eps = np.arctan2(sign * de * r_b, sign * length)
        squared = length**2 + (de * r_b) ** 2
        d_eps = r_b * (dde * length - de * (1 - de)) / np.maximum(squared, 1e-300)
        cos, sin = np.cos(eps), np.sin(eps)
        c, d = length * cos + r_b * sin, r_b * cos - length * sin
        rho = sign * np.sqrt(squared) / (1 + r_b * d_eps)
        return eps, rho, c, d, (1 - de) * cos + d * d_eps, -(1 - de) * sin - c * d_eps


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile:
    """Profile of one flank from its form circle to its tip.

    Parameters
    ----------
    base_radius
        r_b [mm].
    pieces
        Smooth pieces from root to tip.
    has_edge
        Whether it ends in an edge at the tip; a rounded tip ends in the tip circle.
    """

    base_radius: float
    pieces: tuple[Piece, ...]
    has_edge: bool

    @property
    def low(self) -> float:
        """Roll length at the form circle."""
        return self.pieces[0].low

    @property
    def high(self) -> float:
        """Roll length at the end of the last piece."""
        return self.pieces[-1].high

    @property
    def corners(self) -> list[tuple[float, Piece]]:
        """Roll lengths of kinks and of both ends, where a corner may touch, each with a piece that reaches it.

        A rounded tip has no corner.
        """
        inner = [(after.low, after) for after in self.pieces[1:] if not after.is_rounding]
        ends = [(self.low, self.pieces[0])]
        return [*ends, *inner, *([(self.high, self.pieces[-1])] if self.has_edge else [])]

    @cached_property
    def kinks(self) -> list[tuple[float, float]]:
        """Roll lengths of convex kinks, and the increase of slope along the flank there."""
        kinks = []
        for before, after in pairwise(self.pieces):
            joint = np.array(after.low)
            rise = float(after.deviation(joint)[1] - before.deviation(joint)[1])
            # along the flank ds = ℓ dℓ/r_b
            if rise > 0 and not after.is_rounding:
                kinks.append((after.low, rise * self.base_radius / after.low))
        return kinks


def profile(gear: Gear, modifications: tuple[Modification, ...] = ()) -> Profile:
    """Profile of a flank of ``gear`` with its ``modifications``."""
    r_b = gear.base_radius
    low, tip = (float(gear.roll_length(R)) for R in (gear.form_radius, gear.tip_form_radius))
    kinks = sorted({k for m in modifications if (k := m.kink(r_b)) is not None and low < k < tip})
    edges = [low, *kinks, tip]
    pieces = []
    for start, end in pairwise(edges):
        middle = (start + end) / 2
        parts = tuple(m.deviation for m in modifications if m.amount != 0 and m.is_on(middle, r_b))
        pieces.append(Piece(low=start, high=end, base_radius=r_b, parts=parts))
    last = pieces[-1]
    if gear.tip_rounding:
        arc = _Arc(base_radius=r_b, start=tip, radius=gear.tip_rounding)
        end = arc.end(gear.tip_radius)
        parts = (*last.parts, arc.deviation)
        pieces.append(Piece(low=tip, high=end, base_radius=r_b, parts=parts, is_rounding=True))
    elif last.parts:
        # the edge lies on the tip circle, on the modified flank
        high = float(last.at_tangent_length(np.array([tip]))[0])
        pieces[-1] = Piece(low=last.low, high=high, base_radius=r_b, parts=last.parts)
    return Profile(base_radius=r_b, pieces=tuple(pieces), has_edge=not gear.tip_rounding)


@dataclass(frozen=True, kw_only=True)
class _Arc:
    """Arc of a tip rounding that leaves the involute at the roll length ``start`` without kink."""

    base_radius: float
    start: float
    radius: float

    def deviation(self, roll: NDArray, base_radius: float) -> Deviation:
        """e, e′, e″: the arc's centre, seen from the tangent at ℓ, is (x, y)."""
        r_b, inner = base_radius, self.start - self.radius
        eta = (roll - self.start) / r_b
        x, y = inner * np.cos(eta) + r_b * np.sin(eta), r_b * np.cos(eta) - inner * np.sin(eta)
        D, dD, ddD = r_b - y, x / r_b, y / r_b**2
        S = np.sqrt(np.maximum(self.radius**2 - D**2, 1e-12 * self.radius**2))
        dS = -D * dD / S
        ddS = -(dD**2 + D * ddD) / S - (D * dD) ** 2 / S**3
        return roll - x - S, 1 - y / r_b - dS, x / r_b**2 - ddS

    def end(self, tip_radius: float) -> float:
        """Roll length at the tip circle."""
        r_b, inner = self.base_radius, self.start - self.radius
        last = math.copysign(math.sqrt(tip_radius**2 - r_b**2), r_b)
        return self.start + r_b * (math.atan2(r_b, inner) - math.atan2(r_b, last))
