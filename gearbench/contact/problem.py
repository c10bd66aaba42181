"""The dimensionless contact problem at every position of a mesh cycle and its solution, as arrays.

``assemble`` makes the problem, ``solver`` solves it. A segment is a piece of a contact line that carries one force: a
cell, over which the gap may vary, or a Gauss point.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.base import ComplianceEffect, Effect
from gearbench.geometry.action import ContactLines

#: Largest tr(A^{−½} (H − Ψ Ψᵀ) A^{−½}) that the factor Ψ may leave out of the smooth compliance H. A is the compliance
#: of the contact law (C8 of docs/algorithms.md). Compliances change by less than this fraction.
TRUNCATION = 1e-4
#: Trace of H − Ψ Ψᵀ at the level of rounding, divided by the trace of H.
RANK_TOLERANCE = 1e-14


@dataclass(frozen=True, kw_only=True)
class Cells:
    """Cells along contact lines, with the data from which the contact problem at other nodes on the lines follows.

    Parameters
    ----------
    effects
        Acting effects.
    lines
        Lines whose segments are cells.
    gaps
        Total gap at the beginning, middle and end of cells, (position, pair, segment, 3) [mm].
    smooth_lines
        The same lines with Gauss points instead of cells, see ``ContactLines.smooth_lines``.
    factor
        Ψ at the nodes of ``smooth_lines``, (position, pair, node, rank).
    interpolation
        Matrix from values at these nodes to values at the beginning, middle and end of cells, (position, pair, segment,
        3, node).
    laws
        Effects that are contact laws.
    nodes
        Number of points on the patches of a line, the same at all positions.
    share
        Load at each position divided by the load of the problem, (position,).
    field
        Gap that elastic bodies open under the loads of other meshes, at the nodes of ``smooth_lines``, (position, pair,
        node) [mm]; ``gaps`` include it.
    """

    effects: tuple[Effect, ...]
    lines: ContactLines
    gaps: NDArray
    smooth_lines: ContactLines
    factor: NDArray
    interpolation: NDArray
    laws: tuple[ComplianceEffect, ...]
    nodes: int
    share: NDArray
    field: NDArray | None = None

    @cached_property
    def means(self) -> NDArray:
        """Matrix from values at the nodes of ``smooth_lines`` to means over cells, (position, pair, segment, node)."""
        return np.array([1.0, 4.0, 1.0]) / 6 @ self.interpolation  # Simpson's rule

    def part(self, positions: slice | NDArray) -> Cells:
        """Data of some of the positions."""
        names = ("gaps", "factor", "interpolation", "share", *(() if self.field is None else ("field",)))
        arrays = {name: getattr(self, name)[positions] for name in names}
        return replace(self, lines=self.lines.part(positions), smooth_lines=self.smooth_lines.part(positions), **arrays)


@dataclass(frozen=True, kw_only=True)
class ContactProblem:
    """Contact problem: H P + g(P) + e = δ on loaded segments, ≥ δ on separated ones, P ≥ 0, ΣP = 1.

    The unknowns are the forces P of the segments and the approach δ of the gears (C1 of docs/theory.md).

    H = Ψ Ψᵀ is the smooth compliance: all compliance but the contact law. It has one block for every tooth pair, or a
    single block if pairs deflect each other. Forces are in units of the normal force F_bn, displacements in units of
    ``length_scale``. ``gearbench.contact.law`` defines the law g of a segment. Without a law (a = h = 0) H must be
    positive definite.

    Parameters
    ----------
    gap, a, h, sigma, active
        Arrays (position, segment) with the segments of all pairs in one axis: gap e at that end of the segment which
        touches first, coefficients a and h of the law, σ, which is half the variation of e along the segment, and
        whether the segment exists.
    factor
        Ψ, (position, segment, rank).
    block
        Number of the block of each segment, (segment,). Segments of a block share the amplitudes q = Ψᵀ P.
    blocks
        Number of blocks.
    force
        Normal force F_bn [N].
    length_scale
        Unit of displacement λ [mm].
    shape
        (positions, pairs, segments) of the arrays before pairs and segments became one axis.
    cells
        Data of the cells; None if segments are Gauss points.
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
    cells: Cells | None = None


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
        max |min(P_i / F, d_i / λ)| over the segments, (position,), with the distance d_i of the loaded flanks. In each
        segment one of the two should be zero.
    coarse_approach, coarse_stiffness
        Approach and stiffness before the last update of the ends of contact patches; the difference estimates the
        error due to these ends. Without patches they equal ``approach`` and ``stiffness``.
    iterations
        Number of Newton steps, (position,).
    corrected
        Number of positions that ``correct_rounding`` solved again because of rounding errors.
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
    corrected: int = 0


def part_of(problem: ContactProblem, positions: slice | NDArray) -> ContactProblem:
    """Problem at some of the positions."""
    arrays = {name: getattr(problem, name)[positions] for name in ("gap", "a", "h", "sigma", "active", "factor")}
    cells = problem.cells.part(positions) if problem.cells else None
    return replace(problem, **arrays, shape=(len(arrays["gap"]), *problem.shape[1:]), cells=cells)


def under_shares(problem: ContactProblem, share: NDArray) -> ContactProblem:
    """``problem`` with the load at each position multiplied by ``share`` (position,).

    The unit of displacement is taken proportional to the load, so that only gaps and law change: with f = F′/F they
    become e′ = e/f, σ′ = σ/f and g′(P) = g(fP)/f, that is a′ = a − h ln f. ``force`` and ``length_scale`` remain those
    of the full load.
    """
    f = share[:, None]
    cells = replace(problem.cells, share=problem.cells.share * share) if problem.cells else None
    a = problem.a - problem.h * np.log(f)
    return replace(problem, gap=problem.gap / f, sigma=problem.sigma / f, a=a, cells=cells)


def full_factor(problem: ContactProblem, position: int) -> NDArray:
    """Ψ of the existing segments at a position, with the columns of all blocks side by side, (segment, block·rank)."""
    active = problem.active[position]
    factor = problem.factor[position][active]
    full = np.zeros((len(factor), problem.blocks, factor.shape[1]))
    full[np.arange(len(factor)), problem.block[active]] = factor
    return full.reshape(len(factor), -1)


def reduce_rank(problem: ContactProblem, truncation: float = 0.0) -> ContactProblem:
    """Problem whose factors Ψ have no more columns than their numerical rank, or fewer with a ``truncation``.

    On the few segments of a contact line the smooth compliance has fewer independent columns than the tooth has Ritz
    functions: their rank is two for a spur pair with the basis of Garambois et al. (2017), six for a helical pair.
    """
    positions, segments, columns = problem.factor.shape
    if columns == 0:
        return problem
    shape = (positions * problem.blocks, segments // problem.blocks)
    factor = np.where(problem.active[..., None], problem.factor, 0.0).reshape(*shape, columns)
    root = truncated_root(gram(factor), stiffness_of_law(problem).reshape(shape), truncation)
    return replace(problem, factor=root.reshape(positions, segments, -1))


def stiffness_of_law(problem: ContactProblem) -> NDArray:
    """Greatest stiffness dP/dg that the law of each existing segment has under any load, (position, segment).

    It is 1/h for a logarithmic law (its slope at large forces), 1/a for a linear law, and 0 without a law.
    """
    compliance = np.where(problem.h > 0, problem.h, problem.a)
    return np.where(problem.active & (compliance > 0), 1 / np.where(compliance > 0, compliance, 1.0), 0.0)


def gram(factor: NDArray) -> NDArray:
    """Ψ Ψᵀ (…, n, n) for many Ψ (…, n, m) at once."""
    return factor @ np.swapaxes(factor, -1, -2)


def truncated_root(matrix: NDArray, stiffness: NDArray, truncation: float) -> NDArray:
    """L (block, n, rank) with L Lᵀ ≈ H for many H (block, n, n) at once, by pivoted Cholesky factorisation.

    A = diag(1/``stiffness``) is the compliance of the contact law, with its ``stiffness`` (block, n). The part left
    out, R = H − L Lᵀ ≥ 0, has tr(A^{−½} R A^{−½}) ≤ ``truncation``. Thus (1 − truncation)(H + A) ≤ L Lᵀ + A ≤ H + A: no
    deflection changes by more than this fraction (C8 of docs/algorithms.md). Without a law only rounding is left out,
    ``RANK_TOLERANCE`` of the greatest trace of H (Higham, Accuracy and Stability of Numerical Algorithms, §10.3).
    """
    from gearbench.contact._kernels import pivoted_cholesky

    law = stiffness.any()
    weight = np.ascontiguousarray(stiffness) if law else np.ones(stiffness.shape)
    trace = np.einsum("pii,pi->p", matrix, weight).max(initial=0.0)
    limit = max(truncation if law else 0.0, RANK_TOLERANCE * trace)
    L = np.empty(matrix.shape)
    rank = pivoted_cholesky(np.ascontiguousarray(matrix), weight, limit, L)
    return np.ascontiguousarray(np.swapaxes(L[:, :rank], 1, 2))
