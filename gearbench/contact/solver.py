"""Solution of the contact problem at every position: choice of the method, and checks of the residuals."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.dense import correct_rounding, solve_dense
from gearbench.contact.problem import ContactProblem, ContactSolution
from gearbench.errors import GearbenchError

if TYPE_CHECKING:
    from gearbench.contact._kernels import Arrays

#: Residual above which ``ConvergenceError`` is raised.
RESIDUAL_LIMIT = 1e-9
#: Rounding of the approach relative to it. Under tiny loads, deflections are tiny against the gaps of other segments.
ROUNDING = 1e-14
#: Residual above which a position is solved again with its forces as unknowns (``correct_rounding``).
ROUNDING_LIMIT = 1e-10
#: Maximum number of Newton steps at a position.
MAX_STEPS = 200
#: The unknowns of Newton's method are the forces, instead of the amplitudes, if all segments share their amplitudes and
#: there are fewer than DENSE segments for each amplitude, or 2·DENSE if there are at most FEW segments. The matrix,
#: with one row for each loaded segment, is then smaller.
DENSE, FEW = 2.0, 48
#: Residual at which Newton's method takes its last step in a rough solution. This step squares the residual.
ROUGH = 1e-6


class ConvergenceError(GearbenchError):
    """The contact problem was not solved to the required residual."""


@dataclass(frozen=True, kw_only=True)
class Guess:
    """Initial guess of Newton's method; its arrays hold the solution afterwards.

    Parameters
    ----------
    q
        Amplitudes, (position, block, rank).
    delta
        Approach δ [``length_scale``], (position,); −∞ without a guess.
    """

    q: NDArray
    delta: NDArray

    @classmethod
    def empty(cls, problem: ContactProblem) -> Guess:
        """Arrays without a guess."""
        positions = len(problem.gap)
        return cls(
            q=np.zeros((positions, problem.blocks, problem.factor.shape[2])), delta=np.full(positions, -math.inf)
        )


def solve(problem: ContactProblem, guess: Guess | None = None) -> ContactSolution:
    """Solve ``problem`` by Newton's method or, if there is no contact law, by an active-set method with full matrices.

    The unknowns are the amplitudes q of the smooth compliance and the approach δ. Each force follows from the law of
    its segment, P_i = g_i⁻¹(max(0, δ − e_i − ψ_iᵀq)). The solution minimises a convex function (C4 of
    docs/algorithms.md), so Newton's method with line search converges from any start.

    Raises
    ------
    ConvergenceError
        If a residual stays above ``RESIDUAL_LIMIT`` and rounding, or no teeth are in mesh at some position.
    """
    if not problem.active.any(axis=1).all():
        raise ConvergenceError("contact not solved: no teeth are in mesh at some mesh phase")
    least, p = subtract_smallest_gap(problem)
    if has_law(p):
        guess = guess or Guess.empty(p)
        guess.delta[:] -= least
        force, delta, stiffness, steps = newton(p, guess=guess)
        guess.delta[:] = delta + least
    else:
        force, delta, stiffness, steps = solve_dense(p)
    residual = _residual(p, force, delta)
    inaccurate = np.flatnonzero(~(residual.max(axis=0) <= ROUNDING_LIMIT))
    if inaccurate.size:
        _correct_rounding(p, inaccurate, force, delta, stiffness, steps)
        residual = _residual(p, force, delta)
    if not (residual.max(axis=0) <= np.maximum(RESIDUAL_LIMIT, ROUNDING * np.abs(delta))).all():
        raise ConvergenceError(f"contact not solved: residual {residual.max():.1e} after {int(steps.max())} steps")
    approach, stiffness = p.length_scale * (delta + least), p.force / p.length_scale * stiffness
    return ContactSolution(
        force=p.force * force.reshape(p.shape),
        approach=approach,
        stiffness=stiffness,
        coarse_approach=approach,
        coarse_stiffness=stiffness,
        equilibrium=residual[0],
        least_force=force.min(axis=1),
        complementarity=residual[1],
        iterations=steps,
        corrected=inaccurate.size,
    )


def solve_roughly(problem: ContactProblem, guess: Guess, tolerance: float = ROUGH) -> tuple[NDArray, NDArray]:
    """Rough solution: approach δ_n [mm] and ∂F_bn/∂δ_n [N/mm], (position,).

    With a contact law, Newton's method takes its last step once the residual is below ``tolerance``. The residual after
    this step is not checked. ``guess`` holds the solution afterwards.
    """
    least, p = subtract_smallest_gap(problem)
    if not has_law(p):
        solution = solve(problem, guess)
        return solution.approach, solution.stiffness
    guess.delta[:] -= least
    _, delta, stiffness, _ = newton(p, guess=guess, tolerance=tolerance)
    guess.delta[:] = delta + least
    return p.length_scale * guess.delta, p.force / p.length_scale * stiffness


def has_law(problem: ContactProblem) -> bool:
    """Whether there is a contact law in addition to the smooth compliance."""
    return bool(problem.a.any() or problem.h.any())


def subtract_smallest_gap(problem: ContactProblem) -> tuple[NDArray, ContactProblem]:
    """Smallest gap of each position, and the problem with this gap subtracted.

    The approach then has the size of the deflection. With a gap of a million deflections it would lose six digits.
    """
    least = np.min(np.where(problem.active, problem.gap, np.inf), axis=1)
    return least, replace(problem, gap=problem.gap - least[:, None])


def solves_for_forces(p: ContactProblem) -> bool:
    """Whether the unknowns of Newton's method are the forces of ``p`` instead of the amplitudes."""
    segments = p.active.sum() / len(p.active)
    dense = DENSE * (2 if segments <= FEW else 1)
    return bool(p.blocks == 1 and dense * p.factor.shape[2] > segments)


def newton(
    p: ContactProblem,
    limit: int = MAX_STEPS,
    guess: Guess | None = None,
    tolerance: float = 0.0,
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Newton's method: dimensionless forces (position, segment), δ, ∂F/∂δ and numbers of steps, at most ``limit``.

    The smallest gap of each position must be zero. The amplitudes of ``guess`` become those of the solution. Once the
    residual has fallen to ``tolerance``, one last step follows; it gives the forces by the linearised law.
    """
    from gearbench.contact._force_kernels import solve_for_forces
    from gearbench.contact._kernels import Work, solve_positions

    count = len(p.gap)
    force, steps, stiffness = np.zeros_like(p.gap), np.zeros(count, dtype=np.int64), np.empty(count)
    guess = guess or Guess.empty(p)
    delta = guess.delta.copy()
    arguments = guess.q, delta, tolerance, limit, force, stiffness, steps
    if solves_for_forces(p):
        solve_for_forces(arrays(p), *arguments)
    else:
        _, segments, rank = p.factor.shape
        solve_positions(arrays(p), Work.of(p.blocks, rank, segments), *arguments)
    return force, delta, stiffness, steps


def arrays(p: ContactProblem) -> Arrays:
    """Arrays of a problem for the compiled solvers."""
    from gearbench.contact._kernels import Arrays

    block = np.tile(p.block, (len(p.gap), 1))
    return Arrays(p.gap, p.a, p.h, p.sigma, p.active, p.factor, block)


def law_forces(problem: ContactProblem, delta: NDArray, q: NDArray) -> NDArray:
    """Forces (position, segment) by the contact law, from δ (position,) and amplitudes q (position, block, rank)."""
    return forces_and_slopes(problem, delta[:, None] - smooth_deflections(problem, q) - problem.gap)[0]


def smooth_deflections(problem: ContactProblem, q: NDArray) -> NDArray:
    """z = Ψ q of all segments (position, segment), from amplitudes q (position, block, rank)."""
    of_lines = q[:, problem.block[:: problem.shape[2]], :, None]
    return (problem.factor.reshape(*problem.shape, -1) @ of_lines).reshape(problem.gap.shape)


def forces_and_slopes(problem: ContactProblem | Arrays, s: NDArray) -> tuple[NDArray, NDArray]:
    """Forces and slopes of the contact law under compressions s (position, segment); 0 for absent segments."""
    from gearbench.contact._law_kernels import law_forces as forces

    p, result = problem, np.zeros((2, *s.shape))
    result[:, p.active] = forces(s[p.active], p.a[p.active], p.h[p.active], p.sigma[p.active])
    return result[0], result[1]


def _residual(p: ContactProblem, force: NDArray, delta: NDArray) -> NDArray:
    """Residuals of equilibrium and of complementarity, (2, position)."""
    return np.stack([np.abs(force.sum(axis=1) - 1), complementarity_residual(p, force, delta)])


def _correct_rounding(
    p: ContactProblem, positions: NDArray, force: NDArray, delta: NDArray, stiffness: NDArray, steps: NDArray
) -> None:
    """Solve ``positions`` again with ``correct_rounding``, which changes the other arrays in place."""
    for i in positions:
        try:
            force[i], delta[i], stiffness[i], more = correct_rounding(p, int(i), force[i])
        except np.linalg.LinAlgError:
            raise ConvergenceError("contact not solved: the compliance is singular") from None
        steps[i] += more


def complementarity_residual(problem: ContactProblem, force: NDArray, delta: NDArray) -> NDArray:
    """max |min(P, distance)| of each position, (position,).

    The distance of the loaded flanks, H P + g(P) + e − δ, is computed from the forces.
    """
    from gearbench.contact._kernels import complementarity

    residual = np.empty(len(delta))
    complementarity(arrays(problem), force, delta, residual)
    return residual
