"""Stiffness and transmission error of the meshes of a system, as they excite it: shafts displaced, not yielding."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble, scene_lines
from gearbench.contact.bearings import settle
from gearbench.contact.patches import solve_patches
from gearbench.contact.transitions import loaded_phases
from gearbench.effects.base import Effect
from gearbench.effects.shafts import SeatedGear, system_effects
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.results.cycle import MICROMETRES, MeshCycle, Phases, fourier_matrix, mean
from gearbench.results.solved import Solved
from gearbench.scene import Scene

#: N/mm in 1 N/µm.
PER_MICROMETRE = 1e3


@dataclass(frozen=True, kw_only=True)
class LoadedMesh:
    """A mesh under its mean force: its scene with all effects that act, and k and δ_s over the mesh cycle.

    Parameters
    ----------
    scene
        Pair, load, resolution.
    effects
        The scene's own, and the mean displacement of its shafts as a gap.
    lines
        Contact lines.
    cycle
        k and δ_s of teeth and bodies, shafts excluded.
    gears
        Pinion and wheel on their shafts at rest under its forces, where there are shafts.
    """

    scene: Scene
    effects: tuple[Effect, ...]
    lines: ContactLines
    cycle: MeshCycle
    gears: tuple[SeatedGear, ...] = ()

    @property
    def stiffness(self) -> NDArray:
        """k (position,) [N/mm]."""
        return PER_MICROMETRE * self.cycle.mesh_stiffness

    @property
    def error(self) -> NDArray:
        """δ_s (position,) [mm]."""
        return self.cycle.transmission_error / MICROMETRES

    @property
    def mean_stiffness(self) -> float:
        """k̄ [N/mm]."""
        return float(mean(self.stiffness, self.cycle.phases.weight))

    def rows(self, orders: int) -> NDArray:
        """Rows (order + 1, position) that turn values over the cycle into ŷ_0 … ŷ_n, y = Σ ŷ_n e^{2πinτ} (D3).

        Raises
        ------
        InputError
            If uniform phases do not resolve the orders.
        """
        return order_rows(self.cycle.phases, orders)


def order_rows(phases: Phases, orders: int) -> NDArray:
    """As ``LoadedMesh.rows``, of any phases."""
    if phases.size is None and 2 * orders >= len(phases.phase):
        allowed = f"must be more than {2 * orders} for {orders} orders of the mesh frequency, or left out"
        raise InputError("resolution.positions", len(phases.phase), allowed)
    return np.concatenate([phases.weight[None], fourier_matrix(phases, orders)])


def loaded_mesh(scene: Scene, mesh: str = "") -> LoadedMesh:
    """Mesh cycle of one mesh of the system of ``scene``.

    The shafts' elasticity belongs to the dynamic system; in the contact they stand displaced by their mean load (D1).

    Raises
    ------
    InputError, ConvergenceError
        As ``simulate``.
    """
    own = scene
    if scene.has_shafts:
        box = scene.gearbox
        number = scene.gearbox.names.index(mesh)
        own = scene if not mesh else scene.further[number - 1]
        own = replace(own, load=replace(own.load, torque=box.torques[mesh]), system=None, further=())
    phase, weight, size = loaded_phases(own)
    lines = scene_lines(own, phase)
    effects, gears = own.flank_effects, ()
    if scene.has_shafts:
        _, _, motion = settle(own, partial(system_effects, scene.gearbox, mesh), lines, weight)
        effects, gears = (*own.flank_effects, motion), motion.gears
    problem = assemble(own, lines, effects)
    solved = Solved(scene=own, lines=lines, weight=weight, problem=problem, solution=solve_patches(problem), size=size)
    return LoadedMesh(scene=own, effects=effects, lines=lines, cycle=solved.cycle, gears=gears)
