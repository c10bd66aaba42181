"""How far a pair deflects: flanks farther apart than that stay apart."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from gearbench.effects.base import GapEffect
from gearbench.geometry.action import contact_lines
from gearbench.geometry.separation import Separation
from gearbench.scene import Scene

#: How far the lines of the estimate reach [base pitches].
_REACH = 0.3
#: How much farther the lines of a solution reach than this deflection.
MARGIN = 1.3


@lru_cache(maxsize=16)
def greatest_deflection(scene: Scene, flanks: Separation) -> float:
    """Greatest approach of the gears along the line of action over a mesh cycle [mm].

    Solved amid the phases with fewest and with most pairs on the path; lines that reach ``MARGIN`` times as far miss
    nothing. Gaps other than the separation count with their range, so that samples of random errors stay within it.
    """
    from gearbench.contact.assemble import assemble, total_gap
    from gearbench.contact.solver import solve

    room = _REACH * scene.pair.meshing.base_pitch
    span = (scene.pair.meshing.path_start - room, scene.pair.meshing.path_end + room)
    most = scene.pair.meshing.transverse_contact_ratio % 1.0
    phase = np.array([(1 + most) / 2, most / 2])
    lines = replace(
        contact_lines(scene.pair, phase, scene.resolution.segments, flanks, span), typical_load=typical_load(scene)
    )
    deflection = float(solve(assemble(scene, lines)).approach.max())
    if any(isinstance(effect, GapEffect) and not effect.modifications(scene.pair) for effect in scene.effects):
        other = replace(scene, effects=tuple(e for e in scene.effects if e.name != "off_line_contact"))
        deflection += float(np.ptp(total_gap(other, lines)[lines.active]))
    return deflection / math.cos(scene.pair.meshing.beta_b)


def typical_load(scene: Scene) -> float:
    """Half of what a line carries on the mean [N/mm]: pairs touch at their edges as they take or leave their load."""
    mean = scene.F_bn * math.cos(scene.pair.meshing.beta_b) / scene.pair.face_width
    return mean / (2 * max(scene.pair.meshing.transverse_contact_ratio, 1.0))
