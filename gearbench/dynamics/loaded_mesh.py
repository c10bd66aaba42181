"""Stiffness and motion of the meshes of a system under their mean forces, as they excite it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.bearings import OnShafts, settle
from gearbench.contact.look import scene_lines
from gearbench.contact.patches import solve_patches
from gearbench.contact.resultants import Resultants
from gearbench.contact.transitions import loaded_phases
from gearbench.effects.base import Effect
from gearbench.effects.shafts import mesh_spread
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.names import PAIR
from gearbench.results.cycle import MICROMETRES, MeshCycle, Phases, fourier_matrix
from gearbench.results.solved import Solved
from gearbench.scene import Scene

#: N/mm in 1 N/µm.
PER_MICROMETRE = 1e3


@dataclass(frozen=True, kw_only=True, eq=False)
class LoadedMesh:
    """A mesh under its mean force, as ``simulate`` finds it.

    Parameters
    ----------
    scene
        Pair, load, resolution, and the system as this mesh sees it.
    solved
        The contact over the mesh cycle, shafts included where there are any.
    on_shafts
        The same with the shafts, where there are any.
    rows
        Motions of the flanks against each other, with the resultants that work on them: see ``resultants``.
    """

    scene: Scene
    solved: Solved
    on_shafts: OnShafts | None
    rows: int

    @property
    def effects(self) -> tuple[Effect, ...]:
        """All effects that act, those of the shafts included."""
        return self.scene.flank_effects if self.on_shafts is None else self.on_shafts.effects

    @property
    def lines(self) -> ContactLines:
        """Contact lines."""
        return self.solved.lines

    @property
    def cycle(self) -> MeshCycle:
        """Transmission error and stiffness of the whole, shafts included."""
        return self.solved.cycle

    @cached_property
    def _resultants(self) -> Resultants | None:
        return None if self.on_shafts is None or self.rows == 1 else self.on_shafts.resultants(self.rows)

    @cached_property
    def force(self) -> NDArray:
        """Resultants f_s of the flanks (position, row) [N]: force, moment and so on."""
        if self._resultants is None:
            return np.full((len(self.lines.mesh_phase), 1), self.scene.F_bt)
        return self._resultants.force

    @property
    def _whole(self) -> NDArray:
        """S = ∂f/∂x (position, row, row) [N/mm], shafts included."""
        if self._resultants is None:
            return PER_MICROMETRE * self.cycle.mesh_stiffness[:, None, None]
        return self._resultants.stiffness

    @cached_property
    def _spread(self) -> tuple[NDArray, NDArray]:
        if self.on_shafts is None:
            return np.ones((1, 1)), np.zeros((1, 1))
        return mesh_spread(self.on_shafts.gears, self._whole)

    @property
    def spread(self) -> NDArray:
        """Loads at the points of the face (row, point) per resultant."""
        return self._spread[0]

    @property
    def compliance(self) -> NDArray:
        """C of the shafts (row, row) [mm/N] (W13)."""
        return self._spread[1]

    @cached_property
    def motion(self) -> NDArray:
        """Motions x_s of the flanks (position, row) [mm], approach the transmission error without the shafts (W14)."""
        x = -self.force @ self.compliance
        x[:, 0] += self.cycle.transmission_error / MICROMETRES
        return x

    @cached_property
    def stiffness(self) -> NDArray:
        """K = ∂f/∂x (position, row, row) [N/mm] of teeth and bodies: (1 − S C)⁻¹ S, with S that on the shafts (W14)."""
        left = np.linalg.solve(np.eye(len(self.compliance)) - self._whole @ self.compliance, self._whole)
        return (left + np.swapaxes(left, -1, -2)) / 2

    @property
    def mean_stiffness(self) -> NDArray:
        """K̄ (row, row) [N/mm]."""
        return np.einsum("p,pij->ij", self.solved.weight, self.stiffness)

    def waves(self, orders: int) -> NDArray:
        """Rows (order + 1, position) that turn values over the cycle into ŷ_0 … ŷ_n, y = Σ ŷ_n e^{2πinτ} (D3).

        Raises
        ------
        InputError
            If uniform phases do not resolve the orders.
        """
        return order_rows(self.cycle.phases, orders)


def order_rows(phases: Phases, orders: int) -> NDArray:
    """Orders of rows at any phases, see ``LoadedMesh.waves``."""
    if phases.size is None and 2 * orders >= len(phases.phase):
        allowed = f"must be more than {2 * orders} for {orders} orders of the mesh frequency, or left out"
        raise InputError("resolution.positions", len(phases.phase), allowed)
    return np.concatenate([phases.weight[None], fourier_matrix(phases, orders)])


def loaded_mesh(scene: Scene, mesh: str = PAIR, rows: int = 1) -> LoadedMesh:
    """Mesh cycle of one mesh of the system of ``scene``.

    Raises
    ------
    InputError, ConvergenceError
        As ``simulate``.
    """
    seen, on_shafts = scene.seen_from(mesh), None
    phase, weight, size = loaded_phases(seen)
    lines = scene_lines(seen, phase)
    if seen.has_shafts:
        on_shafts = settle(seen, seen.shaft_effects, lines, weight)
        problem, solution = on_shafts.problem, on_shafts.solution
    else:
        problem = assemble(seen, lines)
        solution = solve_patches(problem)
    solved = Solved(scene=seen, lines=lines, weight=weight, problem=problem, solution=solution, size=size)
    return LoadedMesh(scene=seen, solved=solved, on_shafts=on_shafts, rows=rows)
