"""Stiffness and quasi-static motion with which a mesh under its mean force excites a system.

W- and D-numbers are equations of docs/theory.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.batch import Batch, BatchSolution
from gearbench.contact.bearings import OnShafts, solve_on_shafts
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.mesh_loads import with_mesh_loads
from gearbench.contact.patches import solve_patches
from gearbench.contact.resultants import Resultants, resultants, resultants_of_samples
from gearbench.contact.solver import Guess
from gearbench.contact.transitions import loaded_phases
from gearbench.dynamics.balance import Excitation
from gearbench.effects.base import Effect
from gearbench.effects.shafts import flank_loads, mesh_spread
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.names import PAIR
from gearbench.results.cycle import MICROMETRES, MeshCycle, Phases, fourier_rows
from gearbench.results.solved import Solved
from gearbench.scene import Scene

#: N/mm in 1 N/µm.
PER_MICROMETRE = 1e3
#: Coefficient of friction for the estimate of the friction force.
FRICTION = 0.05


@dataclass(frozen=True, kw_only=True)
class FlankState:
    """Quasi-static state of teeth and gear bodies over the mesh cycle, without the shafts.

    Row 0 is the approach of the gears and the force that does work on it; rows 1, 2 … are tilt and bending over the
    face and their resultants (W11). A further axis, for example of samples, comes first.

    Parameters
    ----------
    force
        Resultants f_s (…, position, row) [N].
    motion
        Quasi-static motions x_s of the flanks (…, position, row) [mm].
    stiffness
        K = ∂f/∂x (…, position, row, row) [N/mm].
    """

    force: NDArray
    motion: NDArray
    stiffness: NDArray

    def excitation(self, waves: NDArray) -> Excitation:
        """Excitation of orders 0 … H, from the matrix ``waves`` (2H + 1, position) of ``LoadedMesh.waves``."""
        lower = waves[: len(waves) // 2 + 1]
        motion, force = (np.swapaxes(lower @ values, -1, -2) for values in (self.motion, self.force))
        flat = self.stiffness.reshape(*self.motion.shape[:-1], -1)
        stiffness = np.swapaxes(waves @ flat, -1, -2).reshape(*motion.shape[:-1], motion.shape[-2], -1)
        return Excitation(stiffness=stiffness, motion=motion, force=force)


@dataclass(frozen=True, kw_only=True, eq=False)
class LoadedMesh:
    """A mesh under its mean force, solved as by ``simulate``.

    Parameters
    ----------
    scene
        Pair, load, resolution, and the system as seen from this mesh.
    solved
        Contact over the mesh cycle, including the shafts if there are any.
    on_shafts
        Shafts and bearings in equilibrium with this contact; None without shafts.
    rows_on_shafts
        Number of relative motions (rows) of gears on shafts, see ``resultants``. Gears without shafts have one.
    """

    scene: Scene
    solved: Solved
    on_shafts: OnShafts | None
    rows_on_shafts: int

    @property
    def effects(self) -> tuple[Effect, ...]:
        """All effects that act, including the effects of the shafts."""
        return self.scene.flank_effects if self.on_shafts is None else self.on_shafts.effects

    @property
    def cycle(self) -> MeshCycle:
        """Transmission error and stiffness, including the shafts."""
        return self.solved.cycle

    @property
    def rows(self) -> int:
        """Number of relative motions of the flanks."""
        return 1 if self.on_shafts is None else self.rows_on_shafts

    @cached_property
    def _resultants(self) -> Resultants:
        """Resultants f on the shafts, and S = ∂f/∂x with the compliance of the shafts included."""
        if self.on_shafts is None or self.rows == 1:
            return _one_row(self.scene, self.cycle)
        return self.on_shafts.resultants(self.rows)

    @cached_property
    def _spread(self) -> tuple[NDArray, NDArray]:
        """Values of ``spread`` and ``compliance``, computed together."""
        if self.on_shafts is None:
            return np.ones((1, 1)), np.zeros((1, 1))
        return mesh_spread(self.on_shafts.gears, self._resultants.stiffness)

    @property
    def spread(self) -> NDArray:
        """Loads at the points of the face per unit resultant (row, point)."""
        return self._spread[0]

    @property
    def compliance(self) -> NDArray:
        """Compliance C of the shafts (row, row) [mm/N] (W13)."""
        return self._spread[1]

    @cached_property
    def flanks(self) -> FlankState:
        """Teeth and bodies at the positions of the mesh cycle."""
        return self._off_shafts(self.cycle, self._resultants)

    def at(self, phase: NDArray) -> FlankState:
        """Teeth and bodies at any mesh phases (position,); bearings keep their stiffness in ``on_shafts``."""
        lines = scene_lines(self.scene, phase)
        problem = assemble(self.scene, lines, self.effects)
        guess = Guess.empty(problem)
        solution = solve_patches(problem, guess)
        cycle = MeshCycle.of(self.scene, self.cycle.phases, solution.approach, solution.stiffness)
        forces = None if self.rows == 1 else resultants(problem, lines, solution, guess, self.rows)
        return self._off_shafts(cycle, forces)

    def samples(self, batch: Batch, lines: ContactLines, solution: BatchSolution) -> FlankState:
        """Teeth and bodies (sample, position, …) of error samples, from their contact on ``lines``.

        With several rows, ``solution`` must hold segment forces. Bearings keep their stiffness without errors.
        """
        cycle = MeshCycle.of(self.scene, self.cycle.phases, solution.approach.T, solution.stiffness.T)
        forces = None if self.rows == 1 else resultants_of_samples(batch, lines, solution, self.rows)
        return self._off_shafts(cycle, forces)

    def _off_shafts(self, cycle: MeshCycle, with_shafts: Resultants | None) -> FlankState:
        """Teeth and bodies of a ``cycle``, from which the compliance C of the shafts is removed (W14).

        Without resultants the approach is the only motion.
        """
        with_shafts = with_shafts or _one_row(self.scene, cycle)
        S, C = with_shafts.stiffness, self.compliance
        motion = -with_shafts.force @ C
        motion[..., 0] += cycle.transmission_error / MICROMETRES
        K = np.linalg.solve(np.eye(len(C)) - S @ C, S)
        return FlankState(force=with_shafts.force, motion=motion, stiffness=(K + np.swapaxes(K, -1, -2)) / 2)

    @property
    def load_on_shafts(self) -> tuple[NDArray, NDArray]:
        """Mean loads of the flank forces on the node motions of the shafts of pinion and wheel, (motion,) each."""
        assert self.on_shafts is not None
        return flank_loads(self.on_shafts.gears, self.solved.lines, self.solved.solution.force, self.solved.weight)

    @cached_property
    def friction(self) -> NDArray:
        """Estimated friction force across the line of action (position,) [N]; it changes sign at the pitch point."""
        meshing = self.scene.pair.meshing
        side = np.sign(self.solved.lines.u - meshing.pitch_point)
        return FRICTION * math.cos(meshing.beta_b) * (self.solved.solution.force * side).sum(axis=(1, 2))

    @property
    def mean_stiffness(self) -> NDArray:
        """K̄ (row, row) [N/mm]."""
        return np.einsum("p,pij->ij", self.solved.weight, self.flanks.stiffness)

    def waves(self, orders: int) -> NDArray:
        """Matrix (H + 1, position) from values over the cycle to ŷ_0 … ŷ_H, y = Σ ŷ_n e^{2πinτ} (D3); H is ``orders``.

        Raises
        ------
        InputError
            If there are too few uniform phases to resolve the orders.
        """
        return order_rows(self.cycle.phases, orders)


def _one_row(scene: Scene, cycle: MeshCycle) -> Resultants:
    """Force and stiffness of gears whose only relative motion is the approach."""
    k = PER_MICROMETRE * cycle.mesh_stiffness[..., None, None]
    return Resultants(force=np.full(k.shape[:-1], scene.F_bt), stiffness=k)


@lru_cache(maxsize=16)
def order_rows(phases: Phases, orders: int) -> NDArray:
    """Matrix (n + 1, position) from values at ``phases`` to their orders 0 … n of the cycle; n is ``orders``."""
    if phases.size is None and 2 * orders >= len(phases.phase):
        allowed = f"must be more than {2 * orders}, twice the {orders} orders of the stiffness, or left out"
        raise InputError("resolution.positions", f"{len(phases.phase)} in a cycle", allowed)
    return np.concatenate([phases.weight[None], fourier_rows(phases, np.arange(1, orders + 1) / phases.length)])


def loaded_mesh(scene: Scene, mesh: str = PAIR, rows: int = 1) -> LoadedMesh:
    """Solve the mesh cycle of one mesh of the system of ``scene``, with ``rows`` relative motions.

    Raises
    ------
    InputError, ConvergenceError
        As ``simulate``.
    """
    mesh_scene, on_shafts = with_mesh_loads(scene).seen_from(mesh), None
    phase, weight, size = loaded_phases(mesh_scene)
    lines = scene_lines(mesh_scene, phase)
    if mesh_scene.has_shafts:
        on_shafts = solve_on_shafts(mesh_scene, mesh_scene.shaft_effects, lines, weight)
        problem, solution = on_shafts.problem, on_shafts.solution
    else:
        problem = assemble(mesh_scene, lines)
        solution = solve_patches(problem)
    solved = Solved(scene=mesh_scene, lines=lines, weight=weight, problem=problem, solution=solution, size=size)
    return LoadedMesh(scene=mesh_scene, solved=solved, on_shafts=on_shafts, rows_on_shafts=rows)
