"""Compiled Newton solver of the contact problem (``problem.ContactProblem``), called by ``solver``.

The unknowns of a position are the amplitudes q of the smooth deflection and the approach δ; the solution minimises a
convex function J(q, δ) (C4 of docs/algorithms.md). Index i counts positions, j segments, k blocks, and c columns of the
factor Ψ. The tests compare the solver with a readable NumPy version.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.compiled import SUMS, entry, part
from gearbench.contact._law_kernels import CONSTANTS, SCRATCH, apply_laws, law, law_constants
from gearbench.contact.law import LARGEST_EXPONENT, TANGENT_FROM

#: Newton's method ends after this number of steps in turn that do not lower J: only rounding is left. Two or three may
#: occur near convergence.
IDLE_STEPS = 8
#: It also ends after two steps in turn that leave more than the first fraction of the residual, if this is below the
#: second number times the greatest amplitude (or times 1, if that is more).
STALLED, STALL_LEVEL = 0.5, 1e-11
#: Line search: part of the linear decrease of J that suffices; rounding of J relative to J; shortest step.
SUFFICIENT, ROUNDING_OF_J, SHORTEST_STEP = 1e-4, 1e-14, 1e-12


class Arrays(NamedTuple):
    """Arrays of a ``ContactProblem`` under the same names; ``block`` is (position, segment)."""

    gap: NDArray
    a: NDArray
    h: NDArray
    sigma: NDArray
    active: NDArray
    factor: NDArray
    block: NDArray


class Work(NamedTuple):
    """Scratch arrays of a position.

    ``q`` (block, rank) holds the first guess of the amplitudes, and the solution afterwards. ``trial`` is q during the
    line search, ``step`` the change of q, x scratch of ``newton_direction``. ``grad`` holds the derivatives of J by q,
    ``cross`` their derivatives by −δ, all (block, rank); ``hess`` is the Hessian (block, rank, rank). ``constants`` and
    ``scratch`` (…, segment) belong to the contact law; the last row of ``scratch`` holds the compressions s. ``weight``
    holds the slopes dP/ds of the segments, ``loaded`` the numbers of the loaded ones.
    """

    q: NDArray
    trial: NDArray
    step: NDArray
    x: NDArray
    grad: NDArray
    cross: NDArray
    hess: NDArray
    constants: NDArray
    scratch: NDArray
    weight: NDArray
    loaded: NDArray

    @classmethod
    def of(cls, blocks: int, rank: int, segments: int) -> Work:
        """Scratch arrays for positions with the given numbers of blocks, columns and segments."""
        q, trial, step, x, grad, cross = np.empty((6, blocks, rank))
        constants, scratch = np.empty((CONSTANTS, segments)), np.empty((SCRATCH + 1, segments))
        return cls(
            q, trial, step, x, grad, cross, np.empty((blocks, rank, rank)), constants, scratch, np.empty(segments),
            np.empty(segments, dtype=np.int64),
        )  # fmt: skip


@part()
def compression(p, a, h, sigma):
    """Compression of a segment, or of the end of a cell that touches first, under the force p (``law.compression``)."""
    if sigma > 0.0:
        P_sigma = law(sigma, a, h)[0]
        if p < P_sigma:
            return 2.0 * sigma * math.sqrt(p / P_sigma)
    if p <= 0.0:
        return sigma
    if h == 0.0:
        return sigma + a * p
    edge = math.exp(min(a / h - TANGENT_FROM, LARGEST_EXPONENT))
    low = min(p, edge)
    return sigma + low * (a - h * math.log(low)) + h * (p - low)


@entry()
def complementarity(problem, force, delta, residual):
    """Fill ``residual`` with max |min(P, d)| of each position; d = H P + g(P) + e − δ is the distance of the flanks."""
    p = problem
    positions, n, rank = p.factor.shape
    q = np.empty((p.block.max() + 1, rank))
    for i in range(positions):
        q[:] = 0.0
        for j in range(n):
            if p.active[i, j]:
                for c in range(rank):
                    q[p.block[i, j], c] += p.factor[i, j, c] * force[i, j]
        residual[i] = 0.0
        for j in range(n):
            if p.active[i, j]:
                d = compression(force[i, j], p.a[i, j], p.h[i, j], p.sigma[i, j]) + p.gap[i, j] - delta[i]
                for c in range(rank):
                    d += p.factor[i, j, c] * q[p.block[i, j], c]
                violation = abs(min(force[i, j], d))
                # written so that NaN is kept
                if not violation <= residual[i] and not math.isnan(residual[i]):
                    residual[i] = violation


@part(SUMS)
def add_loaded(factor, block, loaded, weight, force, work):
    """Add the contributions of the ``loaded`` segments to gradient and Hessian of J, four of a block at a time."""
    grad, hess, cross = work.grad, work.hess, work.cross
    rank, n = factor.shape[1], 0
    while n < loaded.size:
        j0 = loaded[n]
        k = block[j0]
        p0, w0 = force[j0], weight[j0]
        # segments of a block need not be adjacent, so all four are checked
        four = n + 4 <= loaded.size and block[loaded[n + 1]] == k and block[loaded[n + 2]] == k
        if four and block[loaded[n + 3]] == k:
            j1, j2, j3 = loaded[n + 1], loaded[n + 2], loaded[n + 3]
            p1, p2, p3 = force[j1], force[j2], force[j3]
            w1, w2, w3 = weight[j1], weight[j2], weight[j3]
            for c in range(rank):
                f0, f1, f2, f3 = factor[j0, c], factor[j1, c], factor[j2, c], factor[j3, c]
                grad[k, c] -= p0 * f0 + p1 * f1 + p2 * f2 + p3 * f3
                f0, f1, f2, f3 = w0 * f0, w1 * f1, w2 * f2, w3 * f3
                cross[k, c] += f0 + f1 + f2 + f3
                for d in range(c + 1):
                    one = f0 * factor[j0, d] + f1 * factor[j1, d]
                    hess[k, c, d] += one + (f2 * factor[j2, d] + f3 * factor[j3, d])
            n += 4
            continue
        for c in range(rank):
            f0 = factor[j0, c]
            grad[k, c] -= p0 * f0
            f0 *= w0
            cross[k, c] += f0
            for d in range(c + 1):
                hess[k, c, d] += f0 * factor[j0, d]
        n += 1


@part(SUMS)
def fill_compressions(i, problem, q, delta, s):
    """Fill the compressions s = δ − e − Ψ q of the segments of position i; −1 for absent segments."""
    for j in range(s.size):
        s[j] = -1.0
        if problem.active[i, j]:
            s[j] = delta - problem.gap[i, j]
            for c in range(q.shape[1]):
                s[j] -= problem.factor[i, j, c] * q[problem.block[i, j], c]


@part(SUMS)
def derivatives(i, problem, q, delta, work, force):
    """Fill forces, gradient and Hessian blocks of J at position i; return ∂J/∂δ, ∂²J/∂δ² and J."""
    quadratic = 0.0
    for k in range(q.shape[0]):
        for c in range(q.shape[1]):
            work.grad[k, c], work.cross[k, c] = q[k, c], 0.0
            for d in range(c):
                work.hess[k, c, d] = 0.0
            work.hess[k, c, c] = 1.0
            quadratic += 0.5 * q[k, c] * q[k, c]
    s, count = work.scratch[SCRATCH], 0
    fill_compressions(i, problem, q, delta, s)
    total, slope, energy = apply_laws(s, work.constants, work.scratch, force, work.weight)
    for j in range(s.size):
        if force[j] > 0.0:
            work.loaded[count] = j
            count += 1
    add_loaded(problem.factor[i], problem.block[i], work.loaded[:count], work.weight, force, work)
    return total - 1.0, slope, quadratic + energy - delta


@part(SUMS)
def newton_direction(total, slope, work):
    """Newton step of δ, and ∂F/∂δ, by eliminating the amplitudes of each block; fills the step of q.

    With the Cholesky factor L of a block of the Hessian: y = L⁻¹ cross, x = L⁻¹ grad and step = L⁻ᵀ (y dδ − x), the
    Newton equations (C6) of docs/theory.md. ``step`` holds y at first.
    """
    grad, hess, cross, x, step = work.grad, work.hess, work.cross, work.x, work.step
    n = grad.shape[1]
    stiffness, right = slope, -total
    for k in range(grad.shape[0]):
        for c in range(n):
            y, z = cross[k, c], grad[k, c]
            for d in range(c + 1):
                t = hess[k, c, d]
                for f in range(d):
                    t -= hess[k, c, f] * hess[k, d, f]
                hess[k, c, d] = math.sqrt(t) if c == d else t / hess[k, d, d]
            for f in range(c):
                y -= hess[k, c, f] * step[k, f]
                z -= hess[k, c, f] * x[k, f]
            step[k, c], x[k, c] = y / hess[k, c, c], z / hess[k, c, c]
            stiffness -= step[k, c] * step[k, c]
            right -= step[k, c] * x[k, c]
    step_d = right / stiffness
    for k in range(grad.shape[0]):
        for c in range(n - 1, -1, -1):
            t = step[k, c] * step_d - x[k, c]
            for f in range(c + 1, n):
                t -= hess[k, f, c] * step[k, f]
            step[k, c] = t / hess[k, c, c]
    return step_d, stiffness


@part()
def closing_direction(i, problem, q, delta, work):
    """Step of δ that compresses one segment by 1, if no segment touches; fills the step of q by steepest descent."""
    s, step_d = work.scratch[SCRATCH], math.inf
    fill_compressions(i, problem, q, delta, s)
    for j in range(s.size):
        if problem.active[i, j]:
            step_d = min(step_d, -s[j])
    work.step[:] = -work.grad
    return step_d + 1.0


@part()
def first_approach(gap, a, h, sigma, active, factor):
    """First guess of δ: all segments touch, but δ is at most that at which a single segment carries the full load."""
    greatest_gap, alone = -math.inf, math.inf
    for j in range(gap.size):
        if not active[j]:
            continue
        greatest_gap = max(greatest_gap, gap[j])
        # compression under the full load, 1: of a partly loaded cell, or at most this
        P_sigma = law(sigma[j], a[j], h[j])[0]
        most = sigma[j] + max(a[j], TANGENT_FROM * h[j])
        delta = gap[j] + (2.0 * sigma[j] / math.sqrt(P_sigma) if P_sigma > 1.0 else most)
        for c in range(factor.shape[1]):
            delta += factor[j, c] * factor[j, c]
        alone = min(alone, delta)
    return min(greatest_gap + 1.0, alone)


@entry()
def solve_positions(problem, work, q, delta, tolerance, limit, force, stiffness, steps):
    """Solve every position of a problem for its amplitudes q (position, block, rank) and approach δ.

    q and δ hold the guess (δ = −∞ for none), and the solution afterwards. Fills forces, ∂F/∂δ and the numbers of steps,
    at most ``limit``. If ``tolerance`` is positive, a position without guess starts from the forces of the previous
    position, see ``_force_kernels.solve_for_forces``.
    """
    for i in range(len(delta)):
        work.q[:] = q[i]
        if tolerance > 0.0 and i > 0 and delta[i] == -math.inf:
            delta[i] = guess_from_forces(i, problem, force[i - 1], delta[i - 1], work.q)
        delta[i], stiffness[i], steps[i] = solve_position(i, problem, work, delta[i], tolerance, limit, force[i])
        q[i] = work.q


@part(SUMS)
def guess_from_forces(i, problem, forces, delta, q):
    """Fill the amplitudes q = Ψᵀ P of position i under ``forces`` of other segments; return δ, −∞ if none is loaded."""
    total = 0.0
    q[:] = 0.0
    for j in range(forces.size):
        if problem.active[i, j]:
            total += forces[j]
    if not total > 0.0:
        return -math.inf
    for j in range(forces.size):
        if problem.active[i, j] and forces[j] > 0.0:
            P, k = forces[j] / total, problem.block[i, j]
            for c in range(q.shape[1]):
                q[k, c] += P * problem.factor[i, j, c]
    return delta


@part()
def solve_position(i, problem, work, delta, tolerance, limit, forces):
    """Newton's method with line search on the convex J(q, δ) of position i.

    J = ½|q|² + Σ ∫P ds − δ. Fills the ``forces``, leaves the amplitudes in work.q, and returns δ, ∂F/∂δ and the
    number of steps. If ``delta`` is finite, it and work.q are the first guess; otherwise there is none. When the
    residual has fallen to ``tolerance``, one last step squares it; the forces are those before this step.
    """
    p, q, trial = problem, work.q, work.trial
    law_constants(p.a[i], p.h[i], p.sigma[i], work.constants)
    if delta == -math.inf:
        delta = first_approach(p.gap[i], p.a[i], p.h[i], p.sigma[i], p.active[i], p.factor[i])
        q[:] = 0.0
    stiffness, best, stalled, idle, iteration = 0.0, math.inf, 0, 0, 0
    total, slope, value = derivatives(i, p, q, delta, work, forces)
    lowest = value
    while True:
        residual, size = abs(total), 1.0
        for k in range(q.shape[0]):
            for c in range(q.shape[1]):
                residual = max(residual, abs(work.grad[k, c]))
                size = max(size, abs(q[k, c]))
        # descent = gradient · step is computed first, because the trials below overwrite the gradient
        if slope > 0.0:
            step_d, stiffness = newton_direction(total, slope, work)
        else:
            step_d = closing_direction(i, p, q, delta, work)
        # rounding is reached when the residual no longer falls
        stalled = stalled + 1 if residual >= STALLED * best and residual <= STALL_LEVEL * size else 0
        best = min(best, residual)
        if residual <= 1e-15 * size or stalled >= 2 or idle >= IDLE_STEPS or iteration >= limit:
            break
        if residual <= tolerance * size and slope > 0.0:
            q += work.step
            return delta + step_d, stiffness, iteration + 1
        descent = total * step_d
        for k in range(q.shape[0]):
            for c in range(q.shape[1]):
                descent += work.grad[k, c] * work.step[k, c]
        t, before = 1.0, value
        while True:
            for k in range(q.shape[0]):
                for c in range(q.shape[1]):
                    trial[k, c] = q[k, c] + t * work.step[k, c]
            total, slope, value = derivatives(i, p, trial, delta + t * step_d, work, forces)
            enough = before + SUFFICIENT * t * descent + ROUNDING_OF_J * (abs(before) + 1.0)
            if value <= enough or t <= SHORTEST_STEP:
                break
            t *= 0.5
        q[:] = trial
        idle = idle + 1 if value >= lowest - ROUNDING_OF_J * (abs(lowest) + 1.0) else 0
        lowest = min(lowest, value)
        delta += t * step_d
        iteration += 1
    return delta, stiffness, iteration


@entry(SUMS)
def pivoted_cholesky(matrix, weight, limit, root):
    """Fill ``root`` (block, n, n) with the Cholesky factors of all H (block, n, n), largest pivot first.

    Rows of ``root`` are the columns of a factor; rows after the rank are zero. The factorisation of a block ends when
    Σ weight · diagonal of the remainder is at most ``limit``. Returns the greatest rank.
    """
    blocks, n, _ = matrix.shape
    diagonal = np.empty(n)
    greatest_rank = 0
    for b in range(blocks):
        for i in range(n):
            diagonal[i] = matrix[b, i, i]
        rank = n
        for k in range(n):
            remainder, pivot, best = 0.0, 0, 0.0
            for i in range(n):
                share = diagonal[i] * weight[b, i]
                remainder += share
                if share > best:
                    best, pivot = share, i
            if remainder <= limit or best <= 0.0:
                rank = k
                break
            row = root[b, k]
            for i in range(n):
                row[i] = matrix[b, pivot, i]
            f = 0
            while f + 4 <= k:
                r0, r1, r2, r3 = root[b, f], root[b, f + 1], root[b, f + 2], root[b, f + 3]
                t0, t1, t2, t3 = r0[pivot], r1[pivot], r2[pivot], r3[pivot]
                for i in range(n):
                    row[i] -= (t0 * r0[i] + t1 * r1[i]) + (t2 * r2[i] + t3 * r3[i])
                f += 4
            while f < k:
                t = root[b, f, pivot]
                for i in range(n):
                    row[i] -= t * root[b, f, i]
                f += 1
            scale = 1.0 / math.sqrt(diagonal[pivot])
            for i in range(n):
                row[i] *= scale
                diagonal[i] = max(diagonal[i] - row[i] * row[i], 0.0)
            diagonal[pivot] = 0.0
        root[b, rank:] = 0.0
        greatest_rank = max(greatest_rank, rank)
    return greatest_rank
