"""All mesh cycles of a train until it repeats: pitch errors, waviness, run-out, planets that pass a sensor.

In every mesh cycle other teeth meet, and each mesh has the gaps of these teeth. The meshes of one cycle form one
contact problem. It is solved like that of a random sample with flank errors.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gearbench.budget import cycles_memory, require
from gearbench.contact.batch import Batch, chunks, on_threads, prepare
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.equilibrium import ForceSearch, MeshAt
from gearbench.errors import InputError
from gearbench.geometry.gear import Gear
from gearbench.geometry.names import RING
from gearbench.hunting.cycles import check_cycles, cycle_gap_amounts, cycle_gap_modes, tooth_to_tooth_effects
from gearbench.results.solved import Solved
from gearbench.results.train_cycle import TrainCycle
from gearbench.scene import Scene
from gearbench.threads import single_threaded_blas
from gearbench.trains.flanks import TrainFlanks
from gearbench.trains.revolution import eccentric, turned
from gearbench.trains.scatter import FORCE_TOLERANCE, LEAST, Curves, curves, levels
from gearbench.trains.solve import SolvedTrain, mesh_scenes, solve_train

#: Change of a mesh force in a step, relative to the largest force, at which a mesh cycle has converged.
FORCE_CHANGE = 1e-9
#: Number of curves over all cycles in memory, in addition to one per mesh.
FURTHER_CURVES = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class TrainCycles:
    """Solution of a train in all its mesh cycles.

    Parameters
    ----------
    solved
        The train with identical teeth on each gear.
    cycle
        Forces and motions in all mesh cycles, (cycle, position, …).
    """

    solved: SolvedTrain
    cycle: TrainCycle

    @property
    def passing(self) -> NDArray | None:
        """Force of the passing planets at a sensor on the ring, (cycle, position) [N]; None without a ring.

        The force of a planet at the angle φ from the sensor is weighted by the Hann window (1 + cos Nφ/2)/2 up to
        |φ| = 2π/N, where N is the number of planets: (M3) of docs/theory.md. Equal forces of evenly spaced planets
        therefore add up to a constant. At time 0 the first planet is at the sensor.
        """
        solved, (cycles, positions, _) = self.solved, self.cycle.force.shape
        train = solved.linkage.train
        time = _times(solved, np.arange(cycles))
        at_ring = [mesh.driven == RING for mesh in train.meshes]
        if not any(at_ring):
            return None
        sensor, total = turned(solved, RING, time), np.zeros((cycles, positions))
        places = [train.places[train.shaft(mesh.driver)] for mesh in train.meshes]
        for m in np.flatnonzero(at_ring):
            x, y = places[m] - train.places[RING]
            φ = np.angle(np.exp(1j * (np.arctan2(y, x) - sensor)))
            total += self.cycle.force[..., m] * np.cos(np.minimum(sum(at_ring) * np.abs(φ), 2 * np.pi) / 4) ** 2
        return total


def gears_apart(scene: Scene) -> dict[str, Gear]:
    """Name → gear, for gears whose state differs from one mesh cycle to the next.

    They have unequal teeth, are eccentric, or are the ring of a planetary set, along which the planets move.
    """
    planetary, gears = scene.planetary, {}
    names = set() if planetary is None else {RING, *planetary.eccentricities}
    for mesh, mesh_scene in zip(scene.geometry.meshes, scene.meshes.values(), strict=True):
        lines, tooth_effects = scene_lines(mesh_scene, np.zeros(1)), tooth_to_tooth_effects(mesh_scene)
        for side, (name, gear) in enumerate(zip(mesh.gears, mesh_scene.pair.gears, strict=True)):
            teeth = np.arange(abs(gear.teeth))
            for effect in tooth_effects:
                # does the gap change if this gear alone turns by one tooth?
                turned_by_one = effect.later(mesh_scene.pair, (1 - side, side))
                gaps = (each.turning(lines, teeth) for each in (effect, turned_by_one))
                before, after = (gap.amounts for gap in gaps if gap is not None)
                names |= set() if np.allclose(before, after, rtol=0, atol=1e-12) else {name}
            gears |= {name: gear} if name in names else {}
    return gears


def check_train_cycles(scene: Scene) -> int:
    """Number of mesh cycles until a train repeats.

    Raises
    ------
    InputError
        If there are too many cycles, if all cycles are equal, or if the scene has several loads.
    """
    if scene.loads:
        raise InputError("loads", f"{len(scene.loads)} loads", "are not supported by hunting: give one [load]")
    gears = gears_apart(scene)
    if not gears:
        raise InputError("effects", "all teeth are alike", "must have pitch_errors, random_pitch or waviness")
    train = scene.geometry
    teeth_per_cycle = [next(train.periods[mesh.name] for mesh in train.meshes if gear in mesh.gears) for gear in gears]
    key = "gears" if scene.planetary is None else "planetary.ring.teeth"
    return check_cycles(list(gears.values()), key, teeth_per_cycle)


def train_cycles_memory(meshes: int, positions: int, cycles: int, orders: float) -> float:
    """Memory [bytes] for all mesh cycles of a train and their spectra up to the mesh order ``orders``."""
    return (meshes + FURTHER_CURVES) * cycles_memory(positions, cycles, orders, 0)


@single_threaded_blas()
def train_cycles(scene: Scene, orders: float, threads: int) -> TrainCycles:
    """Solve all mesh cycles of a ``coupled`` scene.

    ``orders``, the highest mesh order of the spectra, only enters the memory estimate.

    Raises
    ------
    MemoryBudgetError
        If the cycles and their spectra need more memory than there is.
    InputError, ConvergenceError
        Like ``simulate`` and ``check_train_cycles``.
    """
    count = check_train_cycles(scene)
    solved = solve_train(scene, alike=True)
    positions, meshes = len(solved.phases.phase), len(solved.meshes)
    size = f"{count} mesh cycles × {positions} positions × {meshes} meshes"
    require(train_cycles_memory(meshes, positions, count, orders), "hunting", size, "fewer positions would fit")
    forces = curves(solved, float(len(solved.meshes)))
    meshes_and_scenes = zip(mesh_scenes(scene).values(), solved.meshes.values(), strict=True)
    amounts = [
        cycle_gap_amounts(tooth_to_tooth_effects(mesh_scene), mesh.lines, count)
        for mesh_scene, mesh in meshes_and_scenes
    ]

    def batch(mesh: Solved, contact: MeshAt) -> Batch:
        return prepare(contact.problem, cycle_gap_modes(tooth_to_tooth_effects(mesh.scene), mesh.lines))

    flanks = TrainFlanks.of(solved, levels(float(len(solved.meshes))), forces.approach, batch)
    work = partial(_some_cycles, solved, forces, flanks, amounts)
    parts = list(on_threads(work, (np.unique(chunk) for chunk in chunks(np.arange(count))), threads))
    q, F = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    return TrainCycles(solved=solved, cycle=replace(solved.cycle, force=F, motion=q))


def _some_cycles(
    solved: SolvedTrain, forces: Curves, flanks: TrainFlanks, amounts: list[NDArray], cycles: NDArray
) -> tuple[NDArray, NDArray]:
    """Motions q (cycle, position, motion) and forces F (cycle, position, mesh) in the mesh cycles ``cycles``."""
    offset = eccentric(solved, _times(solved, cycles))
    statics = solved.statics(offset)
    _, F = statics.balanced(forces, *solved.first_guess(offset), FORCE_TOLERANCE)
    meshes_under = partial(flanks.under, [of_mesh[cycles] for of_mesh in amounts])
    search = ForceSearch(meshes_under=meshes_under, nominal=flanks.force, least=LEAST, tolerance=FORCE_CHANGE)
    F, q, _, _ = search.solve(statics, F)
    return q, F


def _times(solved: SolvedTrain, cycles: NDArray) -> NDArray:
    """Time [mesh periods] at each position, (cycle, position); negative on coast flanks, solved as a mirror image."""
    time = cycles[:, None] * solved.phases.length + solved.phases.phase
    return -time if solved.linkage.coast else time
