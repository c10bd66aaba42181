"""Trials of a scene on few of its mesh phases, coarser where it is large: a second of work, whatever the scene."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import mesh_phases, scene_lines
from gearbench.contact.phases import gauss_phases
from gearbench.contact.size import pairs_of_teeth
from gearbench.effects.teeth import solid_order
from gearbench.effects.tooth_bending import ToothBending
from gearbench.effort.clock import unseen
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.results.solved import Solved
from gearbench.scene import Scene
from gearbench.solution import solve_lines

A = TypeVar("A")

#: Phases of the short and the long trial; a cycle with no more phases than the long one is tried as a whole.
SHORT, LONG = 4, 32
#: Processor time that a long trial may take: it has fewer phases otherwise, two panels at least [s].
LONGEST = 0.2
#: Work that takes less than this is done again, and the quicker one counts [s].
QUICK = 0.05
#: Pairs of teeth of a trial, segments of each, and of all together at a phase.
PAIRS, SEGMENTS, NODES = 10, 32, 200
#: Functions of a trial's teeth, on the section of solids and on plates, and along the axis of solids.
FUNCTIONS, AXIS = 60, 16


@dataclass(frozen=True, kw_only=True)
class Reduced:
    """A scene no larger than a trial may be.

    Parameters
    ----------
    scene
        The scene, narrower and with fewer segments, Gauss points, and functions of the teeth.
    segments
        How many times as many segments the whole scene has.
    pairs, set_up
        How many times as long the whole scene takes because it has more pairs of teeth, and its set-ups because its
        teeth have more functions; these need so many times as much memory, too.
    """

    scene: Scene
    segments: float
    pairs: float
    set_up: float


def reduced(scene: Scene) -> Reduced:
    """``scene`` as trials see it."""
    resolution, all_pairs = scene.resolution, pairs_of_teeth(scene)
    small = _narrower(scene, all_pairs) if all_pairs > PAIRS else scene
    pairs = pairs_of_teeth(small)
    segments = min(resolution.segments, max(2, min(SEGMENTS, NODES // pairs)))
    size = None if scene.resolution.panel_size is None else min(scene.resolution.panel_size, SHORT)
    small = replace(small, resolution=replace(resolution, segments=segments, gauss_points=size))
    small, set_up = _with_few_functions(small)
    # all pairs move each other
    more = (all_pairs / pairs) ** 2
    return Reduced(scene=small, segments=resolution.segments / segments, pairs=more, set_up=more * set_up)


def _narrower(scene: Scene, pairs: int) -> Scene:
    """The scene with less face width, and so with fewer pairs in contact; as it is where that makes no scene."""
    try:
        return replace(scene, pair=replace(scene.pair, face_width=scene.pair.face_width * PAIRS / pairs))
    except InputError:
        return scene


def _with_few_functions(scene: Scene) -> tuple[Scene, float]:
    """The scene, and how many times as much as its teeth the whole ones take.

    That is a number for each two functions of a section and function along the axis.
    """
    tooth = scene.effect(ToothBending.name)
    if not isinstance(tooth, ToothBending) or tooth.meshed or tooth.basis:
        return scene, 1.0
    order = tooth.order
    if order is None and tooth.model == "solid":
        order = max((solid_order(gear) for gear in scene.pair.gears), key=math.prod)
    if order is None or (order[0] * order[1] <= FUNCTIONS and max(order[2:], default=0) <= AXIS):
        return scene, 1.0
    share = min(1.0, math.sqrt(FUNCTIONS / (order[0] * order[1])))
    few = (*(max(2, round(share * n)) for n in order[:2]), *(min(n, AXIS) for n in order[2:]))
    effects = (replace(e, order=few) if e is tooth else e for e in scene.effects)
    more = (math.prod(order[:2]) / math.prod(few[:2])) ** 2 * math.prod(order[2:]) / math.prod(few[2:])
    return replace(scene, effects=tuple(effects)), more


@dataclass(frozen=True)
class Trial:
    """A scene on some of its mesh phases."""

    scene: Scene
    lines: ContactLines

    @property
    def weight(self) -> NDArray:
        """Weights of the phases, all alike."""
        return np.full(len(self.lines.mesh_phase), 1 / len(self.lines.mesh_phase))

    def solved(self) -> Solved:
        """The contact problem assembled and solved."""
        return solve_lines(self.scene, self.lines, self.weight)


@dataclass(frozen=True)
class Trials:
    """A scene on few and on more of its ``total`` phases."""

    short: Trial
    long: Trial
    total: int

    def at_all(self, few: float, many: float) -> float:
        """A cost at all phases from those of both trials."""
        return extrapolated(few, many, len(self.short.weight), len(self.long.weight), self.total)


def first_trial(scene: Scene, number: int) -> Trial:
    """A trial of the fewest phases, of a pair that no effect has set up anything for, unless that is kept on disk."""
    if not any(effect.preparation(scene.pair, scene.effects_by_name) is not None for effect in scene.effects):
        scene = unseen(scene, number)
    return _trial(scene, len(mesh_phases(scene)[0]), SHORT)


def trials(short: Trial, seconds: float, total: int) -> Trials:
    """A longer trial beside a short one that takes so many ``seconds``; ``total`` phases are predicted."""
    count = min(LONG, int(len(short.weight) * LONGEST / max(seconds, 1e-9)))
    positions = len(mesh_phases(short.scene)[0])
    return Trials(short, _trial(short.scene, positions, max(count, 2 * len(short.weight))), total)


def _trial(scene: Scene, positions: int, count: int) -> Trial:
    """The scene, of so many ``positions``, at ``count`` of them or fewer: on equal panels where it has Gauss panels."""
    size = scene.resolution.panel_size or 1
    panels = min(max(count // size, 1), positions // size)
    return Trial(scene, scene_lines(scene, gauss_phases(np.arange(panels) / panels, size)[0]))


def spent(work: Callable[[], A]) -> tuple[A, float]:
    """Answer of ``work`` and its processor time [s], the lesser of two where it is quick."""
    answer, seconds = timed_once(work)
    return answer, min(seconds, timed_once(work)[1]) if seconds < QUICK else seconds


def timed_once(work: Callable[[], A]) -> tuple[A, float]:
    """Answer of ``work`` and its processor time, of this thread [s]."""
    start = time.thread_time()
    return work(), time.thread_time() - start


def extrapolated(few: float, many: float, short: int, long: int, total: int) -> float:
    """Cost at ``total`` phases from those at ``short`` and ``long``: a constant and an amount for each phase."""
    if long >= total or short == long:
        return many * (total / long if short == long < total else 1.0)
    return many + max(many - few, 0.0) / (long - short) * (total - long)
