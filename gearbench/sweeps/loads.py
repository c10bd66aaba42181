"""A scene under many loads: contact lines and compliance are computed once for all loads that do not change them.

If flanks may part on the line of action, the mesh phases depend on the load, but the contact problem at a phase does
not. It is assembled once at the phases of all loads, and each position is solved under its load. A point of a sweep
therefore equals the result of ``simulate``.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble, with_gaps
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.gaps import conforming
from gearbench.contact.lines import smooth_nodes
from gearbench.contact.loads import in_full_load_units, split_positions, stack_loads, under_force
from gearbench.contact.mesh_loads import with_mesh_loads
from gearbench.contact.patches import solve_patches
from gearbench.contact.problem import ContactProblem, part_of, under_shares
from gearbench.contact.size import pairs_of_teeth
from gearbench.contact.transitions import loaded_phases, mesh_phases, phases_of_loads
from gearbench.effects.base import ComplianceEffect
from gearbench.geometry.action import ContactLines
from gearbench.results.solved import FinerLines, Solved
from gearbench.robustness.montecarlo import RobustProblem, prepare_problem
from gearbench.scene import Scene
from gearbench.scene_file import scene_at
from gearbench.solution import solve_scene
from gearbench.threads import single_threaded_blas

#: Dotted key of the torque.
TORQUE = "load.torque"
#: Largest number of compliances kept, because gears or resolutions may alternate within a grid.
KEPT = 8
#: Largest size [bytes] of the compliance matrices of positions solved together: more do not fit into the cache.
LARGEST = 16e6


def under_loads(scene: Scene, torques: Sequence[float]) -> list[list[Scene]]:
    """``scene`` under each of the torques [N·m], in groups that are solved together.

    Drive and coast flanks are separate groups. Every torque is a separate group off the line of action, where the load
    determines the length of contact lines, and with shafts, whose bearings it loads.
    """
    scenes = [scene_at(scene, {TORQUE: torque}) for torque in torques]
    if _alone(scene):
        return [[each] for each in scenes]
    return [list(group) for _, group in groupby(scenes, lambda each: each.load.coast)]


def _alone(scene: Scene) -> bool:
    """Whether the load affects more than the separation of flanks, so that every load is solved separately."""
    return scene.has_shafts or scene.effect("off_line_contact") is not None


def _share_phases(scene: Scene) -> bool:
    """Whether the mesh phases are the same under all loads of one direction."""
    return scene.resolution.positions is not None or scene.resolution.accuracy is not None or conforming(scene)


def solve_group(scenes: Sequence[Scene], shared: Shared) -> Iterator[Solved]:
    """Solve the scenes of a group of ``under_loads``, a few at a time; results equal those of ``solve_scene``.

    Loads with the same phases give one solution, whose arrays have the load as their first dimension.
    """
    scene = scenes[0]
    if _alone(scene):
        yield from map(solve_scene, scenes)
        return
    if _share_phases(scene):
        cycles = [loaded_phases(scene)] * len(scenes)
    else:
        cycles = phases_of_loads(scene, np.array([each.F_bn / scene.F_bn for each in scenes]))
    counts, most, first = [len(phase) for phase, _, _ in cycles], _most_positions(scene), 0
    while first < len(scenes):
        last = first + 1
        while last < len(scenes) and sum(counts[first : last + 1]) <= most:
            last += 1
        yield from _together(scenes[first:last], cycles[first:last], shared)
        first = last


def _most_positions(scene: Scene) -> int:
    """Largest number of positions solved at the same time; a single load may have more."""
    nodes = smooth_nodes(scene_lines(scene, np.array([0.5]))) * pairs_of_teeth(scene)
    return int(LARGEST / (8.0 * nodes * nodes))


@single_threaded_blas()
def _together(scenes: Sequence[Scene], cycles: Sequence[tuple], shared: Shared) -> list[Solved]:
    """Solve scenes that differ only in the load, each at the phases of its cycle; one solution if all share them."""
    counts = [len(phase) for phase, _, _ in cycles]
    alike = len(cycles) > 1 and all(each is cycles[0] for each in cycles)
    # loads share the phases on panels that the load does not change
    phase, position = np.unique(np.concatenate([phase for phase, _, _ in cycles]), return_inverse=True)
    assembled = shared.assembled(scenes[0], phase)
    shares = np.array([scene.F_bn / assembled.problem.force for scene in scenes])
    problem = under_shares(part_of(assembled.problem, position), np.repeat(shares, counts))
    solution = in_full_load_units(solve_patches(problem), np.repeat(shares, counts))
    if alike:
        _, weight, size = cycles[0]
        solution = stack_loads(solution, len(scenes))
        return [
            Solved(scene=scenes[0], lines=assembled.lines, weight=weight, problem=problem, solution=solution, size=size)
        ]
    result, ends = [], np.cumsum(counts)
    finer = FinerLines(scenes=scenes, phases=[phase for phase, _, _ in cycles])
    for i, (scene, (_, weight, size), one, n, end) in enumerate(
        zip(scenes, cycles, split_positions(solution, counts), counts, ends, strict=True)
    ):
        positions = slice(end - n, end)
        part, share = part_of(problem, positions), scene.F_bn / assembled.problem.force
        cells = replace(part.cells, share=np.ones(n)) if part.cells else None
        part = replace(part, force=scene.F_bn, length_scale=problem.length_scale * share, cells=cells)
        of_load = position[positions]
        # points of a sweep share their contact lines if they have the same phases
        lines = assembled.lines if np.array_equal(of_load, range(len(phase))) else assembled.lines.part(of_load)
        result.append(
            Solved(scene=scene, lines=lines, weight=weight, problem=part, solution=one, size=size, finer=finer, load=i)
        )
    return result


@dataclass(frozen=True, kw_only=True)
class Assembled:
    """A contact problem on its contact lines, scaled for any load."""

    lines: ContactLines
    problem: ContactProblem

    def robust(self, scene: Scene, weight: NDArray) -> RobustProblem:
        """Problem for error samples of ``scene``; ``weight`` are the weights of the positions."""
        return prepare_problem(scene, self.lines, weight, under_force(self.problem, scene.F_bn))


@dataclass(frozen=True)
class Shared:
    """Cache of contact problems: scenes that differ only in loads and gaps share the compliance."""

    _known: dict[Hashable, Assembled] = field(default_factory=dict)

    def samples(self, scenes: Sequence[Scene]) -> Iterator[RobustProblem]:
        """Problem for error samples of each scene of a group of ``under_loads``."""
        scenes = [with_mesh_loads(scene) for scene in scenes]
        phase, weight = mesh_phases(scenes[0])
        assembled = self.assembled(scenes[0], phase)
        return (assembled.robust(scene, weight) for scene in scenes)

    def assembled(self, scene: Scene, phase: NDArray) -> Assembled:
        """Contact problem of ``scene`` at the mesh phases ``phase``."""
        lines = scene_lines(scene, phase)
        stiff = tuple(effect for effect in scene.effects if isinstance(effect, ComplianceEffect))
        # gaps determine the panels of lines; cached lines keep their separation alive, so its id stays valid
        nodes = (lines.u.tobytes(), lines.y.tobytes(), lines.length.tobytes())
        key = (scene.pair, stiff, nodes, lines.cells, lines.coast, id(lines.separation), lines.typical_load)
        stored = self._known.get(key)
        if stored is not None:
            return Assembled(lines=stored.lines, problem=with_gaps(stored.problem, scene.acting_effects, stored.lines))
        assembled = Assembled(lines=lines, problem=assemble(scene, lines))
        if not scene.has_shafts:  # with shafts the compliance depends on the load, by the equilibrium of the bearings
            while len(self._known) >= KEPT:
                self._known.pop(next(iter(self._known)))
            self._known[key] = assembled
        return assembled
