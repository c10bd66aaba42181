"""Distributions of random errors, by the names that scenes give them; f is the amplitude of the error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Distribution = Literal["uniform", "uniform_two_sided", "normal", "normal_two_sided", "fixed"]

#: Probability of a normal variable within three standard deviations.
_WITHIN_3_SIGMA = 0.9973002039367398


@dataclass(frozen=True)
class Law:
    """A distribution for amplitude 1: its mean, its quantile function on (0, 1), and one line that describes it."""

    mean: float
    quantile: Callable[[NDArray], NDArray]
    meaning: str


def _standard_normal(unit: NDArray) -> NDArray:
    """Quantiles of a standard normal variable truncated at ± 3."""
    from scipy.special import ndtri

    return ndtri((1 - _WITHIN_3_SIGMA) / 2 + unit * _WITHIN_3_SIGMA)


DISTRIBUTIONS: MappingProxyType[str, Law] = MappingProxyType(
    {
        "uniform": Law(0.5, lambda u: u, "uniform on [0, f]"),
        "uniform_two_sided": Law(0.0, lambda u: 2 * u - 1, "uniform on [−f, f]"),
        "normal": Law(0.5, lambda u: 0.5 + _standard_normal(u) / 6, "normal, mean f/2, σ = f/6, cut to [0, f]"),
        "normal_two_sided": Law(0.0, lambda u: _standard_normal(u) / 3, "normal, mean 0, σ = f/3, cut to [−f, f]"),
        "fixed": Law(1.0, np.ones_like, "always f"),
    }
)
