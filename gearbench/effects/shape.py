"""Shapes of missing material on a flank, as functions of the position along the profile and over the face.

A shape is an amount [µm] times one or two factors. A factor is a function of one coordinate [mm]: the radius or the
roll length √(R² − r_b²) along the profile, or y over the face of the gear. Positive amounts are missing material.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, is_dataclass
from functools import lru_cache
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gearbench.effects.base import GapEffect
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.gear import Gear
from gearbench.geometry.names import GEARS
from gearbench.geometry.pair import Pair
from gearbench.geometry.profile import Modification

#: Coordinate along the profile: the roll length, which measuring machines use, or the radius.
Along = Literal["roll", "radius"]
#: Span of the profile: the active profile, the involute from form circle to tip, or the whole tooth from root circle to
#: tip.
Span = Literal["active", "involute", "tooth"]
#: Shape of a relief from its start to its end.
Form = Literal["linear", "parabolic", "circular"]
#: Gears that have a shape or an error.
Gears = Literal["both", "pinion", "wheel"]
#: Amount of missing material [µm]; negative for excess material.
Amount = Annotated[float, Field(ge=-1000.0, le=1000.0)]
#: A length on a flank [mm].
Extent = Annotated[float, Field(ge=0.0, le=1000.0)]

MICROMETRE = 1e-3  # mm
#: With more points than this, a curve or grid is treated as smooth: panels of the mesh cycle do not end at its points.
MOST_KINKS = 12


@dataclass(frozen=True, kw_only=True)
class Ramp:
    """A power of t = (x − start)/length, or a circular arc that leaves the flank without kink.

    Parameters
    ----------
    along
        The coordinate x: "radius", "roll" or "face".
    start, length
        x at t = 0, and x(t = 1) − x(t = 0), which may be negative [mm].
    power
        Exponent 1, 2, …
    bend
        κ = length/radius. If not 0, the arc (1 − √(1 − κ²t²))/(1 − √(1 − κ²)) replaces the power.
    one_sided
        Whether the value is 0 for t < 0.
    kinked
        Whether panels of the mesh cycle and of contact lines must end at the start of a one-sided ramp.
    """

    along: Literal["radius", "roll", "face"]
    start: float
    length: float
    power: int = 1
    bend: float = 0.0
    one_sided: bool = False
    kinked: bool = True

    def __call__(self, x: NDArray) -> NDArray:
        """Values at positions x [mm]."""
        t = (x - self.start) / self.length
        if self.one_sided:
            t = np.maximum(t, 0.0)
        if not self.bend:
            return t**self.power
        # (1 − √(1 − κ²t²))/(1 − √(1 − κ²)), written so that κ = 0 is the parabola
        kappa = self.bend
        return t**2 * (1 + math.sqrt(1 - kappa**2)) / (1 + np.sqrt(np.maximum(1 - (kappa * t) ** 2, 0.0)))

    @property
    def kinks(self) -> tuple[float, ...]:
        """Positions x of kinks."""
        return (self.start,) if self.one_sided and self.kinked else ()


@dataclass(frozen=True, kw_only=True)
class Polyline:
    """Straight lines between points at increasing positions, constant before the first and after the last point.

    Parameters
    ----------
    along
        The coordinate of the positions: "roll" or "face".
    at, values
        Positions [mm] and values of the points.
    """

    along: Literal["roll", "face"]
    at: tuple[float, ...]
    values: tuple[float, ...]

    def __call__(self, x: NDArray) -> NDArray:
        """Values at positions x [mm]."""
        return np.interp(x, np.array(self.at), np.array(self.values))

    @property
    def kinks(self) -> tuple[float, ...]:
        """Positions of the points; none if there are more than ``MOST_KINKS``."""
        return self.at if len(self.at) <= MOST_KINKS else ()


@dataclass(frozen=True, kw_only=True)
class Shape:
    """Missing material e = amount · Π factors.

    Parameters
    ----------
    gear
        Gear 0 or 1; None for a shape over the common face of both gears.
    amount
        Amount of missing material [µm].
    factors
        Functions of one coordinate.
    """

    gear: int | None
    amount: float = 1.0
    factors: tuple[Ramp | Polyline, ...]

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap normal to the flanks [mm], (position, pair, segment)."""
        total = np.full(lines.shape, MICROMETRE * self.amount)
        for factor in self.factors:
            total *= factor(_coordinate(lines, self.gear, factor.along))
        # off the line of action a deviation opens the gap in proportion to the lever arm about its gear
        return total if self.gear is None else total * lines.levers[self.gear]

    def modification(self, pair: Pair) -> Modification | None:
        """The shape as a profile modification; None if it varies over the face or consists of points."""
        (factor, *more) = self.factors
        if self.gear is None or more or isinstance(factor, Polyline) or factor.along == "face":
            return None
        return Modification(
            gear=self.gear,
            # a modification is measured in the transverse plane, a gap normal to the flank
            amount=self.amount * MICROMETRE / math.cos(pair.meshing.beta_b),
            start=factor.start,
            length=factor.length,
            power=factor.power,
            arc=factor.bend,
            along=factor.along,
            one_sided=factor.one_sided,
        )


def _coordinate(lines: ContactLines, index: int | None, along: str) -> NDArray:
    if index is None:
        return lines.face
    return lines.gear_face(index) if along == "face" else (lines.radii if along == "radius" else lines.rolls)[index]


@dataclass(frozen=True)
class ShapeEffect(GapEffect):
    """A gap effect that is a sum of shapes."""

    @abstractmethod
    def shapes(self, pair: Pair) -> Iterable[Shape]:
        """Shapes on the flanks of a pair."""

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        return sum((shape.gap(lines) for shape in _shapes(self, lines.pair)), np.zeros(lines.shape))

    def modifications(self, pair: Pair) -> tuple[Modification, ...]:
        """Profile modifications, if every shape is one; otherwise none."""
        modifications = [shape.modification(pair) for shape in _shapes(self, pair)]
        return () if None in modifications else tuple(m for m in modifications if m is not None)

    def kinks(self, pair: Pair) -> tuple[float, ...]:
        """Positions u [mm] on the path of contact where shapes have a kink."""
        kinks = []
        for index, factor in self._factors(pair):
            if index is not None and factor.along != "face":
                rolls = (x if factor.along == "roll" else roll(pair.gears[index], x) for x in factor.kinks)
                kinks += [pair.meshing.along_path(index, x) for x in rolls]
        return tuple(kinks)

    def face_kinks(self, pair: Pair) -> tuple[float, ...]:
        """Positions y [mm] on the common face where shapes have a kink."""
        kinks: list[float] = []
        for index, factor in self._factors(pair):
            if factor.along == "face":
                kinks += [y - (0.0 if index is None else pair.overhangs[index][0]) for y in factor.kinks]
        return tuple(y for y in kinks if 0 < y < pair.meshing.face_width)

    def _factors(self, pair: Pair) -> Iterable[tuple[int | None, Ramp | Polyline]]:
        return ((shape.gear, factor) for shape in _shapes(self, pair) for factor in shape.factors)


@lru_cache(maxsize=64)
def _shapes(effect: ShapeEffect, pair: Pair) -> tuple[Shape, ...]:
    """``effect.shapes``, cached, because the gap is evaluated on many sets of lines."""
    return tuple(effect.shapes(pair))


@dataclass(frozen=True)
class AmountPerGear(ShapeEffect):
    """A shape with an amount for each gear."""

    pinion: Amount = 0.0
    wheel: Amount = 0.0

    @abstractmethod
    def factors(self, pair: Pair, index: int) -> tuple[Ramp, ...]:
        """Factors of the shape on gear ``index``."""

    def shapes(self, pair: Pair) -> list[Shape]:
        """Shapes of the gears whose amount is not zero."""
        amounts = each_gear(self).items()
        return [Shape(gear=index, amount=x, factors=self.factors(pair, index)) for index, x in amounts if x]


def each_gear(effect: object) -> dict[int, Any]:
    """Values of the keys ``pinion`` (0) and ``wheel`` (1) that are given."""
    values = ((index, getattr(effect, name)) for index, name in enumerate(GEARS))
    return {index: value for index, value in values if value is not None}


def roll(gear: Gear, radius: float) -> float:
    """Roll length at a radius [mm]; zero below the base circle."""
    return float(gear.roll_length(radius))


def slope(pair: Pair, index: int, along: Along = "roll", span: Span = "active") -> Ramp:
    """Ramp from 0 at the root end of ``span`` to 1 at its tip end."""
    gear = pair.gears[index]
    ends = {
        "active": pair.meshing.active_radii[index],
        "involute": (gear.form_radius, gear.tip_radius),
        "tooth": (gear.root_radius, gear.tip_radius),
    }[span]
    start, end = (roll(gear, radius) for radius in ends) if along == "roll" else ends
    return Ramp(along=along, start=start, length=end - start)


def face_slope(pair: Pair, index: int | None) -> Ramp:
    """Ramp y/b over the face of gear ``index``, or over the common face (None)."""
    return Ramp(along="face", start=0.0, length=pair.face_of(index))


def barrel(ramp: Ramp) -> Ramp:
    """Parabola (2t − 1)² over the length of a ramp t = 0 … 1: 1 at both ends, 0 in the middle."""
    half = ramp.length / 2
    return Ramp(along=ramp.along, start=ramp.start + half, length=half, power=2)


def relief(along: Literal["radius", "roll", "face"], edge: float, start: float, amount: float, form: Form) -> Ramp:
    """Relief that is full at ``edge`` and zero at ``start`` [mm]; ``amount`` [µm] sets the radius of a circular one.

    The arc is that of (G11) in docs/theory.md.
    """
    length, height = edge - start, abs(amount) * MICROMETRE
    bend = 2 * height * abs(length) / (length**2 + height**2) if form == "circular" else 0.0
    power = 1 if form == "linear" else 2
    return Ramp(along=along, start=start, length=length, power=power, bend=bend, one_sided=True)


def opening(lines: ContactLines, inclination: float, deviation: float) -> NDArray:
    """Gap [mm] between the flanks of gears whose axes diverge over the common face width.

    ``inclination`` f_Σδ is in the common plane of the axes, ``deviation`` f_Σβ perpendicular to it [µm].
    """
    alpha = lines.pair.meshing.alpha_wt
    # a deviation that opens the gap of the drive flanks closes that of the coast flanks
    across = -deviation if lines.coast else deviation
    normal = MICROMETRE * math.cos(lines.pair.meshing.beta_b)
    # diverging axes close the gap of an internal pair
    apart = math.copysign(1.0, lines.pair.centre_distance) * inclination
    opened = apart * math.sin(alpha) + across * math.cos(alpha)
    return normal * opened * lines.face / lines.pair.meshing.face_width


def one_or_each(
    effect: object, required: Sequence[str], more: Sequence[str] = (), names: Sequence[str] = GEARS
) -> None:
    """Check that an effect has either common keys or the tables ``names``, one for each gear or end, but not both.

    Without a table, all ``required`` keys must be given and the keys ``more`` may be given.

    Raises
    ------
    InputError
        If not; the message names the key.
    """
    with_table = [name for name in names if getattr(effect, name) is not None]
    for name in (*required, *more):
        value = getattr(effect, name)
        if with_table and value is not None:
            shown = "given" if is_dataclass(value) else value
            raise InputError(name, shown, f"conflicts with the table {with_table[0]}: give one of the two")
        if not with_table and value is None and name in required:
            raise InputError(name, "missing", f"is required unless there is a table {' or '.join(names)}")


def chosen(gears: Gears) -> tuple[int, ...]:
    """Indices of the chosen gears."""
    return {"both": (0, 1), "pinion": (0,), "wheel": (1,)}[gears]
