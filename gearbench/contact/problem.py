"""The unilateral contact problem of every position of a mesh cycle, dimensionless, as the kernels take it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

#: Columns of Ψ below this fraction of the largest singular value are dropped: H changes by its square, 1e-14.
RANK_TOLERANCE = 1e-7


@dataclass(frozen=True, kw_only=True)
class ContactProblem:
    """H P + g(P) + e = δ on loaded segments, ≥ δ on separated ones, P ≥ 0, ΣP = 1 (C1); H = Ψ Ψᵀ, a block per pair.

    Forces are in units of the normal force F_bn, displacements in units of ``length_scale``. The law g of a segment is
    that of ``gearbench.contact.law``. Without a law, a = h = 0, H itself must be positive definite.

    Parameters
    ----------
    gap, a, h, active
        (position, segment), segments of all pairs side by side; e, the coefficients of the law, and whether the
        segment exists.
    factor
        Ψ, (position, segment, rank).
    block
        Block of each segment, (segment,): segments of one block share the amplitudes of its columns.
    blocks
        Number of blocks.
    force
        Normal force F_bn [N].
    length_scale
        Unit of displacement λ [mm].
    shape
        (positions, pairs, segments) of the arrays before the pairs were put side by side.
    """

    gap: NDArray
    a: NDArray
    h: NDArray
    active: NDArray
    factor: NDArray
    block: NDArray
    blocks: int
    force: float
    length_scale: float
    shape: tuple[int, int, int]


@dataclass(frozen=True, kw_only=True)
class ContactSolution:
    """Forces, approach and stiffness at each position, with the residuals of the solution.

    Parameters
    ----------
    force
        P, (position, pair, segment) [N].
    approach
        δ_n normal to the flank, (position,) [mm].
    stiffness
        ∂F_bn/∂δ_n, (position,) [N/mm].
    equilibrium
        |ΣP − F| / F, (position,).
    least_force
        min P / F, (position,).
    complementarity
        max |min(P_i / F, gap_i / λ)|, (position,): how far the pair (force, gap) is from complementary.
    iterations
        Newton steps, (position,).
    polished
        How many positions were solved once more by the dense active set, because rounding had spoilt the residual.
    """

    force: NDArray
    approach: NDArray
    stiffness: NDArray
    equilibrium: NDArray
    least_force: NDArray
    complementarity: NDArray
    iterations: NDArray
    polished: int = 0


def full_factor(problem: ContactProblem, position: int) -> NDArray:
    """Ψ of the existing segments with a column for each amplitude of each block, (segment, block·rank)."""
    active = problem.active[position]
    own = problem.factor[position][active]
    wide = np.zeros((own.shape[0], problem.blocks, own.shape[1]))
    wide[np.arange(own.shape[0]), problem.block[active]] = own
    return wide.reshape(own.shape[0], -1)


def reduce_rank(problem: ContactProblem) -> ContactProblem:
    """The same problem with the factor of each position and block reduced to its numerical rank.

    On the few segments of a contact line the smooth compliance has fewer independent columns than the tooth has Ritz
    functions: two for a spur pair with the paper's basis, six for a helical one.
    """
    positions, segments, columns = problem.factor.shape
    if columns == 0:
        return problem
    shape = (positions * problem.blocks, segments // problem.blocks, columns)
    factor = np.where(problem.active[..., None], problem.factor, 0.0).reshape(shape)
    return replace(problem, factor=pivoted_root(gram(factor)).reshape(positions, segments, -1))


def gram(factor: NDArray) -> NDArray:
    """Ψ Ψᵀ of many Ψ (…, n, m) at once, (…, n, n)."""
    return factor @ np.swapaxes(factor, -1, -2)


def pivoted_root(matrix: NDArray) -> NDArray:
    """L (block, n, rank) with L Lᵀ = H, of all H (block, n, n) at once, by Cholesky, the largest pivot first.

    The remainder is smaller than 1e-14 of the largest diagonal element in every block (Higham, Accuracy and
    Stability of Numerical Algorithms, §10.3).
    """
    count, n, _ = matrix.shape
    left = np.diagonal(matrix, axis1=1, axis2=2).copy()
    floor = RANK_TOLERANCE**2 * float(left.max(initial=0.0))
    L = np.zeros((count, n, n))
    here = np.arange(count)
    for k in range(n):
        pivot = np.argmax(left, axis=1)
        height = left[here, pivot]
        alive = height > floor
        if not alive.any():
            return np.ascontiguousarray(L[..., :k])
        column = matrix[here, :, pivot] - (L[..., :k] @ L[here, pivot, :k][..., None])[..., 0]
        column *= np.where(alive, 1 / np.sqrt(np.where(alive, height, 1.0)), 0.0)[:, None]
        L[..., k] = column
        left = np.maximum(left - column**2, 0.0)
        left[here, pivot] = 0.0
    return L
