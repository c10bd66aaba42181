"""Base class of crowning and end relief: shapes over the common face of the pair, or over the face of each gear."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, ClassVar

from gearbench.effects.base import Effects
from gearbench.effects.shape import Shape, ShapeEffect, each_gear
from gearbench.errors import naming
from gearbench.geometry.names import GEARS
from gearbench.geometry.pair import Pair


@dataclass(frozen=True)
class OverFace(ShapeEffect):
    """Shapes over the face width, given either by keys for the pair or by a table for each gear."""

    #: Class of the table of a gear. The keys for the pair are its fields; its methods are ``check`` and ``shapes``.
    table_class: ClassVar[type]

    def tables(self) -> dict[int | None, Any]:
        """The table of each gear that has one; without any, the keys for the pair as a table with the index None."""
        of_gears: dict[int | None, Any] = {**each_gear(self)}
        if of_gears:
            return of_gears
        return {None: self.table_class(**{key.name: getattr(self, key.name) for key in fields(self.table_class)})}

    def check(self, pair: Pair, effects: Effects) -> None:
        """Refuse shapes that do not fit on a face."""
        for index, table in self.tables().items():
            with naming(below="" if index is None else GEARS[index]):
                table.check(pair.face_of(index))

    def shapes(self, pair: Pair) -> list[Shape]:
        """The shapes of all tables."""
        return [shape for index, table in self.tables().items() for shape in table.shapes(index, pair.face_of(index))]
