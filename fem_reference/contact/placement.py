"""Two gears turned as rigid bodies to a mesh phase, and the points where their flanks come closest.

The pinion's centre is the origin, the wheel's lies at (0, a'). Each gear's own frame has its tooth 0 on +y and its
loaded flanks on the right; the wheel's frame is turned by 180°. Angles are clockwise from +y of the own frame. Radii,
angles and a' of a ring are negative: its tooth 0 is on −y of its frame, with its tip up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fem_reference.contact.profile import Profile
from fem_reference.section import polar
from gearbench.geometry.pair import Pair

#: Points on each profile for the search of the least separation.
_POINTS = 4000
#: Size of elements at an edge that touches, as a share of the usual size.
AT_EDGE = 1 / 16


@dataclass(frozen=True, kw_only=True)
class Touch:
    """Point at which the flanks of a tooth pair come closest as the pinion alone turns.

    Parameters
    ----------
    pair
        Number k of the tooth pair.
    gap
        Least separation along the line of action from the position of the pinion, r_b1 Δφ [mm].
    radii
        Radii of the touching points on pinion and wheel [mm].
    """

    pair: int
    gap: float
    radii: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Placement:
    """A pair of spur gears at a mesh phase, unmodified flanks in conjugate position but for ``advance``.

    Parameters
    ----------
    pair
        The gear pair.
    phase
        Mesh phase τ.
    profiles
        Right flanks of both gears, modified.
    advance
        Rotation of the pinion ahead of the conjugate position, r_b1 φ [mm].
    """

    pair: Pair
    phase: float
    profiles: tuple[Profile, Profile]
    advance: float = 0.0

    def path_position(self, k: int) -> float:
        """u = u_A + (τ + k) p_bt [mm] of tooth pair k."""
        meshing = self.pair.meshing
        return meshing.path_start + (self.phase + k) * meshing.base_pitch

    @cached_property
    def central(self) -> int:
        """The tooth pair nearest to the middle of the path of contact: tooth 0 of both gears."""
        meshing = self.pair.meshing
        return round((meshing.path_end - meshing.path_start) / 2 / meshing.base_pitch - self.phase)

    @cached_property
    def rotations(self) -> tuple[float, float]:
        """Angles of the teeth 0 of both gears in their frames [rad]: θ = ρ/r_b − α_wt − (ψ + inv α) ."""
        meshing = self.pair.meshing
        u = self.path_position(self.central)
        angles = []
        for gear, rho in zip(self.pair.gears, (u, meshing.tangent_length - u), strict=True):
            at_base = float(gear.involute_half_angle(gear.base_radius))
            angles.append(rho / gear.base_radius - meshing.alpha_wt - at_base)
        return angles[0], angles[1]

    def tooth(self, index: int, k: int) -> int:
        """Number of the tooth of pair k on a gear, counted clockwise in its frame."""
        return (k - self.central) * (1 if index == 0 else -1)

    def placed(self, index: int, xy: NDArray) -> NDArray:
        """Points (2, n) of a gear's frame in the common frame."""
        angle = self.turn(index)
        cos, sin = math.cos(angle), math.sin(angle)
        turned = np.array([[cos, sin], [-sin, cos]]) @ xy
        return turned if index == 0 else np.array([[0.0], [self.pair.meshing.centre_distance]]) - turned

    def touch(self, k: int) -> Touch:
        """First contact of pair k, by search over the whole profiles, tips included."""
        on = [self._flank(index, k) for index in (0, 1)]
        (r1, a1), (r2, a2) = (polar(xy) for xy in on)
        order = np.argsort(r2)
        inside = (r1 >= r2.min()) & (r1 <= r2.max())
        if not inside.any():
            return Touch(pair=k, gap=math.inf, radii=(float(r1.max()), float(r2.min())))
        gap = np.interp(r1[inside], r2[order], a2[order]) - a1[inside]
        # the wheel's corner lies between two points of the pinion
        i, corner = int(np.argmin(gap)), int(np.argmin(r2))
        least, radius = float(gap[i]), float(r1[inside][i])
        if r1.min() <= r2[corner] <= r1.max():
            up = np.argsort(r1)
            at_corner = float(a2[corner] - np.interp(r2[corner], r1[up], a1[up]))
            if at_corner < least:
                least, radius = at_corner, float(r2[corner])
        angle = float(np.interp(radius, r2[order], a2[order]))
        point = np.array([radius * math.sin(angle), radius * math.cos(angle)])
        mate = self.pair.gears[1].sign * math.hypot(point[0], point[1] - self.pair.meshing.centre_distance)
        return Touch(pair=k, gap=self.pair.gears[0].base_radius * least, radii=(radius, mate))

    def touches(self) -> list[Touch]:
        """Touches of all pairs that come near one another: within a base pitch of the path of contact."""
        meshing = self.pair.meshing
        first = math.floor((meshing.path_start - self.path_position(0)) / meshing.base_pitch)
        last = math.ceil((meshing.path_end - self.path_position(0)) / meshing.base_pitch)
        return [self.touch(k) for k in range(first, last + 1)]

    def outline(self, index: int, k: int) -> tuple[NDArray, NDArray]:
        """Radii (n,) from the middle of the fillet of pair k to its tip, and the points of the flank there (2, n)."""
        gear = self.pair.gears[index]
        R = np.linspace((gear.root_radius + gear.form_radius) / 2, gear.tip_radius, _POINTS)
        return R, self._on_flank(index, k, R)

    def in_tooth(self, index: int, k: int, vector: NDArray) -> NDArray:
        """A vector (2,) in the frame of the tooth of pair k: the tooth on +y, its loaded flank at the right."""
        angle = self.turn(index) + 2 * math.pi * self.tooth(index, k) / self.pair.gears[index].teeth
        cos, sin = math.cos(angle), math.sin(angle)
        return np.array([[cos, -sin], [sin, cos]]) @ vector * (1 if index == 0 else -1)

    def _flank(self, index: int, k: int) -> NDArray:
        gear = self.pair.gears[index]
        # from the form circle: the fillets are not meant to touch
        return self._on_flank(index, k, np.linspace(gear.form_radius, gear.tip_radius, _POINTS))

    def _on_flank(self, index: int, k: int, R: NDArray) -> NDArray:
        gear, d = self.pair.gears[index], self.tooth(index, k)
        angle = self.profiles[index].angle(R, k) + 2 * math.pi * d / gear.teeth
        return self.placed(index, np.array([R * np.sin(angle), R * np.cos(angle)]))

    def turn(self, index: int) -> float:
        """Angle of tooth 0 of a gear in its frame, its advance included [rad]."""
        ahead = self.advance / self.pair.gears[0].base_radius if index == 0 else 0.0
        return self.rotations[index] + ahead
