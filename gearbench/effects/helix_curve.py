"""Helix as a curve over the face width: polynomial or points."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic.dataclasses import dataclass

from gearbench.effects.curves import CurvesOfGears
from gearbench.effects.shape import Ramp, face_slope
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class HelixCurve(CurvesOfGears):
    """Deviation of the helix of each gear over the face, the same all along the profile.

    A polynomial runs over the face width of the gear, t = y/b; points are at positions y.

    Parameters
    ----------
    pinion, wheel
        The curve of each gear.
    """

    name: ClassVar[str] = "helix_curve"
    summary: ClassVar[str] = "gap: any curve over the face width of each gear"
    source: ClassVar[str] = "ISO 21771-1, helix modification; ISO 1328-1, helix trace"
    use: ClassVar[str] = "A helix given as a polynomial or as a trace."
    example: ClassVar[dict[str, Any]] = {"pinion": {"at": [0.0, 6.0, 18.0, 24.0], "deviation": [5.0, 0.0, 0.0, 3.0]}}

    def extent(self, pair: Pair, index: int) -> Ramp:
        """y/b over the face of the gear."""
        return face_slope(pair, index)
