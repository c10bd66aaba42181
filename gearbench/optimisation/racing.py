"""Racing: the evaluation of a design stops as soon as its error samples show that the front beats it.

All designs see the same samples (common random numbers), so the difference of two designs needs far fewer samples than
either value alone. A design is computed on the first n₁ < n₂ < … < N samples. After each stage it is compared with
its incumbents: designs of the front whose N samples are all known. Let y_d be the responses of the design and y_i those
of an incumbent. If an objective is a mean, its difference over all N samples is estimated by the mean of y_d − y_i over
the first n. Its standard error is that of a draw of n from N:

    D̂ = ⟨y_d − y_i⟩_n,   s² = Var_n(y_d − y_i)/n · (1 − n/N).

A standard deviation is linearised: each sample contributes its influence ((y − ȳ)² − σ²)/2σ, and the differences of
these influences are averaged in the same way. The maximum over n samples cannot exceed the maximum over N. Its
difference to the incumbent's maximum over N is therefore a lower bound without statistical error, because all weights
are positive.

A design is beaten, and stops, if one incumbent is better in every objective by more than ``STANDARD_ERRORS`` standard
errors of that objective's difference. A design that belongs on the front is stopped by mistake only if a difference
that is truly zero or negative is measured that many standard errors above 0 (probability 3 in 100 000 for each
comparison, less for Sobol points).

A stopped design is assigned the incumbent's statistic over N plus D̂. It keeps its maxima over n, and its quantities
that do not depend on the samples (``study.numbers``). This estimate is free of the error that both designs share on the
first n samples. The incumbent dominates it, so a front never holds a design with fewer than N samples.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.optimisation.study import Objective, OptimisationStudy
from gearbench.results.responses import STATISTICS, split_statistic

#: Samples of the first stage: the kernels solve this many at once, so fewer would take as long.
FIRST = 128
#: Ratio of the numbers of samples after successive stages.
GROWTH = 2
#: Number of standard errors by which an incumbent must be better in every objective.
STANDARD_ERRORS = 4.0
#: Maximum number of incumbents that a design is compared with, spread over the front.
MOST_INCUMBENTS = 64


def stages(study: OptimisationStudy) -> tuple[int, ...]:
    """Number of samples computed after each stage; after the last one, all of them."""
    r = study.robustness
    sizes = [FIRST] if r.racing else []
    while sizes and sizes[-1] * GROWTH < r.samples:
        sizes.append(sizes[-1] * GROWTH)
    return (*(n for n in sizes if n < r.samples), r.samples)


def statistics(values: NDArray, numbers: Sequence[float] = ()) -> NDArray:
    """Values of ``study.statistics``, (statistic,), from responses (response, sample) and ``study.numbers``."""
    return np.array([*(compute(x) for x in values for compute, _ in STATISTICS.values()), *numbers])


def spread(objective: NDArray) -> NDArray:
    """Choose at most ``MOST_INCUMBENTS`` designs of a front, evenly by rank in the first objective.

    ``objective`` is that objective, (design,); returns indices into it.
    """
    order = np.argsort(objective, kind="stable")
    return order[np.unique(np.linspace(0, len(order) - 1, MOST_INCUMBENTS).round().astype(int))]


@dataclass(frozen=True, kw_only=True)
class Incumbents:
    """Designs that a new design races against; all their samples are known.

    Parameters
    ----------
    study
        The study.
    early
        Responses to the samples of all stages but the last, (incumbent, response, sample).
    final
        Values of ``study.statistics`` over all samples, (incumbent, statistic).
    """

    study: OptimisationStudy
    early: NDArray
    final: NDArray

    @classmethod
    def of(
        cls, study: OptimisationStudy, values: Sequence[NDArray], final: Sequence[Sequence[float]]
    ) -> Incumbents | None:
        """Build incumbents from designs with ``values`` (response, sample); None without designs, or with one stage.

        ``final`` holds the values of ``study.statistics`` for every design.
        """
        counts = stages(study)
        if len(counts) == 1 or not values:
            return None
        early = np.array([samples[:, : counts[-2]] for samples in values])
        return cls(study=study, early=early, final=np.array(final))

    def beating(self, values: NDArray, numbers: Sequence[float] = ()) -> int | None:
        """Index of the incumbent that beats a design by the most standard errors; None if none beats it.

        ``values`` are the design's responses to the first samples, (response, sample), ``numbers`` its values of
        ``study.numbers``. An incumbent must be better in every objective by more than ``STANDARD_ERRORS``.
        """
        scores = np.full(len(self.final), math.inf)
        for objective in self.study.objectives:
            D, s = self.difference(objective, values, numbers)
            with np.errstate(divide="ignore", invalid="ignore"):
                scores = np.minimum(scores, np.where(D > 0, D / s, 0.0))
        best = int(np.argmax(scores))
        return best if scores[best] > STANDARD_ERRORS else None

    def difference(
        self, objective: Objective, values: NDArray, numbers: Sequence[float] = ()
    ) -> tuple[NDArray, NDArray]:
        """Difference D̂ of an objective to each incumbent, and its standard error s, (incumbent,) each.

        Arguments are as in ``beating``.
        """
        n = values.shape[1]
        D, influence = np.zeros(len(self.final)), np.zeros((len(self.final), n))
        for name, weight in objective.weights.items():
            if name in self.study.numbers:
                of_incumbents = self.final[:, self.study.statistics.index(name)]
                D += weight * (numbers[self.study.numbers.index(name)] - of_incumbents)
                continue
            response, statistic = split_statistic(name) or (name, "")
            i = self.study.responses.index(response)
            x, y = values[i], self.early[:, i, :n]  # of the design, of the incumbents
            if statistic == "max":
                D += weight * (x.max() - self.final[:, self.study.statistics.index(name)])
                continue
            statistic_of = _mean if statistic == "mean" else _std
            (of_design, influence_design), (of_incumbents, influence_incumbents) = statistic_of(x), statistic_of(y)
            D += weight * (of_design - of_incumbents)
            influence += weight * (influence_design - influence_incumbents)
        return D, influence.std(axis=1, ddof=1) * math.sqrt(1 / n - 1 / self.study.robustness.samples)

    def estimate(self, values: NDArray, incumbent: int, numbers: Sequence[float] = ()) -> NDArray:
        """Estimate the statistics over all samples, (statistic,), of a design that ``incumbent`` beats."""
        of_design = statistics(values, numbers)
        # the design's `numbers` only fill the places of the incumbent's, which are not used below
        of_incumbent = statistics(self.early[incumbent][:, : values.shape[1]], numbers)
        # maxima are bounds and `numbers` are exact: both are kept; responses are never negative
        is_kept = np.array([name.endswith("_max") or name in self.study.numbers for name in self.study.statistics])
        return np.where(is_kept, of_design, np.maximum(self.final[incumbent] + (of_design - of_incumbent), 0.0))


def _mean(x: NDArray) -> tuple[NDArray, NDArray]:
    """Mean, (…), and the influence of each sample on it, (…, sample)."""
    m = x.mean(axis=-1)
    return m, x - m[..., None]


def _std(x: NDArray) -> tuple[NDArray, NDArray]:
    """Standard deviation, (…), and the influence of each sample on it, (…, sample)."""
    s, deviation = x.std(axis=-1, ddof=1), _mean(x)[1]
    scale = np.where(s > 0, s, 1.0)[..., None]
    return s, (deviation**2 - s[..., None] ** 2) / (2 * scale)
