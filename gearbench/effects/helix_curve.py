"""Helix as a curve over the face width: polynomial or points."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic.dataclasses import dataclass

from gearbench.effects.curves import CurvesOfGears
from gearbench.effects.relief import MICROMETRE
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class HelixCurve(CurvesOfGears):
    """Deviation of the helix of each gear over the face, the same all along the profile.

    A polynomial runs over the gear's own face width, t = y/b; points stand at positions y on it.

    Parameters
    ----------
    pinion, wheel
        The curve of each gear.
    """

    name: ClassVar[str] = "helix_curve"
    summary: ClassVar[str] = "gap: any curve over the face width of each gear"
    source: ClassVar[str] = "ISO 21771-1, helix modification; ISO 1328-1, helix trace"
    use: ClassVar[str] = "Where the helix is given as a polynomial or as a trace."
    example: ClassVar[dict[str, Any]] = {"pinion": {"at": [0.0, 6.0, 18.0, 24.0], "deviation": [5.0, 0.0, 0.0, 3.0]}}

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        values = []
        for role, curve in self.curves.items():
            y = lines.own_face(role)
            values.append(curve.values(y / lines.pair.gears[role].face_width, y))
        return MICROMETRE * np.sum(values, axis=0)

    def face_kinks(self, pair: Pair) -> tuple[float, ...]:
        """Positions y [mm] of the points of coarse curves."""
        return tuple(y - pair.overhangs[role][0] for role, curve in self.curves.items() for y in curve.kinks)
