"""A scene solved on its contact lines."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.gaps import conforming, total_gap
from gearbench.contact.problem import ContactProblem, ContactSolution
from gearbench.geometry.action import ContactLines
from gearbench.results.cycle import MICROMETRES, MeshCycle, Phases
from gearbench.scene import Scene


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
