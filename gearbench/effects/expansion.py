"""Gaps of random errors as sums of modes: a mode is a gap, multiplied by its amount in each sample.

``ManufacturingErrors.expansion`` makes them, and ``gearbench.robustness`` draws the samples.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True, eq=False)
class ErrorModes:
    """A group of errors with its modes.

    Parameters
    ----------
    columns
        Which of the errors of the pair belong to this group.
    modes
        Gaps (position, pair, segment, mode) [mm].
    amounts
        Function from values (sample, error) of these errors to the amount of each mode, (sample, mode).
    """

    columns: slice
    modes: NDArray
    amounts: Callable[[NDArray], NDArray]


@dataclass(frozen=True, kw_only=True, eq=False)
class Expansion:
    """Gaps of samples minus the gap of the means: ``modes`` · ``amounts``.

    Parameters
    ----------
    parts
        Groups of errors that change the gap.
    mean
        Mean of each error, (error,).
    """

    parts: tuple[ErrorModes, ...]
    mean: NDArray

    @property
    def modes(self) -> NDArray:
        """Modes of all groups, (position, pair, segment, mode) [mm]."""
        return np.concatenate([part.modes for part in self.parts], axis=-1)

    def amounts(self, errors: NDArray) -> NDArray:
        """Amount of each mode due to ``errors`` (sample, error), minus that due to their means; (sample, mode)."""
        parts = [
            part.amounts(errors[:, part.columns]) - part.amounts(self.mean[None, part.columns]) for part in self.parts
        ]
        return np.concatenate(parts, axis=-1)
