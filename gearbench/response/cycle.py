"""Stiffness and transmission error of the meshes of a system, as they excite it: shafts displaced, not yielding."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble, mesh_phases, scene_lines
from gearbench.contact.bearings import settle
from gearbench.contact.solver import solve
from gearbench.effects.base import Effect
from gearbench.effects.shafts import flank_loads, system_effects
from gearbench.geometry.action import ContactLines
from gearbench.outputs import Solved
from gearbench.response.spectrum import order_rows
from gearbench.scene import Scene

#: µm in 1 mm, and N/mm in 1 N/µm.
MICROMETRES = PER_MICROMETRE = 1e3


@dataclass(frozen=True, kw_only=True)
class MeshCycle:
    """A mesh under its mean force: its scene with all effects that act, and k and δ_s over the mesh cycle.

    Parameters
    ----------
    scene
        Pair, load, resolution.
    effects
        The scene's own, and the mean displacement of its shafts as a gap.
    lines, weight
        Contact lines and the weights of their positions.
    stiffness
        k (position,) of the teeth and bodies, shafts excluded [N/mm].
    error
        δ_s (position,) [mm].
    loads
        On the nodes of the shafts of pinion and wheel, where there are shafts.
    """

    scene: Scene
    effects: tuple[Effect, ...]
    lines: ContactLines
    weight: NDArray
    stiffness: NDArray
    error: NDArray
    loads: tuple[NDArray, NDArray] | None = None

    def rows(self, orders: int) -> NDArray:
        """Rows (order + 1, position) that turn values over the cycle into complex orders."""
        return order_rows(self.lines.mesh_phase, orders, self.scene.resolution.panel_size)


def mesh_cycle(scene: Scene, mesh: str = "") -> MeshCycle:
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
    phase, weight = mesh_phases(own)
    lines = scene_lines(own, phase)
    effects, loads = own.effects, None
    if scene.has_shafts:
        _, shafted, motion = settle(own, partial(system_effects, scene.gearbox, mesh), lines, weight)
        effects = (*own.effects, motion)
        loads = flank_loads(motion.gears, lines, shafted.force, weight)
    problem = assemble(own, lines, effects)
    solved = Solved(scene=own, lines=lines, weight=weight, problem=problem, solution=solve(problem))
    return MeshCycle(
        scene=own,
        effects=effects,
        lines=lines,
        weight=weight,
        stiffness=PER_MICROMETRE * solved.mesh_stiffness,
        error=solved.transmission_error / MICROMETRES,
        loads=loads,
    )


def mean_stiffness(cycle: MeshCycle) -> float:
    """k̄ [N/mm]."""
    return float(np.real(cycle.rows(0)[0] @ cycle.stiffness))
