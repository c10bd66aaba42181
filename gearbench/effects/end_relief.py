"""End relief: material missing towards both ends of the face width."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.effects.base import Effects, GapEffect
from gearbench.effects.relief import Shape, relief
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class EndRelief(GapEffect):
    """End relief of the pair, both gears together, the same at both ends.

    Parameters
    ----------
    amount
        Material missing at either end of the face [µm].
    length
        Length of each relief along the face width [mm]; 0 means no relief.
    shape
        "linear" or "parabolic".
    """

    amount: Annotated[float, Field(ge=-1000.0, le=1000.0)]
    length: Annotated[float, Field(ge=0.0, le=1000.0)]
    shape: Shape = "linear"

    name: ClassVar[str] = "end_relief"
    summary: ClassVar[str] = "gap: relief of both ends of the face"
    source: ClassVar[str] = "ISO 21771 C_βI, C_βII"
    use: ClassVar[str] = "Where only the ends of the face are to be relieved."
    example: ClassVar[dict[str, Any]] = {"amount": 5.0, "length": 2.0}

    def check(self, pair: Pair, beside: Effects) -> None:
        """Refuse reliefs that overlap."""
        half = pair.face_width / 2
        if self.length > half:
            raise InputError("length", self.length, f"must be at most half the face width, {half:.4g} mm")

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        to_edge = np.minimum(lines.y, lines.pair.face_width - lines.y)
        return relief(to_edge, self.length, self.amount, self.shape)
