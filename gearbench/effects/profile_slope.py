"""Profile slope: missing material that increases linearly over the active profile of each gear."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic.dataclasses import dataclass

from gearbench.effects.shape import AmountPerGear, Ramp, slope
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class ProfileSlope(AmountPerGear):
    """Profile slope f_Hα of each gear, linear in the roll length.

    It is zero at the root end of the active profile and has its full amount at the tip end.

    Parameters
    ----------
    pinion, wheel
        Amounts [µm], positive for missing material.
    """

    name: ClassVar[str] = "profile_slope"
    summary: ClassVar[str] = "gap: linear along the profile of each gear"
    source: ClassVar[str] = "ISO 1328-1 f_Hα"
    use: ClassVar[str] = "A known or deliberate deviation of the pressure angle."
    example: ClassVar[dict[str, Any]] = {"pinion": 2.0, "wheel": -3.0}

    def factors(self, pair: Pair, index: int) -> tuple[Ramp, ...]:
        """A ramp from 0 to 1 over the roll lengths of the active profile, which the amount multiplies."""
        return (slope(pair, index),)
