"""A scene solved on its contact lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.gaps import conforming, total_gap
from gearbench.contact.patches import first_round, next_round
from gearbench.contact.problem import ContactProblem, ContactSolution, under_shares
from gearbench.contact.solver import Guess
from gearbench.effects.base import Effect
from gearbench.geometry.action import ContactLines
from gearbench.results.cycle import MICROMETRES, MeshCycle, Phases
from gearbench.scene import Resolution, Scene
from gearbench.threads import single_threaded_blas

#: Number of phases at which a mesh cycle is solved again, and number of segments there over the usual number. Of RMS
#: errors above 0.05 % of peak-to-peak, 97 % are 0.5 to 2 times the change (four phases: 93 %; 1.5 times the segments:
#: 93 %).
REFINED_PHASES, REFINED_SEGMENTS = 6, 2
#: Residuals before the last Newton step there: on cells, and each time that the ends of contact patches are computed.
#: Many cells locate them well from the start, so that two times are enough.
REFINED_ON_CELLS, REFINED_ON_PATCHES = 1e-2, (1e-2, 1e-6)


@dataclass(frozen=True, kw_only=True, eq=False)
class FinerLines:
    """A scene under several loads, solved at a few of the mesh ``phases`` of each, on lines with more segments.

    All loads are solved together, when the first is asked for. ``effects`` are those of the scene, with its shafts as
    they were found.
    """

    scenes: Sequence[Scene]
    phases: Sequence[NDArray]
    effects: Sequence[Effect] | None = None

    @staticmethod
    def some(phase: NDArray) -> NDArray:
        """Indices of those among the phases (phase,) that are closest to ``REFINED_PHASES`` uniform ones."""
        uniform = (np.arange(REFINED_PHASES) + 0.5) / REFINED_PHASES
        return np.unique(np.abs(phase - uniform[:, None]).argmin(axis=1))

    @cached_property
    @single_threaded_blas()
    def solutions(self) -> list[tuple[NDArray, NDArray]]:
        """Approach [mm] and stiffness [N/mm] under each load, (phase,)."""
        scene, phases = self.scenes[0], [phase[self.some(phase)] for phase in self.phases]
        counts = [len(phase) for phase in phases]
        fine = replace(scene, resolution=Resolution(segments=REFINED_SEGMENTS * scene.resolution.segments))
        share = np.repeat([each.F_bn / scene.F_bn for each in self.scenes], counts)
        problem = under_shares(assemble(fine, scene_lines(fine, np.concatenate(phases)), self.effects), share)
        found = first_round(problem, guess := Guess.empty(problem), REFINED_ON_CELLS)
        for tolerance in REFINED_ON_PATCHES if problem.cells else ():
            found = next_round(problem, guess, found.patches, tolerance)
        ends = np.cumsum(counts)[:-1]
        return list(zip(np.split(share * found.approach, ends), np.split(found.stiffness, ends), strict=True))


@dataclass(frozen=True, kw_only=True)
class Solved:
    """A scene solved on its contact lines; all outputs follow from it.

    Arrays of the solution may have further dimensions before the position; outputs then have them too. ``size`` is the
    number of Gauss points on a panel, by default that of the scene. ``at`` gives the phases of the results if they are
    counted from another mesh of a train. Loads that are solved together share ``finer``; this is number ``load`` of it.
    """

    scene: Scene
    lines: ContactLines
    weight: NDArray
    problem: ContactProblem
    solution: ContactSolution
    size: int | None = None
    at: Phases | None = None
    finer: FinerLines | None = None
    load: int = 0

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
    def coarse_cycle(self) -> MeshCycle:
        """``cycle`` before the last update of the ends of contact patches."""
        return MeshCycle.of(self.scene, self.phases, self.solution.coarse_approach, self.solution.coarse_stiffness)

    @cached_property
    def outputs(self) -> dict[str, tuple[tuple[str, ...], NDArray]]:
        """Outputs and responses that were computed so far: name → dimensions and values."""
        return {}

    @cached_property
    def unresolved(self) -> Mapping[str, float]:
        """RMS change of each curve at ``REFINED_PHASES`` if lines have ``REFINED_SEGMENTS`` times the segments.

        More segments bring more nodes of the smooth compliance. Empty unless flanks part along the lines of a pair.
        """
        single, cells = self.at is None and self.solution.approach.ndim == 1, self.problem.cells
        if not single or cells is None or self.conforming:
            return {}
        finer = self.finer or FinerLines(scenes=(self.scene,), phases=(self.lines.mesh_phase,), effects=cells.effects)
        cycle = MeshCycle.of(self.scene, self.phases, *finer.solutions[self.load])
        some = finer.some(self.lines.mesh_phase)
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
