"""Gaps of random errors as modes, and how much of each a sample has."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """Some of the errors and their modes.

    Parameters
    ----------
    columns
        Numbers of the errors.
    modes
        (position, pair, segment, mode) [mm].
    amounts
        Values (sample, error) → how much of each mode they have, (sample, mode).
    """

    columns: slice
    modes: NDArray
    amounts: Callable[[NDArray], NDArray]


@dataclass(frozen=True, kw_only=True, eq=False)
class Expansion:
    """Gaps of samples less that of the means: ``modes`` · ``amounts``.

    Parameters
    ----------
    parts
        The errors that open gaps, and their modes.
    mean
        Mean of each error, (error,).
    """

    parts: tuple[Part, ...]
    mean: NDArray

    @property
    def modes(self) -> NDArray:
        """(position, pair, segment, mode) [mm]."""
        return np.concatenate([part.modes for part in self.parts], axis=-1)

    def amounts(self, errors: NDArray) -> NDArray:
        """Amount of each mode in the ``errors`` (sample, error) beyond their means, (sample, mode)."""
        found = [
            part.amounts(errors[:, part.columns]) - part.amounts(self.mean[None, part.columns]) for part in self.parts
        ]
        return np.concatenate(found, axis=-1)
