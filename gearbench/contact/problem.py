"""The unilateral contact problem of every position of a mesh cycle, dimensionless, as the kernels take it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.base import ComplianceEffect, Effect
from gearbench.geometry.action import ContactLines

#: What a factor may leave out, trace of H over that of the law's slope: compliances change by less than this fraction.
TRUNCATION = 1e-4
#: Rounding: the same over the trace of H itself.
RANK_TOLERANCE = 1e-14


@dataclass(frozen=True, kw_only=True)
class Along:
    """A contact problem along whole contact lines, from which that at any nodes on them follows.

    Parameters
    ----------
    effects
        Those that act.
    lines
        Lines whose segments are cells.
    gaps
        Total gap at the beginning, middle and end of each segment, (position, pair, segment, 3) [mm].
    smooth_lines
        The same lines with Gauss points instead of cells, see ``ContactLines.smooth_lines``.
    factor
        Ψ at their nodes, (position, pair, node, rank).
    rows
        From these nodes to the beginning, middle and end of each segment, (position, pair, segment, 3, node).
    laws
        The effects that are laws of contact.
    nodes
        Gauss points on the patches of each line, as many whichever positions are looked at.
    share
        Load of each position over that of the problem, (position,).
    field
        Gap at the nodes of ``smooth_lines`` beside that of the effects, (position, pair, node) [mm]; ``gaps`` have it.
    """

    effects: tuple[Effect, ...]
    lines: ContactLines
    gaps: NDArray
    smooth_lines: ContactLines
    factor: NDArray
    rows: NDArray
    laws: tuple[ComplianceEffect, ...]
    nodes: int
    share: NDArray
    field: NDArray | None = None

    def part(self, positions: slice | NDArray) -> Along:
        """The same of some of the positions."""
        names = ("gaps", "factor", "rows", "share", *(() if self.field is None else ("field",)))
        arrays = {name: getattr(self, name)[positions] for name in names}
        return replace(self, lines=self.lines.part(positions), smooth_lines=self.smooth_lines.part(positions), **arrays)


@dataclass(frozen=True, kw_only=True)
class ContactProblem:
    """H P + g(P) + e = δ on loaded segments, ≥ δ on separated ones, P ≥ 0, ΣP = 1 (C1); H = Ψ Ψᵀ, a block per pair.

    Forces are in units of the normal force F_bn, displacements in units of ``length_scale``. The law g of a segment is
    that of ``gearbench.contact.law``. Without a law, a = h = 0, H itself must be positive definite.

    Parameters
    ----------
    gap, a, h, sigma, active
        (position, segment), segments of all pairs side by side; e at the end of the segment that touches first, the
        coefficients of the law, half the variation of e along the segment, and whether the segment exists.
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
    along
        The problem along the lines, where segments are cells.
    """

    gap: NDArray
    a: NDArray
    h: NDArray
    sigma: NDArray
    active: NDArray
    factor: NDArray
    block: NDArray
    blocks: int
    force: float
    length_scale: float
    shape: tuple[int, int, int]
    along: Along | None = None


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
    coarse_approach, coarse_stiffness
        The same with the ends of contact patches found once less, of which the difference says how well these are
        known; the same where there are none.
    iterations
        Newton steps, (position,).
    polished
        How many positions were solved once more by the dense active set, because rounding had spoilt the residual.
    """

    force: NDArray
    approach: NDArray
    stiffness: NDArray
    coarse_approach: NDArray
    coarse_stiffness: NDArray
    equilibrium: NDArray
    least_force: NDArray
    complementarity: NDArray
    iterations: NDArray
    polished: int = 0


def part_of(problem: ContactProblem, positions: slice | NDArray) -> ContactProblem:
    """Some positions of a problem."""
    arrays = {name: getattr(problem, name)[positions] for name in ("gap", "a", "h", "sigma", "active", "factor")}
    along = problem.along.part(positions) if problem.along else None
    return replace(problem, **arrays, shape=(len(arrays["gap"]), *problem.shape[1:]), along=along)


def under(problem: ContactProblem, share: NDArray) -> ContactProblem:
    """``problem`` with each position under the ``share`` (position,) of its load.

    With the unit of displacement proportional to the force, only the gaps and the law's level change: for f = F′/F,
    e′ = e/f, σ′ = σ/f and g′(P) = g(fP)/f, i.e. a′ = a − h ln f. Units remain those of the whole load.
    """
    f = share[:, None]
    along = replace(problem.along, share=problem.along.share * share) if problem.along else None
    level = problem.a - problem.h * np.log(f)
    return replace(problem, gap=problem.gap / f, sigma=problem.sigma / f, a=level, along=along)


def full_factor(problem: ContactProblem, position: int) -> NDArray:
    """Ψ of the existing segments with a column for each amplitude of each block, (segment, block·rank)."""
    active = problem.active[position]
    own = problem.factor[position][active]
    wide = np.zeros((own.shape[0], problem.blocks, own.shape[1]))
    wide[np.arange(own.shape[0]), problem.block[active]] = own
    return wide.reshape(own.shape[0], -1)


def reduce_rank(problem: ContactProblem, truncation: float = 0.0) -> ContactProblem:
    """The same problem with the factor of each position and block reduced to its numerical rank, or truncated.

    On the few segments of a contact line the smooth compliance has fewer independent columns than the tooth has Ritz
    functions: two for a spur pair with the paper's basis, six for a helical one.
    """
    positions, segments, columns = problem.factor.shape
    if columns == 0:
        return problem
    shape = (positions * problem.blocks, segments // problem.blocks)
    factor = np.where(problem.active[..., None], problem.factor, 0.0).reshape(*shape, columns)
    root = truncated_root(gram(factor), stiffness_of_law(problem).reshape(shape), truncation)
    return replace(problem, factor=root.reshape(positions, segments, -1))


def stiffness_of_law(problem: ContactProblem) -> NDArray:
    """Greatest dP/dg of the law of each existing segment under any load, (position, segment); 0 without law."""
    rise = np.where(problem.h > 0, problem.h, problem.a)
    return np.where(problem.active & (rise > 0), 1 / np.where(rise > 0, rise, 1.0), 0.0)


def gram(factor: NDArray) -> NDArray:
    """Ψ Ψᵀ of many Ψ (…, n, m) at once, (…, n, n)."""
    return factor @ np.swapaxes(factor, -1, -2)


def truncated_root(matrix: NDArray, stiffness: NDArray, truncation: float) -> NDArray:
    """L (block, n, rank) with L Lᵀ ≈ H, of all H (block, n, n) at once, by Cholesky, the largest pivot first.

    ``stiffness`` (block, n) of the law beside H, A = diag(1/stiffness): what is left out, R = H − L Lᵀ ≥ 0, has
    tr(A^{−½} R A^{−½}) ≤ ``truncation``, so that (1 − truncation)(H + A) ≤ L Lᵀ + A ≤ H + A: no deflection changes by
    more than this fraction (C8 of docs/theory.md). Rounding, 1e-14 of the greatest trace of H, is always left out, and
    nothing else where there is no law (Higham, Accuracy and Stability of Numerical Algorithms, §10.3).
    """
    from gearbench.contact._kernels import pivoted_cholesky

    law = stiffness.any()
    weight = np.ascontiguousarray(stiffness) if law else np.ones(stiffness.shape)
    trace = np.einsum("pii,pi->p", matrix, weight).max(initial=0.0)
    limit = max(truncation if law else 0.0, RANK_TOLERANCE * trace)
    L = np.empty(matrix.shape)
    rank = pivoted_cholesky(np.ascontiguousarray(matrix), weight, limit, L)
    return np.ascontiguousarray(np.swapaxes(L[:, :rank], 1, 2))
