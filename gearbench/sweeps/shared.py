"""What the points of a sweep share: contact lines and compliance, made once for all that does not change them."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble, gap_and_variation, mesh_phases, scene_lines
from gearbench.contact.problem import ContactProblem
from gearbench.effects.base import ComplianceEffect
from gearbench.geometry.action import ContactLines
from gearbench.scene import Scene

#: Compliances kept at once: as many as gears or resolutions take turns within a grid, at most.
KEPT = 8


@dataclass(frozen=True, kw_only=True)
class Assembled:
    """A scene's contact problem under its own torque, on its lines, with the weights of their positions."""

    scene: Scene
    lines: ContactLines
    weight: NDArray
    problem: ContactProblem


@dataclass(frozen=True)
class Shared:
    """Contact problems of many scenes, the compliance kept where only loads and gaps differ."""

    _known: dict[Hashable, Assembled] = field(default_factory=dict)

    def assembled(self, scene: Scene) -> Assembled:
        """Contact problem of ``scene``."""
        phase, weight = mesh_phases(scene)
        stiff = tuple(effect for effect in scene.effects if isinstance(effect, ComplianceEffect))
        lines = scene_lines(scene, phase)
        # lines end and bend where gaps do; a separation is kept by those that use it, and so is its identity
        nodes = (lines.u.tobytes(), lines.y.tobytes(), lines.length.tobytes())
        key = (scene.pair, stiff, nodes, lines.cells, lines.coast, id(lines.separation), lines.typical_load)
        known = self._known.get(key)
        if known is None:
            known = Assembled(scene=scene, lines=lines, weight=weight, problem=assemble(scene, lines))
            while len(self._known) >= KEPT:
                self._known.pop(next(iter(self._known)))
            self._known[key] = known
        if known.scene is scene:
            return known
        # in the units of the problem that is known; its load is set when it is solved
        gap, soft = (x.reshape(known.problem.gap.shape) for x in gap_and_variation(scene, known.lines))
        scale = known.problem.length_scale
        soft = soft if known.problem.a.any() else np.zeros_like(soft)  # without a law there is nothing to average
        gap, soft = np.ascontiguousarray((gap - soft) / scale), np.ascontiguousarray(soft / scale)
        along = known.problem.along
        if along is not None:
            along = replace(along, scene=scene, effects=tuple(scene.acting_effects))
        problem = replace(known.problem, gap=gap, soft=soft, along=along)
        return replace(known, scene=scene, weight=weight, problem=problem)
