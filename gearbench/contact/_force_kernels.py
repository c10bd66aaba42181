"""Compiled Newton solver whose unknowns are the forces of loaded segments, for problems with many amplitudes.

``solver`` calls it if all segments share their amplitudes, that is, if there is one block. The Newton steps are those
of ``gearbench.contact._kernels``, for the same convex J(q, δ), (C4) of docs/algorithms.md. After a step the amplitudes
are q = Ψᵀ v with forces v; J needs only z = Ψ q = H v and |q|². The matrix has one row for each loaded segment (C9 of
docs/algorithms.md). Close to the solution its Cholesky factor is reused for several steps.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.compiled import SUMS, entry, part
from gearbench.contact._kernels import (
    IDLE_STEPS,
    ROUNDING_OF_J,
    SHORTEST_STEP,
    STALL_LEVEL,
    STALLED,
    SUFFICIENT,
    first_approach,
)
from gearbench.contact._law_kernels import CONSTANTS, SCRATCH, apply_laws, law_constants

#: Residuals divided by the greatest deflection. Up to the first they are rounding; up to the second they are rounding
#: if the last step did not halve them.
ROUNDING, NEAR_ROUNDING = 1e-15, 1e-13
#: The factor is reused if the residual is at most the first number, and at most the second number times its value
#: before the previous step.
REUSED, FALLING = 1e-2, 0.03
#: Greatest relative error of the stiffness of a solution to rounding; a tolerance is that of one that ends there.
STIFFNESS_ROUNDING = 1e-14
#: Number of the arrays (segment,) of real numbers in ``Work``.
SEGMENT_ARRAYS = 9


class Work(NamedTuple):
    """Scratch arrays of a position (segment,), of the contact law (…, segment), and B (segment, segment + 1).

    B holds the Cholesky factor U and the column U⁻ᵀ S 1 of ``factorise``. ``weight`` holds the slopes dP/ds,
    ``residual_z`` the residual H P − z, d the step of the forces and dz that of z. ``loaded`` holds the numbers of the
    loaded segments and ``root`` the square roots of their slopes. ``offset`` is the term that ``deflect`` adds to H v,
    ``deflected`` its result; x and v are scratch.
    """

    weight: NDArray
    residual_z: NDArray
    d: NDArray
    dz: NDArray
    root: NDArray
    x: NDArray
    v: NDArray
    offset: NDArray
    deflected: NDArray
    loaded: NDArray
    constants: NDArray
    scratch: NDArray
    B: NDArray


@part(SUMS)
def eliminate(B, n):
    """Replace the first n columns of B by their Cholesky factor U, and the next column b by U⁻ᵀ b.

    Four rows are eliminated at a time, from two rows at a time. B is (≥ n, ≥ n + 1); no result depends on the elements
    below the diagonal, which are overwritten.
    """
    for first in range(0, n, 4):
        last = min(first + 4, n)
        for k in range(first, last):
            pivot = B[k, k : n + 1]
            scale = 1.0 / math.sqrt(pivot[0])
            for j in range(pivot.size):
                pivot[j] *= scale
            for i in range(k + 1, last):
                row, above, f = B[i, i : n + 1], B[k, i : n + 1], B[k, i]
                for j in range(row.size):
                    row[j] -= f * above[j]
        if last < first + 4:
            break
        for i in range(last, n, 2):
            row, a, b = B[i, i : n + 1], B[first, i : n + 1], B[first + 1, i : n + 1]
            c, d = B[first + 2, i : n + 1], B[first + 3, i : n + 1]
            f, g = (a[0], b[0], c[0], d[0]), (a[1], b[1], c[1], d[1])
            if i + 1 < n:
                below = B[i + 1, i : n + 1]
                for j in range(row.size):
                    row[j] -= (f[0] * a[j] + f[1] * b[j]) + (f[2] * c[j] + f[3] * d[j])
                    below[j] -= (g[0] * a[j] + g[1] * b[j]) + (g[2] * c[j] + g[3] * d[j])
            else:
                for j in range(row.size):
                    row[j] -= (f[0] * a[j] + f[1] * b[j]) + (f[2] * c[j] + f[3] * d[j])


@part(SUMS)
def factorise(H, weight, B, loaded, root):
    """Cholesky factor U of I + S H S over the loaded segments, with S = √(dP/ds); returns their number, and ∂F/∂δ.

    Fills ``loaded``, and ``root`` with the diagonal of S. The column of B after U is U⁻ᵀ S 1, with the vector 1 of
    ones; its squared norm is ∂F/∂δ.
    """
    n = 0
    for j in range(weight.size):
        if weight[j] > 0.0:
            loaded[n], root[n] = j, math.sqrt(weight[j])
            n += 1
    for k in range(n):
        row, s = H[loaded[k]], root[k]
        for j in range(k, n):
            B[k, j] = s * root[j] * row[loaded[j]]
        B[k, k] += 1.0
        B[k, n] = s
    eliminate(B, n)
    stiffness = 0.0
    for k in range(n):
        stiffness += B[k, n] * B[k, n]
    return n, stiffness


@part(SUMS)
def forward(B, n, x):
    """x ← U⁻ᵀ x."""
    for k in range(n):
        x[k] /= B[k, k]
        row, rest, y = B[k, k + 1 : n], x[k + 1 : n], x[k]
        for j in range(row.size):
            rest[j] -= row[j] * y


@part(SUMS)
def back(B, n, x):
    """x ← U⁻¹ x."""
    for k in range(n - 1, -1, -1):
        row, rest, t = B[k, k + 1 : n], x[k + 1 : n], x[k]
        for j in range(row.size):
            t -= row[j] * rest[j]
        x[k] = t / B[k, k]


@part(SUMS)
def force_direction(total, residual_z, B, n, loaded, root, stiffness, x, d):
    """Return the Newton step dδ; fill the step d of the forces, zero for segments that are not loaded.

    With the residual g = H P − z: (I + S H S) S⁻¹ d = S (dδ − g) and Σd = 1 − ΣP.
    """
    d[:] = 0.0
    for k in range(n):
        x[k] = -root[k] * residual_z[loaded[k]]
    forward(B, n, x)
    right = -total
    for k in range(n):
        right -= x[k] * B[k, n]
    step = right / stiffness
    for k in range(n):
        x[k] += step * B[k, n]
    back(B, n, x)
    for k in range(n):
        d[loaded[k]] = root[k] * x[k]
    return step


@part(SUMS)
def deflect(H, v, plus, result):
    """result ← H v + plus, skipping zeros of v; returns the greatest magnitude of the result."""
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


@part(SUMS)
def stiffness_at(H, weight, B, n, loaded, root, x, v, offset, deflected, most):
    """∂F/∂δ = 1ᵀ (1/W + H)⁻¹ 1 for the slopes W, to a relative error of ``most``.

    The factor in B may belong to earlier slopes. It gives a first v, and improves it once. With r = 1 − (1/W + H) v,
    the estimate 2 Σv − v·(1/W + H) v has the error rᵀ(1/W + H)⁻¹ r ≤ Σ W r², summed over the loaded segments. If this
    bound is too large, or more segments are loaded, B is computed again.
    """
    # newly loaded segments
    changed = 0
    for j in range(weight.size):
        changed += weight[j] > 0.0
    for k in range(n):
        changed -= weight[loaded[k]] > 0.0
    if changed == 0 and n > 0:
        v[:], offset[:] = 0.0, 0.0
        for k in range(n):
            x[k] = B[k, n]
        for _ in range(2):
            back(B, n, x)
            for k in range(n):
                j = loaded[k]
                # a segment that has lost its load stays without
                v[j] = v[j] + root[k] * x[k] if weight[j] > 0.0 else 0.0
            deflect(H, v, offset, deflected)
            stiffness, error = 0.0, 0.0
            for k in range(n):
                j = loaded[k]
                r = 1.0 - v[j] / weight[j] - deflected[j] if weight[j] > 0.0 else 0.0
                stiffness += v[j] * (1.0 + r)
                error += weight[j] * r * r
                x[k] = root[k] * r
            if error <= most * stiffness:
                return stiffness
            forward(B, n, x)
    return factorise(H, weight, B, loaded, root)[1]


@part()
def forces(z, dz, t, delta, gap, constants, scratch, force, weight):
    """Fill forces and slopes at the deflections z + t dz; returns ΣP − 1, ΣdP/ds and ∫ΣP ds − δ."""
    s = scratch[SCRATCH]
    for j in range(z.size):
        s[j] = delta - gap[j] - (z[j] + t * dz[j])
    total, slope, value = apply_laws(s, constants, scratch, force, weight)
    return total - 1.0, slope, value - delta


@part()
def search(z, dz, delta, step, norms, previous, descent, gap, constants, scratch, force, weight):
    """Line search: halve the step until J falls enough; returns the part t taken, and ΣP − 1, ΣdP/ds, J and |q|² there.

    ``norms`` holds |q|² before the step, q before · q after a whole step, and |q|² after a whole step; ``descent`` is
    the derivative of J along the step, ``previous`` is J before it.
    """
    t = 1.0
    while True:
        total, slope, value = forces(z, dz, t, delta + t * step, gap, constants, scratch, force, weight)
        square = (1 - t) ** 2 * norms[0] + 2 * t * (1 - t) * norms[1] + t * t * norms[2]
        value += square / 2
        enough = previous + SUFFICIENT * t * descent + ROUNDING_OF_J * (abs(previous) + 1.0)
        if value <= enough or t <= SHORTEST_STEP:
            return t, total, slope, value, square
        t *= 0.5


@part()
def solve_forces(H, gap, z, square, delta, force, work, tolerance, limit):
    """Newton's method with line search, starting from δ and from deflections z of amplitudes with |q|² = ``square``.

    Fills ``force``; returns δ, ∂F/∂δ and the number of steps. From a residual r a step with a new factor leaves about
    r², one with a reused factor r times the ratio of r to its value before the previous step. The first step that is
    expected to leave at most ``tolerance``² is the last. The law is not evaluated after it: ``force`` follows from the
    linearised law.
    """
    weight, residual_z, d, dz, root, x, v, offset, deflected, loaded, constants, scratch, B = work
    stiffness, best, stalled, idle, iteration, n, previous = 0.0, math.inf, 0, 0, 0, 0, math.inf
    dz[:] = 0.0
    total, slope, value = forces(z, dz, 0.0, delta, gap, constants, scratch, force, weight)
    value += square / 2
    lowest = value
    while True:
        size = 1.0
        for j in range(z.size):
            size, offset[j] = max(size, abs(z[j])), -z[j]
        residual = max(abs(total), deflect(H, force, offset, residual_z)) / size
        stalled = stalled + 1 if residual >= STALLED * best and residual <= STALL_LEVEL else 0
        best = min(best, residual)
        at_rounding = residual <= ROUNDING or (residual <= NEAR_ROUNDING and stalled >= 1) or stalled >= 2
        reuse = n > 0 and residual <= REUSED and residual <= FALLING * previous
        last = slope > 0.0 and residual * (residual / previous if reuse else residual) <= tolerance * tolerance
        if not last and (at_rounding or idle >= IDLE_STEPS or iteration >= limit):
            if slope > 0.0:
                stiffness = stiffness_at(H, weight, B, n, loaded, root, x, v, offset, deflected, STIFFNESS_ROUNDING)
            return delta, stiffness, iteration
        if slope > 0.0:
            if not reuse:
                n, stiffness = factorise(H, weight, B, loaded, root)
            step = force_direction(total, residual_z, B, n, loaded, root, stiffness, x, d)
            deflect(H, d, residual_z, dz)
        else:
            # no segment is loaded: drop all deflections, and raise the approach by the distance of the nearest segment
            # and by 1, the unit of displacement
            n, step = 0, math.inf
            for j in range(z.size):
                step, d[j], dz[j] = min(step, gap[j] + z[j] - delta + 1.0), 0.0, -z[j]
        if last:
            for j in range(z.size):
                force[j] += d[j]
            final_stiffness = stiffness_at(H, weight, B, n, loaded, root, x, v, offset, deflected, tolerance)
            return delta + step, final_stiffness, iteration + 1
        previous = residual
        # dJ = (ΣP − 1) dδ − P·dz + q·(q_new − q), with q·q_new = v·z and |q_new|² = v·(z + dz) for the new forces v
        descent, product, whole = total * step - square, 0.0, 0.0
        for j in range(z.size):
            v_j = force[j] + d[j]
            product += v_j * z[j]
            whole += v_j * (z[j] + dz[j])
            descent -= force[j] * dz[j]
        norms = square, product, whole
        t, total, slope, value, square = search(
            z, dz, delta, step, norms, value, descent + product, gap, constants, scratch, force, weight
        )
        for j in range(z.size):
            z[j] += t * dz[j]
        idle = idle + 1 if value >= lowest - ROUNDING_OF_J * (abs(lowest) + 1.0) else 0
        lowest = min(lowest, value)
        delta += t * step
        iteration += 1


@entry()
def solve_for_forces(problem, q, delta, tolerance, limit, force, stiffness, steps):
    """Solve every position of a problem for its amplitudes q (position, 1, rank) and approach δ, by forces.

    q and δ hold the guess (δ = −∞ for none), and the solution afterwards. Fills forces, ∂F/∂δ and the numbers of steps.
    If ``tolerance`` is positive, a position without guess starts from the forces of the previous position, which saves
    steps. A solution to rounding (0) does not, so that no bit of it depends on the previous position.
    """
    p = problem
    positions, n = p.gap.shape
    arrays, loaded, unguessed = np.empty((SEGMENT_ARRAYS + 1, n)), np.empty(n, dtype=np.int64), delta == -math.inf
    # memory of the matrices; those of a position are contiguous, so that loops over a row become vector instructions
    of_H, of_B, of_laws = np.empty(n * n), np.empty(n * (n + 1)), np.empty((CONSTANTS + SCRATCH + 1) * n)
    for i in range(positions):
        segment = np.flatnonzero(p.active[i])
        m, loads = segment.size, np.empty(segment.size)
        a, h, sigma, gap = p.a[i][segment], p.h[i][segment], p.sigma[i][segment], p.gap[i][segment]
        psi, active = p.factor[i][segment], p.active[i][segment]
        H = of_H[: m * m].reshape((m, m))
        np.dot(psi, psi.T, H)
        constants = of_laws[: CONSTANTS * m].reshape((CONSTANTS, m))
        scratch = of_laws[CONSTANTS * m : (CONSTANTS + SCRATCH + 1) * m].reshape((SCRATCH + 1, m))
        B = of_B[: m * (m + 1)].reshape((m, m + 1))
        law_constants(a, h, sigma, constants)
        if unguessed[i]:
            previous = force[i - 1][segment]
            total = np.sum(previous)
            q[i] = 0.0
            if tolerance > 0.0 and i > 0 and total > 0.0:
                delta[i] = delta[i - 1]
                q[i, 0] = np.dot(previous / total, psi)
            else:
                delta[i] = first_approach(gap, a, h, sigma, active, psi)
        z, square = arrays[SEGMENT_ARRAYS, :m], np.dot(q[i, 0], q[i, 0])
        z[:] = np.dot(psi, q[i, 0])
        work = Work(
            arrays[0, :m], arrays[1, :m], arrays[2, :m], arrays[3, :m], arrays[4, :m], arrays[5, :m], arrays[6, :m],
            arrays[7, :m], arrays[8, :m], loaded, constants, scratch, B,
        )  # fmt: skip
        delta[i], stiffness[i], steps[i] = solve_forces(H, gap, z, square, delta[i], loads, work, tolerance, limit)
        q[i, 0] = np.dot(loads, psi)
        force[i] = 0.0
        for j in range(m):
            force[i, segment[j]] = loads[j]
