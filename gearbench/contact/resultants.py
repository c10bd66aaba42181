"""Resultants of the flank forces of a mesh (force, moment, …), and their stiffness against approach, tilt and so on.

In the plane of action a point of the flank has the dimensionless lever arm η = (y − b/2 + (u − u_C) tan β_b) / (b/2)
about the middle of the face. Gears that are rigid across their faces approach each other by x₀ + x₁ η. The forces that
do work on x₀ and x₁ are f₀ = ΣF and f₁ = Σ F η. Bending over the face adds Legendre polynomials P_j(η) (W11 of
docs/theory.md). The axis ``row`` of arrays counts the resultants.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from gearbench.contact.batch import Batch, BatchSolution, existing_first
from gearbench.contact.law import slope
from gearbench.contact.patches import on_patches
from gearbench.contact.problem import ContactProblem, ContactSolution, gram
from gearbench.contact.solver import Guess, has_law, law_forces
from gearbench.geometry.action import ContactLines

#: Stiffness that is added to each resultant, in units of the problem, because a resultant has none if too few segments
#: are loaded.
ADDED_STIFFNESS = 1e-9


@dataclass(frozen=True, kw_only=True)
class Resultants:
    """Resultants of the flank forces at each position, along the line of action in the transverse plane.

    Parameters
    ----------
    force
        f (position, row), or for samples (sample, position, row) [N].
    stiffness
        ∂f/∂x (position, row, row), or for samples (sample, position, row, row) [N/mm].
    """

    force: NDArray
    stiffness: NDArray


def lever(lines: ContactLines) -> NDArray:
    """Lever arm η of the segments, (position, pair, segment); from −1 to 1 over the face of spur gears."""
    meshing = lines.pair.meshing
    b, tan_b = meshing.face_width, math.tan(meshing.beta_b)
    return (lines.y - b / 2 + (lines.u - meshing.pitch_point) * tan_b) / (b / 2)


def resultants(
    problem: ContactProblem, lines: ContactLines, solution: ContactSolution, guess: Guess, rows: int
) -> Resultants:
    """The first ``rows`` resultants of the ``solution`` of ``problem`` on ``lines``; ``guess`` is its last iterate.

    The loaded points have the compliance A = ΨΨᵀ + diag(dg/dP), so ∂f/∂x = Rᵀ A⁻¹ R with R_ij = P_j(η_i) (W12 of
    docs/theory.md).
    """
    p, nodes = (problem, lines) if problem.cells is None else on_patches(problem, guess)[:2]
    P = law_forces(p, guess.delta, guess.q) if has_law(p) else (solution.force / p.force).reshape(p.gap.shape)
    loaded = p.active & (P > 0)
    dg = slope(np.where(loaded, P, 1.0), p.a, p.h, p.sigma) if has_law(p) else np.zeros_like(P)
    same = p.block[:, None] == p.block
    A = np.where(loaded[:, :, None] & loaded[:, None, :] & same, gram(p.factor), 0.0)
    index = np.arange(A.shape[-1])
    A[:, index, index] = np.where(loaded, A[:, index, index] + dg, 1.0)
    R = row_shapes(nodes, rows).reshape(*P.shape, rows) * loaded[..., None]
    stiffness = np.swapaxes(R, 1, 2) @ np.linalg.solve(A, R)
    return _in_units(p, lines, np.einsum("ps,psr->pr", P, R), stiffness)


def row_shapes(lines: ContactLines, rows: int) -> NDArray:
    """R (position, pair, segment, row) = P_j(η) of the segments."""
    return legvander(lever(lines), rows - 1)


def resultants_of_samples(batch: Batch, lines: ContactLines, solution: BatchSolution, rows: int) -> Resultants:
    """The first ``rows`` resultants of the samples of ``batch``, if all segments on ``lines`` deflect each other."""
    from gearbench.contact._batch_kernels import schur_complements

    slope, factor, problem = solution.slope, batch.factor, batch.problem
    R = existing_first(problem)(row_shapes(lines, rows).reshape(*problem.active.shape, rows))
    size, complements = factor.shape[-1] + rows, np.empty((len(slope), rows, rows, slope.shape[-1]))
    addend = np.append(np.ones(factor.shape[-1]), np.full(rows, ADDED_STIFFNESS))
    i, j = np.tril_indices(size)
    for t in range(len(slope)):
        # with W = dP/ds, Rᵀ A⁻¹ R is the Schur complement of the rows in (Ψ R)ᵀ W (Ψ R) + diag(1, 0)
        both = np.concatenate([factor[t], R[t]], axis=1)
        product = (both[:, i] * both[:, j]).T @ slope[t]
        product[i == j] += addend[:, None]
        schur_complements(product, size, rows, complements[t])
    stiffness = np.ascontiguousarray(np.moveaxis(complements, -1, 0))
    force = np.swapaxes(np.swapaxes(solution.force, 1, 2) @ R, 0, 1)
    return _in_units(problem, lines, force, stiffness)


def _in_units(problem: ContactProblem, lines: ContactLines, force: NDArray, stiffness: NDArray) -> Resultants:
    """Resultants [N] and stiffness [N/mm] in the transverse plane, from dimensionless ones normal to the flank."""
    cos_b = math.cos(lines.pair.meshing.beta_b)
    unit = problem.force / problem.length_scale * cos_b**2
    return Resultants(
        force=problem.force * cos_b * force, stiffness=unit * (stiffness + np.swapaxes(stiffness, -1, -2)) / 2
    )
