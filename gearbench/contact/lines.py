"""Contact lines of a scene, and the number of nodes that they need.

The segments of a line are Gauss points or, where flanks may separate, cells: short pieces that carry one force each.
"""

from __future__ import annotations

import math
from dataclasses import replace

from numpy.typing import NDArray

from gearbench.contact.gaps import LEAST_VARIATION, flank_separation, gap_kinks, variation
from gearbench.geometry.action import ContactLines, contact_lines
from gearbench.geometry.pair import Pair
from gearbench.scene import Scene

#: Up to this number of segments, as in coarse solutions, lines under a constant gap have Gauss points. With more, they
#: have cells if the smooth compliance (all but the contact law) needs more points than there are segments.
MAX_POINT_SEGMENTS = 12
#: Additional Gauss points on a line for each kink of its deflections.
NODES_PER_KINK = 2


def lines_within(scene: Scene, mesh_phase: NDArray, span: tuple[float, float] | None) -> ContactLines:
    """Contact lines at the phases ``mesh_phase``, over the path of contact or, off the line of action, over ``span``.

    ``span`` is the range of u [mm].
    """
    pair, flanks, segments = scene.pair, flank_separation(scene), scene.resolution.segments
    kinks, face = gap_kinks(scene)
    # off the line of action the gap varies along the lines of helical pairs
    cells = flanks is not None and pair.meshing.overlap_ratio > 0
    if not cells:
        # Gauss points would be enough for a constant gap, but too few for the smooth compliance of wide flanks
        cells = variation(scene, span)[0] > LEAST_VARIATION or MAX_POINT_SEGMENTS < segments < _nodes(pair, segments)
    lines = contact_lines(
        pair, mesh_phase, segments, kinks, face,
        cells=cells, coast=scene.load.coast, span=span,
    )  # fmt: skip
    return replace(lines, separation=flanks, typical_load=0.0 if flanks is None else typical_load(scene))


def typical_load(scene: Scene) -> float:
    """Half the mean line load [N/mm], typical of pairs that touch at an edge while they take up or shed their load."""
    meshing = scene.pair.meshing
    mean = scene.F_bn * math.cos(meshing.beta_b) / meshing.face_width
    return mean / (2 * max(meshing.transverse_contact_ratio, 1.0))


def smooth_nodes(lines: ContactLines) -> int:
    """Number of Gauss points on a line that resolve its smooth compliance as well as its segments resolve the gap.

    At 15 segments there are 8, plus one for every two modules of the line's width, its extent along the face. The error
    of harmonics of gears in use is then below 0.2 of the error allowed there (``tests/accuracy/test_resolution.py``).
    ``points_ratio`` gives the growth with the segments. Each kink of the deflections needs ``NODES_PER_KINK`` more
    points.
    """
    return _nodes(lines.pair, lines.shape[2], len(lines.deflection_kinks))


def points_ratio(segments: int) -> float:
    """Number of points on a line of ``segments``, divided by that on a line of 15 segments.

    Points converge exponentially and segments algebraically, so √2 times the points suffice for twice the segments.
    """
    return math.sqrt(segments / 15)


def _nodes(pair: Pair, segments: int, deflection_kinks: int = 0) -> int:
    """``smooth_nodes`` of lines with a number of segments."""
    meshing = pair.meshing
    tan_b = math.tan(meshing.beta_b)
    path = meshing.path_end - meshing.path_start
    width = min(meshing.face_width, path / tan_b) if tan_b > 0 else meshing.face_width
    at_15_segments = 8 + width / pair.normal_module / 2 + NODES_PER_KINK * deflection_kinks
    return max(2, math.ceil(at_15_segments * points_ratio(segments)))
