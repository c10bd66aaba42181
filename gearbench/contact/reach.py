"""How far a pair deflects at most: flanks farther apart than that stay apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gearbench.effects.base import GapEffect
from gearbench.scene import Scene

#: Phases and segments of the estimate, and what is added for what they miss.
_PHASES, _SEGMENTS, _MARGIN = 6, 5, 1.3


def greatest_deflection(scene: Scene) -> float:
    """Bound on the approach of the gears along the line of action over a mesh cycle [mm].

    Contact kept on the line of action deflects more: every further point that may touch can only stiffen the pair.
    Gaps of errors count with their range, so that a sample of them stays within the bound.
    """
    from gearbench.contact.assemble import assemble, total_gap
    from gearbench.contact.solver import solve
    from gearbench.geometry.action import contact_lines

    effects = tuple(effect for effect in scene.effects if effect.name != "off_line_contact")
    plain = replace(scene, effects=effects)
    lines = contact_lines(scene.pair, (np.arange(_PHASES) + 0.5) / _PHASES, _SEGMENTS)
    deflection = float(solve(assemble(plain, lines)).approach.max())
    if any(isinstance(effect, GapEffect) for effect in effects):
        deflection += float(np.ptp(total_gap(plain, lines)[lines.active]))
    return _MARGIN * deflection / np.cos(scene.pair.base_helix_angle)
