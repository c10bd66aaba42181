"""Interference between a ring and a pinion or cutter: tip fouling off the path of contact, radial assembly.

All angles and lengths here are positive and transverse. Source: Buckingham, Analytical Mechanics of Gears, ch. 10; the
closed forms of the KHK Gear Technical Reference, §4.4, agree (G19, G20 of docs/theory.md).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from gearbench.geometry.pair import Pair


def fouling_room(
    mate: tuple[ArrayLike, ArrayLike], ratio: float, distance: float, tip_radius: float, half_space: float
) -> float:
    """Clearance [mm] on the ring's tip circle between its tips and a mate rolling in it (G19); negative if they foul.

    Parameters
    ----------
    mate
        Points of the mate's tips: radius [mm] and angle from the middle of the tooth [rad].
    ratio
        z_1/z_2.
    distance, tip_radius
        a and r_a2 [mm].
    half_space
        Half-angle of a tooth space of the ring on its tip circle [rad]. On the line of centres the mate's tooth is in
        the middle of the space.
    """
    R, angle = (np.asarray(x, dtype=float) for x in mate)
    cosine = (tip_radius**2 - distance**2 - R**2) / (2 * distance * R)
    crosses = np.abs(cosine) < 1
    if not crosses.any():
        return math.inf
    # turned by t = ±s the point crosses the ring's tip circle; there it has this angle from the middle of the space
    R, angle, s = R[crosses], angle[crosses], np.arccos(cosine[crosses])
    crossings = [np.arctan2(R * np.sin(t), distance + R * np.cos(t)) - (t - angle) * ratio for t in (-s, s)]
    return tip_radius * (half_space - float(np.max(crossings)))


def tip_room(pair: Pair) -> float:
    """Clearance [mm] between the tips of an internal pair off the path of contact, with one flank in contact (G19)."""
    ring, pinion = sorted(pair.gears, key=lambda gear: gear.teeth)
    half_space = math.pi / -ring.teeth + float(ring.involute_half_angle(ring.tip_radius))
    corner = [pinion.tip_radius], [float(pinion.involute_half_angle(pinion.tip_radius))]
    a = abs(pair.meshing.centre_distance)
    working = abs(ring.base_radius) / math.cos(pair.meshing.alpha_wt)
    slack = max(pair.actual_backlash, 0.0) / (2 * working)
    return fouling_room(corner, pinion.teeth / -ring.teeth, a, -ring.tip_radius, half_space - slack)


def radial_room(pair: Pair, starts: tuple[float, ...] = (0.0, 0.5)) -> float:
    """Clearance [mm] along the ring's tip circle during radial assembly of the pinion, in the best position (G20).

    If it is negative, the tips would interfere (trimming), and the pair must be assembled axially. ``starts`` are the
    positions tried [pitches]: 0 has a tooth of the pinion on the line of centres, 0.5 a tooth space.
    """
    ring, pinion = sorted(pair.gears, key=lambda gear: gear.teeth)
    r_1, r_2, a = pinion.tip_radius, -ring.tip_radius, abs(pair.meshing.centre_distance)
    half_tooth = float(pinion.involute_half_angle(r_1))
    half_space = math.pi / -ring.teeth + float(ring.involute_half_angle(ring.tip_radius))
    rooms = []
    for start in starts:
        k = np.arange(start, pinion.teeth / 4)
        angle = 2 * math.pi * k / pinion.teeth + half_tooth
        x, y = r_1 * np.sin(angle), a + r_1 * np.cos(angle)
        enters = (np.hypot(x, y) > r_2) & (angle < math.pi / 2)
        if enters.any():
            room = 2 * math.pi * k[enters] / -ring.teeth + half_space - np.arcsin(x[enters] / r_2)
            rooms.append(r_2 * float(room.min()))
    return max(rooms, default=math.inf)
