"""Archive of a search: each gear set that it asked for, stored once, the front, and the history of generations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.optimisation.front import hypervolume, non_dominated
from gearbench.optimisation.problem import Evaluation, assignments
from gearbench.optimisation.study import Design, OptimisationStudy

#: Ratio of the hypervolume's reference point to the worst objectives of the first generation with feasible designs.
MARGIN = 1.1


class Archive:
    """Designs, numbered from 0 in the order of their first request, with their results and the history of the search.

    Parameters
    ----------
    study
        The study.

    Attributes
    ----------
    designs, results, first_generations
        Lists indexed by design number: the design, its result, and the generation that first asked for it (from 1).
    asked
        Numbers of the designs that the search asked for, one array (member,) per generation.
    evaluated, feasible_found, hypervolumes
        Lists over the generations: number of newly evaluated designs, number of feasible designs so far, and the
        share of the box from 0 to ``reference_point`` that the front dominates.
    reference_point
        Corner of this box, (objective,), fixed by the first generation with feasible designs; NaN before.
    front, front_objectives
        Numbers of the Pareto-optimal designs, and their objectives, (design, objective).
    responses
        Responses of the designs on the front to all error samples, (response, sample), by design number. Filled only
        with ``racing``; designs read from disk have none until they are evaluated again.
    """

    def __init__(self, study: OptimisationStudy) -> None:
        self.study = study
        self.designs: list[Design] = []
        self.results: list[Evaluation] = []
        self.first_generations: list[int] = []
        self.asked: list[NDArray] = []
        self.evaluated: list[int] = []
        self.feasible_found: list[int] = []
        self.hypervolumes: list[float] = []
        self.front: list[int] = []
        self.front_objectives: NDArray = np.empty((0, len(study.objectives)))
        self.reference_point: NDArray = np.full(len(study.objectives), np.nan)
        self.responses: dict[int, NDArray] = {}
        self._number: dict[Any, int] = {}

    def _gear_set(self, design: Design) -> Any:
        """Keys and values that describe the gear set of a design; different codes may describe the same gear set."""
        return assignments(self.study, design)

    def numbers(self, designs: Sequence[Design]) -> NDArray:
        """Numbers of known designs."""
        return np.array([self._number[self._gear_set(design)] for design in designs], dtype="int64")

    def unknown(self, designs: Sequence[Design]) -> list[Design]:
        """Designs whose gear set has no result yet; of several designs for the same gear set, only the first."""
        gear_sets: dict[Any, Design] = {}
        for design in designs:
            gear_sets.setdefault(self._gear_set(design), design)
        return [design for gear_set, design in gear_sets.items() if gear_set not in self._number]

    def add(self, designs: Sequence[Design], new: Mapping[Design, Evaluation]) -> list[Evaluation]:
        """Add a generation and return the results of all its designs; ``new`` holds results of the unknown ones."""
        first_new, unknown = len(self.designs), self.unknown(designs)
        for design in unknown:
            self._number[self._gear_set(design)] = len(self.designs)
            self.designs.append(design)
            self.results.append(replace(new[design], values=None))  # samples are kept for the front only
        self.first_generations += [len(self.asked) + 1] * len(unknown)
        self.asked.append(self.numbers(designs))
        self.evaluated.append(len(unknown))
        feasible_before = (self.feasible_found or [0])[-1]
        self.feasible_found.append(feasible_before + sum(new[design].feasible for design in unknown))
        self._update_front({first_new + i: new[design] for i, design in enumerate(unknown)})
        return [self.results[number] for number in self.asked[-1]]

    def _update_front(self, new: Mapping[int, Evaluation]) -> None:
        """Update front and hypervolume with the new designs that are feasible and were computed on all samples."""
        samples = self.study.robustness.samples
        new = {number: result for number, result in new.items() if result.feasible and result.samples == samples}
        candidates = [*self.front, *new]
        if not candidates:
            self.hypervolumes.append(0.0)
            return
        added = np.array([result.objectives(self.study) for result in new.values()])
        F = np.concatenate([self.front_objectives, added.reshape(len(new), len(self.study.objectives))])
        if np.isnan(self.reference_point).any():
            self.reference_point = MARGIN * F.max(axis=0)
        on_front = non_dominated(F)
        self.front = [i for i, is_on_front in zip(candidates, on_front, strict=True) if is_on_front]
        self.front_objectives = F[on_front]
        self.hypervolumes.append(hypervolume(F[on_front] / self.reference_point))
        self.responses |= {number: result.values for number, result in new.items() if result.values is not None}
        self.responses = {i: self.responses[i] for i in self.front if i in self.responses}
