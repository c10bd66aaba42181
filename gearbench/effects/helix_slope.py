"""Helix slope: a flank that leads, linear over the face width."""

from __future__ import annotations

from typing import Any, ClassVar

from numpy.typing import NDArray
from pydantic.dataclasses import dataclass

from gearbench.effects.base import GapEffect
from gearbench.effects.relief import MICROMETRE, Amount
from gearbench.geometry.action import ContactLines
from gearbench.geometry.role import Role
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class HelixSlope(GapEffect):
    """Helix slope f_Hβ of each gear: zero at y = 0, full amount at y = b. Positive: material missing at y = b.

    Parameters
    ----------
    pinion, wheel
        Amounts over the face width [µm].
    """

    pinion: Amount = 0.0
    wheel: Amount = 0.0

    name: ClassVar[str] = "helix_slope"
    summary: ClassVar[str] = "gap: linear over the face width, each gear"
    source: ClassVar[str] = "ISO 1328-1 f_Hβ"
    use: ClassVar[str] = "A known deviation of the helix, or a deliberate correction."
    example: ClassVar[dict[str, Any]] = {"pinion": 5.0}

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        share = [lines.own_face(role) / gear.face_width for role, gear in zip(Role, lines.pair.gears, strict=True)]
        return MICROMETRE * (self.pinion * share[0] + self.wheel * share[1])
