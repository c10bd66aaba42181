"""Choose the resolution for a requested accuracy.

The search starts at settings that left about this error on gears in use (``AT_PERCENT``). The scene runs at these
settings and again with fewer segments and Gauss points (the companion run). The difference of both runs bounds the
discretisation error; the setting that contributes most is refined until the bound is met.

Solid teeth need one more step, because the order of their functions is a setting too. The first step runs them one rung
lower on the ladder of orders, which saves time: the error of segments and Gauss points hardly depends on the teeth.
Then the order climbs rung by rung. A rung takes at least 1.5 times as long as the one before, so all rungs together
usually take three times the last. The difference of the last two orders, extrapolated with the convergence order that
the singular root allows, bounds the error of the higher one. The last run is the result.

The search fails, and reports the accuracy it reached, if the finest teeth are expected to leave too large an error, if
it runs out of time, or if the next run needs more memory than the budget allows.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from gearbench.accuracy.measure import COVERED, largest_errors
from gearbench.accuracy.settings import (
    GAUSS_POINTS,
    SEGMENTS,
    SOLID_ORDER,
    label,
    with_effect,
    with_order,
    with_resolution,
)
from gearbench.budget import MemoryBudgetError
from gearbench.effects.tooth_bending import tooth_bending
from gearbench.errors import InputError
from gearbench.scene import Scene

#: Type of the answer of a run.
R = TypeVar("R")

#: FE_SHARE: share of the error budget for finite elements. REST_SHARE: share for segments and Gauss points if the order
#: of solid teeth needs the rest; the squares of both errors add up.
FE_SHARE, REST_SHARE = 0.5, 0.6
#: Segments, Gauss points and rung of the ladder of solid orders. AT_PERCENT: for an error of 1 %. A_DECADE: for a
#: tenfold smaller error, segments are multiplied by 2.5 and the others increased by 4 and 3. LEAST: smallest values.
AT_PERCENT, A_DECADE, LEAST = (16, 6, 3), (2.5, 4, 3), (8, 3, 1)
#: Factor on the first number of segments with solid teeth, whose rounds are costly: it usually saves one round.
BESIDE_SOLID = 1.5
#: Segments and Gauss points of the companion run, as shares of those of the run; rungs by which the teeth of the first
#: runs are lower.
COARSER, LOWER = (0.6, 0.7), 1
#: Ratio of the error to the difference from the companion run, for convergence of order 2 in the segments.
ERROR_OVER_CHANGE = 0.6
#: Factor on ``ERROR_OVER_CHANGE`` for peak-to-peak values: their extremes lie where the stiffness rises steeply, as a
#: pair takes up its load.
PEAKS = 2.0
#: Convergence order of solid teeth in the number of functions along the height: the first value up to COARSE_HEIGHT
#: functions, the second beyond. The root is singular, and the last digits also depend on the other directions.
SOLID_CONVERGENCE, COARSE_HEIGHT, FINE_CONVERGENCE = 2.2, 11, 1.5
#: Safety factor on the extrapolated error of the order, because the difference of two orders may be small by chance.
CHANCE = 1.4
#: Maximum number of rounds, and largest factor on the segments in one round.
ROUNDS, LARGEST_FACTOR = 6, 3.0
#: Segments and Gauss points are both refined if their error contributions differ by less than this factor.
ALIKE = 2.0
#: Time after which the search begins no further run [s].
SEARCH_TIME = 300.0
#: Range of accuracies that finite element meshes can be refined to, and their default accuracy.
FE_RANGE, FE_DEFAULT = (1e-4, 0.1), 0.01


@dataclass(frozen=True, kw_only=True)
class Choice(Generic[R]):
    """Settings chosen for a requested accuracy.

    Parameters
    ----------
    scene
        The scene with the chosen settings.
    run
        Answer of its run.
    requested
        Requested relative accuracy.
    errors
        Estimated relative errors of the numbers, (number,).
    names
        Names of the numbers.
    settings
        Chosen settings: name → value as text.
    trials, seconds
        Number of runs, and time of all runs but the last, which is the answer [s].
    """

    scene: Scene
    run: R
    requested: float
    errors: NDArray
    names: tuple[str, ...]
    settings: dict[str, str]
    trials: int
    seconds: float

    @property
    def estimated(self) -> float:
        """Largest estimated error."""
        return float(self.errors.max())

    @property
    def attrs(self) -> dict[str, Any]:
        """Attributes for a Dataset."""
        errors = zip(self.names, self.errors, strict=False)
        return {
            "accuracy_requested": self.requested,
            "accuracy_estimated": self.estimated,
            "accuracy_errors": ", ".join(f"{name} = {error:.2g}" for name, error in errors),
            "accuracy_settings": ", ".join(f"{name} = {value}" for name, value in self.settings.items()),
            "accuracy_trials": self.trials,
            "accuracy_seconds": self.seconds,
        }


def choose(
    scene: Scene,
    run: Callable[[Scene], R],
    numbers: Callable[[R], NDArray] = np.asarray,
    *,
    share: float = 1.0,
    error_over_change: float = ERROR_OVER_CHANGE,
) -> Choice[R]:
    """Choose the resolution of ``scene`` for its requested accuracy; the answer of the final run is in the result.

    Parameters
    ----------
    scene
        A scene with ``resolution.accuracy``.
    run, numbers
        Function that runs a scene with a given resolution, and function that takes from its answer the numbers that
        must be accurate: the first entries of ``COVERED``, of one cycle or of many, (…, number).
    share
        Share of the accuracy that may be used here; the caller uses the rest.
    error_over_change
        Ratio of the error to the difference from the companion run, which has 0.6 of the segments and 0.7 of the Gauss
        points; use 1.5 if errors fall only like 1/n.

    Raises
    ------
    InputError
        If the scene does not ask for an accuracy, or the accuracy cannot be met.
    """
    requested = scene.resolution.accuracy
    if requested is None:
        raise InputError("resolution.accuracy", "missing", "is required: the resolution is chosen to meet it")
    start, budget, settings = time.perf_counter(), share * requested, {}
    scene, meshed = _finite_elements(with_resolution(scene), budget)
    if meshed:
        settings["tooth_bending.accuracy"] = label(meshed)
    search = _Search(run=run, numbers=numbers, scene=scene, requested=requested, error_over_change=error_over_change)
    setting, errors, answer = search.search(budget - meshed)
    return Choice(
        scene=search.scene_at(setting),
        run=answer,
        requested=requested,
        errors=errors + meshed,
        names=COVERED[: len(errors)],
        settings=settings | search.words(setting),
        trials=len(search.values),
        seconds=time.perf_counter() - start - search.seconds[setting],
    )


def first_settings(scene: Scene) -> Scene:
    """Replace the requested accuracy of ``scene`` by the settings at which the search starts."""
    requested = scene.resolution.accuracy
    assert requested is not None
    scene, meshed = _finite_elements(with_resolution(scene), requested)
    search = _Search(
        run=lambda _: np.empty(0),
        numbers=np.asarray,
        scene=scene,
        requested=requested,
        error_over_change=ERROR_OVER_CHANGE,
    )
    return search.scene_at(search.first(requested - meshed))


def _finite_elements(scene: Scene, budget: float) -> tuple[Scene, float]:
    """Set the accuracy of finite elements unless the scene gives it; return the scene and its part of the error."""
    meshed = tooth_bending(scene.effects_by_name, "finite_elements")
    if meshed is None:
        return scene, 0.0
    accuracy = meshed.accuracy
    if accuracy == FE_DEFAULT:
        accuracy = float(np.clip(FE_SHARE * budget, *FE_RANGE))
    if accuracy >= budget:
        raise InputError("accuracy", "too small", f"finite elements leave an error of {100 * accuracy:.2g} %")
    return with_effect(scene, "tooth_bending", accuracy=accuracy), accuracy


@dataclass(frozen=True, kw_only=True, order=True)
class _At:
    """Settings of a run: segments n, Gauss points g, and index on the ladder of solid orders (0 for other teeth)."""

    n: int
    g: int
    order: int = 0


@dataclass(frozen=True, kw_only=True)
class _Search(Generic[R]):
    """Search for the settings; keeps numbers, run time and reached error of all runs, by settings."""

    run: Callable[[Scene], R]
    numbers: Callable[[R], NDArray]
    scene: Scene
    requested: float
    error_over_change: float
    values: dict[_At, NDArray] = field(default_factory=dict)
    seconds: dict[_At, float] = field(default_factory=dict)
    reached: dict[_At, float] = field(default_factory=dict)

    @property
    def orders(self) -> tuple[tuple[int, int, int], ...]:
        return SOLID_ORDER.levels(self.scene)

    @property
    def most(self) -> _At:
        """Finest allowed settings."""
        n, g = (setting.levels(self.scene)[-1] for setting in (SEGMENTS, GAUSS_POINTS))
        return _At(n=n, g=g, order=max(0, len(self.orders) - 1))

    def scene_at(self, setting: _At) -> Scene:
        scene = with_resolution(self.scene, segments=setting.n, gauss_points=setting.g)
        return with_order(scene, self.orders[setting.order]) if self.orders else scene

    def words(self, setting: _At) -> dict[str, str]:
        order = {"order": label(self.orders[setting.order])} if self.orders else {}
        return order | {"segments": label(setting.n), "gauss_points": label(setting.g)}

    def first(self, budget: float) -> _At:
        """Initial settings, whose error on gears in use was about ``budget``."""
        decades = math.log10(0.01 / budget)
        n = AT_PERCENT[0] * A_DECADE[0] ** decades * (BESIDE_SOLID if self.orders else 1)
        g, order = (at + more * decades for at, more in zip(AT_PERCENT[1:], A_DECADE[1:], strict=True))
        n, g, order = (max(least, round(at)) for least, at in zip(LEAST, (n, g, order), strict=True))
        most = self.most
        return _At(n=min(n, most.n), g=min(g, most.g), order=min(order, most.order))

    def search(self, budget: float) -> tuple[_At, NDArray, R]:
        """Find settings whose error is within ``budget``; return them, the error of every number, and the answer."""
        first = self.first(budget)
        if not self.orders:
            return self._resolved(first, budget)
        lower = replace(first, order=max(0, first.order - LOWER))
        setting, rest, _ = self._resolved(lower, REST_SHARE * budget)
        return self._climbed(setting, first.order, rest, budget)

    def _resolved(self, setting: _At, budget: float) -> tuple[_At, NDArray, R]:
        """Search over segments and Gauss points only, until their error is within ``budget``; returns as ``search``."""
        for _ in range(ROUNDS):
            answer = self._solve(setting)
            errors = self.error_over_change * largest_errors(self(self._coarse(setting)), self(setting))
            errors[[name.endswith("peak_to_peak") for name in COVERED[: errors.size]]] *= PEAKS
            error = float(errors.max())
            if not self.orders:
                self.reached[setting] = error
            if error <= budget:
                return setting, errors, answer
            del answer  # it may be large
            finer, most = self._finer(setting, error / budget), self.most
            finer = replace(finer, n=min(most.n, finer.n), g=min(most.g, finer.g))
            if finer == setting:
                raise self._stopped("nothing finer can be chosen")
            setting = finer
        raise self._stopped(f"{ROUNDS} rounds do not suffice")

    def _climbed(self, lower: _At, order: int, rest: NDArray, budget: float) -> tuple[_At, NDArray, R]:
        """Search over the order of solid teeth, upwards from the run at ``lower``; ``rest`` holds the other errors.

        The error of the order, which makes teeth too stiff, is independent of the others, so their squares add up.
        """
        while True:
            setting = replace(lower, order=order)
            answer = self._solve(setting)
            falls = self._falls(lower.order, order)
            by_order = CHANCE * falls / (1 - falls) * largest_errors(self(lower), self(setting))
            errors = np.hypot(rest, by_order)
            self.reached[setting] = float(errors.max())
            if self.reached[setting] <= budget:
                return setting, errors, answer
            finest = float((self._falls(order, self.most.order) * by_order / CHANCE).max())
            if order == self.most.order or finest > budget:
                raise self._stopped(f"solid teeth of the highest order leave about {100 * finest:.2g} %")
            del answer  # it may be large
            lower, order = setting, order + 1

    def _falls(self, lower: int, order: int) -> float:
        """Ratio of the error at one order of solid teeth to that at a lower one."""
        low, high = (self.orders[each][1] for each in (lower, order))
        return (high / low) ** -(SOLID_CONVERGENCE if high <= COARSE_HEIGHT else FINE_CONVERGENCE)

    def _coarse(self, setting: _At) -> _At:
        """Settings of the companion run."""
        return replace(setting, n=_coarser(setting.n, 0), g=_coarser(setting.g, 1))

    def _finer(self, setting: _At, excess: float) -> _At:
        """Refine segments, Gauss points or both, whichever contributes more, to divide the error by ``excess``."""
        between = replace(setting, g=_coarser(setting.g, 1))
        by_phases = float(largest_errors(self(between), self(setting)).max())
        by_segments = float(largest_errors(self(self._coarse(setting)), self(between)).max())
        factor = min(max(1.4, excess ** (1 / 2)), LARGEST_FACTOR)
        n = math.ceil(factor * setting.n) if by_segments * ALIKE >= by_phases else setting.n
        return replace(
            setting,
            n=n,
            g=setting.g + math.ceil(setting.g * (factor - 1) / 2) if by_phases * ALIKE >= by_segments else setting.g,
        )

    def __call__(self, setting: _At) -> NDArray:
        if setting not in self.values:
            self._solve(setting)
        return self.values[setting]

    def _solve(self, setting: _At) -> R:
        if sum(self.seconds.values()) > SEARCH_TIME:
            raise self._stopped(f"{SEARCH_TIME:.0f} s do not suffice")
        start = time.perf_counter()
        try:
            answer = self.run(self.scene_at(setting))
        except MemoryBudgetError as error:
            raise self._stopped(error.allowed) from None
        self.values[setting] = self.numbers(answer)
        self.seconds[setting] = time.perf_counter() - start
        return answer

    def _stopped(self, why: str) -> InputError:
        """Error for a search that cannot go on; says why, and the best error it has reached."""
        if not self.reached:
            return InputError("accuracy", self.requested, f"the search cannot begin: {why}")
        setting, error = min(self.reached.items(), key=lambda item: item[1])
        reached = f"the search ended at an error of about {100 * error:.2g} % with {_listed(self.words(setting))}"
        return InputError("accuracy", self.requested, f"{reached}, because {why}: ask for less, or give these settings")


def _coarser(level: int, setting: int) -> int:
    """Segments (``setting`` 0) or Gauss points (1) of the companion run."""
    return max(1, round(COARSER[setting] * level))


def _listed(settings: dict[str, str]) -> str:
    return ", ".join(f"{name} = {value}" for name, value in settings.items())
