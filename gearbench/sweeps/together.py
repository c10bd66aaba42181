"""A scene under many loads, at the phases that each has by itself: contact lines and compliance of all of them at once.

Where flanks may part the phases follow the load, but the contact problem of a phase does not: gaps and compliance are
those of any load. So the problem is assembled once at the phases of all the loads, and each position solved under its
own. A point of a sweep is what ``simulate`` gives.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble, scene_lines, smooth_nodes
from gearbench.contact.loads import parted
from gearbench.contact.patches import solve_patches
from gearbench.contact.problem import part_of, under
from gearbench.contact.size import pairs_of_teeth
from gearbench.contact.transitions import phases_of_loads
from gearbench.results.solved import Solved
from gearbench.scene import Scene
from gearbench.threads import single_threaded_blas

#: Bytes of the compliance between the nodes of all positions that are solved together: more do not stay in the cache.
LARGEST = 16e6


def solve_together(scenes: Sequence[Scene]) -> Iterator[Solved]:
    """Solutions of scenes that differ in nothing but the load, of one direction, as those of ``solve_scene``.

    On the line of action and without shafts. One after the other, but solved a few at a time.
    """
    scene = scenes[0]
    shares = np.array([each.F_bn / scene.F_bn for each in scenes])
    found = phases_of_loads(scene, shares)
    counts, most, first = [len(phase) for phase, _, _ in found], positions_together(scene), 0
    while first < len(scenes):
        last = first + 1
        while last < len(scenes) and sum(counts[first : last + 1]) <= most:
            last += 1
        yield from _solved(scenes[first:last], shares[first:last] / shares[first], found[first:last])
        first = last


def positions_together(scene: Scene) -> int:
    """Positions that are solved at the same time, at most, where a load has no more."""
    nodes = smooth_nodes(scene_lines(scene, np.array([0.5]))) * pairs_of_teeth(scene)
    return int(LARGEST / (8.0 * nodes * nodes))


@single_threaded_blas()
def _solved(scenes: Sequence[Scene], shares: NDArray, found: Sequence[tuple]) -> list[Solved]:
    """Solutions at the phases ``found`` for each of the ``shares`` of the load of the first."""
    scene, phases = scenes[0], [phase for phase, _, _ in found]
    # panels far from what the load changes have the same phases under all loads
    phase, position = np.unique(np.concatenate(phases), return_inverse=True)
    lines = scene_lines(scene, phase)
    each = np.repeat(shares, [len(own) for own in phases])
    problem = under(part_of(assemble(scene, lines), position), each)
    solutions = parted(solve_patches(problem), shares, [len(own) for own in phases])
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
