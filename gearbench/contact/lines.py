"""Contact lines of a scene over a span of its path, and how finely they are cut."""

from __future__ import annotations

import math
from dataclasses import replace

from numpy.typing import NDArray

from gearbench.contact.gaps import LEAST_VARIATION, flank_separation, gap_kinks, variation
from gearbench.geometry.action import ContactLines, contact_lines
from gearbench.geometry.pair import Pair
from gearbench.scene import Scene

#: Segments up to which a line may have no cells where its compliance would ask for more Gauss points.
FEW_SEGMENTS = 12
#: Gauss points that a whole line has more for each kink of its deflections.
ON_BEND = 2


def lines_within(scene: Scene, mesh_phase: NDArray, span: tuple[float, float] | None) -> ContactLines:
    """Contact lines over the path of contact, or with the separation of the flanks over ``span``."""
    pair, flanks, segments = scene.pair, flank_separation(scene), scene.resolution.segments
    load = 0.0 if flanks is None else typical_load(scene)
    kinks, face = gap_kinks(scene)
    # along the lines of helical pairs flanks that touch off the line of action are never equally far apart
    parting = flanks is not None and pair.meshing.overlap_ratio > 0
    if not parting:
        # Gauss points that resolve the gap of flanks that touch all along do not resolve the compliance of wide ones
        parting = variation(scene, span)[0] > LEAST_VARIATION or FEW_SEGMENTS < segments < _nodes(pair, segments)
    lines = contact_lines(
        pair, mesh_phase, segments, kinks, face,
        parting=parting, coast=scene.load.coast, separation=flanks, span=span,
    )  # fmt: skip
    return replace(lines, typical_load=load)


def typical_load(scene: Scene) -> float:
    """Half of what a line carries on the mean [N/mm]: pairs touch at their edges as they take or leave their load."""
    meshing = scene.pair.meshing
    mean = scene.F_bn * math.cos(meshing.beta_b) / scene.pair.meshing.face_width
    return mean / (2 * max(meshing.transverse_contact_ratio, 1.0))


def smooth_nodes(lines: ContactLines) -> int:
    """Gauss points on a whole line that resolve its smooth compliance, and the load on it, as its segments do the gap.

    8 and one for every two modules of its width at 15 segments: on gears in use harmonics then miss by less than 0.2 of
    what they may (``tests/accuracy/test_resolution.py``). They converge exponentially: √2 as many for twice the cells.
    Where deflections have kinks pieces between them need ``ON_BEND`` more each.
    """
    return _nodes(lines.pair, lines.shape[2], len(lines.bends))


def _nodes(pair: Pair, segments: int, bends: int = 0) -> int:
    meshing = pair.meshing
    tan_b = math.tan(meshing.beta_b)
    path = meshing.path_end - meshing.path_start
    width = min(meshing.face_width, path / tan_b) if tan_b > 0 else meshing.face_width
    least = 8 + width / pair.normal_module / 2 + ON_BEND * bends
    return max(2, math.ceil(least * math.sqrt(segments / 15)))
