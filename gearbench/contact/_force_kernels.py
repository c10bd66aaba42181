"""Compiled Newton solver on the forces of loaded segments: for one block of amplitudes, about as many as segments.

The steps are those of ``gearbench.contact._kernels``, of the same convex J(q, δ): after a step the amplitudes are
q = Ψᵀ v, and J needs only z = Ψ q = H v and |q|². A matrix has a row for each loaded segment (C9 of docs/theory.md).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from gearbench.contact._kernels import IDLE_STEPS, SUMS, cell_law, first_approach

#: Residual, relative to the greatest deflection, at which rounding is reached; up to which it is if it does not fall.
ROUNDING, NEAR_ROUNDING = 1e-15, 1e-13


@njit(cache=True, error_model="numpy")
def forces(z, delta, gap, laws, force, weight):
    """Fill forces and slopes of the law under the deflections z; ΣP − 1, ΣdP/ds and ∫ΣP ds − δ."""
    a, h, soft = laws
    total, slope, value = -1.0, 0.0, -delta
    for j in range(z.size):
        force[j], weight[j], energy = cell_law(delta - gap[j] - z[j], a[j], h[j], soft[j])
        total += force[j]
        slope += weight[j]
        value += energy
    return total, slope, value


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def eliminate(B, n):
    """Cholesky's U of the first n columns of B in place, upper triangle, four rows at a time; further columns: U⁻ᵀ B.

    B (n, ≥ n); what is below the diagonal is neither read nor written.
    """
    width = B.shape[1]
    for first in range(0, n, 4):
        last = min(first + 4, n)
        for k in range(first, last):
            scale = 1.0 / math.sqrt(B[k, k])
            for j in range(k, width):
                B[k, j] *= scale
            for i in range(k + 1, last):
                f = B[k, i]
                for j in range(i, width):
                    B[i, j] -= f * B[k, j]
        if last < first + 4:
            break
        for i in range(last, n):
            f0, f1, f2, f3 = B[first, i], B[first + 1, i], B[first + 2, i], B[first + 3, i]
            for j in range(i, width):
                B[i, j] -= (f0 * B[first, j] + f1 * B[first + 1, j]) + (f2 * B[first + 2, j] + f3 * B[first + 3, j])


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def force_direction(total, H, apart, weight, B, d):
    """Newton step of δ, and ∂F/∂δ; fills d, the step of the forces v beside that of the law, zero where none is loaded.

    With S = √(dP/ds) and the residual g = H P − z: (1 + S H S) S⁻¹ d = S (dδ − g), Σd = 1 − ΣP.
    """
    loaded, root, n = np.empty(d.size, dtype=np.int64), np.empty(d.size), 0
    for j in range(d.size):
        d[j] = 0.0
        if weight[j] > 0.0:
            loaded[n], root[n] = j, math.sqrt(weight[j])
            n += 1
    B = B[:, : n + 2]
    for k in range(n):
        row, s = H[loaded[k]], root[k]
        for j in range(k, n):
            B[k, j] = s * root[j] * row[loaded[j]]
        B[k, k] += 1.0
        B[k, n], B[k, n + 1] = -s * apart[loaded[k]], s
    eliminate(B, n)
    right, stiffness = -total, 0.0
    for k in range(n):
        right -= B[k, n] * B[k, n + 1]
        stiffness += B[k, n + 1] * B[k, n + 1]
    step = right / stiffness
    for k in range(n - 1, -1, -1):
        t = B[k, n] + step * B[k, n + 1]
        for j in range(k + 1, n):
            t -= B[k, j] * B[j, n]
        B[k, n] = t / B[k, k]
        d[loaded[k]] = root[k] * B[k, n]
    return step, stiffness


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def deflect(H, v, plus, result):
    """result = H v + plus, of the few v that are not zero; the greatest of its sizes."""
    for j in range(v.size):
        result[j] = plus[j]
    for i in range(v.size):
        if v[i] != 0.0:
            for j in range(v.size):
                result[j] += H[i, j] * v[i]
    greatest = 0.0
    for j in range(v.size):
        greatest = max(greatest, abs(result[j]))
    return greatest


@njit(cache=True, error_model="numpy")
def search(z, dz, delta, step, norms, before, descent, gap, laws, trial, force, weight):
    """Go along a step until J falls as it should; t, ΣP − 1, ΣdP/ds, J and |q|² there.

    ``norms``: |q|² before the step, the product of both, and |q|² of a whole step.
    """
    t = 1.0
    while True:
        for j in range(z.size):
            trial[j] = z[j] + t * dz[j]
        total, slope, value = forces(trial, delta + t * step, gap, laws, force, weight)
        square = (1 - t) ** 2 * norms[0] + 2 * t * (1 - t) * norms[1] + t * t * norms[2]
        value += square / 2
        if value <= before + 1e-4 * t * descent + 1e-14 * (abs(before) + 1.0) or t <= 1e-12:
            return t, total, slope, value, square
        t *= 0.5


@njit(cache=True, error_model="numpy")
def solve_forces(H, z, square, delta, gap, laws, force, work, B, enough, limit):
    """Newton's method with line search from the deflections z of the amplitudes |q|² = ``square``, and δ.

    Fills ``force``; returns δ, ∂F/∂δ and the number of steps. From a residual of ``enough`` on the last step is taken,
    which squares it, and nothing evaluated after it: ``force`` is then that of the law linearised.
    """
    weight, apart, d, dz, trial = work
    stiffness, best, stalled, idle, iteration = 0.0, math.inf, 0, 0, 0
    total, slope, value = forces(z, delta, gap, laws, force, weight)
    value += square / 2
    lowest = value
    while True:
        size = 1.0
        for j in range(z.size):
            size, trial[j] = max(size, abs(z[j])), -z[j]
        residual = max(abs(total), deflect(H, force, trial, apart)) / size
        if slope > 0.0:
            step, stiffness = force_direction(total, H, apart, weight, B, d)
            deflect(H, d, apart, dz)
        else:
            step = math.inf
            for j in range(z.size):
                step, d[j], dz[j] = min(step, gap[j] + z[j] - delta + 1.0), 0.0, -z[j]
        stalled = stalled + 1 if residual >= 0.5 * best and residual <= 1e-11 else 0
        best = min(best, residual)
        if residual <= enough and slope > 0.0:
            for j in range(z.size):
                force[j] += d[j]
            return delta + step, stiffness, iteration + 1
        at_rounding = residual <= ROUNDING or (residual <= NEAR_ROUNDING and stalled >= 1) or stalled >= 2
        if at_rounding or idle >= IDLE_STEPS or iteration >= limit:
            return delta, stiffness, iteration
        descent, product, whole = total * step - square, 0.0, 0.0
        for j in range(z.size):
            v = force[j] + d[j]
            product += v * z[j]
            whole += v * (z[j] + dz[j])
            descent -= force[j] * dz[j]
        norms = square, product, whole
        t, total, slope, value, square = search(
            z, dz, delta, step, norms, value, descent + product, gap, laws, trial, force, weight
        )
        for j in range(z.size):
            z[j] = trial[j]
        idle = idle + 1 if value >= lowest - 1e-14 * (abs(lowest) + 1.0) else 0
        lowest = min(lowest, value)
        delta += t * step
        iteration += 1


@njit(cache=True, error_model="numpy", nogil=True)
def solve_coupled(gap, a, h, soft, active, factor, q, delta, enough, limit, force, stiffness, steps):
    """Solve every position of a problem whose segments share one block of amplitudes q (position, rank).

    q and δ are the guess, δ = −∞ for none, and afterwards the solution. Fills forces, ∂F/∂δ and the numbers of steps.
    Where the last step is taken early, a position without a guess begins from the forces of the one before it.
    """
    positions, n = gap.shape
    B, work, none = np.empty((n, n + 2)), np.empty((5, n)), delta == -math.inf
    for i in range(positions):
        segment = np.flatnonzero(active[i])
        m = segment.size
        psi = factor[i][segment]
        H = np.dot(psi, psi.T)
        laws = a[i][segment], h[i][segment], soft[i][segment]
        own = np.empty(m)
        if none[i]:
            before = force[i - 1][segment]
            total = np.sum(before)
            if enough > 0.0 and i > 0 and total > 0.0:
                delta[i], q[i] = delta[i - 1], np.dot(before / total, psi)
            else:
                delta[i], q[i] = first_approach(i, gap, a, h, soft, active, factor), 0.0
        delta[i], stiffness[i], steps[i] = solve_forces(
            H, np.dot(psi, q[i]), np.dot(q[i], q[i]), delta[i], gap[i][segment], laws, own,
            (work[0, :m], work[1, :m], work[2, :m], work[3, :m], work[4, :m]), B[:m], enough, limit,
        )  # fmt: skip
        q[i] = np.dot(own, psi)
        force[i] = 0.0
        for j in range(m):
            force[i, segment[j]] = own[j]
