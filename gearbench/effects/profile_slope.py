"""Profile slope: a flank that leans, linear in the roll length of each gear."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic.dataclasses import dataclass

from gearbench.effects.shape import AmountOfGears, Ramp, slope
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class ProfileSlope(AmountOfGears):
    """Profile slope f_Hα of each gear: zero at the start of its active profile, full amount at its end (tip side).

    Linear along the path of contact, i.e. in roll length, as a profile is measured. Positive: material missing at
    the tip.

    Parameters
    ----------
    pinion, wheel
        Amounts [µm].
    """

    name: ClassVar[str] = "profile_slope"
    summary: ClassVar[str] = "gap: linear along the profile of each gear"
    source: ClassVar[str] = "ISO 1328-1 f_Hα"
    use: ClassVar[str] = "A known deviation of the pressure angle, or a deliberate one."
    example: ClassVar[dict[str, Any]] = {"pinion": 2.0, "wheel": -3.0}

    def factors(self, pair: Pair, index: int) -> tuple[Ramp, ...]:
        """t over the roll length of the active profile."""
        return (slope(pair, index),)
