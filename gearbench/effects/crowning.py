"""Crowning: parabolic, symmetric over the face width."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.effects.base import GapEffect
from gearbench.effects.relief import MICROMETRE
from gearbench.geometry.action import ContactLines
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Crowning(GapEffect):
    """Crowning of the pair, both gears together: e = C_β (2y/b − 1)².

    Parameters
    ----------
    amount
        C_β, material missing at either end of the face [µm].
    """

    amount: Annotated[float, Field(ge=-1000.0, le=1000.0)]

    name: ClassVar[str] = "crowning"
    summary: ClassVar[str] = "gap: parabola over the face width"
    source: ClassVar[str] = "ISO 21771 C_β; Garambois et al. 2017"
    use: ClassVar[str] = "Where the load must stay away from the ends of the face."
    example: ClassVar[dict[str, Any]] = {"amount": 4.0}

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        return self.amount * MICROMETRE * (2 * lines.y / lines.pair.face_width - 1) ** 2
