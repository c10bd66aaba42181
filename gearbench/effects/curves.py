"""Base class of ``profile_curve`` and ``helix_curve``: a polynomial, or points with straight lines between them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass as plain_dataclass
from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.effects.shape import Amount, Polyline, Ramp, Shape, ShapeEffect, each_gear
from gearbench.errors import InputError
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT

Coordinates = Annotated[tuple[Annotated[float, Field(ge=-20000.0, le=20000.0)], ...], Field(max_length=10000)]
Deviations = Annotated[tuple[Amount, ...], Field(max_length=10000)]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class FlankCurve:
    """Deviation along one coordinate of a flank, as a polynomial or as points.

    Parameters
    ----------
    polynomial
        Coefficients c_1, c_2, … of c_1 t + c_2 t² + … [µm], t from 0 to 1; at most 12.
    at
        Increasing positions of at least two points [mm]. Beyond them the curve is constant.
    deviation
        Deviation at each point [µm].
    """

    polynomial: Annotated[Deviations, Field(max_length=12)] | None = None
    at: Coordinates | None = None
    deviation: Deviations | None = None

    def __post_init__(self) -> None:
        if (self.polynomial is None) == (self.at is None):
            given = "missing" if self.at is None else "given"
            raise InputError("polynomial", given, "give either polynomial, or at and deviation")
        if self.polynomial is not None:
            if not self.polynomial:
                raise InputError("polynomial", "[]", "must have at least one coefficient")
            if self.deviation is not None:
                raise InputError("deviation", "given", "conflicts with polynomial: give one of the two")
            return
        count = 0 if self.deviation is None else len(self.deviation)
        positions = self.at or ()
        if len(positions) < 2 or count != len(positions):
            allowed = f"must have as many values as `at` ({len(positions)}), at least two"
            raise InputError("deviation", f"{count} values", allowed)
        if not np.all(np.diff(positions) > 0):
            raise InputError("at", list(positions), "must increase")

    def shapes(self, index: int, extent: Ramp) -> Iterator[Shape]:
        """Shapes of the curve on gear ``index``; ``extent`` is t, the variable of the polynomial."""
        if self.at is not None and self.deviation is not None:
            positions, values, along = self.at, self.deviation, "face" if extent.along == "face" else "roll"
            if along == "roll" and extent.start < 0 <= positions[0]:  # roll lengths of an internal gear are negative
                positions, values = tuple(-x for x in reversed(positions)), values[::-1]
            yield Shape(gear=index, factors=(Polyline(along=along, at=positions, values=values),))
        for power, c in enumerate(self.polynomial or (), start=1):
            if c:
                yield Shape(gear=index, amount=c, factors=(replace(extent, power=power),))


@plain_dataclass(frozen=True)
class CurvesOfGears(ShapeEffect):
    """A curve for one gear or both."""

    pinion: FlankCurve | None = None
    wheel: FlankCurve | None = None

    def __post_init__(self) -> None:
        if self.pinion is None and self.wheel is None:
            raise InputError("pinion", "missing", "a curve is required, here or for the wheel")

    @property
    def curves(self) -> dict[int, FlankCurve]:
        """The curve of each gear that has one."""
        return each_gear(self)

    @abstractmethod
    def extent(self, pair: Pair, index: int) -> Ramp:
        """The variable t of the polynomial, a ramp from 0 to 1 on the flank of gear ``index``."""

    def shapes(self, pair: Pair) -> list[Shape]:
        """The terms of the polynomials, or the lines through the points."""
        return [
            shape for index, curve in self.curves.items() for shape in curve.shapes(index, self.extent(pair, index))
        ]
