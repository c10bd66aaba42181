"""Choose the resolution for an accuracy: settings known to leave about such an error, one run, coarser companions.

``AT_PERCENT`` says what errors settings left on gears in use. The scene runs at those for its accuracy, and with fewer
segments and Gauss points: the difference of the answers bounds their error, and what it blames is raised. Solid teeth
are one rung lower meanwhile, which takes less time. What these segments and Gauss points leave hardly depends on the
teeth: with them the order climbs, rung by rung, each dearer by a half and more, so that all of them take three times
the last as a rule. The difference between the last two orders bounds the error of the higher one by the order of
convergence that the singular root leaves. The last run is the result.

The search ends where the finest teeth are expected to leave too much, after its time,
or where the next run needs more memory than there may be, and says what it has reached.
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

#: The answer of a run.
R = TypeVar("R")

#: Shares of the budget, where a scene has them: of finite elements, and of segments and Gauss points beside the order
#: of solid teeth, whose squares add up.
FE_SHARE, REST_SHARE = 0.5, 0.6
#: Segments, Gauss points and rung of the ladder of solid orders for an error of 1 %, and what each factor of ten adds:
#: the segments are multiplied, as errors fall like their power −2.5; least of each.
AT_PERCENT, A_DECADE, LEAST = (16, 6, 3), (2.5, 4, 3), (8, 3, 1)
#: Factor on the first number of segments with solid teeth: their rounds cost more, and this saves one.
BESIDE_SOLID = 1.5
#: Segments and Gauss points of the companion, as shares, and how many rungs lower the teeth of the first runs are.
COARSER, LOWER = (0.6, 0.7), 1
#: Error over the difference to the companion of single runs: order 2 in the segments.
LEFT = 0.6
#: The same of peak-to-peak values over that of other numbers: they end where the stiffness rises steeply, at births.
PEAKS = 2.0
#: Order of convergence of solid teeth in the number of functions along the height, up to the second number of them and
#: beyond: the root is singular, and digits that are left wait for the other directions too.
SOLID_CONVERGENCE, COARSE_HEIGHT, FINE_CONVERGENCE = 2.2, 11, 1.5
#: Factor on the extrapolated error of the higher of two orders: their difference is sometimes small by chance.
CHANCE = 1.4
#: Rounds of settings that are tried, and by how much the segments are raised at most in one.
ROUNDS, MOST = 6, 3.0
#: Segments and Gauss points are both raised where their contributions differ by less than this factor.
ALIKE = 2.0
#: Time after which a search begins no other run [s].
SEARCH_TIME = 300.0
#: Accuracies of finite elements that their meshes can be refined to, and the one they have by default.
FE_RANGE, FE_DEFAULT = (1e-4, 0.1), 0.01


@dataclass(frozen=True, kw_only=True)
class Choice(Generic[R]):
    """Settings chosen for an accuracy.

    Parameters
    ----------
    scene
        The scene with the settings written into it.
    run
        Answer of its run.
    requested
        Relative accuracy asked for.
    errors
        Estimated relative error of each number, (number,).
    names
        Of the numbers.
    settings
        The settings chosen, in words by setting.
    trials, seconds
        Number of runs, and time of all but the one that is the answer [s].
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
        """Largest of the estimated errors."""
        return float(self.errors.max())

    @property
    def attrs(self) -> dict[str, Any]:
        """Attributes of a Dataset."""
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
    left: float = LEFT,
) -> Choice[R]:
    """Resolution of ``scene`` whose estimated error is within its accuracy, and the answer of its run.

    Parameters
    ----------
    scene
        With ``resolution.accuracy``.
    run, numbers
        Runs a scene of given resolution; the numbers of its answer that are to be accurate, the first of ``COVERED``,
        of one cycle or of many (…, number).
    share
        Share of the accuracy that may be spent; the rest belongs to the caller's choices.
    left
        Error over the difference to an answer with 0.6 of the segments and 0.7 of the Gauss points; 1.5 where errors
        fall like 1/n only.

    Raises
    ------
    InputError
        If the scene asks for no accuracy, or it cannot be met.
    """
    requested = scene.resolution.accuracy
    if requested is None:
        raise InputError("resolution.accuracy", "missing", "the resolution is chosen for it")
    start, budget, settings = time.perf_counter(), share * requested, {}
    scene, meshed = _finite_elements(with_resolution(scene), budget)
    if meshed:
        settings["tooth_bending.accuracy"] = label(meshed)
    search = _Search(run=run, numbers=numbers, scene=scene, requested=requested, left=left)
    at, errors, answer = search.search(budget - meshed)
    return Choice(
        scene=search.scene_at(at),
        run=answer,
        requested=requested,
        errors=errors + meshed,
        names=COVERED[: len(errors)],
        settings=settings | search.words(at),
        trials=len(search.values),
        seconds=time.perf_counter() - start - search.seconds[at],
    )


def first_settings(scene: Scene) -> Scene:
    """``scene``, which asks for an accuracy, with the settings that the search for them begins with."""
    requested = scene.resolution.accuracy
    assert requested is not None
    scene, meshed = _finite_elements(with_resolution(scene), requested)
    search = _Search(run=lambda _: np.empty(0), numbers=np.asarray, scene=scene, requested=requested, left=LEFT)
    return search.scene_at(search.first(requested - meshed))


def _finite_elements(scene: Scene, budget: float) -> tuple[Scene, float]:
    """The scene with finite elements of the accuracy they must have, unless it gives another, and their share."""
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
    """Segments, Gauss points, and rung of the ladder of solid orders (0 where the scene has none)."""

    n: int
    g: int
    order: int = 0


@dataclass(frozen=True, kw_only=True)
class _Search(Generic[R]):
    """Answers of a scene by settings."""

    run: Callable[[Scene], R]
    numbers: Callable[[R], NDArray]
    scene: Scene
    requested: float
    left: float
    values: dict[_At, NDArray] = field(default_factory=dict)
    seconds: dict[_At, float] = field(default_factory=dict)
    reached: dict[_At, float] = field(default_factory=dict)

    @property
    def orders(self) -> tuple[tuple[int, int, int], ...]:
        return SOLID_ORDER.levels(self.scene)

    @property
    def most(self) -> _At:
        """The finest settings."""
        n, g = (setting.levels(self.scene)[-1] for setting in (SEGMENTS, GAUSS_POINTS))
        return _At(n=n, g=g, order=max(0, len(self.orders) - 1))

    def scene_at(self, at: _At) -> Scene:
        scene = with_resolution(self.scene, segments=at.n, gauss_points=at.g)
        return with_order(scene, self.orders[at.order]) if self.orders else scene

    def words(self, at: _At) -> dict[str, str]:
        order = {"order": label(self.orders[at.order])} if self.orders else {}
        return order | {"segments": label(at.n), "gauss_points": label(at.g)}

    def first(self, budget: float) -> _At:
        """Settings that left an error of the ``budget`` on gears in use."""
        decades = math.log10(0.01 / budget)
        n = AT_PERCENT[0] * A_DECADE[0] ** decades * (BESIDE_SOLID if self.orders else 1)
        g, order = (at + more * decades for at, more in zip(AT_PERCENT[1:], A_DECADE[1:], strict=True))
        n, g, order = (max(least, round(at)) for least, at in zip(LEAST, (n, g, order), strict=True))
        most = self.most
        return _At(n=min(n, most.n), g=min(g, most.g), order=min(order, most.order))

    def search(self, budget: float) -> tuple[_At, NDArray, R]:
        """Settings whose error is within ``budget``, the error of each number, and the answer."""
        first = self.first(budget)
        if not self.orders:
            return self._resolved(first, budget)
        lower = replace(first, order=max(0, first.order - LOWER))
        at, rest, _ = self._resolved(lower, REST_SHARE * budget)
        return self._climbed(at, first.order, rest, budget)

    def _resolved(self, at: _At, budget: float) -> tuple[_At, NDArray, R]:
        """Search over segments and Gauss points alone, for the error that these leave; see ``search``."""
        for _ in range(ROUNDS):
            answer = self._solve(at)
            errors = self.left * largest_errors(self(self._coarse(at)), self(at))
            errors[[name.endswith("peak_to_peak") for name in COVERED[: errors.size]]] *= PEAKS
            error = float(errors.max())
            if not self.orders:
                self.reached[at] = error
            if error <= budget:
                return at, errors, answer
            del answer  # may be large
            finer, most = self._finer(at, error / budget), self.most
            finer = replace(finer, n=min(most.n, finer.n), g=min(most.g, finer.g))
            if finer == at:
                raise self._stopped("nothing finer can be chosen")
            at = finer
        raise self._stopped(f"{ROUNDS} rounds do not suffice")

    def _climbed(self, lower: _At, order: int, rest: NDArray, budget: float) -> tuple[_At, NDArray, R]:
        """Search over the order of solid teeth, from the answer with ``lower`` orders; ``rest`` are other errors.

        Errors of the order, with which teeth are too stiff, and the rest have nothing to do with each other: their
        squares add up.
        """
        while True:
            at = replace(lower, order=order)
            answer = self._solve(at)
            falls = self._falls(lower.order, order)
            by_order = CHANCE * falls / (1 - falls) * largest_errors(self(lower), self(at))
            errors = np.hypot(rest, by_order)
            self.reached[at] = float(errors.max())
            if self.reached[at] <= budget:
                return at, errors, answer
            finest = float((self._falls(order, self.most.order) * by_order / CHANCE).max())
            if order == self.most.order or finest > budget:
                raise self._stopped(f"solid teeth of the highest order leave about {100 * finest:.2g} %")
            del answer  # may be large
            lower, order = at, order + 1

    def _falls(self, lower: int, order: int) -> float:
        """Error of one order of solid teeth over that of a lower one."""
        low, high = (self.orders[each][1] for each in (lower, order))
        return (high / low) ** -(SOLID_CONVERGENCE if high <= COARSE_HEIGHT else FINE_CONVERGENCE)

    def _coarse(self, at: _At) -> _At:
        """Settings of the companion."""
        return replace(at, n=_coarser(at.n, 0), g=_coarser(at.g, 1))

    def _finer(self, at: _At, excess: float) -> _At:
        """``at`` with more of what contributes more, segments or Gauss points, for an error so much less."""
        between = replace(at, g=_coarser(at.g, 1))
        by_phases = float(largest_errors(self(between), self(at)).max())
        by_segments = float(largest_errors(self(self._coarse(at)), self(between)).max())
        factor = min(max(1.4, excess ** (1 / 2)), MOST)
        n = math.ceil(factor * at.n) if by_segments * ALIKE >= by_phases else at.n
        return replace(
            at, n=n, g=at.g + math.ceil(at.g * (factor - 1) / 2) if by_phases * ALIKE >= by_segments else at.g
        )

    def __call__(self, at: _At) -> NDArray:
        if at not in self.values:
            self._solve(at)
        return self.values[at]

    def _solve(self, at: _At) -> R:
        if sum(self.seconds.values()) > SEARCH_TIME:
            raise self._stopped(f"{SEARCH_TIME:.0f} s do not suffice")
        start = time.perf_counter()
        try:
            answer = self.run(self.scene_at(at))
        except MemoryBudgetError as error:
            raise self._stopped(error.allowed) from None
        self.values[at] = self.numbers(answer)
        self.seconds[at] = time.perf_counter() - start
        return answer

    def _stopped(self, why: str) -> InputError:
        """The search has come to its end: why, and what it has reached."""
        if not self.reached:
            return InputError("accuracy", self.requested, f"the search cannot begin: {why}")
        at, error = min(self.reached.items(), key=lambda item: item[1])
        reached = f"the search ended at an error of about {100 * error:.2g} % with {_listed(self.words(at))}"
        return InputError("accuracy", self.requested, f"{reached}, because {why}: ask for less, or give these settings")


def _coarser(level: int, setting: int) -> int:
    """Segments (0) or Gauss points (1) of a companion."""
    return max(1, round(COARSER[setting] * level))


def _listed(settings: dict[str, str]) -> str:
    return ", ".join(f"{name} = {value}" for name, value in settings.items())
