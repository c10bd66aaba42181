"""Tip relief: material missing towards the tip, measured on the radius."""

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
class TipRelief(GapEffect):
    """Tip relief: e = amount · (R − (r_a − length))/length above the start radius r_a − length, or its square.

    Parameters
    ----------
    amount
        Material missing at the tip [µm].
    length
        Radial length L from the tip [mm]; 0 means no relief.
    shape
        "linear" (the paper's) or "parabolic".
    gear
        "both" (each the same), "pinion" or "wheel".
    """

    amount: Annotated[float, Field(ge=-1000.0, le=1000.0)]
    length: Annotated[float, Field(ge=0.0, le=1000.0)]
    shape: Shape = "linear"
    gear: Gears = "both"

    name: ClassVar[str] = "tip_relief"
    summary: ClassVar[str] = "gap: relief of the tip, linear or parabolic in the radius"
    source: ClassVar[str] = "ISO 21771 C_α; Garambois et al. 2017"
    use: ClassVar[str] = "Where teeth enter contact too early under load."
    example: ClassVar[dict[str, Any]] = {"amount": 6.0, "length": 0.5}

    def check(self, pair: Pair, beside: Effects) -> None:
        """Refuse a relief longer than the tooth."""
        for i in chosen(self.gear):
            height = pair.gears[i].tooth_height
            if self.length > height:
                raise InputError("length", self.length, f"must be at most the tooth height, {height:.4g} mm")

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        total = np.zeros(lines.shape)
        for i in chosen(self.gear):
            total += relief(lines.pair.gears[i].tip_radius - lines.radii[i], self.length, self.amount, self.shape)
        return total

    def kinks(self, pair: Pair) -> tuple[float, ...]:
        """Where the relief begins on the path of contact, u [mm]."""
        if self.amount == 0 or self.length == 0:
            return ()
        starts = [pair.gears[i].tip_radius - self.length for i in chosen(self.gear)]
        return tuple(pair.meshing.path_coordinate(i, r) for i, r in zip(chosen(self.gear), starts, strict=True))
