"""End relief: material missing towards both ends of the face, or one of them."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic.dataclasses import dataclass

from gearbench.effects.base import Effects, GapEffect
from gearbench.effects.relief import Amount, Extent, Shape, relief
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT

_ENDS = ("at_0", "at_b")


@dataclass(frozen=True, kw_only=True, config=STRICT)
class OneEnd:
    """Relief of one end of the face.

    Parameters
    ----------
    amount
        Material missing at the end of the face [µm].
    length
        Along the face width [mm]; 0 means no relief.
    shape
        "linear", "parabolic" or "circular".
    """

    amount: Amount
    length: Extent
    shape: Shape = "linear"


@dataclass(frozen=True, kw_only=True, config=STRICT)
class EndRelief(GapEffect):
    """End relief of the pair, both gears together: the same at both ends, or a table for either end.

    Parameters
    ----------
    amount
        Material missing at either end of the face [µm].
    length
        Length of each relief along the face width [mm]; 0 means no relief.
    shape
        "linear", "parabolic" or "circular".
    at_0, at_b
        Relief of the end at y = 0, at y = b, in place of the keys above.
    """

    amount: Amount | None = None
    length: Extent | None = None
    shape: Shape = "linear"
    at_0: OneEnd | None = None
    at_b: OneEnd | None = None

    name: ClassVar[str] = "end_relief"
    summary: ClassVar[str] = "gap: relief of the ends of the face"
    source: ClassVar[str] = "ISO 21771-1 C_βI, C_βII"
    use: ClassVar[str] = "Where only the ends of the face are to be relieved."
    example: ClassVar[dict[str, Any]] = {"amount": 5.0, "length": 2.0}

    def __post_init__(self) -> None:
        own = [name for name in _ENDS if getattr(self, name) is not None]
        for name in ("amount", "length"):
            value = getattr(self, name)
            if own and value is not None:
                raise InputError(name, value, f"conflicts with the table {own[0]}: give one of the two")
            if not own and value is None:
                raise InputError(name, "missing", "is required, or a table at_0 or at_b")

    @property
    def ends(self) -> tuple[OneEnd | None, OneEnd | None]:
        """Relief at y = 0 and at y = b."""
        if self.amount is None or self.length is None:
            return self.at_0, self.at_b
        same = OneEnd(amount=self.amount, length=self.length, shape=self.shape)
        return same, same

    def check(self, pair: Pair, beside: Effects) -> None:
        """Refuse reliefs that overlap."""
        b, lengths = pair.meshing.face_width, [0.0 if end is None else end.length for end in self.ends]
        if self.length is not None and self.length > b / 2:
            raise InputError("length", self.length, f"must be at most half the face width, {b / 2:.4g} mm")
        if sum(lengths) > b:
            name = _ENDS[int(np.argmax(lengths))]
            allowed = f"both together must be at most the face width, {b:.4g} mm"
            raise InputError(f"{name}.length", max(lengths), allowed)

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        total = np.zeros(lines.shape)
        for end, distance in zip(self.ends, (lines.face, lines.pair.meshing.face_width - lines.face), strict=True):
            if end is not None:
                total += relief(distance, end.length, end.amount, end.shape)
        return total

    def face_kinks(self, pair: Pair) -> tuple[float, ...]:
        """Where each relief begins, y [mm]."""
        at_0, at_b = (None if end is None or end.amount == 0 else end.length or None for end in self.ends)
        found = (at_0, None if at_b is None else pair.meshing.face_width - at_b)
        return tuple(y for y in found if y is not None)
