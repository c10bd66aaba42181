"""A shape over the face width: of the pair over the common face, or of each gear over its own."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, ClassVar

from gearbench.effects.base import Effects
from gearbench.effects.shape import Shape, ShapeEffect
from gearbench.errors import InputError
from gearbench.geometry.pair import Pair
from gearbench.geometry.role import Role


@dataclass(frozen=True)
class OverFace(ShapeEffect):
    """Shapes over the face width, whose keys are those of the pair, or in a table for each gear."""

    #: Input class of the table of a gear, with ``check`` and ``shapes`` of the face.
    of_pair: ClassVar[type]

    def tables(self) -> dict[Role | None, Any]:
        """The table of each gear that has one, or of the pair (None)."""
        own: dict[Role | None, Any] = {r: table for r in Role if (table := getattr(self, r.label)) is not None}
        return own or {None: self.of_pair(**{key.name: getattr(self, key.name) for key in fields(self.of_pair)})}

    def check(self, pair: Pair, beside: Effects) -> None:
        """Refuse what does not fit on a face."""
        for role, table in self.tables().items():
            try:
                table.check(pair.face_of(role))
            except InputError as error:
                raise error if role is None else error.within(role.label) from None

    def shapes(self, pair: Pair) -> list[Shape]:
        """The shapes of all tables."""
        return [shape for role, table in self.tables().items() for shape in table.shapes(role, pair.face_of(role))]
