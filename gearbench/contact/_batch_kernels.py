"""Compiled solver of many error samples if the blocks of a position deflect independently; ``batch`` calls it.

``_lane_kernels`` explains lanes. The Newton method of ``gearbench.contact._kernels`` runs on all lanes at once; a
converged lane takes no steps. The tests compare both solvers with a readable NumPy version. Index j counts lanes,
i segments, k blocks, and r unknowns of all blocks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.compiled import FUSED, entry, part
from gearbench.contact._lane_kernels import (
    add_combination,
    apply_laws,
    fill_gaps,
    first_guess,
    keep_forces,
    note_guess_errors,
    restore_converged,
    save_lanes,
    steepen,
)


class Blocks(NamedTuple):
    """Compliance and first guess of a ``Batch`` whose blocks deflect independently, for compiled code.

    The fields have the same names as those of the ``Batch``.
    """

    firsts: NDArray
    blocks: NDArray
    ranks: NDArray
    factor: NDArray
    product: NDArray
    start: NDArray
    guess: NDArray


class Equations(NamedTuple):
    """Newton equations of a position for the convex J(q, δ) of ``_kernels.solve_position``, (unknown, lane).

    ``q`` holds the amplitudes and δ, ``grad`` the derivatives of J by the amplitudes, ``cross`` their derivatives by
    −δ, and ``hess`` the second derivatives by the amplitudes, lower triangles row by row.
    """

    q: NDArray
    grad: NDArray
    cross: NDArray
    hess: NDArray


@part(FUSED)
def fill_compressions(first, ranks, factor, q, delta, lanes):
    """Fill the compressions s = δ − e − Ψ q of all segments."""
    number = delta.size
    rank, gap, s = factor.shape[1], lanes.gap, lanes.s
    for k in range(first.size - 1):
        columns = ranks[k]
        for i in range(first[k], first[k + 1]):
            for j in range(number):
                s[i, j] = delta[j] - gap[i, j]
            c = 0
            while c + 2 <= columns:
                b0, b1, r = factor[i, c], factor[i, c + 1], k * rank + c
                for j in range(number):
                    s[i, j] -= b0 * q[r, j] + b1 * q[r + 1, j]
                c += 2
            if c < columns:
                b0, r = factor[i, c], k * rank + c
                for j in range(number):
                    s[i, j] -= b0 * q[r, j]


@part(FUSED)
def gradient(first, ranks, factor, load, lanes, equations):
    """Fill ΣP − load, the gradient of J(q, δ), and the residual of each lane; load is (lane,)."""
    number = lanes.done.size
    blocks, rank = first.size - 1, factor.shape[1]
    p, total, residual = lanes.p, lanes.total, lanes.residual
    q, grad = equations.q, equations.grad
    for j in range(number):
        total[j] = -load[j]
    for i in range(first[blocks]):
        for j in range(number):
            total[j] += p[i, j]
    for j in range(number):
        residual[j] = abs(total[j])
    for k in range(blocks):
        for r in range(k * rank, (k + 1) * rank):
            for j in range(number):
                grad[r, j] = 0.0
            if r < k * rank + ranks[k]:
                add_combination(first[k], first[k + 1], factor, r - k * rank, p, grad, r)
                for j in range(number):
                    grad[r, j] = q[r, j] - grad[r, j]
                    residual[j] = max(residual[j], abs(grad[r, j]))


@part(FUSED)
def hessian(first, ranks, factor, product, lanes, equations):
    """Fill the second derivatives of J(q, δ) for each block; ``product`` is a position of ``Batch.product``."""
    number = lanes.done.size
    blocks, rank = first.size - 1, factor.shape[1]
    w, slope = lanes.w, lanes.slope
    cross, hess = equations.cross, equations.hess
    size = rank * (rank + 1) // 2
    for j in range(number):
        slope[j] = 0.0
    for i in range(first[blocks]):
        for j in range(number):
            slope[j] += w[i, j]
    for k in range(blocks):
        for c in range(rank):
            r = k * rank + c
            for j in range(number):
                cross[r, j] = 0.0
            if c >= ranks[k]:
                continue
            add_combination(first[k], first[k + 1], factor, c, w, cross, r)
            for d in range(c + 1):
                t = c * (c + 1) // 2 + d
                one = 1.0 if c == d else 0.0
                for j in range(number):
                    hess[k * size + t, j] = one
                add_combination(first[k], first[k + 1], product.T, t, w, hess, k * size + t)


@part(FUSED)
def factorise(ranks, rank, hess, x, y):
    """Replace the Hessian of each block by its Cholesky factor L with inverse diagonal, and x, y by L⁻¹x, L⁻¹y."""
    number = x.shape[1]
    size = rank * (rank + 1) // 2
    for k in range(ranks.size):
        for c in range(ranks[k]):
            row, xr = k * size + c * (c + 1) // 2, k * rank + c
            for d in range(c + 1):
                other = k * size + d * (d + 1) // 2
                f = 0
                while f + 3 <= d:
                    a0, a1, a2, b0, b1, b2 = row + f, row + f + 1, row + f + 2, other + f, other + f + 1, other + f + 2
                    for j in range(number):
                        two = hess[a0, j] * hess[b0, j] + hess[a1, j] * hess[b1, j]
                        hess[row + d, j] -= two + hess[a2, j] * hess[b2, j]
                    f += 3
                while f < d:
                    for j in range(number):
                        hess[row + d, j] -= hess[row + f, j] * hess[other + f, j]
                    f += 1
                if c == d:
                    for j in range(number):
                        hess[row + d, j] = 1.0 / np.sqrt(hess[row + d, j])
                else:
                    for j in range(number):
                        hess[row + d, j] *= hess[other + d, j]
            for f in range(c):
                for j in range(number):
                    x[xr, j] -= hess[row + f, j] * x[k * rank + f, j]
                    y[xr, j] -= hess[row + f, j] * y[k * rank + f, j]
            for j in range(number):
                x[xr, j] *= hess[row + c, j]
                y[xr, j] *= hess[row + c, j]


@part(FUSED)
def back_substitute(ranks, rank, hess, x):
    """x ← L⁻ᵀ x for each block."""
    number = x.shape[1]
    size = rank * (rank + 1) // 2
    for k in range(ranks.size):
        for c in range(ranks[k] - 1, -1, -1):
            r = k * rank + c
            for f in range(c + 1, ranks[k]):
                t = k * size + f * (f + 1) // 2 + c
                for j in range(number):
                    x[r, j] -= hess[t, j] * x[k * rank + f, j]
            t = k * size + c * (c + 1) // 2 + c
            for j in range(number):
                x[r, j] *= hess[t, j]


@part(FUSED)
def newton_step(ranks, rank, lanes, equations, delta, which):
    """One full Newton step of q and δ in the lanes whose ``done`` is ``which``; ``lanes.slope`` becomes ∂F/∂δ."""
    number = delta.size
    total, slope, done, step = lanes.total, lanes.slope, lanes.done, lanes.step
    q, y, x, hess = equations
    blocks = ranks.size
    # grad and cross become y = L⁻¹ grad and x = L⁻¹ cross
    factorise(ranks, rank, hess, x, y)
    for j in range(number):
        step[j] = -total[j]
    for r in range(blocks * rank):
        for j in range(number):
            slope[j] -= x[r, j] * x[r, j]
            step[j] -= x[r, j] * y[r, j]
    for j in range(number):
        step[j] = step[j] / slope[j] if done[j] == which else 0.0
    for r in range(blocks * rank):
        for j in range(number):
            x[r, j] = x[r, j] * step[j] - y[r, j]
    back_substitute(ranks, rank, hess, x)
    for r in range(blocks * rank):
        for j in range(number):
            q[r, j] = q[r, j] + x[r, j] if done[j] == which else q[r, j]
    for j in range(number):
        delta[j] += step[j]


@part(FUSED)
def solve_lanes(t, system, laws, lanes, equations, delta, stiffness, tolerance, limit):
    """Newton's method on all lanes of position t of ``system`` (``Blocks``); returns the number of steps.

    A lane takes no step while its residual is within the tolerance; ``lanes.done`` tells which lanes these are. In the
    end these lanes take one more step with the slopes of ``steepen``, which also give the stiffness. These slopes are
    not the derivative of the forces, so the step leaves a few percent of the residual.
    """
    number = delta.size
    first, ranks = system.firsts[t, : system.blocks[t] + 1], system.ranks[t, : system.blocks[t]]
    factor, product, done = system.factor[t], system.product[t], lanes.done
    n, rank, steps = first[ranks.size], factor.shape[1], 0
    for steps in range(1, limit + 1):
        fill_compressions(first, ranks, factor, equations.q, delta, lanes)
        apply_laws(n, laws, lanes)
        gradient(first, ranks, factor, lanes.load[t], lanes, equations)
        count = 0.0
        for j in range(number):
            done[j] = 1.0 if lanes.residual[j] <= tolerance else 0.0
            count += done[j]
        if count == number or steps == limit:
            break
        hessian(first, ranks, factor, product, lanes, equations)
        newton_step(ranks, rank, lanes, equations, delta, 0.0)
    steepen(n, laws, lanes)
    hessian(first, ranks, factor, product, lanes, equations)
    newton_step(ranks, rank, lanes, equations, delta, 1.0)
    for j in range(number):
        stiffness[j] = lanes.slope[j]
    return steps


@entry(FUSED)
def schur_complements(matrix, size, rows, result):
    """Fill ``result`` (row, row, lane) with the Schur complements of the last ``rows`` rows of symmetric matrices.

    Lower triangles of the matrices are stored row by row, (…, lane); they are overwritten.
    """
    number = matrix.shape[1]
    nothing = np.zeros((size, number))
    factorise(np.array([size]), size, matrix, nothing, nothing)
    first = size - rows
    for i in range(rows):
        a = (first + i) * (first + i + 1) // 2 + first
        for k in range(i + 1):
            b = (first + k) * (first + k + 1) // 2 + first
            for j in range(number):
                # factors have inverse diagonals
                total = matrix[a + k, j] / matrix[b + k, j] if k < i else 1.0 / matrix[a + i, j] ** 2
                for c in range(k):
                    total += matrix[a + c, j] * matrix[b + c, j]
                result[i, k, j] = result[k, i, j] = total


@entry(FUSED)
def solve_chunk(gaps, system, draws, lanes, tolerance, limit, results):
    """Solve every position for one chunk of samples and fill ``results``.

    The first guess of (q, δ) is linear in the draws (error, lane). The errors that this guess had at the previous two
    positions are added to it with the weights ``gaps.extrapolation``. Within a position, gaps and δ are counted from
    the smallest gap of the sample.
    """
    number = draws.shape[1]
    rank, unknowns = system.factor.shape[2], system.start.shape[1] - 1
    q, grad, cross = np.empty((unknowns + 1, number)), np.empty((unknowns, number)), np.empty((unknowns, number))
    equations = Equations(q, grad, cross, np.empty((unknowns * (rank + 1) // 2 + 1, number)))
    guess_errors, saved = np.zeros((2, unknowns + 1, number)), np.empty((unknowns + 4, number))
    steps = 0
    for t in range(len(gaps.existing)):
        extrapolation, laws = gaps.extrapolation[t], gaps.laws[t]
        delta, stiffness, done = results.delta[t], results.stiffness[t], results.done[t]
        fill_gaps(t, gaps, draws, lanes)
        first_guess(system.start[t], system.guess[t], draws, extrapolation, guess_errors, q)
        for j in range(number):
            delta[j] = q[unknowns, j] - lanes.least[j]
        # an extrapolated guess is given half of the steps; without success the linear guess follows
        first_limit = limit if extrapolation[0] == 0.0 else limit // 2
        steps += solve_lanes(t, system, laws, lanes, equations, delta, stiffness, tolerance, first_limit)
        if extrapolation[0] != 0.0 and lanes.done.sum() < number:
            # with large errors Newton's method converges more often from the linear guess alone
            save_lanes(q, delta, stiffness, lanes.done, saved)
            for r in range(unknowns + 1):
                for j in range(number):
                    q[r, j] = -guess_errors[0, r, j]
            for j in range(number):
                delta[j] = q[unknowns, j] - lanes.least[j]
            steps += solve_lanes(t, system, laws, lanes, equations, delta, stiffness, tolerance, limit)
            restore_converged(q, delta, stiffness, lanes.done, saved)
        if len(results.force):
            first = system.firsts[t, : system.blocks[t] + 1]
            fill_compressions(first, system.ranks[t, : system.blocks[t]], system.factor[t], q, delta, lanes)
            apply_laws(first[-1], laws, lanes)
            steepen(first[-1], laws, lanes)
            keep_forces(t, first[-1], lanes, results)
        for j in range(number):
            delta[j] += lanes.least[j]
            done[j] = lanes.done[j]
            q[unknowns, j] = delta[j]
        note_guess_errors(q, done, guess_errors[0])
    return steps
