"""A mesh in the frame of the shafts: points of action and directions of its forces, (W7) of docs/theory.md.

The frame is right-handed, with z along the shafts. A rotation that is clockwise when viewed along z is positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.geometry.pair import Pair


@dataclass(frozen=True, kw_only=True)
class MeshFrame:
    """Orientation of a pair between its shafts.

    Parameters
    ----------
    pair
        The pair; its pinion drives.
    across
        Unit vector (x, y) from the pinion's axis to the wheel's.
    turn
        +1 if the pinion turns clockwise, −1 otherwise; reversed for coast flanks.
    hand
        +1 for a right-handed pinion (and for spur gears), −1 for a left-handed one.
    middle
        Middles of the faces of pinion and wheel on their shafts [mm].
    coast
        Whether the coast flanks are loaded. Their face coordinate counts from the other end.
    """

    pair: Pair
    across: tuple[float, float]
    turn: int
    hand: int
    middle: tuple[float, float]
    coast: bool = False

    @property
    def along(self) -> int:
        """+1 if the face coordinate y of the pair increases with the positions on the shafts, −1 otherwise."""
        return self.turn * self.hand

    @property
    def direction(self) -> NDArray:
        """Force on the wheel per unit of transverse force along the line of action, (3,)."""
        return np.array([*self._line, -self.along * math.tan(self.pair.meshing.beta_b)])

    @property
    def _axes(self) -> tuple[NDArray, NDArray]:
        """Unit vectors in the transverse plane: from pinion to wheel, and the motion of the pinion at the wheel."""
        c, s = self.across
        return np.array([c, s]), self.turn * np.array([-s, c])

    @property
    def _line(self) -> NDArray:
        """Unit vector along the line of action, (2,)."""
        x, y = self._axes
        alpha = self.pair.meshing.alpha_wt
        return math.sin(alpha) * x + math.cos(alpha) * y

    def wrench(self, index: int, u: ArrayLike) -> NDArray:
        """Force and moment (…, 6) about the axis of gear ``index`` per unit of transverse force.

        The force acts at the contact point u on the path of contact. On the wheel the sign is that of the real force,
        on the pinion it is reversed, so that the work on both is the deflection along the line of action.
        """
        x, y = self._axes
        alpha, r_b = self.pair.meshing.alpha_wt, self.pair.gears[0].base_radius
        foot = r_b * (math.cos(alpha) * x - math.sin(alpha) * y)
        point = foot + np.asarray(u, dtype=float)[..., None] * self._line
        if index == 1:
            point = point - self.pair.meshing.centre_distance * x
        n = self.direction
        px, py = point[..., 0], point[..., 1]
        moment = np.stack([py * n[2], -px * n[2], px * n[1] - py * n[0]], axis=-1)
        both = np.concatenate([np.broadcast_to(n, moment.shape), moment], axis=-1)
        return both if index == 1 else -both

    def position(self, index: int, y: ArrayLike) -> NDArray:
        """Position on the shaft of gear ``index`` [mm] at the face coordinate y [mm]."""
        gear_y = np.asarray(y, dtype=float) + self.pair.overhangs[index][int(self.coast)]
        return self.middle[index] + self.along * (gear_y - self.pair.gears[index].face_width / 2)
