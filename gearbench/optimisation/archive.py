"""All designs a search has asked for, each known once, and how the search went.

In memory are the numbers and objectives of the front; all else is in a ``Register``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.optimisation.front import hypervolume, non_dominated
from gearbench.optimisation.problem import Evaluation
from gearbench.optimisation.register import Register
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
    asked, evaluated, feasible_found, hypervolumes
        For each generation: designs asked for, those not known before, feasible ones known so far, share of the box
        below ``reference_point`` that they dominate.
    front
        Numbers of the designs that no other dominates.
    front_objectives
        Their objectives, (design, objective).
    """

    study: OptimisationStudy
    asked: list[int] = field(default_factory=list)
    evaluated: list[int] = field(default_factory=list)
    feasible_found: list[int] = field(default_factory=list)
    hypervolumes: list[float] = field(default_factory=list)
    front: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._register = Register(self.study)
        self.front_objectives: NDArray = np.empty((0, len(self.study.objectives)))
        self._reference: NDArray | None = None

    def __len__(self) -> int:
        return len(self._register)

    def numbers(self, designs: Sequence[Design]) -> list[int]:
        """Numbers of known designs."""
        found = [self._register.number(design) for design in designs]
        assert None not in found
        return [number for number in found if number is not None]

    def unknown(self, designs: Sequence[Design]) -> list[Design]:
        """Those of ``designs`` that have no result yet, each different gear once."""
        return self._register.unknown(designs)

    def add(self, designs: Sequence[Design], new: Mapping[Design, Evaluation]) -> list[Evaluation]:
        """Add a generation; ``new`` holds the results of the unknown designs. Returns the results of all of it."""
        generation, before, unknown = len(self.asked) + 1, len(self), self.unknown(designs)
        added = [new[design] for design in unknown]
        self._register.add(generation, unknown, added)
        numbers = self.numbers(designs)
        self._register.note_asked(generation, numbers)
        self.asked.append(len(numbers))
        self.evaluated.append(len(added))
        feasible = {before + i: result for i, result in enumerate(added) if result.feasible}
        self.feasible_found.append(len(feasible) + (self.feasible_found[-1] if self.feasible_found else 0))
        whole = {i: r for i, r in feasible.items() if r.samples == self.study.robustness.samples}
        left = self._update_front(whole)
        self._register.drop_responses(left)
        for number in whole.keys() & set(self.front):
            if (values := whole[number].values) is not None:
                self._register.keep_responses(number, values)
        return [
            replace(added[number - before], values=None) if number >= before else self._register.result(number)
            for number in numbers
        ]

    def design(self, number: int) -> Design:
        """The design of a number."""
        return self._register.design(number)

    def result(self, number: int) -> Evaluation:
        """The result of a number."""
        return self._register.result(number)

    def responses(self, number: int) -> NDArray | None:
        """Responses of a design of the front to all error samples, (response, sample), where they are kept."""
        return self._register.responses(number)

    def keep_responses(self, number: int, values: NDArray) -> None:
        """Keep the responses of a design of the front, as long as it is on it."""
        self._register.keep_responses(number, values)

    def batches(self) -> Iterator[list[tuple[Design, Evaluation, int]]]:
        """All designs in their order, their results and the generations they were first asked for, some at a time."""
        return self._register.batches()

    def asked_numbers(self) -> Iterator[NDArray]:
        """Of each generation the numbers of the designs it asked for, (member,)."""
        return self._register.asked()

    @property
    def reference_point(self) -> NDArray:
        """Reference point of the hypervolume, (objective,); NaN before there is a feasible design."""
        return np.full(len(self.study.objectives), np.nan) if self._reference is None else self._reference

    def _update_front(self, feasible: Mapping[int, Evaluation]) -> list[int]:
        """Take feasible designs into account; the numbers of those that leave the front."""
        candidates = [*self.front, *feasible]
        if not candidates:
            self.hypervolumes.append(0.0)
            return []
        found = np.array([result.objectives(self.study) for result in feasible.values()])
        F = np.concatenate([self.front_objectives, found.reshape(len(feasible), len(self.study.objectives))])
        if self._reference is None:
            self._reference = MARGIN * F.max(axis=0)
        keep = non_dominated(F)
        before = set(self.front)
        self.front = [i for i, kept in zip(candidates, keep, strict=True) if kept]
        self.front_objectives = F[keep]
        self.hypervolumes.append(hypervolume(F[keep] / self._reference))
        return list(before - set(self.front))
