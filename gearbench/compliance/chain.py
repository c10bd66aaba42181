"""Symmetric positive definite systems whose blocks form a chain: each is coupled to the next two only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.lapack import cholesky, solve_lower

#: Rows of solved right-hand sides that are multiplied with each other at a time.
_TOGETHER = 250


@dataclass(frozen=True, kw_only=True)
class Chain:
    """Block pentadiagonal matrix K, eliminated block by block (Golub & Van Loan, Matrix Computations, §4.3, §4.5.1).

    Parameters
    ----------
    diagonal
        A_0, A_1, …, symmetric.
    coupling
        E_0, E_1, …: the block between A_i and A_{i+1}.
    beyond
        F_0, F_1, …: the block between A_i and A_{i+2}; none where they are not coupled.
    """

    diagonal: Sequence[NDArray]
    coupling: Sequence[NDArray]
    beyond: Sequence[NDArray] = ()

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return sum(len(block) for block in self.diagonal)

    def matrix(self) -> NDArray:
        """K itself."""
        ends = np.cumsum([0, *(len(block) for block in self.diagonal)])
        K = np.zeros((self.size, self.size))
        for apart, blocks in enumerate((self.diagonal, self.coupling, self.beyond)):
            for i, block in enumerate(blocks):
                here, there = slice(ends[i], ends[i + 1]), slice(ends[i + apart], ends[i + apart + 1])
                K[here, there], K[there, here] = block, block.T
        return K

    @property
    def condition(self) -> float:
        """Condition number of K scaled to a unit diagonal."""
        K = self.matrix()
        scale = 1 / np.sqrt(np.diagonal(K))
        return float(np.linalg.cond(K * scale * scale[:, None]))

    def compliance(self, right: NDArray) -> NDArray:
        """Bᵀ K⁻¹ B of right-hand sides B (n, m): a column costs nothing above the first block in which it begins.

        Raises
        ------
        numpy.linalg.LinAlgError
            If K is not positive definite.
        """
        starts = np.cumsum([0, *(len(block) for block in self.diagonal)])
        begins = np.full(right.shape[1], len(self.diagonal))
        for i in reversed(range(len(self.diagonal))):
            begins[right[starts[i] : starts[i + 1]].any(axis=0)] = i
        order = np.argsort(begins, kind="stable")
        here = np.searchsorted(begins[order], np.arange(len(self.diagonal)), side="right")
        halves = self._half(np.take(right, order, axis=1), starts, here)
        total = np.zeros((len(order), len(order)))
        first = 0
        for i in range(len(self.diagonal)):
            if starts[i + 1] - first >= _TOGETHER or i == len(self.diagonal) - 1:
                some = halves[first : starts[i + 1], : here[i]]
                total[: here[i], : here[i]] += some.T @ some
                first = starts[i + 1]
        result = np.empty_like(total)
        result[order[:, None], order] = total
        return result

    def _half(self, right: NDArray, starts: NDArray, here: NDArray) -> NDArray:
        """L⁻¹ B of the Cholesky factor L, in place of B; its first ``here[i]`` columns begin at block i or above."""
        count = len(self.diagonal)
        # what is left of the block that is next to be eliminated, of its coupling to the one after, and of that one
        own, off = self._block(0, 0).copy(), self._block(0, 1)
        after = self._block(1, 0)
        for i in range(count):
            n1, n2 = (starts[min(j + 1, count)] - starts[min(j, count)] for j in (i + 1, i + 2))
            rows, m = slice(starts[i], starts[i + 1]), here[i]
            sides = np.concatenate([off, self._block(i, 2), right[rows, :m]], axis=1)
            if sides.size:  # LAPACK refuses empty systems
                right[rows, :m] = solve_lower(cholesky(own), sides)[:, n1 + n2 :]
            taken = sides[:, : n1 + n2].T @ sides
            own, off = after - taken[:n1, :n1], self._block(i + 1, 1) - taken[:n1, n1 : n1 + n2]
            after = self._block(i + 2, 0) - taken[n1:, n1 : n1 + n2]
            right[starts[i + 1] : starts[i + 1] + n1 + n2, :m] -= taken[:, n1 + n2 :]
        return right

    def _block(self, i: int, apart: int) -> NDArray:
        """The block between A_i and A_{i + apart}; without rows or columns beyond the end, zero where there is none."""
        blocks = (self.diagonal, self.coupling, self.beyond)[apart]
        if i < len(blocks):
            return blocks[i]
        sizes = [len(self.diagonal[j]) if j < len(self.diagonal) else 0 for j in (i, i + apart)]
        return np.zeros(sizes)
