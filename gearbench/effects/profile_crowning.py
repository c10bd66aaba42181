"""Profile crowning (barrelling): parabolic in the roll length of each gear."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic.dataclasses import dataclass

from gearbench.effects.shape import AmountPerGear, Ramp, barrel, slope
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class ProfileCrowning(AmountPerGear):
    """Profile crowning C_α of each gear: e = C_α (2t − 1)², t from 0 to 1 over the roll length of its active profile.

    Parameters
    ----------
    pinion, wheel
        C_α, material missing at either end of the active profile [µm].
    """

    name: ClassVar[str] = "profile_crowning"
    summary: ClassVar[str] = "gap: parabola along the profile of each gear"
    source: ClassVar[str] = "ISO 21771-1 C_α"
    use: ClassVar[str] = "To relieve tip and root without a kink."
    example: ClassVar[dict[str, Any]] = {"pinion": 4.0, "wheel": 4.0}

    def factors(self, pair: Pair, index: int) -> tuple[Ramp, ...]:
        """(2t − 1)² over the roll length of the active profile."""
        return (barrel(slope(pair, index)),)
