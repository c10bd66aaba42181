"""Symmetric positive definite systems whose blocks form a chain: each block couples only to the next two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.lapack import addresses


@dataclass(frozen=True, kw_only=True)
class Sums:
    """Many matrices, each a weighted sum of two given ones.

    Parameters
    ----------
    matrices
        The given matrices.
    which
        Numbers of two given matrices for each sum, (…, 2).
    factors
        Weights, (…, 2); if the second is zero, its matrix is ignored.
    """

    matrices: Sequence[NDArray]
    which: NDArray
    factors: NDArray

    def matrix(self, *index: int) -> NDArray:
        """One of the matrices."""
        (i, j), (a, b) = self.which[index], self.factors[index]
        return a * self.matrices[i] + b * self.matrices[j] if b else a * self.matrices[i]


@dataclass(frozen=True, kw_only=True)
class Sides:
    """Right-hand sides of a chain, in groups of columns.

    Parameters
    ----------
    widths
        Number of columns of each group, (groups,).
    blocks
        Rows of every group at every block of the chain, (count, groups).
    """

    widths: NDArray
    blocks: Sums


@dataclass(frozen=True, kw_only=True)
class Chain:
    """Block pentadiagonal matrix K, eliminated block by block (Golub & Van Loan, Matrix Computations, §4.3, §4.5.1).

    Parameters
    ----------
    sizes
        Sizes of the blocks, (count,).
    blocks
        (apart, i): the block that couples i with i + ``apart``, 0, 1 or 2; blocks beyond the end are ignored.
    """

    sizes: NDArray
    blocks: Sums

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.sizes.sum())

    def matrix(self) -> NDArray:
        """K as a full matrix."""
        ends = np.cumsum([0, *self.sizes])
        K = np.zeros((self.size, self.size))
        for distance, i in product(range(3), range(len(self.sizes))):
            if i + distance < len(self.sizes):
                rows, columns = slice(ends[i], ends[i + 1]), slice(ends[i + distance], ends[i + distance + 1])
                K[rows, columns] = self.blocks.matrix(distance, i)
                K[columns, rows] = K[rows, columns].T
        return K

    @property
    def condition(self) -> float:
        """Condition number of K scaled to a unit diagonal."""
        K = self.matrix()
        scale = 1 / np.sqrt(np.diagonal(K))
        return float(np.linalg.cond(K * scale * scale[:, None]))

    def compliance(self, right: NDArray | Sides) -> NDArray:
        """Bᵀ K⁻¹ B of right-hand sides B (n, m). Groups of columns cost nothing above their first nonzero block.

        Raises
        ------
        numpy.linalg.LinAlgError
            If K is not positive definite.
        """
        from gearbench.compliance._chain_kernels import chain_compliance

        sides = right if isinstance(right, Sides) else self._one_group(right)
        count, most = len(self.sizes), int(self.sizes.max(initial=0))
        nonzero = sides.blocks.factors.any(axis=2)
        begins = np.where(nonzero.any(axis=0), nonzero.argmax(axis=0), count)
        order = np.argsort(begins, kind="stable")
        begun = np.searchsorted(begins[order], np.arange(count), side="right")
        starts = np.cumsum([0, *sides.widths[order]])
        ends = np.cumsum([0, *sides.widths])
        columns = np.concatenate([np.zeros(0, dtype=int), *(np.arange(*ends[g : g + 2]) for g in order)])
        matrices, own_count = [*self.blocks.matrices, *sides.blocks.matrices], len(self.blocks.matrices)
        values = np.concatenate([np.zeros(0), *(matrix.ravel() for matrix in matrices)])
        offset = np.cumsum([0, *(matrix.size for matrix in matrices)])
        m = len(columns)
        result, lower = np.empty((2, m, m))
        rows_in_memory = np.empty((3, most, min(3, count) * most + m))
        sizes = np.append(self.sizes, np.zeros(4, dtype=int))
        chain = sizes, values, offset[self.blocks.which], np.ascontiguousarray(self.blocks.factors)
        which, factors = (np.ascontiguousarray(table[:, order]) for table in (sides.blocks.which, sides.blocks.factors))
        groups = begun, starts, offset[which + own_count], factors
        numbers = np.zeros(6, dtype=np.int32)
        if not chain_compliance(result, rows_in_memory, lower, columns, chain, groups, numbers, addresses()):
            raise np.linalg.LinAlgError("a matrix is not positive definite")
        return result

    def _one_group(self, right: NDArray) -> Sides:
        """Right-hand sides (n, m) as a single group of columns."""
        which = np.repeat(np.arange(len(self.sizes))[:, None, None], 2, axis=2)
        factors = np.broadcast_to([1.0, 0.0], which.shape)
        rows = np.split(right, np.cumsum(self.sizes)[:-1])
        return Sides(widths=np.array([right.shape[1]]), blocks=Sums(matrices=rows, which=which, factors=factors))
