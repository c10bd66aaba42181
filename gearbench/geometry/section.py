"""Transverse section of an involute gear: angles, pitch and base circle. Source: ISO 21771.

They follow from number of teeth, module and angles alone. ``gear.Gear`` adds what depends on tip, root and profile
shift.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, kw_only=True)
class TransverseSection:
    """Transverse section of a gear, spur or helical.

    Equations: (G1) of docs/theory.md.

    Parameters
    ----------
    teeth
        Number of teeth z; negative for an internal gear, whose radii then are negative too.
    normal_module
        m_n [mm].
    pressure_angle, helix_angle
        α_n and β [°].
    """

    teeth: int
    normal_module: float
    pressure_angle: float
    helix_angle: float

    @cached_property
    def alpha_n(self) -> float:
        """Normal pressure angle α_n [rad]."""
        return math.radians(self.pressure_angle)

    @cached_property
    def beta(self) -> float:
        """Helix angle β at the pitch circle [rad]."""
        return math.radians(self.helix_angle)

    @cached_property
    def alpha_t(self) -> float:
        """Transverse pressure angle α_t [rad], tan α_t = tan α_n / cos β."""
        return math.atan(math.tan(self.alpha_n) / math.cos(self.beta))

    @cached_property
    def beta_b(self) -> float:
        """Base helix angle β_b [rad], tan β_b = tan β cos α_t."""
        return math.atan(math.tan(self.beta) * math.cos(self.alpha_t))

    @property
    def transverse_module(self) -> float:
        """Transverse module m_t = m_n / cos β [mm]."""
        return self.normal_module / math.cos(self.beta)

    @property
    def pitch_radius(self) -> float:
        """Reference pitch radius r = m_t z / 2 [mm]."""
        return self.transverse_module * self.teeth / 2

    @property
    def base_radius(self) -> float:
        """Base radius r_b = r cos α_t [mm]."""
        return self.pitch_radius * math.cos(self.alpha_t)

    @property
    def sign(self) -> float:
        """1, or −1 of an internal gear."""
        return math.copysign(1.0, self.teeth)

    def roll_length(self, radius: ArrayLike) -> NDArray:
        """Roll length ℓ = √(R² − r_b²) [mm] at radii R [mm]: radius of curvature of the flank; negative on a ring."""
        return self.sign * np.sqrt(np.maximum(np.square(radius) - self.base_radius**2, 0.0))

    def radius_at(self, roll: ArrayLike) -> NDArray:
        """Radii R [mm] at roll lengths [mm]: the inverse of ``roll_length``."""
        return self.sign * np.hypot(self.base_radius, roll)

    @property
    def base_pitch(self) -> float:
        """Transverse base pitch p_bt = 2π r_b / z [mm]."""
        return 2 * math.pi * self.base_radius / self.teeth
