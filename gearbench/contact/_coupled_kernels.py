"""Compiled solver for many error samples at once, if all segments deflect each other through many amplitudes.

``batch`` calls it. A lane is one error sample, the last axis of the arrays (``_lane_kernels``). All lanes share the
matrices but do not interact. A cell is a segment over which the gap varies.

The linear problem (``gearbench.contact.reference``, B2 of docs/algorithms.md) replaces the contact laws by springs W₀,
their slopes at the mean errors. The unknowns are u = W₀ z − P, the forces of these springs minus the forces P of the
laws. The segments move by z = z₁ load + G u, where G is the response of the linear problem to u under a given total
force. The matrices I + ΔG of Newton's method, with Δ = W − W₀, differ from the identity only where the slope W of a law
differs from W₀. They are self-adjoint in the inner product a·G b, so conjugate gradients solve the equations: in single
precision, since a Newton step needs few digits. Residuals and stiffness are in double precision. ``rise`` is z₁, the z
under a unit total force; ``flexibility`` is c = ∂δ/∂F (``Reference``). The tests compare the solver with a readable
NumPy version.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.compiled import FUSED, entry, part
from gearbench.contact._lane_kernels import (
    apply_laws,
    fill_gaps,
    keep_forces,
    note_guess_errors,
    restore_converged,
    save_lanes,
    steepen,
)

#: Relative residual at which the conjugate gradients of a Newton step end: far from the solution, and close to it.
COARSEST, FINEST = 1e-1, 1e-4
#: Maximum number of conjugate gradient steps of a Newton step; the Newton step then uses the solution reached so far.
MOST_CONJUGATE_STEPS = 60
#: Residuals and search directions of smaller magnitude are set to zero; forces are of order 1. Segments without load
#: converge at once, and products of the rounding left in their residuals would be denormal numbers, which are slow.
SMALLEST = np.float32(1e-20)


class Conjugate(NamedTuple):
    """Scratch arrays of conjugate gradients for v + ΔG v = r, in single precision.

    ``change`` is Δ = W − W₀, v the solution, r the residual, d the search direction. These and the products Gr, Gd are
    arrays (segment, lane); the others are (lane,): ``product`` is r·Gr and ``next_product`` r·Gr after the step; a lane
    is finished when r·Gr is at most ``enough``. ``alpha`` is the length of the step, ``beta`` the part of the old
    direction in the new one, ``precision`` the requested relative residual.
    """

    change: NDArray
    v: NDArray
    r: NDArray
    Gr: NDArray
    d: NDArray
    Gd: NDArray
    product: NDArray
    enough: NDArray
    alpha: NDArray
    beta: NDArray
    next_product: NDArray
    precision: NDArray


@part(FUSED)
def residuals(u, z, p, w, rise, load, weight, negative, change, total):
    """negative ← −R with R = u + p − W₀ (z + rise · load), change ← W − W₀ (single precision), total ← Σ|R|."""
    number = total.size
    for j in range(number):
        total[j] = 0.0
    for i in range(u.shape[0]):
        w0, r = weight[i], rise[i]
        for j in range(number):
            f = u[i, j] + p[i, j] - w0 * (z[i, j] + r * load[j])
            total[j] += abs(f)
            negative[i, j] = -f
            change[i, j] = w[i, j] - w0


@part()
def or_zero(x):
    """x, or 0 if its magnitude is below ``SMALLEST``."""
    return x if abs(x) > SMALLEST else np.float32(0.0)


@part(FUSED)
def first_direction(r, Gr, d, Gd, product):
    """d ← r, Gd ← G r, product ← r·G r."""
    number = product.size
    for j in range(number):
        product[j] = np.float32(0.0)
    for i in range(r.shape[0]):
        for j in range(number):
            d[i, j] = r[i, j]
            Gd[i, j] = Gr[i, j]
            product[j] += r[i, j] * Gr[i, j]


@part(FUSED)
def next_direction(r, Gr, d, Gd, beta):
    """d ← r + β d, Gd ← G r + β G d."""
    number = beta.size
    for i in range(r.shape[0]):
        for j in range(number):
            d[i, j] = or_zero(r[i, j] + beta[j] * d[i, j])
            Gd[i, j] = Gr[i, j] + beta[j] * Gd[i, j]


@part(FUSED)
def curvature(change, d, Gd, product):
    """product ← (G d)·(d + ΔG d)."""
    number = product.size
    for j in range(number):
        product[j] = np.float32(0.0)
    for i in range(d.shape[0]):
        for j in range(number):
            product[j] += Gd[i, j] * (d[i, j] + change[i, j] * Gd[i, j])


@part(FUSED)
def advance(change, d, Gd, alpha, v, r):
    """v ← v + α d, r ← r − α (d + ΔG d)."""
    number = alpha.size
    for i in range(d.shape[0]):
        for j in range(number):
            v[i, j] += alpha[j] * d[i, j]
            r[i, j] = or_zero(r[i, j] - alpha[j] * (d[i, j] + change[i, j] * Gd[i, j]))


@part(FUSED)
def inner(a, b, product):
    """product ← a·b for each lane."""
    number = product.size
    for j in range(number):
        product[j] = np.float32(0.0)
    for i in range(a.shape[0]):
        for j in range(number):
            product[j] += a[i, j] * b[i, j]


@part(FUSED)
def product_with(G, r, Gr):
    """Gr ← G r, summed in the same order for all lanes; with BLAS the order would depend on the position of a lane."""
    number = r.shape[1]
    n = len(G)
    fours, twos = n - n % 4, n - n % 2
    Gr[:] = np.float32(0.0)
    for i in range(0, fours, 4):
        for k in range(0, twos, 2):
            a, b, c, d = G[i, k], G[i + 1, k], G[i + 2, k], G[i + 3, k]
            a1, b1, c1, d1 = G[i, k + 1], G[i + 1, k + 1], G[i + 2, k + 1], G[i + 3, k + 1]
            for j in range(number):
                r0, r1 = r[k, j], r[k + 1, j]
                Gr[i, j] += a * r0 + a1 * r1
                Gr[i + 1, j] += b * r0 + b1 * r1
                Gr[i + 2, j] += c * r0 + c1 * r1
                Gr[i + 3, j] += d * r0 + d1 * r1
    for i in range(n):
        for k in range(twos if i < fours else 0, n):
            a = G[i, k]
            for j in range(number):
                Gr[i, j] += a * r[k, j]


@part(FUSED)
def conjugate_gradients(G, work):
    """Solve v + ΔG v = r to the ``precision`` of each lane in the norm of G; overwrites r, returns the step count."""
    change, v, r, Gr, d, Gd, product, enough, alpha, beta, next_product, precision = work
    number = r.shape[1]
    v[:] = np.float32(0.0)
    product_with(G, r, Gr)
    first_direction(r, Gr, d, Gd, product)
    for j in range(number):
        enough[j] = precision[j] * precision[j] * product[j]
    for step in range(MOST_CONJUGATE_STEPS):
        # alpha holds the curvature until the length of the step replaces it
        curvature(change, d, Gd, alpha)
        for j in range(number):
            alpha[j] = product[j] / alpha[j] if product[j] > enough[j] else np.float32(0.0)
        advance(change, d, Gd, alpha, v, r)
        product_with(G, r, Gr)
        inner(r, Gr, next_product)
        unfinished = 0
        for j in range(number):
            beta[j] = next_product[j] / product[j] if product[j] > enough[j] else np.float32(0.0)
            product[j] = next_product[j] if product[j] > enough[j] else product[j]
            unfinished += product[j] > enough[j]
        if unfinished == 0:
            return step + 1
        next_direction(r, Gr, d, Gd, beta)
    return MOST_CONJUGATE_STEPS


@part(FUSED)
def stiffness_from(change, rise, flexibility, v, Gv, stiffness):
    """∂F/∂δ = 1/(c − v·G v − Σ Δ ζ²) with ζ = z₁ + G v, where v solves v + ΔG v = −Δ z₁.

    Its error is of second order in the error of v.
    """
    number = stiffness.size
    for j in range(number):
        stiffness[j] = flexibility
    for i in range(change.shape[0]):
        r = rise[i]
        for j in range(number):
            zeta = r + Gv[i, j]
            stiffness[j] -= v[i, j] * Gv[i, j] + change[i, j] * zeta * zeta
    for j in range(number):
        stiffness[j] = 1.0 / stiffness[j]


@part(FUSED)
def fill_compressions(G, u, rise, load, lanes, z):
    """z ← G u, and fill the compressions s = z + rise · load − gap of all segments."""
    number = load.size
    np.dot(G, u, z)
    for i in range(len(u)):
        for j in range(number):
            lanes.s[i, j] = z[i, j] + rise[i] * load[j] - lanes.gap[i, j]


@part(FUSED)
def solve_coupled_lanes(t, G, G32, linear, laws, lanes, u, z, work, stiffness, limits):
    """Newton's method on all lanes of position t; ``lanes.done`` tells which converged.

    ``linear`` is the ``Reference``, G32 is G in single precision. ``limits`` holds the sum of residual forces at which
    the method ends, the precision of the conjugate gradients for the stiffness, and the maximum number of Newton steps.
    Returns the numbers of Newton and conjugate gradient steps.
    """
    number = stiffness.size
    tolerance, fine, limit = limits
    n, total, done, p, w, s = len(u), lanes.total, lanes.done, lanes.p, lanes.w, lanes.s
    rise, weight, load = linear.rise[t, :n], linear.weight[t, :n], lanes.load[t]
    iteration, conjugate = 0, 0
    for iteration in range(limit + 1):
        fill_compressions(G, u, rise, load, lanes, z)
        apply_laws(n, laws, lanes)
        residuals(u, z, p, w, rise, load, weight, work.r, work.change, total)
        count = 0.0
        for j in range(number):
            done[j] = 1.0 if total[j] <= tolerance else 0.0
            count += done[j]
            precision = np.float32(min(max(total[j], FINEST), COARSEST))
            # above 1: a converged lane takes no step
            work.precision[j] = np.float32(2.0) if total[j] <= tolerance else precision
        if count == number or iteration == limit:
            break
        for i in range(n):
            for j in range(number):
                work.r[i, j] = np.float32(0.0) if total[j] <= tolerance else or_zero(work.r[i, j])
        conjugate += conjugate_gradients(G32, work)
        for i in range(n):
            for j in range(number):
                u[i, j] += work.v[i, j]
    # the stiffness takes the slopes of the mean of the law over each cell: steepen makes them from w, (C11) of
    # docs/algorithms.md
    steepen(n, laws, lanes)
    for i in range(n):
        for j in range(number):
            work.change[i, j] = w[i, j] - weight[i]
            work.r[i, j] = -work.change[i, j] * rise[i]
    for j in range(number):
        work.precision[j] = np.float32(fine)
    conjugate += conjugate_gradients(G32, work)
    # p and s are free by now: they hold v and Δ in double precision
    for i in range(n):
        for j in range(number):
            p[i, j], s[i, j] = work.v[i, j], w[i, j] - weight[i]
    np.dot(G, p[:n], z)
    stiffness_from(s[:n], rise, linear.flexibility[t], p[:n], z, stiffness)
    return iteration, conjugate


@entry(FUSED)
def solve_coupled_chunk(gaps, linear, draws, lanes, accuracy, limit, results):
    """Solve every position for one chunk of samples and fill ``results``.

    Newton's method starts from the ``linear`` solution (``Reference``). The errors that this start had at the previous
    two positions are added to it with the weights ``gaps.extrapolation``. ``accuracy`` holds the residual at which the
    method ends, and the precision of the conjugate gradients for the stiffness. Within a position, gaps and δ are
    counted from the smallest gap of the sample. Returns the numbers of steps of both methods.
    """
    number = draws.shape[1]
    positions, n = gaps.gap.shape
    all_u, all_z, single = np.empty((n, number)), np.empty((n, number)), np.empty((6, n, number), dtype=np.float32)
    guess_errors, saved = np.zeros((2, n, number)), np.empty((n + 3, number))
    small, begin, newton, conjugate = np.empty((6, number), dtype=np.float32), 0, 0, 0
    tolerance, fine = accuracy
    for t in range(positions):
        m, extrapolation, laws = gaps.existing[t], gaps.extrapolation[t], gaps.laws[t]
        delta, stiffness, done = results.delta[t], results.stiffness[t], results.done[t]
        G = linear.response[begin : begin + m * m].reshape((m, m))
        G32 = linear.single_response[begin : begin + m * m].reshape((m, m))
        begin += m * m
        fill_gaps(t, gaps, draws, lanes)
        u, z = all_u[:m], all_z[:m]
        work = Conjugate(
            single[0, :m], single[1, :m], single[2, :m], single[3, :m], single[4, :m], single[5, :m],
            small[0], small[1], small[2], small[3], small[4], small[5],
        )  # fmt: skip
        for i in range(m):
            # gap at the mean errors, at the end of the cell that touches first
            at_mean = gaps.gap[t, i] - abs(gaps.tilt[t, i])
            for j in range(number):
                first = linear.start[t, i] + linear.weight[t, i] * (lanes.gap[i, j] - at_mean)
                u[i, j] = first + extrapolation[0] * guess_errors[0, i, j] + extrapolation[1] * guess_errors[1, i, j]
                guess_errors[1, i, j] = guess_errors[0, i, j]
                # holds −first until note_guess_errors adds the solution
                guess_errors[0, i, j] = -first
        # an extrapolated start is given half of the steps; if it fails, the linear solution alone is the start
        first_limit = limit if extrapolation[0] == 0.0 else limit // 2
        steps = solve_coupled_lanes(
            t, G, G32, linear, laws, lanes, u, z, work, stiffness, (tolerance, fine, first_limit)
        )
        if extrapolation[0] != 0.0 and lanes.done.sum() < number:
            # with large errors Newton's method converges more often from the linear solution alone
            save_lanes(u, delta, stiffness, lanes.done, saved[: m + 3])
            for i in range(m):
                for j in range(number):
                    u[i, j] = -guess_errors[0, i, j]
            steps = solve_coupled_lanes(t, G, G32, linear, laws, lanes, u, z, work, stiffness, (tolerance, fine, limit))
            restore_converged(u, delta, stiffness, lanes.done, saved[: m + 3])
        if len(results.force):
            fill_compressions(G, u, linear.rise[t, :m], lanes.load[t], lanes, z)
            apply_laws(m, laws, lanes)
            steepen(m, laws, lanes)
            keep_forces(t, m, lanes, results)
        newton += steps[0]
        conjugate += steps[1]
        for j in range(number):
            delta[j] = linear.flexibility[t] * lanes.load[t, j] + lanes.least[j]
            done[j] = lanes.done[j]
        for i in range(m):
            for j in range(number):
                delta[j] += linear.rise[t, i] * u[i, j]
        note_guess_errors(u, lanes.done, guess_errors[0])
    return newton, conjugate
