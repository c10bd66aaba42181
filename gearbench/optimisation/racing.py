"""Racing: a design stops as soon as enough error samples show that the front beats it.

All designs see the same samples (common random numbers), so the difference of two designs needs far fewer samples than
either value alone. A design is computed on the first n₁ < n₂ < … < N samples. After each stage it is compared with
designs whose N samples are known, its incumbents. Of an objective that is a mean, the difference over all N samples is
estimated by the mean of y_d − y_r over the first n, with the standard error of a draw of n from N,

    D̂ = ⟨y_d − y_r⟩_n,   s² = Var_n(y_d − y_r)/n · (1 − n/N).

A standard deviation is the average of its influence ((y − ȳ)² − σ²)/2σ to first order, and compared likewise; the
maximum of n samples is no more than that of N, so that its difference to the incumbent's maximum over N is a bound
without error. A design is beaten where one incumbent is better in every objective by more than ``STANDARD_ERRORS`` of
that objective's difference: it stops. A design of the front is stopped by mistake only if a difference that is not
positive is measured to be that many standard errors above 0 (3 in 100 000 for each comparison, and less for Sobol
points).

A stopped design is taken to have its incumbent's statistic over N plus D̂: that is dominated by the incumbent, so that a
front never holds a design with fewer samples than asked for, and free of the common error of the first n samples.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.optimisation.study import Objective, OptimisationStudy
from gearbench.results.responses import STATISTICS, split_statistic

#: Samples of the first stage: the kernels solve as many at once, so that fewer would cost as much. Each stage has
#: ``GROWTH`` times the samples of the one before it.
FIRST, GROWTH = 128, 2
#: Standard errors by which an incumbent must be better in every objective.
STANDARD_ERRORS = 4.0
#: Incumbents that a design is compared with at most, spread over the front.
MOST_INCUMBENTS = 64


def stages(study: OptimisationStudy) -> tuple[int, ...]:
    """Samples of a design after each stage, the last one all of them."""
    r = study.robustness
    found = [FIRST] if r.racing else []
    while found and found[-1] * GROWTH < r.samples:
        found.append(found[-1] * GROWTH)
    return (*(n for n in found if n < r.samples), r.samples)


def statistics(values: NDArray, numbers: Sequence[float] = ()) -> NDArray:
    """``study.statistics`` of a design, (statistic,), from its responses (response, sample) and ``study.numbers``."""
    return np.array([*(compute(x) for x in values for compute, _ in STATISTICS.values()), *numbers])


def spread(first: NDArray) -> NDArray:
    """Designs of a front to compare with, at most ``MOST_INCUMBENTS``, evenly by rank in the first objective.

    ``first`` holds that objective of each, (design,).
    """
    order = np.argsort(first, kind="stable")
    return order[np.unique(np.linspace(0, len(order) - 1, MOST_INCUMBENTS).round().astype(int))]


@dataclass(frozen=True, kw_only=True)
class Incumbents:
    """Designs whose samples are all known.

    Parameters
    ----------
    study
        The study.
    early
        Responses of the samples before the last stage, (incumbent, response, sample).
    known
        Statistics over all samples, and numbers, (incumbent, statistic).
    """

    study: OptimisationStudy
    early: NDArray
    known: NDArray

    @classmethod
    def of(
        cls, study: OptimisationStudy, values: Sequence[NDArray], known: Sequence[Sequence[float]]
    ) -> Incumbents | None:
        """Incumbents from designs with ``values`` (response, sample); None without designs or without stages.

        ``known`` holds the statistics of each, as ``study.statistics`` names them.
        """
        steps = stages(study)
        if len(steps) == 1 or not values:
            return None
        early = np.array([each[:, : steps[-2]] for each in values])
        return cls(study=study, early=early, known=np.array(known))

    def beating(self, values: NDArray, numbers: Sequence[float] = ()) -> int | None:
        """The incumbent that beats a design by the most standard errors, from its first samples, (response, sample).

        ``numbers`` are those of the study. None where no incumbent is better in every objective by more than
        ``STANDARD_ERRORS``.
        """
        scores = np.full(len(self.known), math.inf)
        for objective in self.study.objectives:
            D, s = self.difference(objective, values, numbers)
            with np.errstate(divide="ignore", invalid="ignore"):
                scores = np.minimum(scores, np.where(D > 0, D / s, 0.0))
        best = int(np.argmax(scores))
        return best if scores[best] > STANDARD_ERRORS else None

    def difference(
        self, objective: Objective, values: NDArray, numbers: Sequence[float] = ()
    ) -> tuple[NDArray, NDArray]:
        """D̂ of an objective to each incumbent and its standard error s, (incumbent,); ``values`` as in ``beating``."""
        n = values.shape[1]
        D, influence = np.zeros(len(self.known)), np.zeros((len(self.known), n))
        for name, weight in objective.weights.items():
            if name in self.study.numbers:
                theirs = self.known[:, self.study.statistics.index(name)]
                D += weight * (numbers[self.study.numbers.index(name)] - theirs)
                continue
            i, statistic = self._where(name)
            x, y = values[i], self.early[:, i, :n]
            if statistic == "max":
                D += weight * (x.max() - self.known[:, self.study.statistics.index(name)])
                continue
            of = _mean if statistic == "mean" else _std
            (mine, on_mine), (theirs, on_theirs) = of(x), of(y)
            D += weight * (mine - theirs)
            influence += weight * (on_mine - on_theirs)
        return D, influence.std(axis=1, ddof=1) * math.sqrt(1 / n - 1 / self.study.robustness.samples)

    def _where(self, name: str) -> tuple[int, str]:
        """Number of the response, and statistic, of a name."""
        found = split_statistic(name)
        assert found is not None
        return self.study.responses.index(found[0]), found[1]

    def estimate(self, values: NDArray, incumbent: int, numbers: Sequence[float] = ()) -> NDArray:
        """Statistics over all samples of a design that ``incumbent`` beats, (statistic,), from its first samples."""
        mine = statistics(values, numbers)
        theirs = statistics(self.early[incumbent][:, : values.shape[1]], numbers)
        certain = np.array([name.endswith("_max") or name in self.study.numbers for name in self.study.statistics])
        return np.where(certain, mine, np.maximum(self.known[incumbent] + (mine - theirs), 0.0))


def _mean(x: NDArray) -> tuple[NDArray, NDArray]:
    """Mean, (…), and the influence of each sample on it, (…, sample)."""
    m = x.mean(axis=-1)
    return m, x - m[..., None]


def _std(x: NDArray) -> tuple[NDArray, NDArray]:
    """Standard deviation, (…), and the influence of each sample on it, (…, sample)."""
    s, deviation = x.std(axis=-1, ddof=1), _mean(x)[1]
    scale = np.where(s > 0, s, 1.0)[..., None]
    return s, (deviation**2 - s[..., None] ** 2) / (2 * scale)
