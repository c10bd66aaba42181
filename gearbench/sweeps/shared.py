"""What scenes share: contact lines and compliance, made once for all that does not change them."""

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
)
from gearbench.contact.loads import solve_loads, under
from gearbench.contact.problem import ContactProblem, ContactSolution
from gearbench.contact.transitions import loaded_phases
from gearbench.effects.base import ComplianceEffect
from gearbench.geometry.action import ContactLines
from gearbench.results.solved import Solved
from gearbench.robustness.montecarlo import RobustProblem, prepare_problem
from gearbench.scene import Load, Scene
from gearbench.schema import read
from gearbench.solution import solve_scene

#: Compliances kept at once: as many as gears or resolutions take turns within a grid, at most.
KEPT = 8


def under_loads(scene: Scene, torques: Sequence[float], *, sampled: bool = False) -> list[list[Scene]]:
    """``scene`` under each of the torques [N·m], in groups of those that are solved together.

    Drive and coast flanks are not; nor are flanks that touch off the line of action, where the load decides how far
    contact lines reach, nor gears on shafts, whose bearings it loads. ``sampled``: phases of samples do not follow the
    load.
    """
    scenes = [scene.under(read(Load, {"torque": torque}, "load")) for torque in torques]
    if not (_loads_share(scene, sampled=sampled) or phases_follow(scene)):
        return [[each] for each in scenes]
    return [list(group) for _, group in groupby(scenes, lambda each: each.load.coast)]


def phases_follow(scene: Scene) -> bool:
    """Whether the load decides nothing but the phases of ``simulate``: where flanks part on the line of action."""
    return not (scene.has_shafts or scene.effect("off_line_contact") is not None or _loads_share(scene))


def _loads_share(scene: Scene, *, sampled: bool = False) -> bool:
    """Whether ``simulate`` has the same contact lines of ``scene`` under all loads of one direction."""
    if scene.has_shafts or scene.effect("off_line_contact") is not None:
        return False
    resolution = scene.resolution
    return sampled or resolution.positions is not None or resolution.accuracy is not None or conforming(scene)


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

    def solved(self, solution: ContactSolution) -> Solved:
        """The scene with its solution, or with those under several loads."""
        return Solved(
            scene=self.scene, lines=self.lines, weight=self.weight, problem=self.problem, solution=solution,
            size=self.size,
        )  # fmt: skip

    def robust(self, scene: Scene) -> RobustProblem:
        """The problem of error samples of ``scene``: this one under another load."""
        return prepare_problem(scene, self.lines, self.weight, under(self.problem, scene.F_bn))


@dataclass(frozen=True)
class Shared:
    """Contact problems of many scenes, the compliance kept where only loads and gaps differ."""

    _known: dict[Hashable, Assembled] = field(default_factory=dict)

    def solutions(self, group: Sequence[Scene], threads: int = 1) -> tuple[Assembled, Iterator[ContactSolution]]:
        """Contact problem of a group of ``under_loads``, and its solutions under one load after the other."""
        scene = group[0]
        if len(group) == 1 and not _loads_share(scene):
            solved = solve_scene(scene)
            at = Assembled(
                scene=scene, lines=solved.lines, weight=solved.weight, problem=solved.problem, size=solved.size
            )
            return at, iter([solved.solution])
        at = self.assembled(group[0])
        return at, solve_loads(at.problem, [scene.F_bn for scene in group], threads)

    def assembled(self, scene: Scene, *, sampled: bool = False) -> Assembled:
        """Contact problem of ``scene`` at phases that all loads share, or error samples."""
        if not sampled and conforming(scene):
            phase, weight, size = loaded_phases(scene)
        else:
            phase, weight, size = *mesh_phases(scene), None
        stiff = tuple(effect for effect in scene.effects if isinstance(effect, ComplianceEffect))
        lines = scene_lines(scene, phase)
        if scene.has_shafts:  # compliances of their own, bearings at rest under the torque
            return Assembled(scene=scene, lines=lines, weight=weight, problem=assemble(scene, lines), size=size)
        # lines end and bend where gaps do; a separation is kept by those that use it, and so is its identity
        nodes = (lines.u.tobytes(), lines.y.tobytes(), lines.length.tobytes())
        key = (scene.pair, stiff, nodes, lines.cells, lines.coast, id(lines.separation), lines.typical_load)
        known = self._known.get(key)
        if known is None:
            known = Assembled(scene=scene, lines=lines, weight=weight, problem=assemble(scene, lines), size=size)
            while len(self._known) >= KEPT:
                self._known.pop(next(iter(self._known)))
            self._known[key] = known
        if known.scene is scene:
            return known
        # in the units of the problem that is known; its load is set when it is solved
        own = known.lines
        gaps = gaps_along(scene, own)
        gap, soft = (x.reshape(known.problem.gap.shape) for x in gap_and_variation(gaps))
        scale = known.problem.length_scale
        soft = soft if known.problem.a.any() else np.zeros_like(soft)  # without a law there is nothing to average
        gap, soft = np.ascontiguousarray((gap - soft) / scale), np.ascontiguousarray(soft / scale)
        along = known.problem.along
        if along is not None:
            along = replace(along, scene=scene, effects=tuple(scene.acting_effects), gaps=gaps)
        problem = replace(known.problem, gap=gap, soft=soft, along=along)
        return replace(known, scene=scene, weight=weight, problem=problem)
