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
def energy(q, delta, gap, a, h, active, factor, block):
    """Convex function J(q, δ) = ½|q|² + Σ ∫P ds − δ that the solution minimises."""
    total = -delta
    for k in range(q.shape[0]):
        for c in range(q.shape[1]):
            total += 0.5 * q[k, c] * q[k, c]
    for i in range(gap.size):
        if active[i]:
            s = delta - gap[i]
            for c in range(q.shape[1]):
                s -= factor[i, c] * q[block[i], c]
            total += law(s, a[i], h[i])[2]
    return total


@njit(cache=True, error_model="numpy")
def derivatives(q, delta, gap, a, h, active, factor, block, force, grad, hess, cross):
    """Fill forces, gradient and Hessian blocks of J; return ∂J/∂δ, ∂²J/∂δ² and J."""
    rank = q.shape[1]
    grad[:] = q
    hess[:] = 0.0
    cross[:] = 0.0
    total, slope, value = -1.0, 0.0, -delta
    for k in range(q.shape[0]):
        for c in range(rank):
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
def cholesky_solve(m, x, y):
    """Overwrite the lower triangle of m by its Cholesky factor, and x, y by m⁻¹x, m⁻¹y."""
    n = x.size
    for c in range(n):
        for d in range(c + 1):
            t = m[c, d]
            for k in range(d):
                t -= m[c, k] * m[d, k]
            m[c, d] = np.sqrt(t) if c == d else t / m[d, d]
    for c in range(n):
        tx, ty = x[c], y[c]
        for k in range(c):
            tx -= m[c, k] * x[k]
            ty -= m[c, k] * y[k]
        x[c], y[c] = tx / m[c, c], ty / m[c, c]
    for c in range(n - 1, -1, -1):
        tx, ty = x[c], y[c]
        for k in range(c + 1, n):
            tx -= m[k, c] * x[k]
            ty -= m[k, c] * y[k]
        x[c], y[c] = tx / m[c, c], ty / m[c, c]


@njit(cache=True, error_model="numpy")
def solve_position(gap, a, h, active, factor, block, blocks, force):
    """Newton's method with line search on the convex J(q, δ); fills force, returns δ, ∂F/∂δ and the number of steps."""
    rank = factor.shape[1]
    q, step_q = np.zeros((blocks, rank)), np.zeros((blocks, rank))
    grad, cross = np.empty((blocks, rank)), np.empty((blocks, rank))
    hess = np.empty((blocks, rank, rank))
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
        # -- Newton step: eliminate the amplitudes of each block, then δ
        descent = 0.0
        if slope > 0.0:
            stiffness, right = slope, -total
            for k in range(blocks):
                step_q[k] = cross[k]
                raw = grad[k].copy()
                cholesky_solve(hess[k], step_q[k], raw)
                for c in range(rank):
                    stiffness -= cross[k, c] * step_q[k, c]
                    right -= cross[k, c] * raw[c]
                    hess[k, c, 0] = raw[c]
            step_d = right / stiffness
            for k in range(blocks):
                for c in range(rank):
                    step_q[k, c] = step_q[k, c] * step_d - hess[k, c, 0]
        else:  # nothing touches: close the smallest gap
            step_d = np.inf
            for i in range(gap.size):
                if active[i]:
                    s = gap[i] - delta
                    for c in range(rank):
                        s += factor[i, c] * q[block[i], c]
                    step_d = min(step_d, s)
            step_d += 1.0
            for k in range(blocks):
                for c in range(rank):
                    step_q[k, c] = -grad[k, c]
        descent = total * step_d
        for k in range(blocks):
            for c in range(rank):
                descent += grad[k, c] * step_q[k, c]
        # -- rounding is reached when the residual no longer falls
        if residual <= 1e-15 * size:
            break
        stalled = stalled + 1 if residual >= 0.5 * best and residual <= 1e-11 * size else 0
        best = min(best, residual)
        if stalled >= 2:
            break
        t = 1.0
        while t > 1e-12:
            trial = energy(q + t * step_q, delta + t * step_d, gap, a, h, active, factor, block)
            if trial <= value + 1e-4 * t * descent + 1e-14 * (abs(value) + 1.0):
                break
            t *= 0.5
        q += t * step_q
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
