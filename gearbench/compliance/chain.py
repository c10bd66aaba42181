"""Symmetric positive definite systems whose blocks form a chain: each is coupled to the next one only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Chain:
    """Block tridiagonal matrix K, factorised block by block (Golub & Van Loan, Matrix Computations, §4.5.1).

    Parameters
    ----------
    diagonal
        A_0, A_1, …, symmetric.
    coupling
        E_0, E_1, …: the block between A_i and A_{i+1}.
    """

    diagonal: Sequence[NDArray]
    coupling: Sequence[NDArray]

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return sum(len(block) for block in self.diagonal)

    def matrix(self) -> NDArray:
        """K itself."""
        ends = np.cumsum([0, *(len(block) for block in self.diagonal)])
        K = np.zeros((self.size, self.size))
        for i, block in enumerate(self.diagonal):
            K[ends[i] : ends[i + 1], ends[i] : ends[i + 1]] = block
        for i, block in enumerate(self.coupling):
            here, there = slice(ends[i], ends[i + 1]), slice(ends[i + 1], ends[i + 2])
            K[here, there], K[there, here] = block, block.T
        return K

    @property
    def condition(self) -> float:
        """Condition number of K scaled to a unit diagonal."""
        K = self.matrix()
        scale = 1 / np.sqrt(np.diagonal(K))
        return float(np.linalg.cond(K * scale * scale[:, None]))

    @cached_property
    def _factor(self) -> Sequence[tuple[NDArray, NDArray]]:
        """L_i, and L_i⁻¹ E_i, of the Cholesky factor.

        Raises
        ------
        numpy.linalg.LinAlgError
            If K is not positive definite.
        """
        found, block = [], self.diagonal[0]
        for i in range(len(self.diagonal)):
            L = np.linalg.cholesky(block)
            if i == len(self.coupling):
                found.append((L, np.zeros((len(L), 0))))  # nothing follows
                break
            G = lower_solve(L, self.coupling[i])
            found.append((L, G))
            block = self.diagonal[i + 1] - G.T @ G
        return found

    def compliance(self, right: NDArray) -> NDArray:
        """Bᵀ K⁻¹ B of right-hand sides B (n, m): a column costs nothing above the first block in which it begins."""
        starts = np.cumsum([0, *(len(block) for block in self.diagonal)])
        begins = np.full(right.shape[1], len(self.diagonal))
        for i in reversed(range(len(self.diagonal))):
            begins[right[starts[i] : starts[i + 1]].any(axis=0)] = i
        order = np.argsort(begins, kind="stable")
        here = np.searchsorted(begins[order], np.arange(len(self.diagonal)), side="right")
        sorted_right = right[:, order]
        total = np.zeros((len(order), len(order)))
        for i, (L, G) in enumerate(self._factor):
            rest = sorted_right[starts[i] : starts[i + 1], : here[i]]
            half = lower_solve(L, rest)
            total[: here[i], : here[i]] += half.T @ half
            sorted_right[starts[i + 1] : starts[i + 1] + G.shape[1], : here[i]] -= G.T @ half
        result = np.empty_like(total)
        result[order[:, None], order] = total
        return result


def lower_solve(L: NDArray, right: NDArray) -> NDArray:
    """L⁻¹ B of a lower triangle L."""
    from scipy.linalg import lapack

    if not right.size:  # LAPACK refuses empty systems
        return right.copy()
    # solve_triangular checks its arguments for longer than these small systems take
    solution, _ = lapack.dtrtrs(L, right, lower=1)  # pyright: ignore[reportAttributeAccessIssue]
    return solution
