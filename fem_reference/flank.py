"""The loaded flank: points, normals and the points below them on the centre line of the tooth.

Flank coordinates are the radius R, from form circle to tip circle, and y = 0…b across the face width. Forces act along
the inward normal of the right flank, the line of action; displacements are measured along it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.gear import Gear


@dataclass(frozen=True)
class Flank:
    """Right flank of tooth d of a gear.

    Parameters
    ----------
    gear
        The gear.
    d
        Number of the tooth, counted clockwise.
    """

    gear: Gear
    d: int = 0

    def _turn(self, y: NDArray) -> NDArray:
        gear = self.gear
        return 2 * math.pi * self.d / gear.teeth + y * math.tan(gear.beta) / gear.pitch_radius

    def _space(self, u: NDArray, v: NDArray, y: NDArray) -> NDArray:
        """Vectors with components u (across), v (along the centre line) at y, in Cartesian coordinates."""
        c, s = np.cos(self._turn(y)), np.sin(self._turn(y))
        return np.stack([c * u + s * v, c * v - s * u], axis=-1)

    def position(self, R: NDArray, y: NDArray) -> NDArray:
        """Points of the flank (…, 3) [mm]."""
        psi = self.gear.involute_half_angle(R)
        return np.concatenate([self._space(R * np.sin(psi), R * np.cos(psi), y), y[..., None]], axis=-1)

    def normal(self, R: NDArray, y: NDArray) -> NDArray:
        """Inward normals (…, 3), inclined by β_b to the transverse plane."""
        gamma, beta_b = self.gear.load_angle(R), self.gear.beta_b
        across = math.cos(beta_b) * self._space(-np.cos(gamma), -np.sin(gamma), y)
        return np.concatenate([across, np.full(y.shape, math.sin(beta_b))[..., None]], axis=-1)

    def below(self, R: NDArray, y: NDArray) -> NDArray:
        """Points (…, 3) where the transverse line of action through (R, y) meets the centre line of the tooth [mm].

        Its radius is r_b / cos γ; a rigid motion in the transverse plane moves both ends of that line equally.
        """
        radius = self.gear.base_radius / np.cos(self.gear.load_angle(R))
        return np.concatenate([self._space(np.zeros_like(radius), radius, y), y[..., None]], axis=-1)

    def stretch(self, R: NDArray) -> NDArray:
        """Flank area per dR dy, √(1/cos²α_R + tan²β_R)."""
        gear = self.gear
        tan_b = R * math.tan(gear.beta) / gear.pitch_radius
        return np.sqrt((R / gear.base_radius) ** 2 + tan_b**2)

    def coordinates(self, position: NDArray) -> tuple[NDArray, NDArray]:
        """(R, y) of points of the flank (point, 3)."""
        return np.hypot(position[:, 0], position[:, 1]), position[:, 2]
