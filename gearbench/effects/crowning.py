"""Crowning over the face width."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.effects.over_face import OverFace
from gearbench.effects.shape import Amount, Ramp, Shape, one_or_each
from gearbench.errors import InputError
from gearbench.schema import STRICT

Highest = Annotated[float, Field(ge=0.0, le=20000.0)]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class OneCrowning:
    """Crowning of one gear over its face.

    Parameters
    ----------
    amount
        C_β, material missing at either end of the face [µm].
    amount_at_0
        C_β0, material missing at y = 0, if different from y = b [µm].
    highest
        Position y_0 of the highest point [mm]; by default the middle of the face.
    """

    amount: Amount
    amount_at_0: Amount | None = None
    highest: Highest | None = None

    def check(self, b: float) -> None:
        """Refuse, with an ``InputError``, a highest point outside the face."""
        if self.highest is not None and self.highest > b:
            raise InputError("highest", self.highest, f"must be at most the face width, {b:.4g} mm")

    def shapes(self, index: int | None, b: float) -> list[Shape]:
        """One parabola over a face of the width b [mm], or half parabolas on both sides of the highest point."""
        amount_at_0 = self.amount if self.amount_at_0 is None else self.amount_at_0
        top = b / 2 if self.highest is None else self.highest
        if amount_at_0 == self.amount and top == b / 2:
            parabola = Ramp(along="face", start=top, length=top, power=2)
            return [Shape(gear=index, amount=self.amount, factors=(parabola,))]
        halves = []
        for amount, length in ((amount_at_0, -top), (self.amount, b - top)):
            if length:  # the highest point may be at an end of the face
                half = Ramp(along="face", start=top, length=length, power=2, one_sided=True, kinked=False)
                halves.append(Shape(gear=index, amount=amount, factors=(half,)))
        return halves


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Crowning(OverFace):
    """Crowning e = C_β (2y/b − 1)², for the pair over the common face or in a table for each gear.

    Unsymmetrical crowning: e = C_β0 (1 − y/y_0)² before the highest point y_0, C_β ((y − y_0)/(b − y_0))² after it.

    Parameters
    ----------
    amount
        C_β, material missing at either end of the face [µm].
    amount_at_0
        C_β0, material missing at y = 0, if different from y = b [µm].
    highest
        Position y_0 of the highest point [mm]; by default the middle of the face.
    pinion, wheel
        Crowning of each gear over its face, instead of the keys above.
    """

    amount: Amount | None = None
    amount_at_0: Amount | None = None
    highest: Highest | None = None
    pinion: OneCrowning | None = None
    wheel: OneCrowning | None = None

    table_class: ClassVar[type] = OneCrowning
    name: ClassVar[str] = "crowning"
    summary: ClassVar[str] = "gap: parabola over the face width"
    source: ClassVar[str] = "ISO 21771-1 C_β; Garambois et al. 2017"
    use: ClassVar[str] = "To keep the load away from the ends of the face."
    example: ClassVar[dict[str, Any]] = {"amount": 4.0}

    def __post_init__(self) -> None:
        one_or_each(self, ("amount",), ("amount_at_0", "highest"))
