"""Root relief: material missing towards the start of the active profile, measured on the radius."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.effects.base import Effects, GapEffect
from gearbench.effects.relief import Gears, Shape, chosen, relief
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class RootRelief(GapEffect):
    """Root relief: full at the start of the active profile (r_SAP), gone at r_SAP + length.

    Parameters
    ----------
    amount
        Material missing at the start of the active profile [µm].
    length
        Radial length from there [mm]; 0 means no relief.
    shape
        "linear" or "parabolic".
    gear
        "both" (each the same), "pinion" or "wheel".
    """

    amount: Annotated[float, Field(ge=-1000.0, le=1000.0)]
    length: Annotated[float, Field(ge=0.0, le=1000.0)]
    shape: Shape = "linear"
    gear: Gears = "both"

    name: ClassVar[str] = "root_relief"
    summary: ClassVar[str] = "gap: relief of the root side of the active profile"
    source: ClassVar[str] = "ISO 21771 C_f"
    use: ClassVar[str] = "Instead of, or with, relief of the mate's tip."
    example: ClassVar[dict[str, Any]] = {"amount": 3.0, "length": 0.3}

    def check(self, pair: Pair, beside: Effects) -> None:
        """Refuse a relief longer than the active profile."""
        for i in chosen(self.gear):
            start, end = pair.meshing.active_radii[i]
            if self.length > end - start:
                raise InputError("length", self.length, f"must be at most the active profile, {end - start:.4g} mm")

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        total = np.zeros(lines.shape)
        for i in chosen(self.gear):
            start = lines.pair.meshing.active_radii[i][0]
            total += relief(lines.radii[i] - start, self.length, self.amount, self.shape)
        return total

    def kinks(self, pair: Pair) -> tuple[float, ...]:
        """Where the relief ends on the path of contact, u [mm]."""
        if self.amount == 0 or self.length == 0:
            return ()
        return tuple(
            pair.meshing.path_coordinate(i, pair.meshing.active_radii[i][0] + self.length) for i in chosen(self.gear)
        )
