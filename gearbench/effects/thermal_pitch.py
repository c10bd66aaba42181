"""Different base pitches of gears with different temperatures."""

from __future__ import annotations

import math
from typing import ClassVar

from numpy.typing import NDArray
from pydantic.dataclasses import dataclass

from gearbench.effects.base import GapEffect
from gearbench.geometry.action import ContactLines
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class ThermalPitch(GapEffect):
    """Base pitches that differ by p_bt (ε_1 − ε_2), with the gears' thermal strains ε: a gap for each tooth pair.

    It has no table in ``[effects]``; it acts if ``[pair.temperature]`` expands the two gears differently. In the plane
    of action the flanks of an expanding gear move away from the point where its base circle touches the line of action,
    and from the middle of the face (G16 of docs/theory.md). The gap is zero at the pitch point in the middle of the
    face. Beyond the pitch point a pinion that expands more than the wheel closes the gap.
    """

    name: ClassVar[str] = "thermal_pitch"
    summary: ClassVar[str] = "gap: base pitches of gears of different temperatures"
    source: ClassVar[str] = "free thermal strain of involute gears"
    of_flank: ClassVar[bool] = False

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        meshing, (pinion, wheel) = lines.pair.meshing, lines.pair.strains
        # the same all along a contact line, because the gear grows along its axis too
        ahead = lines.u - meshing.pitch_point - (lines.y - meshing.face_width / 2) * math.tan(meshing.beta_b)
        return (wheel - pinion) * math.cos(meshing.beta_b) * ahead
