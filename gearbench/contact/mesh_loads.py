"""Mean loads of the meshes on their shafts, each from its own contact.

A mesh loads its shafts where its flanks carry, which depends on its errors and on the bending of the shafts under all
other meshes. Coarse contacts of all meshes are therefore solved by turns, until no load changes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.coarse_solution import COARSE_PHASES, coarse_solution
from gearbench.contact.patches import next_round
from gearbench.contact.solver import ConvergenceError, Guess, has_law, law_forces, solve
from gearbench.scene import Resolution, Scene
from gearbench.schema import changed
from gearbench.threads import single_threaded_blas

if TYPE_CHECKING:
    from gearbench.system.gearbox import MeshLoads

#: The loads stand if no force on a node changes by more than this share of the largest; largest number of rounds.
TOLERANCE, MAX_ROUNDS = 1e-3, 50


def with_mesh_loads(scene: Scene) -> Scene:
    """Return ``scene`` with the mean loads of all meshes on its shafts; without shafts, the scene itself.

    Raises
    ------
    ConvergenceError
        If the loads do not converge.
    """
    if not scene.has_shafts or scene.mesh_loads is not None or len(scene.shaft_effects()) == 1:
        return scene
    return changed(scene, mesh_loads=_mesh_loads(replace(scene, resolution=Resolution())))


@lru_cache(maxsize=16)
@single_threaded_blas()
def _mesh_loads(scene: Scene) -> MeshLoads:
    """Mean loads of the meshes of ``scene``; its resolution does not matter."""
    from gearbench.system.gearbox import MeshLoads
    from gearbench.system.mechanics import resting_states, static_equilibrium

    box = scene.gearbox
    loads = MeshLoads(
        of_mesh={name: (box.load(name, 0), box.load(name, 1)) for name in box.names}, settled=resting_states(box)
    )
    for _ in range(MAX_ROUNDS):
        on_shafts = changed(scene, mesh_loads=loads)
        of_mesh = {name: _of_contact(on_shafts.seen_from(name)) for name in box.names}
        before, after = (_forces(of) for of in (loads.of_mesh, of_mesh))
        if np.abs(after - before).max() <= TOLERANCE * np.abs(before).max():
            return loads
        settled = static_equilibrium(box, of_mesh, dict(enumerate(loads.settled)))
        loads = MeshLoads(of_mesh=of_mesh, settled=settled)
    raise ConvergenceError(f"the meshes bend each other's shafts: their loads did not converge in {MAX_ROUNDS} rounds")


def _forces(of_mesh: Mapping[str, tuple[NDArray, NDArray]]) -> NDArray:
    """Forces (node, 3) of all meshes, without the moments on the nodes."""
    return np.concatenate([load.reshape(-1, 6)[:, :3] for of_gears in of_mesh.values() for load in of_gears])


def _of_contact(scene: Scene) -> tuple[NDArray, NDArray]:
    """Mean load (size,) of the scene's pair on the nodes of the shafts of pinion and wheel."""
    from gearbench.effects.shafts import Shafts, flank_loads

    coarse = coarse_solution(scene, COARSE_PHASES)
    (shafts,) = (effect for effect in scene.acting_effects if isinstance(effect, Shafts))
    problem, lines, count = coarse.problem, coarse.lines, len(coarse.phase)
    guess = Guess(q=coarse.guess.q.copy(), delta=coarse.guess.delta.copy())
    if problem.cells is not None:  # forces of cells would be placed in their middles
        patches = next_round(problem, guess, None).patches
        assert patches is not None
        problem, lines = patches.problem, patches.lines
    if has_law(problem):
        force = problem.force * law_forces(problem, guess.delta, guess.q).reshape(lines.shape)
    else:
        force = solve(problem, guess).force
    return flank_loads(shafts.gears, lines, force, np.full(count, 1 / count))
