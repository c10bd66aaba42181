"""Symmetric positive definite systems whose blocks form a chain: each is coupled to the next two only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.lapack import addresses


@dataclass(frozen=True, kw_only=True)
class Sums:
    """Many matrices, each of them the sum of two given ones times factors.

    Parameters
    ----------
    matrices
        Those given.
    which
        Two numbers of given ones for each matrix, (…, 2).
    factors
        Their factors, (…, 2); where one is zero, its matrix does not matter.
    """

    matrices: Sequence[NDArray]
    which: NDArray
    factors: NDArray

    def matrix(self, *index: int) -> NDArray:
        """One of them."""
        return sum(
            factor * self.matrices[k]
            for k, factor in zip(self.which[index], self.factors[index], strict=True)
            if factor
        )  # pyright: ignore[reportReturnType]

    def values(self) -> tuple[NDArray, NDArray]:
        """The given matrices one after the other, and where in them each sum begins, (…, 2)."""
        starts = np.cumsum([0, *(matrix.size for matrix in self.matrices)])
        return np.concatenate([np.zeros(0), *(matrix.ravel() for matrix in self.matrices)]), starts[self.which]


@dataclass(frozen=True, kw_only=True)
class Sides:
    """Right-hand sides of a chain, in groups of columns.

    Parameters
    ----------
    widths
        Number of columns of each group, (groups,).
    blocks
        Their rows at each block, (count, groups).
    """

    widths: NDArray
    blocks: Sums


@dataclass(frozen=True, kw_only=True)
class Chain:
    """Block pentadiagonal matrix K, eliminated block by block (Golub & Van Loan, Matrix Computations, §4.3, §4.5.1).

    Parameters
    ----------
    sizes
        Of the blocks, (count,).
    blocks
        (apart, i): the block between unknowns i and i + ``apart``, 0, 1, 2; those beyond the end do not matter.
    """

    sizes: NDArray
    blocks: Sums

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.sizes.sum())

    def matrix(self) -> NDArray:
        """K itself."""
        ends = np.cumsum([0, *self.sizes])
        K = np.zeros((self.size, self.size))
        for apart, i in product(range(3), range(len(self.sizes))):
            if i + apart < len(self.sizes):
                here, there = slice(ends[i], ends[i + 1]), slice(ends[i + apart], ends[i + apart + 1])
                K[here, there] = self.blocks.matrix(apart, i)
                K[there, here] = K[here, there].T
        return K

    @property
    def condition(self) -> float:
        """Condition number of K scaled to a unit diagonal."""
        K = self.matrix()
        scale = 1 / np.sqrt(np.diagonal(K))
        return float(np.linalg.cond(K * scale * scale[:, None]))

    def compliance(self, right: NDArray) -> NDArray:
        """Bᵀ K⁻¹ B of right-hand sides B (n, m).

        Raises
        ------
        numpy.linalg.LinAlgError
            If K is not positive definite.
        """
        count, columns = len(self.sizes), right.shape[1]
        rows = np.split(right, np.cumsum(self.sizes)[:-1])
        which = np.repeat(np.arange(count)[:, None, None], 2, axis=2)
        blocks = Sums(matrices=rows, which=which, factors=np.broadcast_to([1.0, 0.0], which.shape))
        return -self.condensed(Sides(widths=np.array([columns]), blocks=blocks), np.zeros((columns, columns)))

    def condensed(self, sides: Sides, border: NDArray) -> NDArray:
        """C − Bᵀ K⁻¹ B of right-hand sides B and a symmetric ``border`` C (m, m).

        A group of columns costs nothing above the first block in which it begins.

        Raises
        ------
        numpy.linalg.LinAlgError
            If K is not positive definite.
        """
        from gearbench.compliance._chain_kernels import condense_chain

        count, most = len(self.sizes), int(self.sizes.max(initial=0))
        there = sides.blocks.factors.any(axis=2)
        begins = np.where(there.any(axis=0), there.argmax(axis=0), count)
        order = np.argsort(begins, kind="stable")
        begun = np.searchsorted(begins[order], np.arange(count), side="right")
        starts = np.cumsum([0, *sides.widths[order]])
        ends = np.cumsum([0, *sides.widths])
        columns = np.concatenate([np.zeros(0, dtype=int), *(np.arange(ends[g], ends[g + 1]) for g in order)])
        values, offset = self.blocks.values()
        more, side_offset = sides.blocks.values()
        m = len(columns)
        result = np.array(border, dtype=float, order="C")
        memory = np.empty((3, most, min(3, count) * most + m)), np.empty((m, m))
        sizes, together = np.append(self.sizes, np.zeros(4, dtype=int)), np.concatenate([values, more])
        chain = sizes, together, offset, np.ascontiguousarray(self.blocks.factors)
        begin = np.ascontiguousarray(side_offset[:, order] + len(values))
        groups = begun, starts, begin, np.ascontiguousarray(sides.blocks.factors[:, order])
        if not condense_chain(result, *memory, columns, chain, groups, np.zeros(6, dtype=np.int32), addresses()):
            raise np.linalg.LinAlgError("a matrix is not positive definite")
        return result
