"""Shapes of the errors of a flank and of a pair of axes: gap of a unit error, on the segments of the contact lines.

All shapes are dimensionless with largest value 1, positive = material missing. Along the profile t runs from the
start of the active profile (0, root side) to its end (1, tip side) of the gear in question; across the face η = y/b, of
the gear's own face; of axes, of the common one.
A constant added to a shape moves the mean transmission error and nothing else, so where a shape is anchored does not
matter to any RMS value.
"""

from __future__ import annotations

import math
from typing import Literal

from numpy.typing import NDArray

from gearbench.geometry.action import ContactLines
from gearbench.geometry.role import Role

#: Coordinate that is equally divided along the profile: roll length, as profiles are measured, or the radius.
Along = Literal["roll", "radius"]
#: Extent of the profile: the active profile, the involute from form circle to tip, or the tooth from the root.
Range = Literal["active", "involute", "tooth"]


def profile_coordinate(lines: ContactLines, role: Role, along: Along = "roll", span: Range = "active") -> NDArray:
    """t from 0 (root side) to 1 (tip side) of the profile of pinion (0) or wheel (1), (position, pair, segment)."""
    body = lines.pair.gears[role]
    start, end = {
        "active": lines.pair.meshing.active_radii[role],
        "involute": (body.form_radius, body.tip_radius),
        "tooth": (body.root_radius, body.tip_radius),
    }[span]
    radius = lines.radii[role]
    if along == "radius":
        return (radius - start) / (end - start)
    r_b = body.base_radius  # below the base circle there is no roll length: it counts from there
    first, last = (math.sqrt(max(r**2 - r_b**2, 0.0)) for r in (start, end))
    return (lines.rolls[role] - first) / (last - first)


def profile_slope(lines: ContactLines, role: Role, along: Along, span: Range) -> NDArray:
    """t: missing at the tip."""
    return profile_coordinate(lines, role, along, span)


def profile_form(lines: ContactLines, role: Role, along: Along, span: Range) -> NDArray:
    """(2t − 1)²: a barrel, missing at both ends of the profile."""
    return (2 * profile_coordinate(lines, role, along, span) - 1) ** 2


def helix_slope(lines: ContactLines, role: Role, *_: object) -> NDArray:
    """η: missing at y = b."""
    return lines.own_face(role) / lines.pair.gears[role].face_width


def helix_form(lines: ContactLines, role: Role, *_: object) -> NDArray:
    """(2η − 1)²: a crown, missing at both ends of the face."""
    return (2 * helix_slope(lines, role) - 1) ** 2


def inclination(lines: ContactLines, *_: object) -> NDArray:
    """η sin α_wt cos β_b: axes that approach each other in their common plane."""
    return _axis(lines) * math.sin(lines.pair.meshing.alpha_wt)


def deviation(lines: ContactLines, *_: object) -> NDArray:
    """η cos α_wt cos β_b: axes that lean across their common plane; the other way round for the coast flanks."""
    return (-1 if lines.coast else 1) * _axis(lines) * math.cos(lines.pair.meshing.alpha_wt)


def _axis(lines: ContactLines) -> NDArray:
    return math.cos(lines.pair.meshing.beta_b) * lines.face / lines.pair.meshing.face_width
