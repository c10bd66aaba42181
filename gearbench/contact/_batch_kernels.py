"""Compiled solver for many gap vectors against one compliance: samples side by side in the lanes of the processor.

The same Newton method as ``gearbench.contact._kernels``, on ``LANES`` samples at once: every inner loop runs over the
lanes, so that it compiles to vector instructions. A lane that has converged is frozen; no lane sees another, so that
a sample's answer does not depend on its neighbours. A NumPy twin in the tests holds both to the same answers.
"""

from __future__ import annotations

import numpy as np

from gearbench.compiled import FUSED, entry, part
from gearbench.contact._lane_kernels import (
    LANES,
    add_combination,
    begin,
    keep_settled,
    note_missed,
    restore_settled,
)
from gearbench.contact._logarithm_kernels import LN2, MAGIC, MANTISSA, ONE, level_start, logarithm_parts


@part(FUSED)
def split_exponent(bits, mantissa_bits, exponent_bits):
    """Mantissa in [1, 2) and exponent of positive doubles, through their bits."""
    for j in range(LANES):
        mantissa_bits[j] = (bits[j] & MANTISSA) | ONE
        exponent_bits[j] = (bits[j] >> 52) | MAGIC


@part(FUSED)
def linear_law(i, s, a, p, w):
    """Row i of forces p and slopes w of a linear law, p = s/a."""
    inverse = 1.0 / a
    for j in range(LANES):
        on = s[i, j] > 0.0
        p[i, j] = s[i, j] * inverse if on else 0.0
        w[i, j] = inverse if on else 0.0


@part(FUSED)
def log_law_start(kappa, x, mantissa, exponent, level):
    """First guess of L with L − ln L = κ − ln x, and x ← x / L."""
    for j in range(LANES):
        _, bottom, product, inverse = level_start(kappa, mantissa[j], exponent[j])
        level[j] = product * product * inverse
        x[j] = x[j] * bottom * bottom * inverse


@part(FUSED)
def log_law_finish(i, s, edge, kappa, h, mantissa, exponent, level, p, w):
    """Row i of p and w: one step of Halley's method from the guess L, with the exact ln(x/L)."""
    inverse_h = 1.0 / h
    for j in range(LANES):
        e, f, r = logarithm_parts(mantissa[j], exponent[j])
        residual = level[j] - kappa + e * LN2 + 2.0 * f * r
        slope = level[j] - 1.0
        below = slope * slope - 0.5 * residual
        above = level[j] * (below - residual * slope)  # L = above / below
        x = min(s[i, j], edge)
        scale = 1.0 / (h * above * (above - below))
        over = s[i, j] - edge
        on = s[i, j] > 0.0
        force = x * below * (above - below) * scale + max(over, 0.0) * inverse_h
        rate = inverse_h if over > 0.0 else below * above * scale
        p[i, j] = force if on else 0.0
        w[i, j] = rate if on else 0.0


@part(FUSED)
def open_cell(i, s, soft, t):
    """Loaded part t of the cell of row i, and the compression of its middle where all of it is loaded, or soft."""
    half = 0.5 / soft
    for j in range(LANES):
        t[j] = min(max(s[i, j] * half, 0.0), 1.0)
        s[i, j] = max(s[i, j] - soft, soft)


@part(FUSED)
def close_cell(i, soft, t, p, w):
    """Row i of p and w of cells of which only the part t is loaded."""
    inverse = 1.0 / soft
    for j in range(LANES):
        w[i, j] = p[i, j] * t[j] * inverse if t[j] < 1.0 else w[i, j]
        p[i, j] = p[i, j] * t[j] * t[j]


@part(FUSED)
def log_law(i, s, h, kappa, edge, p, w, rows, bits):
    """Row i of forces p and slopes w of the law with a logarithm."""
    for j in range(LANES):
        x = min(s[i, j], edge)
        rows[0, j] = x if x > 1e-290 else 1e-290
    split_exponent(bits[0], bits[1], bits[2])
    log_law_start(kappa, rows[0], rows[1], rows[2], rows[3])
    split_exponent(bits[0], bits[1], bits[2])
    log_law_finish(i, s, edge, kappa, h, rows[1], rows[2], rows[3], p, w)


@part(FUSED)
def apply_laws(n, s, a, h, kappa, edge, soft, p, w, rows, bits):
    """Forces p and slopes w (n, lanes) of segments compressed by s, the law of each its own; uses s up."""
    for i in range(n):
        if soft[i] > 0.0:
            open_cell(i, s, soft[i], rows[4])
        if h[i] == 0.0:
            linear_law(i, s, a[i], p, w)
        else:
            log_law(i, s, h[i], kappa[i], edge[i], p, w, rows, bits)
        if soft[i] > 0.0:
            close_cell(i, soft[i], rows[4], p, w)


@part(FUSED)
def compress(first, ranks, gap, factor, q, delta, s):
    """s = δ − e − Ψ q of every segment."""
    rank = factor.shape[1]
    for k in range(first.size - 1):
        own = ranks[k]
        for i in range(first[k], first[k + 1]):
            for j in range(LANES):
                s[i, j] = delta[j] - gap[i, j]
            c = 0
            while c + 2 <= own:
                b0, b1, r = factor[i, c], factor[i, c + 1], k * rank + c
                for j in range(LANES):
                    s[i, j] -= b0 * q[r, j] + b1 * q[r + 1, j]
                c += 2
            if c < own:
                b0, r = factor[i, c], k * rank + c
                for j in range(LANES):
                    s[i, j] -= b0 * q[r, j]


@part(FUSED)
def normal_equations(first, ranks, factor, product, q, p, w, grad, cross, hess, total, slope):
    """Gradient and Hessian of J(q, δ) per block; lower triangles of the Hessian stored row by row.

    product (rank(rank+1)/2, n).
    """
    blocks, rank = first.size - 1, factor.shape[1]
    size = rank * (rank + 1) // 2
    for j in range(LANES):
        total[j] = -1.0
        slope[j] = 0.0
    for i in range(first[blocks]):
        for j in range(LANES):
            total[j] += p[i, j]
            slope[j] += w[i, j]
    for k in range(blocks):
        for c in range(rank):
            r = k * rank + c
            for j in range(LANES):
                grad[r, j] = 0.0
                cross[r, j] = 0.0
            if c >= ranks[k]:
                continue
            add_combination(first[k], first[k + 1], factor, c, p, grad, r)
            add_combination(first[k], first[k + 1], factor, c, w, cross, r)
            for j in range(LANES):
                grad[r, j] = q[r, j] - grad[r, j]
            for d in range(c + 1):
                t = c * (c + 1) // 2 + d
                one = 1.0 if c == d else 0.0
                for j in range(LANES):
                    hess[k * size + t, j] = one
                add_combination(first[k], first[k + 1], product.T, t, w, hess, k * size + t)


@part(FUSED)
def factorise(ranks, rank, hess, x, y):
    """Cholesky factor of each block (inverse diagonal), and L⁻¹x, L⁻¹y in place."""
    size = rank * (rank + 1) // 2
    for k in range(ranks.size):
        for c in range(ranks[k]):
            row, xr = k * size + c * (c + 1) // 2, k * rank + c
            for d in range(c + 1):
                other = k * size + d * (d + 1) // 2
                f = 0
                while f + 3 <= d:
                    a0, a1, a2, b0, b1, b2 = row + f, row + f + 1, row + f + 2, other + f, other + f + 1, other + f + 2
                    for j in range(LANES):
                        two = hess[a0, j] * hess[b0, j] + hess[a1, j] * hess[b1, j]
                        hess[row + d, j] -= two + hess[a2, j] * hess[b2, j]
                    f += 3
                while f < d:
                    for j in range(LANES):
                        hess[row + d, j] -= hess[row + f, j] * hess[other + f, j]
                    f += 1
                if c == d:
                    for j in range(LANES):
                        hess[row + d, j] = 1.0 / np.sqrt(hess[row + d, j])
                else:
                    for j in range(LANES):
                        hess[row + d, j] *= hess[other + d, j]
            for f in range(c):
                for j in range(LANES):
                    x[xr, j] -= hess[row + f, j] * x[k * rank + f, j]
                    y[xr, j] -= hess[row + f, j] * y[k * rank + f, j]
            for j in range(LANES):
                x[xr, j] *= hess[row + c, j]
                y[xr, j] *= hess[row + c, j]


@part(FUSED)
def back_substitute(ranks, rank, hess, x):
    """x ← L⁻ᵀ x of each block."""
    size = rank * (rank + 1) // 2
    for k in range(ranks.size):
        for c in range(ranks[k] - 1, -1, -1):
            r = k * rank + c
            for f in range(c + 1, ranks[k]):
                t = k * size + f * (f + 1) // 2 + c
                for j in range(LANES):
                    x[r, j] -= hess[t, j] * x[k * rank + f, j]
            t = k * size + c * (c + 1) // 2 + c
            for j in range(LANES):
                x[r, j] *= hess[t, j]


@part(FUSED)
def newton_step(ranks, rank, hess, x, y, rows, stiffness, q, delta, tolerance):
    """One full Newton step of the lanes that are not done; returns how many are done after it.

    rows: 4 total, 5 slope, 6 residual, 7 done, 8 step of δ. A lane whose residual has reached the tolerance keeps the
    stiffness of this point, takes this last step (which squares its residual) and is frozen.
    """
    total, slope, residual, done, step = rows[4], rows[5], rows[6], rows[7], rows[8]
    blocks = ranks.size
    for j in range(LANES):
        step[j] = -total[j]
    for r in range(blocks * rank):
        for j in range(LANES):
            slope[j] -= x[r, j] * x[r, j]
            step[j] -= x[r, j] * y[r, j]
    for j in range(LANES):
        fresh = (done[j] == 0.0) & (residual[j] <= tolerance)
        stiffness[j] = slope[j] if fresh else stiffness[j]
        step[j] = step[j] / slope[j] if done[j] == 0.0 else 0.0
    for r in range(blocks * rank):
        for j in range(LANES):
            x[r, j] = x[r, j] * step[j] - y[r, j]
    back_substitute(ranks, rank, hess, x)
    for r in range(blocks * rank):
        for j in range(LANES):
            q[r, j] = q[r, j] + x[r, j] if done[j] == 0.0 else q[r, j]
    count = 0.0
    for j in range(LANES):
        delta[j] += step[j]
        done[j] = 1.0 if residual[j] <= tolerance else done[j]
        count += done[j]
    return count


@part(FUSED)
def solve_lanes(
    first, ranks, gap, factor, product, law, q, delta, stiffness, tolerance, limit, s, p, w, grad, cross, hess, rows
):
    """Newton's method on all lanes of one position; rows[7] tells which lanes converged. Returns the steps taken."""
    blocks, rank = first.size - 1, factor.shape[1]
    n, bits = first[blocks], rows.view(np.int64)
    for j in range(LANES):
        rows[7, j] = 0.0
    for iteration in range(limit):
        compress(first, ranks, gap, factor, q, delta, s)
        apply_laws(n, s, law[0], law[1], law[2], law[3], law[4], p, w, rows, bits)
        normal_equations(first, ranks, factor, product, q, p, w, grad, cross, hess, rows[4], rows[5])
        for j in range(LANES):
            rows[6, j] = abs(rows[4, j])
        for r in range(blocks * rank):
            for j in range(LANES):
                rows[6, j] = max(rows[6, j], abs(grad[r, j]))
        factorise(ranks, rank, hess, cross, grad)
        if newton_step(ranks, rank, hess, cross, grad, rows, stiffness, q, delta, tolerance) == LANES:
            return iteration + 1
    return limit


@part(FUSED)
def from_smallest(n, gap, delta, least):
    """Count the gaps of each lane and its δ from the smallest gap, so that large gaps leave δ its digits."""
    for j in range(LANES):
        least[j] = gap[0, j]
    for i in range(1, n):
        for j in range(LANES):
            least[j] = min(least[j], gap[i, j])
    for i in range(n):
        for j in range(LANES):
            gap[i, j] -= least[j]
    for j in range(LANES):
        delta[j] -= least[j]


@entry(FUSED)
def solve_chunk(
    firsts, blocks, ranks, ahead, gap0, modes, draws, factor, product, laws, start, guess, tolerance, limit,
    delta, stiffness, done,
):  # fmt: skip
    """Solve every position for one chunk of ``LANES`` samples; fills δ, ∂F/∂δ and whether they converged.

    ranks (position, block): columns of the factor that are not zero in a block. gap0 (position, n), modes (position,
    error, n), draws (error, lanes): e = gap0 + Σ modes · draws. start (position, block·rank + 1)
    and guess (position, error, block·rank + 1): first guess of (q, δ), linear in the draws. To it comes, by the weights
    ahead (position, 2), what it missed at the two positions before.
    """
    positions, n = gap0.shape
    errors, rank = draws.shape[0], factor.shape[2]
    most = start.shape[1] - 1
    gap, s, p, w = np.empty((n, LANES)), np.empty((n, LANES)), np.empty((n, LANES)), np.empty((n, LANES))
    q, grad, cross = np.empty((most + 1, LANES)), np.empty((most, LANES)), np.empty((most, LANES))
    hess, rows = np.empty((most * (rank + 1) // 2 + 1, LANES)), np.empty((9, LANES))
    least, missed, kept = np.empty(LANES), np.zeros((2, most + 1, LANES)), np.empty((most + 4, LANES))
    steps = 0
    for t in range(positions):
        first = firsts[t, : blocks[t] + 1]
        for i in range(first[blocks[t]]):
            for j in range(LANES):
                gap[i, j] = gap0[t, i]
            add_combination(0, errors, modes[t], i, draws, gap, i)
        begin(start[t], guess[t], draws, ahead[t], missed, q)
        for j in range(LANES):
            delta[t, j] = q[most, j]
        from_smallest(first[blocks[t]], gap, delta[t], least)
        steps += solve_lanes(
            first, ranks[t, : blocks[t]], gap, factor[t], product[t], laws[t], q, delta[t], stiffness[t], tolerance,
            limit if ahead[t, 0] == 0.0 else limit // 2, s, p, w, grad, cross, hess, rows,
        )  # fmt: skip
        if ahead[t, 0] != 0.0 and rows[7].sum() < LANES:
            # large errors: from the linear solution alone Newton's method goes farther
            keep_settled(q, delta[t], stiffness[t], rows[7], kept)
            for r in range(most + 1):
                for j in range(LANES):
                    q[r, j] = -missed[0, r, j]
            for j in range(LANES):
                delta[t, j] = q[most, j] - least[j]
            steps += solve_lanes(
                first, ranks[t, : blocks[t]], gap, factor[t], product[t], laws[t], q, delta[t], stiffness[t], tolerance,
                limit, s, p, w, grad, cross, hess, rows,
            )  # fmt: skip
            restore_settled(q, delta[t], stiffness[t], rows[7], kept)
        for j in range(LANES):
            delta[t, j] += least[j]
            done[t, j] = rows[7, j]
            q[most, j] = delta[t, j]
        note_missed(q, done[t], missed[0])
    return steps
