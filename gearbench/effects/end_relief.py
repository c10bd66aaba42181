"""End relief: material missing towards both ends of the face, or one of them."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from pydantic.dataclasses import dataclass

from gearbench.effects.over_face import OverFace
from gearbench.effects.shape import Amount, Extent, Form, Shape, one_or_each, relief
from gearbench.errors import InputError
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
        Length along the face width [mm]; 0: no relief.
    shape
        Shape of the relief.
    """

    amount: Amount
    length: Extent
    shape: Form = "linear"


@dataclass(frozen=True, kw_only=True, config=STRICT)
class OneFace:
    """End relief of one gear over its face: the same at both ends, or a table for each end.

    Parameters
    ----------
    amount
        Material missing at either end of the face [µm].
    length
        Length along the face width [mm]; 0: no relief.
    shape
        Shape of the relief.
    at_0, at_b
        Relief of the end at y = 0 and of that at y = b, instead of the keys above.
    """

    amount: Amount | None = None
    length: Extent | None = None
    shape: Form = "linear"
    at_0: OneEnd | None = None
    at_b: OneEnd | None = None

    def __post_init__(self) -> None:
        one_or_each(self, ("amount", "length"), names=_ENDS)

    @property
    def ends(self) -> tuple[OneEnd | None, OneEnd | None]:
        """Relief at y = 0 and at y = b."""
        if self.amount is None or self.length is None:
            return self.at_0, self.at_b
        same = OneEnd(amount=self.amount, length=self.length, shape=self.shape)
        return same, same

    def check(self, b: float) -> None:
        """Refuse, with an ``InputError``, reliefs that overlap on a face of the width b [mm]."""
        lengths = [0.0 if end is None else end.length for end in self.ends]
        if self.length is not None and self.length > b / 2:
            raise InputError("length", self.length, f"must be at most half the face width, {b / 2:.4g} mm")
        if sum(lengths) > b:
            name = _ENDS[int(np.argmax(lengths))]
            allowed = f"at_0 and at_b together must be at most the face width, {b:.4g} mm"
            raise InputError(f"{name}.length", max(lengths), allowed)

    def shapes(self, index: int | None, b: float) -> list[Shape]:
        """Reliefs, if not zero, on a face of the width b [mm]; ``index`` is that of the gear, None for the pair."""
        shapes = []
        for end, edge, inwards in zip(self.ends, (0.0, b), (1, -1), strict=True):
            if end is not None and end.amount and end.length:
                ramp = relief("face", edge, edge + inwards * end.length, end.amount, end.shape)
                shapes.append(Shape(gear=index, amount=end.amount, factors=(ramp,)))
        return shapes


@dataclass(frozen=True, kw_only=True, config=STRICT)
class EndRelief(OverFace):
    """End relief, for the pair over the common face or in a table for each gear.

    Parameters
    ----------
    amount
        Material missing at either end of the face [µm].
    length
        Length along the face width [mm]; 0: no relief.
    shape
        Shape of the relief.
    at_0, at_b
        Relief of the end at y = 0 and of that at y = b, instead of the keys above.
    pinion, wheel
        End relief of each gear over its face, instead of all keys above.
    """

    amount: Amount | None = None
    length: Extent | None = None
    shape: Form = "linear"
    at_0: OneEnd | None = None
    at_b: OneEnd | None = None
    pinion: OneFace | None = None
    wheel: OneFace | None = None

    table_class: ClassVar[type] = OneFace
    name: ClassVar[str] = "end_relief"
    summary: ClassVar[str] = "gap: relief of the ends of the face"
    source: ClassVar[str] = "ISO 21771-1 C_βI, C_βII"
    use: ClassVar[str] = "To relieve only the ends of the face."
    example: ClassVar[dict[str, Any]] = {"amount": 5.0, "length": 2.0}

    def __post_init__(self) -> None:
        if self.pinion is None and self.wheel is None:
            one_or_each(self, ("amount", "length"), names=_ENDS)
        else:  # no common key beside the table of a gear
            one_or_each(self, ("amount", "length"), more=_ENDS)
