"""Groups of scenes that share contact lines and compliance, solved one load after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.accuracy.measure import MEASURED, covered
from gearbench.contact.loads import stacked
from gearbench.contact.problem import ContactSolution
from gearbench.robustness.adaptive import LEFT
from gearbench.robustness.dataset import robust_dataset
from gearbench.robustness.montecarlo import respond
from gearbench.scene import Scene
from gearbench.solution import columns, dataset
from gearbench.sweeps.ragged import ragged
from gearbench.sweeps.shared import Assembled, Shared, phases_follow
from gearbench.sweeps.together import solve_together

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.accuracy.choose import Choice

#: The dimension of the loads of a group, and its unit.
LOAD, UNIT = "torque", "N·m"


@dataclass(kw_only=True)
class Solver:
    """Solves groups of scenes, see ``sweeps.shared.under_loads``.

    Parameters
    ----------
    outputs
        Of ``simulate``; with samples, responses that get statistics.
    draws
        Number of samples, seed and sampler; empty: none.
    threads
        Number of threads.
    shared
        What the groups share.
    """

    outputs: Sequence[str]
    draws: dict[str, Any]
    threads: int
    shared: Shared = field(default_factory=Shared)
    #: Scenes solved so far, and the settings chosen for groups.
    done: int = 0
    _choices: list[Choice] = field(default_factory=list)

    def solve(self, group: Sequence[Scene]) -> Iterator[Callable[[], xr.Dataset]]:
        """Solve one scene of ``group`` after the other; each time what makes the Dataset of all until then.

        It is that of ``simulate``, or with samples of ``robust``, along ``LOAD``.
        """
        for each in self._sampled(group) if self.draws else self._solved(group):
            self.done += 1
            yield each

    @property
    def attrs(self) -> dict[str, Any]:
        """Settings chosen for an accuracy, as attributes of a Dataset."""
        if not self._choices:
            return {}
        found = [choice.attrs for choice in self._choices]
        worst = max(found, key=lambda attrs: attrs["accuracy_estimated"])
        settings = dict.fromkeys(attrs["accuracy_settings"] for attrs in found)
        sums = {name: sum(attrs[name] for attrs in found) for name in ("accuracy_trials", "accuracy_seconds")}
        return worst | {"accuracy_settings": "; ".join(settings)} | sums

    def _solved(self, group: Sequence[Scene]) -> Iterator[Callable[[], xr.Dataset]]:
        if phases_follow(group[0]) and len(group) > 1:
            yield from self._together(group)
            return
        found: list[ContactSolution] = []
        at, solutions = self._solutions(group)
        for solution in solutions:
            found.append(solution)
            yield partial(self._dataset, at, tuple(found), [scene.load.torque for scene in group[: len(found)]])

    def _together(self, group: Sequence[Scene]) -> Iterator[Callable[[], xr.Dataset]]:
        parts = []
        for solved in solve_together(group):
            parts.append((*columns(solved, self.outputs), solved.solution.polished))
            torque = [scene.load.torque for scene in group[: len(parts)]]
            yield partial(ragged, tuple(parts), LOAD, (np.array(torque), {"units": UNIT}), group[0])

    def _dataset(self, at: Assembled, found: Sequence[ContactSolution], torque: list[float]) -> xr.Dataset:
        loads = {LOAD: (np.array(torque), {"units": UNIT})}
        return dataset(at.solved(stacked(found)), self.outputs, 0.0, before=loads)

    def _solutions(self, group: Sequence[Scene]) -> tuple[Assembled, Iterator[ContactSolution]]:
        """Problem of the group, and its solutions; at the resolution that an accuracy asks for."""
        if group[0].resolution.accuracy is None:
            return self.shared.solutions(group, self.threads)
        from gearbench.accuracy.choose import choose

        def run(scene: Scene) -> tuple[Assembled, list[ContactSolution]]:
            at, solutions = self.shared.solutions([scene.under(each.load) for each in group], self.threads)
            return at, list(solutions)

        choice = choose(group[0], run, _numbers, left=LEFT)
        self._choices.append(choice)
        at, found = choice.run
        return at, iter(found)

    def _sampled(self, group: Sequence[Scene]) -> Iterator[Callable[[], xr.Dataset]]:
        at, parts, how = self.shared.assembled(group[0], sampled=True), [], self.draws
        names = tuple(dict.fromkeys((*MEASURED, *self.outputs)))
        for scene in group:
            problem = at.robust(scene)
            errors = problem.draw(how["samples"], how["seed"], how["sampler"])
            answers, complete = respond(problem, errors, self.threads, names=names)
            if not complete:
                raise KeyboardInterrupt
            own = {"sampler": how["sampler"], "seed": how["seed"], "complete": True, "wall_time": 0.0}
            made = robust_dataset(problem, errors, answers, more=self.outputs, **own)
            parts.append(made.drop_vars("error"))
            yield partial(_side_by_side, tuple(parts))


def _numbers(run: tuple[Assembled, list[ContactSolution]]) -> NDArray:
    """The numbers that an accuracy covers, (load, number)."""
    at, found = run
    return np.moveaxis(covered(at.solved(stacked(found)).cycle), 0, -1)


def _side_by_side(parts: Sequence[xr.Dataset]) -> xr.Dataset:
    import xarray as xr

    return xr.concat(parts, LOAD, data_vars="all", coords="minimal", compat="override", combine_attrs="override")
