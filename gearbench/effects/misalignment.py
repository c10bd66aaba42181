"""Misalignment of the two axes: inclination in their common plane, deviation out of it."""

from __future__ import annotations

from typing import Any, ClassVar

from numpy.typing import NDArray
from pydantic.dataclasses import dataclass

from gearbench.effects.base import GapEffect
from gearbench.effects.shape import Amount, opening
from gearbench.geometry.action import ContactLines
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Misalignment(GapEffect):
    """Axes that are not parallel: a gap that is linear over the face width, zero at y = 0, positive towards y = b.

    At y = b the gap normal to the flank is (f_Σδ sin α_wt + f_Σβ cos α_wt) cos β_b: f_Σδ moves the axes apart in their
    common plane, f_Σβ moves the wheel away perpendicular to this plane.

    Parameters
    ----------
    inclination
        f_Σδ, in the common plane of the axes, over the face width [µm].
    deviation
        f_Σβ, perpendicular to that plane, over the face width [µm].
    """

    inclination: Amount = 0.0
    deviation: Amount = 0.0

    of_flank: ClassVar[bool] = False
    name: ClassVar[str] = "misalignment"
    summary: ClassVar[str] = "gap: linear over the face width, from axes that are not parallel"
    source: ClassVar[str] = "ISO/TR 10064-3 f_Σδ, f_Σβ"
    use: ClassVar[str] = "Axes known not to be parallel: bent shafts, tilted bearings."
    example: ClassVar[dict[str, Any]] = {"inclination": 4.0, "deviation": 6.0}

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        return opening(lines, self.inclination, self.deviation)
