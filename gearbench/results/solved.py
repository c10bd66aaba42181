"""A scene solved on its contact lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.gaps import conforming, total_gap
from gearbench.contact.patches import solve_patches
from gearbench.contact.problem import ContactProblem, ContactSolution
from gearbench.geometry.action import ContactLines
from gearbench.results.cycle import MICROMETRES, MeshCycle, Phases
from gearbench.scene import Resolution, Scene
from gearbench.threads import single_threaded_blas

#: Number of phases at which a mesh cycle is solved again, and number of segments there over the usual number. The RMS
#: errors of curves in use are 0.6 to 2.3 times the change; with 4/3 of the segments they would be up to seven times it,
#: because a few more nodes of the smooth compliance may change nothing.
REFINED_PHASES, REFINED_SEGMENTS = 4, 2


@dataclass(frozen=True, kw_only=True)
class Solved:
    """A scene solved on its contact lines; all outputs follow from it.

    Arrays of the solution may have further dimensions before the position; outputs then have them too. ``size`` is the
    number of Gauss points on a panel, by default that of the scene. ``at`` gives the phases of the results if they are
    counted from another mesh of a train.
    """

    scene: Scene
    lines: ContactLines
    weight: NDArray
    problem: ContactProblem
    solution: ContactSolution
    size: int | None = None
    at: Phases | None = None

    @cached_property
    def phases(self) -> Phases:
        """Mesh phases of the results."""
        if self.at is not None:
            return self.at
        size = self.size or self.scene.resolution.panel_size
        return Phases(phase=self.lines.mesh_phase, weight=self.weight, size=size)

    @cached_property
    def cycle(self) -> MeshCycle:
        """Static transmission error and mesh stiffness at the scene's mesh phases."""
        return MeshCycle.of(self.scene, self.phases, self.solution.approach, self.solution.stiffness)

    @cached_property
    def floors(self) -> dict[str, NDArray]:
        """Noise floors of the harmonics that were computed so far, by curve."""
        return {}

    @cached_property
    def unresolved(self) -> Mapping[str, float]:
        """RMS change of each curve at ``REFINED_PHASES`` if lines have ``REFINED_SEGMENTS`` times the segments.

        More segments bring more nodes of the smooth compliance. Empty unless flanks part along the lines of a pair.
        """
        single = self.at is None and self.solution.approach.ndim == 1 and not self.scene.has_shafts
        if not single or self.problem.cells is None or self.conforming:
            return {}
        count = len(self.lines.mesh_phase)
        some = np.unique((np.arange(REFINED_PHASES) + 0.5) / REFINED_PHASES * count).astype(int)
        fine = replace(self.scene, resolution=Resolution(segments=REFINED_SEGMENTS * self.scene.resolution.segments))
        lines = scene_lines(fine, self.lines.mesh_phase[some])
        with single_threaded_blas():
            solution = solve_patches(assemble(fine, lines))
        cycle = MeshCycle.of(fine, self.phases, solution.approach, solution.stiffness)
        curves = "transmission_error", "mesh_stiffness"
        changes = {name: getattr(self.cycle, name)[some] - getattr(cycle, name) for name in curves}
        return {name: float(np.sqrt(np.mean(change**2))) for name, change in changes.items()}

    @cached_property
    def conforming(self) -> bool:
        """Whether the flanks touch along their whole lines, so that the phases of transitions are known in advance."""
        return conforming(self.scene.one_load)

    def line_load(self) -> NDArray:
        """Line load, (position, pair, segment) [N/mm]; zero where a pair has no contact line."""
        return self.solution.force / np.where(self.lines.length > 0, self.lines.length, 1.0) / self.lines.lever

    def load_share(self) -> NDArray:
        """Share of the normal force on every tooth pair, (position, pair); NaN without load."""
        force = self.solution.force.sum(axis=-1)
        total = force.sum(axis=-1, keepdims=True)
        return force / np.where(total > 0, total, np.nan)

    def initial_gap(self) -> NDArray:
        """Initial gap e, (position, pair, segment) [µm]."""
        return MICROMETRES * total_gap(self.scene.acting_effects, self.lines)
