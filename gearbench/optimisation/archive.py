"""All designs a search has asked for, each different gear once, and how the search went."""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from gearbench.optimisation.front import hypervolume, non_dominated
from gearbench.optimisation.problem import Evaluation, gear_key
from gearbench.optimisation.study import Design, OptimisationStudy

#: The reference point of the hypervolume, over the worst objectives of the first feasible designs.
MARGIN = 1.1
#: Gears whose keys are kept.
KEYS = 10_000


class Archive:
    """Designs numbered from 0 in the order they were first asked for, their results, and the history of the search.

    A design takes 8 bytes a number and about 200 more: a million of them 0.4 GB.

    Parameters
    ----------
    study
        The study.

    Attributes
    ----------
    asked
        Numbers of the designs that each generation asked for, (member,).
    evaluated, feasible_found, hypervolumes
        For each generation: designs not known before, feasible ones known so far, share of the box below
        ``reference_point`` that they dominate.
    front, front_objectives
        Numbers of the designs that no other dominates, and their objectives, (design, objective).
    responses
        By the number of a design of the front its responses to all error samples, (response, sample), where designs
        race; those of designs read from disk are unknown at first.
    """

    def __init__(self, study: OptimisationStudy) -> None:
        self.study = study
        self.asked: list[NDArray] = []
        self.evaluated: list[int] = []
        self.feasible_found: list[int] = []
        self.hypervolumes: list[float] = []
        self.front: list[int] = []
        self.front_objectives: NDArray = np.empty((0, len(study.objectives)))
        self.reference_point: NDArray = np.full(len(study.objectives), np.nan)
        self.responses: dict[int, NDArray] = {}
        self._key = lru_cache(maxsize=KEYS)(partial(gear_key, study))
        self._number: dict[bytes, int] = {}
        self._codes, self._known, self._samples, self._first = array("d"), array("d"), array("q"), array("q")
        self._reasons: list[str] = []

    def __len__(self) -> int:
        return len(self._reasons)

    def numbers(self, designs: Sequence[Design]) -> NDArray:
        """Numbers of known designs."""
        return np.array([self._number[self._key(design)] for design in designs], dtype="int64")

    def unknown(self, designs: Sequence[Design]) -> list[Design]:
        """Designs without a result, each different gear once."""
        found: dict[bytes, Design] = {}
        for design in designs:
            found.setdefault(self._key(design), design)
        return [design for key, design in found.items() if key not in self._number]

    def add(self, designs: Sequence[Design], new: Mapping[Design, Evaluation]) -> list[Evaluation]:
        """Add a generation; ``new`` holds the results of the unknown designs. Returns the results of all of it."""
        before, unknown, whole = len(self), self.unknown(designs), {}
        for design in unknown:
            result = new[design]
            if result.feasible and result.samples == self.study.robustness.samples:
                whole[len(self)] = result
            self._number[self._key(design)] = len(self)
            self._codes.extend(design)
            self._known.extend((result.violation, *result.constraints, *result.statistics))
            self._reasons.append(result.reason)
            self._samples.append(result.samples)
            self._first.append(len(self.asked) + 1)
        self.asked.append(self.numbers(designs))
        self.evaluated.append(len(self) - before)
        feasible = sum(new[design].feasible for design in unknown)
        self.feasible_found.append(feasible + (self.feasible_found[-1] if self.feasible_found else 0))
        self._update_front(whole)
        return [self.result(number) for number in self.asked[-1]]

    def design(self, number: int) -> Design:
        """The design of a number, as it was first asked for."""
        count = len(self.study.variables)
        codes = self._codes[number * count : (number + 1) * count]
        return tuple(x if v.kind == "real" else int(x) for v, x in zip(self.study.variables, codes, strict=True))

    def result(self, number: int) -> Evaluation:
        """The result of a number, without responses."""
        limits = 1 + len(self.study.constraints)
        count = limits + len(self.study.statistics)
        violation, *values = self._known[number * count : (number + 1) * count]
        return Evaluation(
            violation=violation,
            reason=self._reasons[number],
            constraints=tuple(values[: limits - 1]),
            statistics=tuple(values[limits - 1 :]),
            samples=self._samples[number],
        )

    @property
    def first_generations(self) -> NDArray:
        """The generation that asked for each design first, (design,)."""
        return np.array(self._first, dtype="int64")

    def _update_front(self, feasible: Mapping[int, Evaluation]) -> None:
        """Take feasible designs into account."""
        candidates = [*self.front, *feasible]
        if not candidates:
            self.hypervolumes.append(0.0)
            return
        found = np.array([result.objectives(self.study) for result in feasible.values()])
        F = np.concatenate([self.front_objectives, found.reshape(len(feasible), len(self.study.objectives))])
        if np.isnan(self.reference_point).any():
            self.reference_point = MARGIN * F.max(axis=0)
        keep = non_dominated(F)
        self.front = [i for i, kept in zip(candidates, keep, strict=True) if kept]
        self.front_objectives = F[keep]
        self.hypervolumes.append(hypervolume(F[keep] / self.reference_point))
        new = {number: result.values for number, result in feasible.items() if result.values is not None}
        self.responses = {i: values for i, values in (self.responses | new).items() if i in set(self.front)}
