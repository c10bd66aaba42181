"""Shapes over the face width, of the pair (common face) or of each gear (its face)."""

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
    """Shapes over the face width, with keys of the pair or a table for each gear."""

    #: Input class of the keys of the pair, and of the table of a gear, with ``check`` and ``shapes``.
    of_pair: ClassVar[type]

    def tables(self) -> dict[int | None, Any]:
        """The table of each gear that has one, or of the pair (None)."""
        of_gears: dict[int | None, Any] = {**each_gear(self)}
        return of_gears or {None: self.of_pair(**{key.name: getattr(self, key.name) for key in fields(self.of_pair)})}

    def check(self, pair: Pair, effects: Effects) -> None:
        """Refuse shapes that do not fit on a face."""
        for index, table in self.tables().items():
            with naming(below="" if index is None else GEARS[index]):
                table.check(pair.face_of(index))

    def shapes(self, pair: Pair) -> list[Shape]:
        """The shapes of all tables."""
        return [shape for index, table in self.tables().items() for shape in table.shapes(index, pair.face_of(index))]
