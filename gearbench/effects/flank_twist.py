"""Flank twist: a profile slope that changes over the face width."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

from pydantic.dataclasses import dataclass

from gearbench.effects.shape import AmountPerGear, Ramp, face_slope, slope
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class FlankTwist(AmountPerGear):
    """Flank twist S_α of each gear: e = S_α (y/b − ½) (t − ½).

    t runs from 0 to 1 over the roll length of the active profile. S_α is the profile slope at y = b minus that at y =
    0. Positive: material missing at the tip at y = b and at the root at y = 0, excess at the two other corners.

    Parameters
    ----------
    pinion, wheel
        S_α, change of the profile slope over the face width [µm].
    """

    name: ClassVar[str] = "flank_twist"
    summary: ClassVar[str] = "gap: profile slope that changes linearly over the face width"
    source: ClassVar[str] = "ISO 21771-1 S_α"
    use: ClassVar[str] = "The twist that generating grinding leaves on a crowned helical flank, or a deliberate one."
    example: ClassVar[dict[str, Any]] = {"pinion": 6.0}

    def factors(self, pair: Pair, index: int) -> tuple[Ramp, ...]:
        """(y/b − ½) and (t − ½)."""
        along, over = slope(pair, index), face_slope(pair, index)
        return tuple(replace(ramp, start=ramp.start + ramp.length / 2) for ramp in (over, along))
