"""Functions along the axis of a gear: polynomials, piecewise if the width of the body varies.

On each piece they are a straight line between its ends and integrated Legendre polynomials, which are zero there:
``axis_functions``, with 1 and t replaced by 1 − η and η where neighbouring pieces share the value between them. A
single piece keeps 1 and t, so that even and odd functions decouple on straight teeth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.bases import axis_functions, gauss, legendre_functions
from gearbench.compliance.solid import axis_integrals


@dataclass(frozen=True, kw_only=True)
class FaceFunctions:
    """Continuous functions on 0 … b: one for each break, then those of each piece that are zero at its ends.

    Parameters
    ----------
    breaks
        Ends of the pieces, from 0 to b [mm].
    counts
        Number of functions on each piece, at least 2.
    """

    breaks: tuple[float, ...]
    counts: tuple[int, ...]

    @property
    def count(self) -> int:
        """Number of functions."""
        return len(self.breaks) + sum(count - 2 for count in self.counts)

    def of_piece(self, piece: int) -> NDArray:
        """Functions that are not zero on a piece, in ascending degree."""
        first = len(self.breaks) + [0, *accumulate(count - 2 for count in self.counts)][piece]
        return np.concatenate([[piece, piece + 1], np.arange(first, first + self.counts[piece] - 2)]).astype(int)

    def length(self, piece: int) -> float:
        """Length of a piece [mm]."""
        return self.breaks[piece + 1] - self.breaks[piece]

    @cached_property
    def degrees(self) -> tuple[NDArray, NDArray]:
        """Piece of each function, −1 at a break, and its number within the piece."""
        piece, number = np.full(self.count, -1), np.zeros(self.count, dtype=int)
        for i in range(len(self.counts)):
            inner = self.of_piece(i)[2:]
            piece[inner], number[inner] = i, np.arange(2, self.counts[i])
        return piece, number

    def values(self, y: NDArray) -> tuple[NDArray, NDArray]:
        """Values and slopes [1/mm] of all functions at y [mm], (point, count)."""
        out = np.zeros((2, len(y), self.count))
        piece = np.clip(np.searchsorted(self.breaks, y, side="right") - 1, 0, len(self.counts) - 1)
        for i in range(len(self.counts)):
            at = piece == i
            if not at.any():
                continue
            found = np.stack(axis_functions(self.counts[i], (y[at] - self.breaks[i]) / self.length(i)))
            found[1] /= self.length(i)
            out[np.ix_(np.arange(2), np.flatnonzero(at), self.of_piece(i))] = found @ self._ends(i).T
        return out[0], out[1]

    def integrals(self, pieces: tuple[int, ...] | None = None) -> NDArray:
        """∫ h_a⁽ⁱ⁾ h_c⁽ʲ⁾ dy over all or some pieces, (2, 2, count, count)."""
        out = np.zeros((2, 2, self.count, self.count))
        for i in range(len(self.counts)) if pieces is None else pieces:
            T, b, at = self._ends(i), self.length(i), self.of_piece(i)
            scaled = axis_integrals(self.counts[i]) * np.array([[b, 1.0], [1.0, 1 / b]])[:, :, None, None]
            out[:, :, at[:, None], at] += T @ scaled @ T.T
        return out

    def load(self, q: int) -> NDArray:
        """∫ h_a φ_j dy of the functions and q Legendre functions orthonormal on 0 … b, (count, q)."""
        b, out = self.breaks[-1], np.zeros((self.count, q))
        for i, count in enumerate(self.counts):
            eta, weight = gauss((count + q) // 2 + 1)
            y = self.breaks[i] + self.length(i) * eta
            h = axis_functions(count, eta)[0] @ self._ends(i).T
            scaled = (self.length(i) / math.sqrt(b)) * weight[:, None] * legendre_functions(q, y / b)
            out[self.of_piece(i)] += h.T @ scaled
        return np.where(np.abs(out) > 1e-14 * np.abs(out).max(), out, 0.0)

    def _ends(self, piece: int) -> NDArray:
        """Matrix from 1, t, … to the functions of a piece, (count, count): 1 − η, η, …, t = 2η − 1."""
        T = np.eye(self.counts[piece])
        if len(self.counts) > 1:
            T[:2, :2] = [[0.5, -0.5], [0.5, 0.5]]
        return T
