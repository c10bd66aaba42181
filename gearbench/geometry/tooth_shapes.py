"""Outlines of the teeth of both gears in mesh, for drawings: transverse section at the middle of the face width.

The pinion's centre is the origin, the wheel's lies a′ above it. The pinion turns clockwise and drives; the contact
moves along the line of action, P(u) = r_b1 (−sin α_wt, cos α_wt) + u (cos α_wt, sin α_wt), from T₁ at u = 0, where this
line touches the base circle of the pinion, towards T₂ on that of the wheel. A tooth of the pinion that touches at u is
turned clockwise by u/r_b1 − α_wt − ψ_b1 from the line of centres; ψ_b1 is its half-angle at the base circle. The same
holds for the wheel, seen from its centre, with T₁T₂ − u instead of u.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.gear import Gear
from gearbench.geometry.pair import Pair

#: Teeth drawn of each gear on either side of the first pair.
AROUND = 3


@dataclass(frozen=True, kw_only=True)
class TeethInMesh:
    """Both gears at mesh phase 0, and their rotation from there.

    Parameters
    ----------
    pinion, wheel
        Outlines about their own centres, (point, 2) [mm].
    radii
        Base radii r_b1, r_b2 [mm]: at phase τ the pinion has turned clockwise by τ p_bt/r_b1.
    pitch, angle, distance
        Base pitch p_bt [mm], α_wt [rad], a′ [mm].
    first
        u at which tooth pair 0 touches at phase 0, in the middle of the face [mm].
    path
        Ends u_A and u_E of the path of contact [mm].
    """

    pinion: NDArray
    wheel: NDArray
    radii: tuple[float, float]
    pitch: float
    angle: float
    distance: float
    first: float
    path: tuple[float, float]

    def at(self, phase: float) -> tuple[NDArray, NDArray]:
        """Outlines of pinion and wheel at a mesh phase, (point, 2) [mm]."""
        pinion, wheel = (
            turn(points, sign * phase * self.pitch / radius)
            for points, sign, radius in zip((self.pinion, self.wheel), (1, -1), self.radii, strict=True)
        )
        return pinion, wheel + np.array([0.0, self.distance])

    def contacts(self, phase: float) -> NDArray:
        """Points in contact at a mesh phase, (contact, 2) [mm]."""
        k = np.arange(-AROUND - 1, AROUND + 2)
        u = self.first + (phase + k) * self.pitch
        return self.on_path(u[(u >= self.path[0]) & (u <= self.path[1])])

    def on_path(self, u: NDArray) -> NDArray:
        """Points P(u) of the line of action, (u, 2) [mm]."""
        sin, cos = math.sin(self.angle), math.cos(self.angle)
        return self.radii[0] * np.array([-sin, cos]) + np.asarray(u)[:, None] * np.array([cos, sin])


def mesh(pair: Pair) -> TeethInMesh:
    """Teeth of ``pair`` near the pitch point."""
    pinion, wheel = pair.gears
    alpha = pair.meshing.alpha_wt
    first = pair.meshing.path_start + pair.meshing.face_width / 2 * math.tan(pair.meshing.beta_b)
    # the tooth nearest the pitch point is in the middle of the drawing
    nearest = round((pair.meshing.pitch_point - first) / pair.meshing.base_pitch)
    u = first + nearest * pair.meshing.base_pitch
    outlines = []
    for gear, position in ((pinion, u), (wheel, pair.meshing.tangent_length - u)):
        centre = position / gear.base_radius - alpha - float(gear.involute_half_angle(gear.base_radius))
        outlines.append(turn(outline(gear), centre))
    return TeethInMesh(
        pinion=outlines[0],
        wheel=-outlines[1],
        radii=(pinion.base_radius, wheel.base_radius),
        pitch=pair.meshing.base_pitch,
        angle=alpha,
        distance=pair.meshing.centre_distance,
        first=first,
        path=(pair.meshing.path_start, pair.meshing.path_end),
    )


def outline(gear: Gear, around: int = AROUND) -> NDArray:
    """Closed outline of 2·around + 1 teeth (at most all) on a strip of the body, middle one on +y, (point, 2) [mm]."""
    count = min(2 * around + 1, abs(gear.teeth))
    right = gear.flank_points(16, 10)
    tooth = np.concatenate([right * [-1, 1], right[::-1]])  # left root, tip, right root
    pitch = 2 * math.pi / gear.teeth
    teeth = [turn(tooth, (i - (count - 1) / 2) * pitch) for i in range(count)]
    inner = gear.root_radius - min(0.8 * gear.tooth_height, 0.9 * abs(gear.root_radius))
    angle = np.linspace(0.5 * count * pitch, -0.5 * count * pitch, 3 * count)
    return np.concatenate([*teeth, inner * np.column_stack([np.sin(angle), np.cos(angle)])])


def turn(points: NDArray, angle: float) -> NDArray:
    """``points`` (point, 2) turned clockwise by ``angle`` [rad] about the origin."""
    sin, cos = math.sin(angle), math.cos(angle)
    return points @ np.array([[cos, -sin], [sin, cos]])
