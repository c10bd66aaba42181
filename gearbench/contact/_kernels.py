"""Compiled Newton solver of the contact problem, held equal to a readable NumPy twin by the tests."""

from __future__ import annotations

import math

import numpy as np

from gearbench.compiled import SUMS, entry, part
from gearbench.contact.law import TANGENT_FROM

#: Steps in a row without fall of the energy after which rounding is reached; convergence needs two or three.
IDLE_STEPS = 8
#: L − ln L where the law is continued by its tangent.
TANGENT_LEVEL = TANGENT_FROM - math.log(TANGENT_FROM)


@part()
def law(s, a, h):
    """Force P, slope dP/ds and energy ∫P ds of a segment compressed by s under g(P) = P (a − h ln P)."""
    if s <= 0.0:
        return 0.0, 0.0, 0.0
    if h == 0.0:
        p = s / a
        return p, 1.0 / a, 0.5 * s * p
    # with L = a/h − ln P: s = h P L, so that L − ln L = a/h + ln h − ln s
    level = a / h + math.log(h) - math.log(s)
    if level <= TANGENT_LEVEL:
        p0 = math.exp(a / h - TANGENT_FROM)
        over = s - h * p0 * TANGENT_FROM
        energy = h * p0 * p0 * (TANGENT_FROM / 2 - 0.25) + over * (p0 + over / (2 * h))
        return p0 + over / h, 1.0 / h, energy
    rise = math.log(level)
    big = level + rise + rise / level
    for _ in range(20):  # Halley's method: the digits triple
        residual = big - math.log(big) - level
        slope = big - 1.0
        step = residual * big * slope / (slope * slope - 0.5 * residual)
        big -= step
        if abs(step) <= 1e-6 * big:
            break
    p = s / (h * big)
    return p, 1.0 / (h * (big - 1.0)), h * p * p * (big / 2 - 0.25)


@part()
def cell_law(s, a, h, soft):
    """``law`` as the mean over a cell along which the compression varies by ±soft, s at its greatest (C7)."""
    if s <= 0.0:
        return 0.0, 0.0, 0.0
    if soft == 0.0:
        return law(s, a, h)
    p0, _, e0 = law(soft, a, h)
    if s >= 2.0 * soft:
        p, w, e = law(s - soft, a, h)
        return p, w, e - e0 + 2.0 / 3.0 * soft * p0
    t = s / (2.0 * soft)
    return p0 * t * t, p0 * t / soft, 2.0 / 3.0 * soft * p0 * t * t * t


@part()
def compression(p, a, h, soft):
    """Compression of a segment, or of the end of a cell that touches first, under the force p."""
    if soft > 0.0:
        whole = law(soft, a, h)[0]
        if p < whole:
            return 2.0 * soft * math.sqrt(p / whole)
    if p <= 0.0:
        return soft
    if h == 0.0:
        return soft + a * p
    edge = math.exp(min(a / h - TANGENT_FROM, 700.0))
    low = min(p, edge)
    return soft + low * (a - h * math.log(low)) + h * (p - low)


@entry()
def complementarity(force, delta, gap, a, h, soft, active, factor, block, blocks, residual):
    """max |min(P, gap)| of each position, gap = H P + g(P) + e − δ."""
    positions, n = gap.shape
    rank = factor.shape[2]
    for i in range(positions):
        shared = np.zeros((blocks, rank))
        for j in range(n):
            if active[i, j]:
                for c in range(rank):
                    shared[block[j], c] += factor[i, j, c] * force[i, j]
        residual[i] = 0.0
        for j in range(n):
            if active[i, j]:
                apart = compression(force[i, j], a[i, j], h[i, j], soft[i, j]) + gap[i, j] - delta[i]
                for c in range(rank):
                    apart += factor[i, j, c] * shared[block[j], c]
                worst = abs(min(force[i, j], apart))
                if not worst <= residual[i] and not math.isnan(residual[i]):
                    residual[i] = worst


@part(SUMS)
def add_loaded(i, loaded, weight, factor, block, force, grad, hess, cross):
    """Add what the ``loaded`` segments contribute to gradient and Hessian, four of a block at a time."""
    rank, n = factor.shape[2], 0
    while n < loaded.size:
        j0 = loaded[n]
        k = block[i, j0]
        p0, w0 = force[i, j0], weight[n]
        # segments of a block need not lie side by side: all four are asked
        four = n + 4 <= loaded.size and block[i, loaded[n + 1]] == k and block[i, loaded[n + 2]] == k
        if four and block[i, loaded[n + 3]] == k:
            j1, j2, j3 = loaded[n + 1], loaded[n + 2], loaded[n + 3]
            p1, p2, p3 = force[i, j1], force[i, j2], force[i, j3]
            w1, w2, w3 = weight[n + 1], weight[n + 2], weight[n + 3]
            for c in range(rank):
                f0, f1, f2, f3 = factor[i, j0, c], factor[i, j1, c], factor[i, j2, c], factor[i, j3, c]
                grad[k, c] -= p0 * f0 + p1 * f1 + p2 * f2 + p3 * f3
                f0, f1, f2, f3 = w0 * f0, w1 * f1, w2 * f2, w3 * f3
                cross[k, c] += f0 + f1 + f2 + f3
                for d in range(c + 1):
                    one = f0 * factor[i, j0, d] + f1 * factor[i, j1, d]
                    hess[k, c, d] += one + (f2 * factor[i, j2, d] + f3 * factor[i, j3, d])
            n += 4
            continue
        for c in range(rank):
            f0 = factor[i, j0, c]
            grad[k, c] -= p0 * f0
            f0 *= w0
            cross[k, c] += f0
            for d in range(c + 1):
                hess[k, c, d] += f0 * factor[i, j0, d]
        n += 1


@part(SUMS)
def derivatives(i, q, delta, gap, a, h, soft, active, factor, block, force, grad, hess, cross):
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
    weight, loaded, count = np.empty(gap.shape[1]), np.empty(gap.shape[1], dtype=np.int64), 0
    for j in range(gap.shape[1]):
        force[i, j] = 0.0
        if not active[i, j]:
            continue
        k, s = block[i, j], delta - gap[i, j]
        for c in range(rank):
            s -= factor[i, j, c] * q[k, c]
        p, w, e = cell_law(s, a[i, j], h[i, j], soft[i, j])
        force[i, j] = p
        total += p
        slope += w
        value += e
        if p > 0.0:
            weight[count], loaded[count] = w, j
            count += 1
    add_loaded(i, loaded[:count], weight, factor, block, force, grad, hess, cross)
    return total, slope, value


@part(SUMS)
def newton_direction(total, slope, grad, hess, cross, x, step_q):
    """Newton step of δ and ∂F/∂δ, by eliminating the amplitudes of each block (C6); fills the step of q.

    With the Cholesky factor L of a block of the Hessian: y = L⁻¹ cross, x = L⁻¹ grad, step = L⁻ᵀ (y dδ − x).
    """
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
                y -= hess[k, c, f] * step_q[k, f]
                z -= hess[k, c, f] * x[k, f]
            step_q[k, c], x[k, c] = y / hess[k, c, c], z / hess[k, c, c]
            stiffness -= step_q[k, c] * step_q[k, c]
            right -= step_q[k, c] * x[k, c]
    step_d = right / stiffness
    for k in range(grad.shape[0]):
        for c in range(n - 1, -1, -1):
            t = step_q[k, c] * step_d - x[k, c]
            for f in range(c + 1, n):
                t -= hess[k, f, c] * step_q[k, f]
            step_q[k, c] = t / hess[k, c, c]
    return step_d, stiffness


@part()
def closing_direction(i, q, delta, gap, active, factor, block, grad, step_q):
    """Step of δ that closes the smallest gap where nothing touches; fills step_q with steepest descent."""
    step_d = math.inf
    for j in range(gap.shape[1]):
        if active[i, j]:
            s = gap[i, j] - delta
            for c in range(q.shape[1]):
                s += factor[i, j, c] * q[block[i, j], c]
            step_d = min(step_d, s)
    for k in range(q.shape[0]):
        for c in range(q.shape[1]):
            step_q[k, c] = -grad[k, c]
    return step_d + 1.0


@part()
def first_approach(i, gap, a, h, soft, active, factor):
    """An approach at which all segments touch, but no more than if one of them carried the load by itself."""
    greatest, alone = -math.inf, math.inf
    for j in range(gap.shape[1]):
        if not active[i, j]:
            continue
        greatest = max(greatest, gap[i, j])
        whole = law(soft[i, j], a[i, j], h[i, j])[0]
        most = soft[i, j] + max(a[i, j], TANGENT_FROM * h[i, j])
        delta = gap[i, j] + (2.0 * soft[i, j] / math.sqrt(whole) if whole > 1.0 else most)
        for c in range(factor.shape[2]):
            delta += factor[i, j, c] * factor[i, j, c]
        alone = min(alone, delta)
    return min(greatest + 1.0, alone)


@entry()
def solve_position(i, gap, a, h, soft, active, factor, block, force, work, hess, limit, delta=-math.inf, enough=0.0):
    """``newton_position``, which other kernels call: no kernel calls this one."""
    return newton_position(i, gap, a, h, soft, active, factor, block, force, work, hess, limit, delta, enough)


@part()
def newton_position(i, gap, a, h, soft, active, factor, block, force, work, hess, limit, delta, enough):
    """Newton's method with line search on the convex J(q, δ) of position i.

    J = ½|q|² + Σ ∫P ds − δ. Fills force[i] and leaves the amplitudes in work[0]; returns δ, ∂F/∂δ and the number of
    steps, at most ``limit``. work, six arrays (block, rank), and hess (block, rank, rank) are scratch. A finite
    ``delta`` is a first guess of δ, and work[0] then one of the amplitudes. From a residual of ``enough`` on the last
    step is taken, which squares it, and nothing evaluated after it.
    """
    q, trial, step_q, x, grad, cross = work
    if delta == -math.inf:
        delta = first_approach(i, gap, a, h, soft, active, factor)
        for k in range(q.shape[0]):
            for c in range(q.shape[1]):
                q[k, c] = 0.0
    stiffness, best, stalled, idle, iteration = 0.0, math.inf, 0, 0, 0
    total, slope, value = derivatives(i, q, delta, gap, a, h, soft, active, factor, block, force, grad, hess, cross)
    lowest = value
    while True:
        residual, size = abs(total), 1.0
        for k in range(q.shape[0]):
            for c in range(q.shape[1]):
                residual = max(residual, abs(grad[k, c]))
                size = max(size, abs(q[k, c]))
        # descent = gradient · step, and the gradient is overwritten by the trials below
        if slope > 0.0:
            step_d, stiffness = newton_direction(total, slope, grad, hess, cross, x, step_q)
        else:
            step_d = closing_direction(i, q, delta, gap, active, factor, block, grad, step_q)
        # rounding is reached when the residual no longer falls
        stalled = stalled + 1 if residual >= 0.5 * best and residual <= 1e-11 * size else 0
        best = min(best, residual)
        if residual <= 1e-15 * size or stalled >= 2 or idle >= IDLE_STEPS or iteration >= limit:
            break
        if residual <= enough * size and slope > 0.0:
            for k in range(q.shape[0]):
                for c in range(q.shape[1]):
                    q[k, c] += step_q[k, c]
            return delta + step_d, stiffness, iteration + 1
        descent = total * step_d
        for k in range(q.shape[0]):
            for c in range(q.shape[1]):
                descent += grad[k, c] * step_q[k, c]
        t, before = 1.0, value
        while True:
            for k in range(q.shape[0]):
                for c in range(q.shape[1]):
                    trial[k, c] = q[k, c] + t * step_q[k, c]
            total, slope, value = derivatives(
                i, trial, delta + t * step_d, gap, a, h, soft, active, factor, block, force, grad, hess, cross
            )
            if value <= before + 1e-4 * t * descent + 1e-14 * (abs(before) + 1.0) or t <= 1e-12:
                break
            t *= 0.5
        for k in range(q.shape[0]):
            for c in range(q.shape[1]):
                q[k, c] = trial[k, c]
        idle = idle + 1 if value >= lowest - 1e-14 * (abs(lowest) + 1.0) else 0
        lowest = min(lowest, value)
        delta += t * step_d
        iteration += 1
    return delta, stiffness, iteration


@entry()
def first_guess(gap, a, h, soft, active, factor, block, blocks, modes, force, work, hess, limit, start, guess):
    """Fill (q, δ) of every position at its own gap, and their derivatives with respect to the errors.

    Arrays as in ``gearbench.contact.batch.Batch``. With W = dP/ds on the loaded segments and C = [−Ψ 1],
    s = C (q, δ) − e, the solution moves by [diag(1, …, 1, 0) + CᵀWC] d(q, δ) = CᵀW de.
    """
    rank, most = factor.shape[2], start.shape[1] - 1
    errors = modes.shape[1]
    for t in range(gap.shape[0]):
        size = blocks[t] * rank
        delta, _, _ = newton_position(
            t, gap, a, h, soft, active, factor, block, force, work, hess, limit, -math.inf, 0.0
        )
        start[t, most] = delta
        matrix, right = np.zeros((size + 1, size + 1)), np.zeros((size + 1, errors))
        for c in range(size):
            matrix[c, c] = 1.0
            start[t, c] = work[0][c // rank, c % rank]
        for j in range(gap.shape[1]):
            if not active[t, j]:
                continue
            offset, s = block[t, j] * rank, delta - gap[t, j]
            for c in range(rank):
                s -= factor[t, j, c] * start[t, offset + c]
            w = cell_law(s, a[t, j], h[t, j], soft[t, j])[1]
            for c in range(rank):
                for d in range(rank):
                    matrix[offset + c, offset + d] += w * factor[t, j, c] * factor[t, j, d]
                matrix[offset + c, size] -= w * factor[t, j, c]
                matrix[size, offset + c] -= w * factor[t, j, c]
                for m in range(errors):
                    right[offset + c, m] -= w * factor[t, j, c] * modes[t, m, j]
            matrix[size, size] += w
            for m in range(errors):
                right[size, m] += w * modes[t, m, j]
        solution = np.linalg.solve(matrix, right)
        for m in range(errors):
            guess[t, m, most] = solution[size, m]
            for c in range(size):
                guess[t, m, c] = solution[c, m]


@entry(SUMS)
def pivoted_cholesky(matrix, weight, limit, root):
    """Rows of the factors of all H (block, n, n), the largest pivot first, zero behind the rank; the greatest rank.

    A block ends where Σ weight · diagonal of what is left is at most ``limit``. root (block, n, n).
    """
    blocks, n, _ = matrix.shape
    left = np.empty(n)
    most = 0
    for b in range(blocks):
        for i in range(n):
            left[i] = matrix[b, i, i]
        rank = n
        for k in range(n):
            rest, pivot, best = 0.0, 0, 0.0
            for i in range(n):
                share = left[i] * weight[b, i]
                rest += share
                if share > best:
                    best, pivot = share, i
            if rest <= limit or best <= 0.0:
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
            scale = 1.0 / math.sqrt(left[pivot])
            for i in range(n):
                row[i] *= scale
                left[i] = max(left[i] - row[i] * row[i], 0.0)
            left[pivot] = 0.0
        root[b, rank:] = 0.0
        most = max(most, rank)
    return most
