"""Tip relief: material missing towards the tip."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic.dataclasses import dataclass

from gearbench.effects.profile_relief import ProfileRelief
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class TipRelief(ProfileRelief):
    """Tip relief: e = amount · (R − (r_a − length))/length above its start at R = r_a − length, if linear.

    A parabolic relief has the square of the fraction.

    Parameters
    ----------
    amount
        Material missing at the tip [µm].
    length
        Radial length from the tip [mm]; 0: no relief.
    shape
        Shape of the relief.
    gear
        Gears that have the relief.
    pinion, wheel
        Relief of each gear, instead of the keys above.
    """

    name: ClassVar[str] = "tip_relief"
    summary: ClassVar[str] = "gap: relief of the tip"
    source: ClassVar[str] = "ISO 21771-1 C_αa; Garambois et al. 2017"
    use: ClassVar[str] = "If teeth enter contact too early under load."
    example: ClassVar[dict[str, Any]] = {"amount": 6.0, "length": 0.5}
    side: ClassVar[int] = 1
    limited_by: ClassVar[str] = "the tooth height"

    def edge(self, pair: Pair, index: int) -> float:
        """r_a [mm]."""
        return pair.gears[index].tip_radius

    def limits(self, pair: Pair, index: int) -> tuple[float, float]:
        """The whole tooth [mm]."""
        return pair.gears[index].root_radius, pair.gears[index].tip_radius
