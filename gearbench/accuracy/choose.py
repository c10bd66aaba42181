"""Choose the cheapest resolution that meets an accuracy, from the scene's own answers to finer ones.

Segments and Gauss points are turned up, whichever contributes more, from the coarsest levels on, until the answers of
five levels agree: the present one, one and two rungs more segments (twice as many), and the same of Gauss points. Both
gains added are the limit that all trials are held against. The largest difference D of the five to it bounds its error,
if errors fall like 1/n or faster: e(n) − e(2n) ≥ e(2n). The cheapest levels whose difference to it, with D added, is
within the accuracy are chosen. Where contact is lost segment by segment, single answers may agree by chance; that is
why three levels of each knob are compared, not two.

The search ends where the next trial is expected to take it beyond its time, or needs more memory than there may be, and
says what it has reached.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.accuracy.knobs import (
    GAUSS_POINTS,
    SEGMENTS,
    SOLID_ORDER,
    label,
    with_effect,
    with_order,
    with_resolution,
)
from gearbench.accuracy.measure import relative_errors
from gearbench.budget import MemoryBudgetError
from gearbench.effects.tooth_bending import tooth_bending
from gearbench.errors import InputError
from gearbench.scene import Scene

#: A scene → the numbers whose error is meant, see ``gearbench.accuracy.measure``.
Evaluate = Callable[[Scene], NDArray]

#: The numbers that an accuracy is of, said with every result.
COVERS = "mean and RMS over the mesh cycle of transmission_error and mesh_stiffness, over samples their means"
#: Shares of the budget of the dearest parts, where a scene has it: finite elements, and the order of solid teeth.
FE_SHARE, ORDER_SHARE = 0.5, 0.6
#: Rungs of the ladders that make a level about twice as fine, and where the search begins.
DOUBLE, START = 2, 1
#: Both knobs are turned where their contributions differ by less than this factor, by at most that number of rungs.
ALIKE, MOST_RUNGS = 2.0, 4
#: Levels are tried that are guessed to be within so much of the budget, others within this share of the effort so far.
NEAR, EXTRA = 1.5, 0.3
#: Cost of a mesh phase in segments, beside those it has, and of a trial, whatever its settings.
PHASE_COST, TRIAL_COST = 4, 60
#: Time that a search may take [s], and how the time of a trial grows with its cost, at most.
SEARCH_TIME, GROWTH = 300.0, 2.0
#: Order of convergence of solid teeth in the number of functions along the height: the root is singular.
SOLID_CONVERGENCE = 2.0
#: Accuracies of finite elements that their meshes can be refined to, and the one they have by default.
FE_RANGE, FE_DEFAULT = (1e-4, 0.1), 0.01


@dataclass(frozen=True, kw_only=True)
class Choice:
    """Settings chosen for an accuracy.

    Parameters
    ----------
    scene
        The scene with the settings written into it.
    requested, estimated
        Relative accuracy asked for, and the estimated error of these settings.
    settings
        The settings chosen, in words by knob.
    trials
        Number of trial runs.
    """

    scene: Scene
    requested: float
    estimated: float
    settings: dict[str, str]
    trials: int

    @property
    def attrs(self) -> dict[str, Any]:
        """As attributes of a Dataset."""
        chosen = ", ".join(f"{name} = {value}" for name, value in self.settings.items())
        return {
            "accuracy_requested": self.requested,
            "accuracy_estimated": self.estimated,
            "accuracy_covers": COVERS,
            "accuracy_settings": chosen,
            "accuracy_trials": self.trials,
        }


def choose(scene: Scene, evaluate: Evaluate, share: float = 1.0) -> Choice:
    """Cheapest resolution of ``scene`` whose estimated error is within its accuracy.

    Parameters
    ----------
    scene
        With ``resolution.accuracy``.
    evaluate
        Runs a scene of given resolution and returns the numbers that are to be accurate.
    share
        Share of the accuracy that may be spent; the rest belongs to the caller's choices.

    Raises
    ------
    InputError
        If the scene asks for no accuracy, or no level meets it.
    """
    requested = scene.resolution.accuracy
    if requested is None:
        raise InputError("resolution.accuracy", "missing", "the resolution is chosen for it")
    budget, settings = share * requested, {}
    scene, spent = _finite_elements(with_resolution(scene), budget)
    if spent:
        settings["tooth_bending.accuracy"] = label(spent)
    orders, trials = SOLID_ORDER.levels(scene), 0
    if orders:
        k, error, trials = _solid_order(scene, orders, evaluate, ORDER_SHARE * (budget - spent))
        scene, spent, settings["order"] = with_order(scene, orders[k]), spent + error, label(orders[k])
    grid = _Grid(evaluate=evaluate, scene=scene, requested=requested)
    n, g, error = grid.search(budget - spent)
    settings |= {"segments": label(grid.segments[n]), "gauss_points": label(grid.points[g])}
    return Choice(
        scene=grid.scene_at(n, g),
        requested=requested,
        estimated=spent + error,
        settings=settings,
        trials=trials + len(grid.values),
    )


def _finite_elements(scene: Scene, budget: float) -> tuple[Scene, float]:
    """The scene with finite elements of the accuracy they must have, unless it gives another, and their share."""
    meshed = tooth_bending(scene.effects_by_name, "finite_elements")
    if meshed is None:
        return scene, 0.0
    accuracy = meshed.accuracy
    if accuracy == FE_DEFAULT:
        accuracy = float(np.clip(FE_SHARE * budget, *FE_RANGE))
    if accuracy >= budget:
        raise _unmet("finite elements", accuracy)
    return with_effect(scene, "tooth_bending", accuracy=accuracy), accuracy


def _solid_order(scene: Scene, orders: tuple[Any, ...], evaluate: Evaluate, budget: float) -> tuple[int, float, int]:
    """Index of the lowest order of solid teeth within ``budget``, its error, and the number of trials."""

    def values(k: int) -> NDArray:
        return evaluate(with_order(with_resolution(scene, segments=12, gauss_points=3), orders[k]))

    error, here = math.inf, values(START)
    for k in range(START, len(orders) - 1):
        finer = values(k + 1)
        ratio = orders[k][1] / orders[k + 1][1]
        error = float(relative_errors(here, finer).max()) / (1 - ratio**SOLID_CONVERGENCE)
        if error <= budget:
            return k, error, k + 2 - START
        here = finer
    raise _unmet("the order of solid teeth", error)


def _unmet(source: str, error: float) -> InputError:
    return InputError("accuracy", "too small", f"{source} leaves an error of {100 * error:.2g} % at its finest")


@dataclass(frozen=True, kw_only=True)
class _Grid:
    """Answers of a scene on the grid of segments and Gauss points, kept by the indices of the levels."""

    evaluate: Evaluate
    scene: Scene
    requested: float
    values: dict[tuple[int, int], NDArray] = field(default_factory=dict)
    seconds: dict[tuple[int, int], float] = field(default_factory=dict)
    reached: dict[tuple[int, int], float] = field(default_factory=dict)

    @property
    def segments(self) -> tuple[Any, ...]:
        return SEGMENTS.levels(self.scene)

    @property
    def points(self) -> tuple[Any, ...]:
        return GAUSS_POINTS.levels(self.scene)

    def scene_at(self, n: int, g: int) -> Scene:
        return GAUSS_POINTS.with_level(SEGMENTS.with_level(self.scene, self.segments[n]), self.points[g])

    def __call__(self, n: int, g: int) -> NDArray:
        if (n, g) not in self.values:
            if self._expected((n, g)) + sum(self.seconds.values()) > SEARCH_TIME:
                raise self._stopped(f"{SEARCH_TIME:.0f} s do not suffice")
            start = time.perf_counter()
            try:
                self.values[n, g] = self.evaluate(self.scene_at(n, g))
            except MemoryBudgetError as error:
                raise self._stopped(error.allowed) from None
            self.seconds[n, g] = time.perf_counter() - start
        return self.values[n, g]

    def _expected(self, at: tuple[int, int]) -> float:
        """Seconds of a trial, from those of the dearest one so far; the first one prepares teeth and kernels."""
        if len(self.seconds) < 2:
            return 0.0
        last = max(list(self.seconds)[1:], key=self._cost)
        return self.seconds[last] * (self._cost(at) / self._cost(last)) ** GROWTH

    def _stopped(self, why: str) -> InputError:
        """The search has come to the end of its budget: why, and what it has reached."""
        if not self.reached:
            return InputError("accuracy", self.requested, f"the search cannot begin: {why}")
        (n, g), error = min(self.reached.items(), key=lambda item: item[1])
        settings = f"segments = {label(self.segments[n])}, gauss_points = {label(self.points[g])}"
        reached = f"the search ended at an error of about {100 * error:.2g} % with {settings}"
        return InputError("accuracy", self.requested, f"{reached}, because {why}: ask for less, or give these settings")

    def search(self, budget: float) -> tuple[int, int, float]:
        """Indices of segments and Gauss points whose error is within ``budget``, and that error."""
        n = g = START
        last = len(self.segments) - 1 - DOUBLE, len(self.points) - 1 - DOUBLE
        while True:
            by_segments = self.difference((n, g), self(n + DOUBLE, g))
            by_phases = self.difference((n, g), self(n, g + DOUBLE))
            spread = max(by_segments, by_phases)
            self.reached[n, g] = 2 * spread
            if 2 * spread <= budget:
                limit, spread = self._limit(n, g)
                if 2 * spread <= budget:
                    at = self._cheapest((n, g), limit, budget - spread)
                    return *at, spread + self.difference(at, limit)
            up = (
                self._rungs(by_segments, budget) * (by_segments * ALIKE >= by_phases),
                self._rungs(by_phases, budget) * (by_phases * ALIKE >= by_segments),
            )
            # where one knob is at its end, the other may still help
            finer = min(n + up[0], last[0]), min(g + up[1], last[1])
            if finer == (n, g):
                raise _unmet("the resolution", spread)
            n, g = finer

    def _rungs(self, difference: float, budget: float) -> int:
        """Rungs to climb at once: as many as errors of order 2 need for half of their fall."""
        return max(1, min(MOST_RUNGS, math.floor(math.log2(max(difference / budget, 1.0)))))

    def _limit(self, n: int, g: int) -> tuple[NDArray, float]:
        """The reference, and the largest difference of the levels around it.

        Segments and Gauss points are made finer one at a time, and both gains added: the finest level of both together
        would cost as much as all the others.
        """
        limit = self(n + DOUBLE, g) + self(n, g + DOUBLE) - self(n, g)
        around = [(n + i, g) for i in range(DOUBLE + 1)] + [(n, g + i) for i in range(1, DOUBLE + 1)]
        return limit, max(self.difference(at, limit) for at in around)

    def difference(self, at: tuple[int, int], other: NDArray) -> float:
        """Largest relative difference of an answer to another one."""
        return float(relative_errors(self(*at), other).max())

    def _cheapest(self, start: tuple[int, int], limit: NDArray, budget: float) -> tuple[int, int]:
        """The cheapest levels that differ from ``limit`` by no more than ``budget``, in the order of their cost.

        Answers of levels are guessed from those of as many segments and those of as many Gauss points as ``start``,
        both differences to ``start`` added. Levels whose guess is not near are tried only while that takes a small
        part of the effort so far: where contact is lost segment by segment, some of them happen to be good.
        """
        n, g = start
        lines = [(i, g) for i in range(n + DOUBLE + 1)] + [(n, k) for k in range(g + DOUBLE + 1)]
        known = {at: self(*at) for at in lines}
        spare = EXTRA * sum(self._cost(at) for at in self.values)
        for at in sorted(product(range(n + DOUBLE + 1), range(g + DOUBLE + 1)), key=self._cost):
            guess = known[at[0], g] + known[n, at[1]] - known[n, g]
            if at not in self.values and float(relative_errors(guess, limit).max()) > NEAR * budget:
                spare -= self._cost(at)
                if spare < 0:
                    continue
            if self.difference(at, limit) <= budget:
                return at
        return start  # which is within: its difference is part of the spread

    def _cost(self, at: tuple[int, int]) -> float:
        """Cost of a trial: a fixed part, and every phase costs as much as a few segments by itself."""
        return TRIAL_COST + self.points[at[1]] * (PHASE_COST + self.segments[at[0]])
