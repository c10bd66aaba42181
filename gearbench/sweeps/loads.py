"""A scene under many loads: contact lines and compliance are made once for all loads that do not change them.

Where flanks may part on the line of action the mesh phases follow the load, but the contact problem of a phase does
not: it is assembled once at the phases of all loads, and each position is solved under its own. So a point of a sweep
is what ``simulate`` gives.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import (
    assemble,
    conforming,
    gap_and_variation,
    gaps_along,
    mesh_phases,
    scene_lines,
    smooth_nodes,
)
from gearbench.contact.loads import parted, solve_loads
from gearbench.contact.loads import under as under_force
from gearbench.contact.patches import solve_patches
from gearbench.contact.problem import ContactProblem, ContactSolution, part_of, under
from gearbench.contact.size import pairs_of_teeth
from gearbench.contact.transitions import loaded_phases, phases_of_loads
from gearbench.effects.base import ComplianceEffect
from gearbench.geometry.action import ContactLines
from gearbench.results.solved import Solved
from gearbench.robustness.montecarlo import RobustProblem, prepare_problem
from gearbench.scene import Scene
from gearbench.scene_file import scene_at
from gearbench.solution import solve_scene
from gearbench.threads import single_threaded_blas

#: Dotted key of the torque.
TORQUE = "load.torque"
#: Most compliances kept at once: gears or resolutions may take turns within a grid.
KEPT = 8
#: Bytes of the compliance between the nodes of all positions that are solved together: more do not stay in the cache.
LARGEST = 16e6


def under_loads(scene: Scene, torques: Sequence[float], *, sampled: bool = False) -> list[list[Scene]]:
    """``scene`` under each of the torques [N·m], in groups of those that are solved together.

    Drive and coast flanks are separate groups. Off the line of action, where the load decides how far contact lines
    reach, and on shafts, whose bearings it loads, each torque stands alone. ``sampled``: phases of error samples do not
    follow the load.
    """
    scenes = [scene_at(scene, {TORQUE: torque}) for torque in torques]
    if not (_share_phases(scene, sampled=sampled) or phases_follow(scene)):
        return [[each] for each in scenes]
    return [list(group) for _, group in groupby(scenes, lambda each: each.load.coast)]


def phases_follow(scene: Scene) -> bool:
    """Whether the load decides nothing but the phases of ``simulate``: where flanks part on the line of action."""
    return not (scene.has_shafts or scene.effect("off_line_contact") is not None or _share_phases(scene))


def _share_phases(scene: Scene, *, sampled: bool = False) -> bool:
    """Whether contact lines and phases are the same under all loads of one direction."""
    if scene.has_shafts or scene.effect("off_line_contact") is not None:
        return False
    resolution = scene.resolution
    return sampled or resolution.positions is not None or resolution.accuracy is not None or conforming(scene)


def solve_group(group: Sequence[Scene], shared: Shared, threads: int = 1) -> Iterator[Solved]:
    """Solution of each scene of a group of ``under_loads``, in order, as that of ``solve_scene``."""
    if phases_follow(group[0]):
        return _at_own_phases(group)
    if not _share_phases(group[0]):
        return map(solve_scene, group)
    at = shared.assembled(group[0])
    solutions = solve_loads(at.problem, [scene.F_bn for scene in group], threads)
    return (at.solved(scene, solution) for scene, solution in zip(group, solutions, strict=True))


def _at_own_phases(scenes: Sequence[Scene]) -> Iterator[Solved]:
    """Solutions of scenes that differ in the load alone, at the phases of each, a few scenes at a time."""
    scene = scenes[0]
    shares = np.array([each.F_bn / scene.F_bn for each in scenes])
    found = phases_of_loads(scene, shares)
    counts, most, first = [len(phase) for phase, _, _ in found], positions_together(scene), 0
    while first < len(scenes):
        last = first + 1
        while last < len(scenes) and sum(counts[first : last + 1]) <= most:
            last += 1
        yield from _together(scenes[first:last], shares[first:last] / shares[first], found[first:last])
        first = last


def positions_together(scene: Scene) -> int:
    """The most positions that are solved at the same time, unless one load has more."""
    nodes = smooth_nodes(scene_lines(scene, np.array([0.5]))) * pairs_of_teeth(scene)
    return int(LARGEST / (8.0 * nodes * nodes))


@single_threaded_blas()
def _together(scenes: Sequence[Scene], shares: NDArray, found: Sequence[tuple]) -> list[Solved]:
    """Solutions at the phases ``found`` for each of the ``shares`` of the load of the first scene."""
    scene, phases = scenes[0], [phase for phase, _, _ in found]
    # panels far from what the load changes have the same phases under all loads
    phase, position = np.unique(np.concatenate(phases), return_inverse=True)
    lines, counts = scene_lines(scene, phase), [len(own) for own in phases]
    problem = under(part_of(assemble(scene, lines), position), np.repeat(shares, counts))
    solutions = parted(solve_patches(problem), shares, counts)
    result, begin = [], 0
    for one, share, (own, weight, size), solution in zip(scenes, shares, found, solutions, strict=True):
        here = slice(begin, begin + len(own))
        part = part_of(problem, here)
        along = replace(part.along, scene=one, share=np.ones(len(own))) if part.along else None
        part = replace(part, force=one.F_bn, length_scale=problem.length_scale * share, along=along)
        at = lines.part(position[here])
        result.append(Solved(scene=one, lines=at, weight=weight, problem=part, solution=solution, size=size))
        begin += len(own)
    return result


@dataclass(frozen=True, kw_only=True)
class Assembled:
    """A scene's contact problem under its own torque, on its lines, with the weights of their positions.

    ``size`` is the number of Gauss points on each panel, where that is not the scene's.
    """

    scene: Scene
    lines: ContactLines
    weight: NDArray
    problem: ContactProblem
    size: int | None = None

    def solved(self, scene: Scene, solution: ContactSolution) -> Solved:
        """``scene``, this one under another load, with its solution."""
        problem = under_force(self.problem, scene.F_bn)
        return Solved(
            scene=scene, lines=self.lines, weight=self.weight, problem=problem, solution=solution, size=self.size
        )

    def robust(self, scene: Scene) -> RobustProblem:
        """The problem of error samples of ``scene``, this one under another load."""
        return prepare_problem(scene, self.lines, self.weight, under_force(self.problem, scene.F_bn))


@dataclass(frozen=True)
class Shared:
    """Contact problems of many scenes; the compliance is kept where only loads and gaps differ."""

    _known: dict[Hashable, Assembled] = field(default_factory=dict)

    def assembled(self, scene: Scene, *, sampled: bool = False) -> Assembled:
        """Contact problem of ``scene`` at phases that all loads, or error samples, share."""
        if not sampled and conforming(scene):
            phase, weight, size = loaded_phases(scene)
        else:
            phase, weight, size = *mesh_phases(scene), None
        lines = scene_lines(scene, phase)
        if scene.has_shafts:  # their compliance depends on the load: bearings are at rest under the torque
            return Assembled(scene=scene, lines=lines, weight=weight, problem=assemble(scene, lines), size=size)
        stiff = tuple(effect for effect in scene.effects if isinstance(effect, ComplianceEffect))
        # lines end and bend where gaps do; a separation is kept by those that use it, and so is its identity
        nodes = (lines.u.tobytes(), lines.y.tobytes(), lines.length.tobytes())
        key = (scene.pair, stiff, nodes, lines.cells, lines.coast, id(lines.separation), lines.typical_load)
        known = self._known.get(key)
        if known is None:
            known = Assembled(scene=scene, lines=lines, weight=weight, problem=assemble(scene, lines), size=size)
            while len(self._known) >= KEPT:
                self._known.pop(next(iter(self._known)))
            self._known[key] = known
        return known if known.scene is scene else _with_gaps(known, scene, weight)


def _with_gaps(known: Assembled, scene: Scene, weight: NDArray) -> Assembled:
    """``known`` with the gaps of ``scene``, in the units of the known problem; the load is set when it is solved."""
    gaps = gaps_along(scene, known.lines)
    gap, soft = (x.reshape(known.problem.gap.shape) for x in gap_and_variation(gaps))
    scale = known.problem.length_scale
    soft = soft if known.problem.a.any() else np.zeros_like(soft)  # without a law there is nothing to average
    gap, soft = np.ascontiguousarray((gap - soft) / scale), np.ascontiguousarray(soft / scale)
    along = known.problem.along
    if along is not None:
        along = replace(along, scene=scene, effects=tuple(scene.acting_effects), gaps=gaps)
    problem = replace(known.problem, gap=gap, soft=soft, along=along)
    return replace(known, scene=scene, weight=weight, problem=problem)
