"""Root relief: material missing towards the start of the active profile."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic.dataclasses import dataclass

from gearbench.effects.profile_relief import ProfileRelief
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class RootRelief(ProfileRelief):
    """Root relief: full at the start of the active profile (r_SAP), gone at r_SAP + length.

    By ``amount`` and ``length``, the same of both gears or of one, or by a table for each gear as on its drawing.

    Parameters
    ----------
    amount
        Material missing at the start of the active profile [µm].
    length
        Radial length from there [mm]; 0 means no relief.
    shape
        "linear", "parabolic" or "circular".
    gear
        "both" (each the same), "pinion" or "wheel".
    pinion, wheel
        Relief of each gear, in place of the keys above.
    """

    name: ClassVar[str] = "root_relief"
    summary: ClassVar[str] = "gap: relief of the root side of the active profile"
    source: ClassVar[str] = "ISO 21771-1 C_αf"
    use: ClassVar[str] = "Instead of, or with, relief of the mate's tip."
    example: ClassVar[dict[str, Any]] = {"amount": 3.0, "length": 0.3}
    side: ClassVar[int] = -1
    reach: ClassVar[str] = "the active profile"

    def edge(self, pair: Pair, index: int) -> float:
        """r_SAP [mm]."""
        return pair.meshing.active_radii[index][0]

    def limits(self, pair: Pair, index: int) -> tuple[float, float]:
        """The active profile [mm]."""
        return pair.meshing.active_radii[index]
