"""Root relief: material missing towards the start of the active profile."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic.dataclasses import dataclass

from gearbench.effects.profile_relief import ProfileRelief
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class RootRelief(ProfileRelief):
    """Root relief: full at the start of the active profile (r_SAP), zero at r_SAP + length.

    Parameters
    ----------
    amount
        Material missing at the start of the active profile [µm].
    length
        Radial length from there [mm]; 0: no relief.
    shape
        Shape of the relief.
    gear
        Gears that have the relief.
    pinion, wheel
        Relief of each gear, instead of the keys above.
    """

    name: ClassVar[str] = "root_relief"
    summary: ClassVar[str] = "gap: relief of the root side of the active profile"
    source: ClassVar[str] = "ISO 21771-1 C_αf"
    use: ClassVar[str] = "Instead of the tip relief of the mate, or with it."
    example: ClassVar[dict[str, Any]] = {"amount": 3.0, "length": 0.3}
    side: ClassVar[int] = -1
    limited_by: ClassVar[str] = "the height of the active profile"

    def edge(self, pair: Pair, index: int) -> float:
        """r_SAP [mm]."""
        return pair.meshing.active_radii[index][0]

    def limits(self, pair: Pair, index: int) -> tuple[float, float]:
        """The active profile [mm]."""
        return pair.meshing.active_radii[index]
