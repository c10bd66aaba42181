"""Shapes of the errors of a flank and of a pair of axes: gap of a unit error, on the segments of the contact lines.

All shapes are dimensionless with largest value 1, positive = material missing. Along the profile t runs from the
start of the active profile (0, root side) to its end (1, tip side) of the gear in question; across the face η = y/b.
A constant added to a shape moves the mean transmission error and nothing else, so where a shape is anchored does not
matter to any RMS value.
"""

from __future__ import annotations

import math
from typing import Literal

from numpy.typing import NDArray

from gearbench.geometry.action import ContactLines

#: What is equally divided along the profile: roll length, as profiles are measured, or the radius.
Along = Literal["roll", "radius"]


def profile_coordinate(lines: ContactLines, gear: int, along: Along = "roll") -> NDArray:
    """t ∈ [0, 1] along the active profile of the pinion (0) or the wheel (1), (position, pair, segment)."""
    if along == "radius":
        start, end = lines.pair.active_radii[gear]
        return (lines.radii[gear] - start) / (end - start)
    start, end = lines.pair.path_start, lines.pair.path_end
    t = (lines.u - start) / (end - start)
    return t if gear == 0 else 1 - t


def profile_slope(lines: ContactLines, gear: int, along: Along) -> NDArray:
    """t: missing at the tip."""
    return profile_coordinate(lines, gear, along)


def profile_form(lines: ContactLines, gear: int, along: Along) -> NDArray:
    """(2t − 1)²: a barrel, missing at both ends of the profile."""
    return (2 * profile_coordinate(lines, gear, along) - 1) ** 2


def helix_slope(lines: ContactLines, _gear: int, _along: Along) -> NDArray:
    """η: missing at y = b."""
    return lines.y / lines.pair.face_width


def helix_form(lines: ContactLines, _gear: int, _along: Along) -> NDArray:
    """(2η − 1)²: a crown, missing at both ends of the face."""
    return (2 * lines.y / lines.pair.face_width - 1) ** 2


def inclination(lines: ContactLines, _gear: int = 0, _along: Along = "roll") -> NDArray:
    """η sin α_wt cos β_b: axes that approach each other in their common plane."""
    return _axis(lines) * math.sin(lines.pair.working_pressure_angle)


def deviation(lines: ContactLines, _gear: int = 0, _along: Along = "roll") -> NDArray:
    """η cos α_wt cos β_b: axes that lean across their common plane."""
    return _axis(lines) * math.cos(lines.pair.working_pressure_angle)


def _axis(lines: ContactLines) -> NDArray:
    return math.cos(lines.pair.base_helix_angle) * lines.y / lines.pair.face_width
