"""All designs a search has asked for, each known once, and how the search went."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.optimisation.front import hypervolume, non_dominated
from gearbench.optimisation.problem import Evaluation, assignments
from gearbench.optimisation.study import Design, OptimisationStudy

#: The reference point of the hypervolume, over the worst objectives of the first feasible designs.
MARGIN = 1.1


@dataclass(kw_only=True)
class Archive:
    """Designs in the order they were first asked for, their results, and the history of the search.

    Parameters
    ----------
    study
        The study.
    designs, results, first
        Each different gear once, its result, and the generation it was first asked for.
    asked
        For each generation the numbers in ``designs`` of those asked for.
    evaluated, feasible_found, hypervolumes
        For each generation: designs not known before, feasible ones known so far, share of the box below
        ``reference_point`` that they dominate.
    front
        Numbers of the designs that no other dominates.
    values
        Responses of designs of the front to all error samples, (response, sample), by number; where the study races.
    """

    study: OptimisationStudy
    designs: list[Design] = field(default_factory=list)
    results: list[Evaluation] = field(default_factory=list)
    first: list[int] = field(default_factory=list)
    asked: list[list[int]] = field(default_factory=list)
    evaluated: list[int] = field(default_factory=list)
    feasible_found: list[int] = field(default_factory=list)
    hypervolumes: list[float] = field(default_factory=list)
    front: list[int] = field(default_factory=list)
    values: dict[int, NDArray] = field(default_factory=dict)
    _numbers: dict[Hashable, int] = field(default_factory=dict)
    _reference: NDArray | None = None

    def numbers(self, designs: Sequence[Design]) -> list[int]:
        """Numbers of known designs."""
        return [self._numbers[assignments(self.study, design)] for design in designs]

    def unknown(self, designs: Sequence[Design]) -> list[Design]:
        """Those of ``designs`` that have no result yet, each different gear once."""
        found: dict[Hashable, Design] = {}
        for design in designs:
            found.setdefault(assignments(self.study, design), design)
        return [design for gear, design in found.items() if gear not in self._numbers]

    def add(self, designs: Sequence[Design], new: Mapping[Design, Evaluation]) -> list[Evaluation]:
        """Add a generation; ``new`` holds the results of the unknown designs. Returns the results of all of it."""
        generation, before = len(self.asked) + 1, len(self.designs)
        for design in self.unknown(designs):
            self._numbers[assignments(self.study, design)] = len(self.designs)
            if (values := new[design].values) is not None:
                self.values[len(self.designs)] = values
            self.designs.append(design)
            self.results.append(replace(new[design], values=None))
            self.first.append(generation)
        numbers = self.numbers(designs)
        self.asked.append(numbers)
        self.evaluated.append(len(self.designs) - before)
        feasible = [i for i in range(before, len(self.designs)) if self.results[i].feasible]
        self.feasible_found.append(len(feasible) + (self.feasible_found[-1] if self.feasible_found else 0))
        self._update_front([i for i in feasible if self.results[i].samples == self.study.robustness.samples])
        self.values = {i: self.values[i] for i in self.front if i in self.values}
        return [self.results[number] for number in numbers]

    @property
    def reference_point(self) -> NDArray:
        """Reference point of the hypervolume, (objective,); NaN before there is a feasible design."""
        return np.full(len(self.study.objectives), np.nan) if self._reference is None else self._reference

    def _update_front(self, feasible: list[int]) -> None:
        candidates = [*self.front, *feasible]
        if not candidates:
            self.hypervolumes.append(0.0)
            return
        F = np.array([self.results[i].objectives(self.study) for i in candidates])
        if self._reference is None:
            self._reference = MARGIN * F.max(axis=0)
        keep = non_dominated(F)
        self.front = [i for i, kept in zip(candidates, keep, strict=True) if kept]
        self.hypervolumes.append(hypervolume(F[keep] / self._reference))
