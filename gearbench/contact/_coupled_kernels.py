"""Compiled solver for many gap vectors where all segments of a position move each other: samples in lanes.

Newton's method in the forces u beside those of the linear problem at the mean errors (``gearbench.contact.reference``,
B2 of docs/theory.md): its matrices I + ΔG differ from the identity only where the slope of a law differs from that at
the mean errors. Their solution by conjugate gradients needs a few digits only and has them in single precision;
residuals and stiffness are computed in double precision. All lanes share G: the products with it are those of BLAS.
No lane sees another. A NumPy twin in the tests holds it to the same answers.
"""

from __future__ import annotations

import numpy as np

from gearbench.compiled import FUSED, entry, part
from gearbench.contact._batch_kernels import apply_laws, from_smallest
from gearbench.contact._lane_kernels import (
    LANES,
    add_combination,
    keep_settled,
    note_missed,
    restore_settled,
)

#: Precision of the Newton steps relative to their first residual: at least, and at most.
LEAST_PRECISION, MOST_PRECISION = 1e-1, 1e-4
#: Conjugate gradient steps after which a lane goes on with what it has.
MOST_CONJUGATE = 60


@part(FUSED)
def residuals(u, z, p, w, rise, weight, own, change, total):
    """own ← −F, F = u + p − W₀ z, and change ← W − W₀, single precision; total ← Σ|F|. z lacks ``rise``."""
    for j in range(LANES):
        total[j] = 0.0
    for i in range(u.shape[0]):
        w0, r = weight[i], rise[i]
        for j in range(LANES):
            f = u[i, j] + p[i, j] - w0 * (z[i, j] + r)
            total[j] += abs(f)
            own[i, j] = -f
            change[i, j] = w[i, j] - w0


@part(FUSED)
def first_direction(r, Gr, d, Gd, product):
    """d ← r, G d ← G r; product ← r·G r."""
    for j in range(LANES):
        product[j] = np.float32(0.0)
    for i in range(r.shape[0]):
        for j in range(LANES):
            d[i, j] = r[i, j]
            Gd[i, j] = Gr[i, j]
            product[j] += r[i, j] * Gr[i, j]


@part(FUSED)
def next_direction(r, Gr, d, Gd, beta):
    """d ← r + β d, G d ← G r + β G d."""
    for i in range(r.shape[0]):
        for j in range(LANES):
            d[i, j] = r[i, j] + beta[j] * d[i, j]
            Gd[i, j] = Gr[i, j] + beta[j] * Gd[i, j]


@part(FUSED)
def curvature(change, d, Gd, product):
    """product ← (G d)·(d + ΔG d)."""
    for j in range(LANES):
        product[j] = np.float32(0.0)
    for i in range(d.shape[0]):
        for j in range(LANES):
            product[j] += Gd[i, j] * (d[i, j] + change[i, j] * Gd[i, j])


@part(FUSED)
def advance(change, d, Gd, alpha, v, r):
    """v ← v + α d, r ← r − α (d + ΔG d)."""
    for i in range(d.shape[0]):
        for j in range(LANES):
            v[i, j] += alpha[j] * d[i, j]
            r[i, j] -= alpha[j] * (d[i, j] + change[i, j] * Gd[i, j])


@part(FUSED)
def inner(a, b, product):
    """product ← a·b of each lane."""
    for j in range(LANES):
        product[j] = np.float32(0.0)
    for i in range(a.shape[0]):
        for j in range(LANES):
            product[j] += a[i, j] * b[i, j]


@part(FUSED)
def conjugate_gradients(G, change, precision, v, r, Gr, d, Gd, rows):
    """v with v + ΔG v = r to the ``precision`` of each lane in the norm of G, single precision; uses r up.

    rows: 0 r·G r, 1 bound on it, 2 α, 3 β, 4 new product.
    """
    product, bound, alpha, beta, fresh = rows[0], rows[1], rows[2], rows[3], rows[4]
    v[:] = np.float32(0.0)
    np.dot(G, r, Gr)
    first_direction(r, Gr, d, Gd, product)
    for j in range(LANES):
        bound[j] = precision[j] * precision[j] * product[j]
    for step in range(MOST_CONJUGATE):
        curvature(change, d, Gd, alpha)
        for j in range(LANES):
            alpha[j] = product[j] / alpha[j] if product[j] > bound[j] else np.float32(0.0)
        advance(change, d, Gd, alpha, v, r)
        np.dot(G, r, Gr)
        inner(r, Gr, fresh)
        count = 0
        for j in range(LANES):
            beta[j] = fresh[j] / product[j] if product[j] > bound[j] else np.float32(0.0)
            product[j] = fresh[j] if product[j] > bound[j] else product[j]
            count += product[j] > bound[j]
        if count == 0:
            return step + 1
        next_direction(r, Gr, d, Gd, beta)
    return MOST_CONJUGATE


@part(FUSED)
def compress(gap, z, rise, s):
    """s = z − e."""
    for i in range(gap.shape[0]):
        r = rise[i]
        for j in range(LANES):
            s[i, j] = z[i, j] + r - gap[i, j]


@part(FUSED)
def stiffness_from(change, rise, flexibility, v, Gv, stiffness):
    """∂F/∂δ from v, good to the square of its precision."""
    for j in range(LANES):
        stiffness[j] = flexibility
    for i in range(change.shape[0]):
        r = rise[i]
        for j in range(LANES):
            zeta = r + Gv[i, j]
            stiffness[j] -= v[i, j] * Gv[i, j] + change[i, j] * zeta * zeta
    for j in range(LANES):
        stiffness[j] = 1.0 / stiffness[j]


@part(FUSED)
def solve_coupled_lanes(
    G, G32, gap, law, rise, weight, flexibility, u, stiffness, tolerance, fine, limit, z, s, p, w, single, rows, small
):  # fmt: skip
    """Newton's method on all lanes of one position; rows[7] tells which lanes converged. Returns (Newton, CG) steps.

    tolerance: sum of the residual forces; fine: precision of the conjugate gradients for the stiffness.
    """
    n, bits, total, done = gap.shape[0], rows.view(np.int64), rows[6], rows[7]
    change, v, r, Gr, d, Gd = single[0, :n], single[1, :n], single[2, :n], single[3, :n], single[4, :n], single[5, :n]
    precision = small[5]
    iteration, conjugate = 0, 0
    for iteration in range(limit + 1):
        np.dot(G, u, z)
        compress(gap, z, rise, s)
        apply_laws(n, s, law[0], law[1], law[2], law[3], law[4], p, w, rows, bits)
        residuals(u, z, p, w, rise, weight, r, change, total)
        count = 0.0
        for j in range(LANES):
            done[j] = 1.0 if total[j] <= tolerance else 0.0
            count += done[j]
            precision[j] = np.float32(min(max(total[j], MOST_PRECISION), LEAST_PRECISION))
            precision[j] = np.float32(2.0) if total[j] <= tolerance else precision[j]
        if count == LANES or iteration == limit:
            break
        conjugate += conjugate_gradients(G32, change, precision, v, r, Gr, d, Gd, small)
        for i in range(n):
            for j in range(LANES):
                u[i, j] += v[i, j]
    for i in range(n):
        for j in range(LANES):
            r[i, j] = -change[i, j] * rise[i]
    for j in range(LANES):
        precision[j] = np.float32(fine)
    conjugate += conjugate_gradients(G32, change, precision, v, r, Gr, d, Gd, small)
    for i in range(n):
        for j in range(LANES):
            p[i, j], s[i, j] = v[i, j], w[i, j] - weight[i]
    np.dot(G, p, z)
    stiffness_from(s, rise, flexibility, p, z, stiffness)
    return iteration, conjugate


@entry(FUSED)
def solve_coupled_chunk(
    count, ahead, gap0, modes, draws, laws, response, single_response, rise, flexibility, weight, start, tolerance,
    fine, limit, delta, stiffness, done,
):  # fmt: skip
    """Solve every position for one chunk of ``LANES`` samples; fills δ, ∂F/∂δ and whether they converged.

    A sample begins from the linear solution and, by the weights ``ahead``, from what that missed at the two positions
    before.

    Arrays as in ``gearbench.contact.batch.Batch`` and ``Reference``; draws (error, lanes).
    """
    positions, n = gap0.shape
    gap, s, p, w = np.empty((n, LANES)), np.empty((n, LANES)), np.empty((n, LANES)), np.empty((n, LANES))
    u, z, single = np.empty((n, LANES)), np.empty((n, LANES)), np.empty((6, n, LANES), dtype=np.float32)
    missed, kept = np.zeros((2, n, LANES)), np.empty((n + 3, LANES))
    rows, small, least = np.empty((9, LANES)), np.empty((6, LANES), dtype=np.float32), np.empty(LANES)
    begin, steps, conjugate = 0, 0, 0
    for t in range(positions):
        m = count[t]
        G = response[begin : begin + m * m].reshape((m, m))
        G32 = single_response[begin : begin + m * m].reshape((m, m))
        begin += m * m
        for i in range(m):
            for j in range(LANES):
                gap[i, j] = gap0[t, i]
            add_combination(0, draws.shape[0], modes[t], i, draws, gap, i)
        for j in range(LANES):
            delta[t, j] = 0.0
        from_smallest(m, gap, delta[t], least)
        for i in range(m):
            for j in range(LANES):
                first = start[t, i] + weight[t, i] * (gap[i, j] - gap0[t, i])
                u[i, j] = first + ahead[t, 0] * missed[0, i, j] + ahead[t, 1] * missed[1, i, j]
                missed[1, i, j] = missed[0, i, j]
                missed[0, i, j] = -first
        newton, more = solve_coupled_lanes(
            G, G32, gap[:m], laws[t], rise[t, :m], weight[t, :m], flexibility[t], u[:m], stiffness[t], tolerance,
            fine, limit if ahead[t, 0] == 0.0 else limit // 2, z[:m], s[:m], p[:m], w[:m], single, rows, small,
        )  # fmt: skip
        if ahead[t, 0] != 0.0 and rows[7].sum() < LANES:
            # large errors: from the linear solution alone Newton's method goes farther
            keep_settled(u[:m], delta[t], stiffness[t], rows[7], kept[: m + 3])
            for i in range(m):
                for j in range(LANES):
                    u[i, j] = -missed[0, i, j]
            newton, more = solve_coupled_lanes(
                G, G32, gap[:m], laws[t], rise[t, :m], weight[t, :m], flexibility[t], u[:m], stiffness[t], tolerance,
                fine, limit, z[:m], s[:m], p[:m], w[:m], single, rows, small,
            )  # fmt: skip
            restore_settled(u[:m], delta[t], stiffness[t], rows[7], kept[: m + 3])
        steps += newton
        conjugate += more
        for j in range(LANES):
            delta[t, j] = flexibility[t] + least[j]
            done[t, j] = rows[7, j]
        for i in range(m):
            for j in range(LANES):
                delta[t, j] += rise[t, i] * u[i, j]
        note_missed(u[:m], rows[7], missed[0])
    return steps, conjugate
