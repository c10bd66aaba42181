"""Helix slope: a deviation that is linear over the face width."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic.dataclasses import dataclass

from gearbench.effects.shape import AmountPerGear, Ramp, face_slope
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class HelixSlope(AmountPerGear):
    """Helix slope f_Hβ of each gear: zero at y = 0, full amount at y = b.

    Parameters
    ----------
    pinion, wheel
        Amounts over the face width [µm].
    """

    name: ClassVar[str] = "helix_slope"
    summary: ClassVar[str] = "gap: linear over the face width of each gear"
    source: ClassVar[str] = "ISO 1328-1 f_Hβ"
    use: ClassVar[str] = "A known or deliberate deviation of the helix."
    example: ClassVar[dict[str, Any]] = {"pinion": 5.0}

    def factors(self, pair: Pair, index: int) -> tuple[Ramp, ...]:
        """y/b over the face of the gear."""
        return (face_slope(pair, index),)
