"""Finite elements along the axis of a gear: piecewise polynomials of high order, and their products."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from gearbench.compliance.bases import gauss, height_functions
from gearbench.compliance.local import flank_functions


@dataclass(frozen=True, kw_only=True)
class Axis:
    """Hats between the ends of the elements and integrated Legendre functions within them.

    Parameters
    ----------
    ends
        Ends of the elements, from 0 to the face width [mm].
    degree
        Their polynomial degree.
    """

    ends: tuple[float, ...]
    degree: int

    @property
    def size(self) -> int:
        """Number of functions."""
        return self.degree * (len(self.ends) - 1) + 1

    @cached_property
    def products(self) -> tuple[sp.csr_array, sp.csr_array, sp.csr_array]:
        """∫ h_a h_b, ∫ h_a h_b′ and ∫ h_a′ h_b′ dy, all three with the same pattern."""
        eta, weight = gauss(self.degree + 1)
        value, slope = self._local(eta)
        found = []
        for left, right, power in ((value, value, 1), (value, slope, 0), (slope, slope, -1)):
            local = left.T @ (weight[:, None] * right)
            found.append(self._assemble([local * length**power for length in np.diff(self.ends)]))
        return found[0], found[1], found[2]

    def load(self, count: int) -> NDArray:
        """∫ h_a φ_j dy with the ``count`` orthonormal Legendre functions of the face width, (size, count)."""
        eta, weight = gauss((self.degree + count) // 2 + 1)
        value, _ = self._local(eta)
        out = np.zeros((self.size, count))
        for e, (low, high) in enumerate(zip(self.ends, self.ends[1:], strict=False)):
            phi = flank_functions(count, low + eta * (high - low), 0.0, self.ends[-1])
            out[self._numbers(e)] += (high - low) * (value * weight[:, None]).T @ phi
        return out

    def _numbers(self, e: int) -> NDArray:
        return e * self.degree + np.append(np.arange(self.degree), self.degree)

    def _local(self, eta: NDArray) -> tuple[NDArray, NDArray]:
        """Falling hat, bubbles, rising hat, and their derivatives by η on one element, (point, degree + 1)."""
        value, slope = height_functions(self.degree, eta)
        value, slope = np.column_stack([1 - eta, value[:, 1:], eta]), np.column_stack([0 * eta - 1, slope[:, 1:], 0 * eta + 1])
        return value, slope

    def _assemble(self, blocks: list[NDArray]) -> sp.csr_array:
        numbers = np.array([self._numbers(e) for e in range(len(blocks))])
        n = self.degree + 1
        row, col = np.repeat(numbers, n, axis=1).ravel(), np.tile(numbers, n).ravel()
        return sp.coo_array((np.array(blocks).ravel(), (row, col)), shape=(self.size, self.size)).tocsr()
