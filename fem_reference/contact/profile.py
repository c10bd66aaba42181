"""Manufactured right flanks: the involute without the material removed by the gaps of a scene."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.base import GapEffect
from gearbench.effects.profile_relief import ProfileRelief
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair

#: Fixed-point steps for the roll length; each gains a factor of about a hundred.
_STEPS = 5


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Right flank of one gear in one transverse section.

    Parameters
    ----------
    pair, gear
        The pair, and the gear.
    effects
        Effects that remove material. Effects without a gear are cut from the pinion.
    y
        Position across the face [mm]; by default its middle.
    """

    pair: Pair
    gear: int
    effects: tuple[GapEffect, ...]
    y: float | None = None

    def missing(self, R: NDArray, k: int) -> NDArray:
        """Missing material normal to the flank [mm] at the radii R (n,) of the tooth of pair k.

        R is where the flank is: the point of the involute that was moved there lies farther out (T1 of docs/theory.md).
        """
        gear, effects = self.pair.gears[self.gear], self._own()
        if not effects:
            return np.zeros(len(R))
        length = gear.sign * np.sqrt(np.maximum(R**2 - gear.base_radius**2, 0.0))
        missing = np.zeros(len(R))
        for _ in range(_STEPS):
            missing = self._missing_at(length + missing / math.cos(gear.beta_b), effects, k)
        return missing

    def _missing_at(self, roll: NDArray, effects: list[GapEffect], k: int) -> NDArray:
        """The same at roll lengths of the involute."""
        u = self.pair.meshing.along_path(self.gear, roll)
        lines = ContactLines(
            pair=self.pair,
            mesh_phase=np.zeros(1),
            index=np.array([k]),
            u=u[None, None],
            y=np.full((1, 1, len(u)), self.pair.meshing.face_width / 2 if self.y is None else self.y),
            length=np.ones((1, 1)),
        )
        return sum((each.gap(lines)[0, 0] for each in effects), np.zeros(len(u)))

    def angle(self, R: NDArray, k: int) -> NDArray:
        """Angle [rad] of the flank from the middle of its tooth: e = r_b cos β_b Δψ."""
        gear = self.pair.gears[self.gear]
        return gear.half_angle(R) - self.missing(R, k) / (gear.base_radius * math.cos(gear.beta_b))

    def _own(self) -> list[GapEffect]:
        reliefs = [each for each in self.effects if isinstance(each, ProfileRelief)]
        rest = [each for each in self.effects if each not in reliefs] if self.gear == 0 else []
        return [*rest, *(own for each in reliefs if (own := each.only_on(self.gear)) is not None)]
