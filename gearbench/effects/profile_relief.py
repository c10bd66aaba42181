"""Relief of one end of the profile: common part of tip and root relief."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass as plain_dataclass
from dataclasses import replace
from typing import Annotated, ClassVar

from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.effects.base import Effects
from gearbench.effects.shape import (
    Along,
    Amount,
    Extent,
    Form,
    Gears,
    Shape,
    ShapeEffect,
    chosen,
    each_gear,
    one_or_each,
    relief,
    roll,
)
from gearbench.errors import InputError
from gearbench.geometry.names import GEARS
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT

#: Keys that say where a relief starts.
_STARTS = ("length", "start_diameter", "start_roll_length", "start_roll_angle")


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Relief:
    """Relief of one gear: its amount, and one of four keys that say where it starts.

    Parameters
    ----------
    amount
        Material missing at the relieved end [µm].
    length
        Radial height from the relieved end [mm].
    start_diameter
        Diameter of the start [mm].
    start_roll_length
        Roll length √(R² − r_b²) of the start [mm].
    start_roll_angle
        Roll angle √(R² − r_b²)/r_b of the start [°].
    shape
        Shape of the relief; "circular" is an arc tangent to the flank.
    along
        Coordinate of the shape: "radius" or "roll" length. By default the radius for a length or a diameter, the roll
        length for a roll length or angle.
    """

    amount: Amount
    length: Extent | None = None
    start_diameter: Annotated[float, Field(gt=0.0, le=40000.0)] | None = None
    start_roll_length: Annotated[float, Field(ge=0.0, le=10000.0)] | None = None
    start_roll_angle: Annotated[float, Field(ge=0.0, le=180.0)] | None = None
    shape: Form = "linear"
    along: Along | None = None

    def __post_init__(self) -> None:
        given = [name for name in _STARTS if getattr(self, name) is not None]
        if not given:
            raise InputError("length", "missing", f"is required unless one of {', '.join(_STARTS[1:])} is given")
        if len(given) > 1:
            raise InputError(given[1], getattr(self, given[1]), f"conflicts with {given[0]}: give one of the two")


# pydantic checks the keys of its subclasses
@plain_dataclass(frozen=True)
class ProfileRelief(ShapeEffect):
    """Relief of one end of the profile: common keys for both gears or one of them, or a table for each."""

    amount: Amount | None = None
    length: Extent | None = None
    shape: Form = "linear"
    gear: Gears = "both"
    pinion: Relief | None = None
    wheel: Relief | None = None

    #: +1 for the tip, −1 for the root.
    side: ClassVar[int]
    #: What limits the length of a relief, in words.
    limited_by: ClassVar[str]

    def __post_init__(self) -> None:
        one_or_each(self, ("amount", "length"))
        with_table = list(each_gear(self))
        if with_table and self.gear != "both":
            raise InputError("gear", self.gear, f"conflicts with the table {GEARS[with_table[0]]}: give one of the two")

    @abstractmethod
    def edge(self, pair: Pair, index: int) -> float:
        """Radius of the relieved end [mm]."""

    def tables(self) -> dict[int, Relief]:
        """The relief of each gear that has one."""
        if self.amount is not None and self.length is not None:
            same = Relief(amount=self.amount, length=self.length, shape=self.shape)
            return dict.fromkeys(chosen(self.gear), same)
        return each_gear(self)

    def only_on(self, index: int) -> ProfileRelief | None:
        """The effect with only the relief of gear ``index``, as a table; None if that gear has no relief."""
        table = self.tables().get(index)
        cleared = {"amount": None, "length": None, "shape": "linear", "gear": "both", GEARS[1 - index]: None}
        return None if table is None else replace(self, **cleared, **{GEARS[index]: table})

    def shapes(self, pair: Pair) -> list[Shape]:
        """The reliefs of nonzero amount and length."""
        shapes = []
        for index, table in self.tables().items():
            edge, start = self.edge(pair, index), self.start(pair, index, table)
            by_roll = table.start_roll_length is not None or table.start_roll_angle is not None
            along = table.along or ("roll" if by_roll else "radius")
            if along == "roll":
                edge, start = (roll(pair.gears[index], radius) for radius in (edge, start))
            if table.amount != 0 and edge != start:
                ramp = relief(along, edge, start, table.amount, table.shape)
                shapes.append(Shape(gear=index, amount=table.amount, factors=(ramp,)))
        return shapes

    def start(self, pair: Pair, index: int, table: Relief) -> float:
        """Radius at which the relief begins [mm]."""
        gear = pair.gears[index]
        if table.length is not None:
            return self.edge(pair, index) - self.side * table.length
        if table.start_diameter is not None:
            return math.copysign(table.start_diameter / 2, gear.teeth)
        if table.start_roll_length is not None:
            return float(gear.radius_at(table.start_roll_length))
        return gear.base_radius * math.hypot(1.0, math.radians(table.start_roll_angle or 0.0))

    def check(self, pair: Pair, effects: Effects) -> None:
        """Refuse a relief that does not fit the tooth."""
        for index, table in self.tables().items():
            edge, (low, high) = self.edge(pair, index), self.limits(pair, index)
            key = "" if self.amount is not None else f"{GEARS[index]}."
            start = self.start(pair, index, table)
            if table.length is not None:
                longest = edge - low if self.side > 0 else high - edge
                if table.length > longest:
                    allowed = f"must be at most {self.limited_by}, {longest:.4g} mm"
                    raise InputError(f"{key}length", table.length, allowed)
                if table.along == "roll" and abs(start) < abs(pair.gears[index].base_radius):
                    raise InputError(f"{key}along", "roll", "begins below the base circle: no roll length there")
                continue
            name = next(name for name in _STARTS if getattr(table, name) is not None)
            # The involute of an external gear begins at the base circle. Radii of an internal gear are negative.
            if low > 0:
                low = max(low, pair.gears[index].base_radius)
            if not low <= start <= high:
                smallest, largest = sorted((abs(2 * low), abs(2 * high)))
                allowed = f"must lie on the tooth, at a diameter of {smallest:.6g} to {largest:.6g} mm"
                if name != "start_diameter":
                    allowed += f", not {abs(2 * start):.6g} mm"
                raise InputError(f"{key}{name}", getattr(table, name), allowed)

    @abstractmethod
    def limits(self, pair: Pair, index: int) -> tuple[float, float]:
        """Radii [mm] between which a relief may begin."""
