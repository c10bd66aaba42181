"""Right flanks as they are made: the involute less the material that the gaps of a scene take away."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.base import GapEffect
from gearbench.effects.profile_relief import ProfileRelief
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.geometry.role import Role


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Right flank of one gear in the middle of its face.

    Parameters
    ----------
    pair, role
        The pair, and which gear of it.
    effects
        Effects that take material away. One that does not say from which gear is cut from the pinion.
    """

    pair: Pair
    role: Role
    effects: tuple[GapEffect, ...]

    def missing(self, R: NDArray, k: int) -> NDArray:
        """Missing material normal to the flank [mm] at the radii R (n,) of the tooth of pair k."""
        u = np.array([self.pair.meshing.path_coordinate(self.role, float(r)) for r in R])
        lines = ContactLines(
            pair=self.pair,
            mesh_phase=np.zeros(1),
            index=np.array([k]),
            u=u[None, None],
            y=np.full((1, 1, len(u)), self.pair.face_width / 2),
            length=np.ones((1, 1)),
        )
        return sum((each.gap(lines)[0, 0] for each in self._own()), np.zeros(len(R)))

    def angle(self, R: NDArray, k: int) -> NDArray:
        """Angle [rad] of the flank from the middle of its tooth: e = r_b Δψ."""
        gear = self.pair.gears[self.role]
        return gear.half_angle(R) - self.missing(R, k) / gear.base_radius

    def _own(self) -> list[GapEffect]:
        reliefs = [each for each in self.effects if isinstance(each, ProfileRelief)]
        rest = [each for each in self.effects if each not in reliefs] if self.role == Role.PINION else []
        return [*rest, *(own for each in reliefs if (own := each.on(self.role)) is not None)]
