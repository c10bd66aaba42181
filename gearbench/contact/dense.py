"""Active-set solver with full matrices, for compliances without a contact law and solutions that rounding spoils."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.law import compression, slope
from gearbench.contact.problem import ContactProblem, full_factor

#: Steps of Newton's method on the contact set; afterwards one segment changes at a time.
FULL_STEPS = 30
#: Linearisations of the contact law in ``correct_rounding``; each squares the residual.
CORRECTION_STEPS = 4
#: Smallest force at which a contact law is linearised, since its slope at zero is infinite.
LEAST_FORCE = 1e-15


def solve_dense(problem: ContactProblem) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Solve every position; return forces (position, segment), δ, ∂F/∂δ and the numbers of steps."""
    count = problem.gap.shape[0]
    force = np.zeros(problem.gap.shape)
    delta, stiffness, steps = np.empty(count), np.empty(count), np.empty(count, np.int64)
    for p in range(count):
        active, psi = problem.active[p], full_factor(problem, p)
        force[p, active], delta[p], stiffness[p], steps[p] = active_set(psi @ psi.T, problem.gap[p, active])
    return force, delta, stiffness, steps


def correct_rounding(problem: ContactProblem, position: int, force: NDArray) -> tuple[NDArray, float, float, int]:
    """Remove rounding errors from forces of a position; returns forces (segment,), δ, ∂F/∂δ and the number of steps.

    If the law is a million times stiffer than the teeth, the forces P = s/a that follow from the amplitudes lose six
    digits. Here the forces are the unknowns and the law is linearised about them, so that no division by a is needed.
    """
    active, psi = problem.active[position], full_factor(problem, position)
    p = problem
    H, e, a, h, sigma = psi @ psi.T, *(x[position, active] for x in (p.gap, p.a, p.h, p.sigma))
    P, delta, stiffness, steps = force[active], 0.0, 0.0, 0
    for _ in range(CORRECTION_STEPS):
        P0 = np.maximum(P, LEAST_FORCE)
        g, dg = compression(P0, a, h, sigma), slope(P0, a, h, sigma)
        P, delta, stiffness, count = active_set(H + np.diag(dg), e + g - dg * P0)
        steps += count
    all_forces = np.zeros_like(force)
    all_forces[active] = P
    return all_forces, delta, stiffness, steps


def active_set(H: NDArray, e: NDArray) -> tuple[NDArray, float, float, int]:
    """Solve H P + e ≥ δ, P ≥ 0, ΣP = 1 with complementarity, for positive definite H.

    Newton's method on the contact set usually ends in a few steps but may cycle. Then one segment changes at a time,
    which lowers the energy in every step and therefore ends (Lawson and Hanson, Solving Least Squares Problems, 1974,
    chapter 23).

    Returns
    -------
    P, δ, ∂F/∂δ and the number of steps.
    """
    loaded = np.ones(e.size, dtype=bool)
    for step in range(FULL_STEPS):
        P, delta, stiffness = _equal_approach(H, e, loaded)
        next_loaded = np.where(loaded, P > 0, _gap(H, e, P, delta) < 0)
        if np.array_equal(next_loaded, loaded):
            return P, delta, stiffness, step + 1
        loaded = next_loaded
    return one_at_a_time(H, e)


def one_at_a_time(H: NDArray, e: NDArray) -> tuple[NDArray, float, float, int]:
    """``active_set`` by changes of one segment at a time, with the same results."""
    loaded = np.zeros(e.size, dtype=bool)
    loaded[np.argmin(0.5 * np.diagonal(H) + e)] = True
    P, delta, stiffness = _equal_approach(H, e, loaded)
    steps = FULL_STEPS + 1
    while steps < FULL_STEPS + 10 * e.size + 10:  # far more than needed; rounding might cycle
        gap = np.where(loaded, np.inf, _gap(H, e, P, delta))
        worst = int(np.argmin(gap))
        if gap[worst] >= 0:
            break
        loaded[worst] = True
        trial, delta, stiffness = _equal_approach(H, e, loaded)
        while np.any(trial < 0):  # step until a force reaches zero, and let this segment separate
            falling = trial < 0
            P = P + np.min(P[falling] / (P[falling] - trial[falling])) * (trial - P)
            loaded &= ~(falling & (P <= 1e-14))  # zero but for rounding
            P[~loaded] = 0.0
            trial, delta, stiffness = _equal_approach(H, e, loaded)
        P = trial
        steps += 1
    return P, delta, stiffness, steps


def _equal_approach(H: NDArray, e: NDArray, loaded: NDArray) -> tuple[NDArray, float, float]:
    """P = H⁻¹(δ1 − e) with ΣP = 1, under which all loaded segments approach by δ; then δ and the stiffness 1ᵀH⁻¹1."""
    A = np.flatnonzero(loaded)
    x, z = np.linalg.solve(H[np.ix_(A, A)], np.column_stack([np.ones(A.size), e[A]])).T
    delta = (1 + z.sum()) / x.sum()
    P = np.zeros(e.size)
    P[A] = delta * x - z
    return P, float(delta), float(x.sum())


def _gap(H: NDArray, e: NDArray, P: NDArray, delta: float) -> NDArray:
    """Gap H P + e − δ; values within rounding are set to zero."""
    gap = H @ P + e - delta
    return np.where(np.abs(gap) > 1e-14 * (np.abs(e) + abs(delta) + np.abs(H) @ np.abs(P)), gap, 0.0)
