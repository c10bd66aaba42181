"""Compiled Newton solver of the contact problem; its readable twin is ``gearbench.contact.reference``."""

from __future__ import annotations

import numpy as np
from numba import njit

MAX_ITERATIONS = 200
#: a/h − ln P below which the law is continued by its tangent.
TANGENT_FROM = 2.0


@njit(cache=True, error_model="numpy")
def law(s, a, h):
    """Force P, slope dP/ds and energy ∫P ds of a segment compressed by s under g(P) = P (a − h ln P)."""
    if s <= 0.0:
        return 0.0, 0.0, 0.0
    if h == 0.0:
        p = s / a
        return p, 1.0 / a, 0.5 * s * p
    # with L = a/h − ln P: s = h P L, so that L − ln L = a/h + ln h − ln s
    level = a / h + np.log(h) - np.log(s)
    if level <= TANGENT_FROM - np.log(TANGENT_FROM):
        p0 = np.exp(a / h - TANGENT_FROM)
        over = s - h * p0 * TANGENT_FROM
        energy = h * p0 * p0 * (TANGENT_FROM / 2 - 0.25) + over * (p0 + over / (2 * h))
        return p0 + over / h, 1.0 / h, energy
    big = level + np.log(level) + 0.5
    for _ in range(20):
        step = (big - np.log(big) - level) * big / (big - 1.0)
        big -= step
        if abs(step) <= 1e-15 * big:
            break
    p = s / (h * big)
    return p, 1.0 / (h * (big - 1.0)), h * p * p * (big / 2 - 0.25)


@njit(cache=True, error_model="numpy")
def energy(q, step_q, t, delta, gap, a, h, active, factor, block):
    """Convex function J = ½|q + t·step_q|² + Σ ∫P ds − δ that the solution minimises."""
    total = -delta
    for k in range(q.shape[0]):
        for c in range(q.shape[1]):
            total += 0.5 * (q[k, c] + t * step_q[k, c]) ** 2
    for i in range(gap.size):
        if active[i]:
            k, s = block[i], delta - gap[i]
            for c in range(q.shape[1]):
                s -= factor[i, c] * (q[k, c] + t * step_q[k, c])
            total += law(s, a[i], h[i])[2]
    return total


@njit(cache=True, error_model="numpy")
def derivatives(q, delta, gap, a, h, active, factor, block, force, grad, hess, cross):
    """Fill forces, gradient and Hessian blocks of J; return ∂J/∂δ, ∂²J/∂δ² and J."""
    rank = q.shape[1]
    total, slope, value = -1.0, 0.0, -delta
    for k in range(q.shape[0]):
        for c in range(rank):
            grad[k, c], cross[k, c] = q[k, c], 0.0
            for d in range(c):
                hess[k, c, d] = 0.0
            hess[k, c, c] = 1.0
            value += 0.5 * q[k, c] * q[k, c]
    for i in range(gap.size):
        force[i] = 0.0
        if not active[i]:
            continue
        k = block[i]
        s = delta - gap[i]
        for c in range(rank):
            s -= factor[i, c] * q[k, c]
        p, w, e = law(s, a[i], h[i])
        force[i] = p
        total += p
        slope += w
        value += e
        if p == 0.0:
            continue
        for c in range(rank):
            fc = factor[i, c]
            grad[k, c] -= p * fc
            cross[k, c] += w * fc
            for d in range(c + 1):
                hess[k, c, d] += w * fc * factor[i, d]
    return total, slope, value


@njit(cache=True, error_model="numpy")
def cholesky_solve(k, m, x, y):
    """Overwrite the lower triangle of m[k] by its Cholesky factor, and x[k], y[k] by m⁻¹x, m⁻¹y."""
    n = x.shape[1]
    for c in range(n):
        for d in range(c + 1):
            t = m[k, c, d]
            for f in range(d):
                t -= m[k, c, f] * m[k, d, f]
            m[k, c, d] = np.sqrt(t) if c == d else t / m[k, d, d]
    for c in range(n):
        for f in range(c):
            x[k, c] -= m[k, c, f] * x[k, f]
            y[k, c] -= m[k, c, f] * y[k, f]
        x[k, c] /= m[k, c, c]
        y[k, c] /= m[k, c, c]
    for c in range(n - 1, -1, -1):
        for f in range(c + 1, n):
            x[k, c] -= m[k, f, c] * x[k, f]
            y[k, c] -= m[k, f, c] * y[k, f]
        x[k, c] /= m[k, c, c]
        y[k, c] /= m[k, c, c]


@njit(cache=True, error_model="numpy")
def newton_direction(total, slope, grad, hess, cross, solved, step_q):
    """Newton step of (q, δ) and ∂F/∂δ, by eliminating the amplitudes of each block; fills step_q."""
    stiffness, right = slope, -total
    for k in range(grad.shape[0]):
        for c in range(grad.shape[1]):
            step_q[k, c], solved[k, c] = cross[k, c], grad[k, c]
        cholesky_solve(k, hess, step_q, solved)
        for c in range(grad.shape[1]):
            stiffness -= cross[k, c] * step_q[k, c]
            right -= cross[k, c] * solved[k, c]
    step_d = right / stiffness
    for k in range(grad.shape[0]):
        for c in range(grad.shape[1]):
            step_q[k, c] = step_q[k, c] * step_d - solved[k, c]
    return step_d, stiffness


@njit(cache=True, error_model="numpy")
def closing_direction(q, delta, gap, active, factor, block, grad, step_q):
    """Step of δ that closes the smallest gap where nothing touches; fills step_q with steepest descent."""
    step_d = np.inf
    for i in range(gap.size):
        if active[i]:
            s = gap[i] - delta
            for c in range(q.shape[1]):
                s += factor[i, c] * q[block[i], c]
            step_d = min(step_d, s)
    for k in range(q.shape[0]):
        for c in range(q.shape[1]):
            step_q[k, c] = -grad[k, c]
    return step_d + 1.0


@njit(cache=True, error_model="numpy")
def solve_position(gap, a, h, active, factor, block, blocks, force):
    """Newton's method with line search on the convex J(q, δ); fills force, returns δ, ∂F/∂δ and the number of steps."""
    rank = factor.shape[1]
    q, step_q, solved = np.zeros((blocks, rank)), np.zeros((blocks, rank)), np.zeros((blocks, rank))
    grad, cross, hess = np.zeros((blocks, rank)), np.zeros((blocks, rank)), np.zeros((blocks, rank, rank))
    delta = -np.inf
    for i in range(gap.size):
        if active[i]:
            delta = max(delta, gap[i])
    delta += 1.0
    stiffness, best, stalled, iteration = 0.0, np.inf, 0, 0
    while iteration < MAX_ITERATIONS:
        total, slope, value = derivatives(q, delta, gap, a, h, active, factor, block, force, grad, hess, cross)
        residual, size = abs(total), 1.0
        for k in range(blocks):
            for c in range(rank):
                residual = max(residual, abs(grad[k, c]))
                size = max(size, abs(q[k, c]))
        if slope > 0.0:
            step_d, stiffness = newton_direction(total, slope, grad, hess, cross, solved, step_q)
        else:
            step_d = closing_direction(q, delta, gap, active, factor, block, grad, step_q)
        # rounding is reached when the residual no longer falls
        stalled = stalled + 1 if residual >= 0.5 * best and residual <= 1e-11 * size else 0
        best = min(best, residual)
        if residual <= 1e-15 * size or stalled >= 2:
            break
        descent = total * step_d
        for k in range(blocks):
            for c in range(rank):
                descent += grad[k, c] * step_q[k, c]
        t = 1.0
        while t > 1e-12:
            trial = energy(q, step_q, t, delta + t * step_d, gap, a, h, active, factor, block)
            if trial <= value + 1e-4 * t * descent + 1e-14 * (abs(value) + 1.0):
                break
            t *= 0.5
        for k in range(blocks):
            for c in range(rank):
                q[k, c] += t * step_q[k, c]
        delta += t * step_d
        iteration += 1
    return delta, stiffness, iteration


@njit(cache=True, error_model="numpy", nogil=True)
def solve_positions(gap, a, h, active, factor, block, blocks):
    """Solve every position; return forces (position, segment), δ, ∂F/∂δ and the numbers of Newton steps."""
    count = gap.shape[0]
    force = np.zeros(gap.shape)
    delta, stiffness, steps = np.empty(count), np.empty(count), np.empty(count, np.int64)
    for p in range(count):
        delta[p], stiffness[p], steps[p] = solve_position(
            gap[p], a[p], h[p], active[p], factor[p], block, blocks, force[p]
        )
    return force, delta, stiffness, steps


@njit(cache=True, error_model="numpy", nogil=True)
def first_guess(count, blocks, firsts, gap, modes, factor, laws, start, guess):
    """Fill (q, δ) of every position at its own gap, and their derivatives with respect to the errors.

    Arrays as in ``gearbench.contact.batch.Batch``. With W = dP/ds on the loaded segments and C = [−Ψ 1],
    s = C (q, δ) − e, the solution moves by [diag(1, …, 1, 0) + CᵀWC] d(q, δ) = CᵀW de.
    """
    rank, most = factor.shape[2], start.shape[1] - 1
    errors = modes.shape[1]
    for t in range(count.size):
        n, size = count[t], blocks[t] * rank
        block, active, force = np.empty(n, np.int64), np.ones(n, np.bool_), np.zeros(n)
        for k in range(blocks[t]):
            block[firsts[t, k] : firsts[t, k + 1]] = k
        delta, _, _ = solve_position(
            gap[t, :n], laws[t, 0, :n], laws[t, 1, :n], active, factor[t, :n], block, blocks[t], force
        )
        matrix, right = np.zeros((size + 1, size + 1)), np.zeros((size + 1, errors))
        start[t, most] = delta
        for c in range(size):
            matrix[c, c] = 1.0
        for i in range(n):
            offset = block[i] * rank
            for c in range(rank):
                start[t, offset + c] += force[i] * factor[t, i, c]
        for i in range(n):
            offset, s = block[i] * rank, delta - gap[t, i]
            for c in range(rank):
                s -= factor[t, i, c] * start[t, offset + c]
            w = law(s, laws[t, 0, i], laws[t, 1, i])[1]
            for c in range(rank):
                for d in range(rank):
                    matrix[offset + c, offset + d] += w * factor[t, i, c] * factor[t, i, d]
                matrix[offset + c, size] -= w * factor[t, i, c]
                matrix[size, offset + c] -= w * factor[t, i, c]
                for m in range(errors):
                    right[offset + c, m] -= w * factor[t, i, c] * modes[t, m, i]
            matrix[size, size] += w
            for m in range(errors):
                right[size, m] += w * modes[t, m, i]
        solution = np.linalg.solve(matrix, right)
        for m in range(errors):
            guess[t, m, most] = solution[size, m]
            for c in range(size):
                guess[t, m, c] = solution[c, m]
