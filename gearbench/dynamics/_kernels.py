"""Compiled loops of the dynamics, held equal to readable NumPy twins by the tests."""

from __future__ import annotations

import numpy as np

from gearbench.compiled import entry, part

#: Samples solved side by side.
LANES = 8


@part()
def _free(by, s, count, p, v):
    for r in range(count):
        pp, pv, vp, vv = by[0, s, r], by[1, s, r], by[2, s, r], by[3, s, r]
        for j in range(p.shape[1]):
            here, speed = p[r, j], v[r, j]
            p[r, j] = pp * here + pv * speed
            v[r, j] = vp * here + vv * speed


@part()
def _kick(stiffness, a, dt, count, p, v, motion):
    """v ← v − Δt aᵀ K a p of the first ``count`` modes; ``motion`` (row, column) is scratch."""
    rows, columns = motion.shape
    motion[:] = 0.0
    for m in range(rows):
        for i in range(count):
            for j in range(columns):
                motion[m, j] += a[m, i] * p[i, j]
    for m in range(rows):
        for n in range(rows):
            for i in range(count):
                share = stiffness[m, n] * dt * a[m, i]
                for j in range(columns):
                    v[i, j] -= share * motion[n, j]


@entry()
def monodromy(own, half, a, kick, dt, r, counts):
    """Map (speed, 2·mode, 2·mode) of (p, v/ω_r) over a period of kicks between free motion.

    The kicks K(t) − K̄ are (1 or speed, step, row, row). At each speed the first ``counts`` modes (speed,) move; the
    others stand still.
    """
    rows, size = a.shape
    steps = kick.shape[1]
    out = np.zeros((len(dt), 2 * size, 2 * size))
    motion = np.empty((rows, 2 * size))
    for s in range(len(dt)):
        p, v = np.zeros((size, 2 * size)), np.zeros((size, 2 * size))
        count = counts[s]
        for i in range(count):
            p[i, i], v[i, size + i] = 1.0, r[i]
        _free(half, s, count, p, v)
        for step in range(steps):
            _kick(kick[min(s, len(kick) - 1), step], a, dt[s], count, p, v, motion)
            if step < steps - 1:
                _free(own, s, count, p, v)
        _free(half, s, count, p, v)
        out[s, :size] = p
        for i in range(count):
            out[s, size + i] = v[i] / r[i]
    return out


@entry()
def force_squares(stiffness, drive, dynamic):
    """Σ|f̂_n|² (speed, lane) of (K + D) x = b, f̂ = −D x; orders 1 … H, order 0 eliminated before.

    stiffness (2H, 2H, lane), drive (2H, lane), D (speed, H) complex. Orders are eliminated in 2 × 2 blocks from the
    highest, where D rules, to the first.
    """
    n, lanes = drive.shape
    out = np.zeros((len(dynamic), lanes))
    A, b = np.empty((n, n, lanes)), np.empty((n, lanes))
    for s in range(len(dynamic)):
        A[:], b[:] = stiffness, drive
        for k in range(n // 2):
            re, im = dynamic[s, k].real, dynamic[s, k].imag
            for i in range(lanes):
                A[2 * k, 2 * k, i] += re
                A[2 * k + 1, 2 * k + 1, i] += re
                A[2 * k, 2 * k + 1, i] -= im
                A[2 * k + 1, 2 * k, i] += im
        for k in range(n - 2, -1, -2):
            _eliminate(A, b, k)
        for k in range(0, n, 2):
            for j in range(k):
                for i in range(lanes):
                    b[k, i] -= A[k, j, i] * b[j, i]
                    b[k + 1, i] -= A[k + 1, j, i] * b[j, i]
            d = dynamic[s, k // 2]
            size = d.real * d.real + d.imag * d.imag
            for i in range(lanes):
                out[s, i] += size * (b[k, i] ** 2 + b[k + 1, i] ** 2)
    return out


@part()
def _eliminate(A, b, k):
    """Solve rows k, k+1 for their unknowns and put them into all rows above."""
    lanes = b.shape[1]
    for i in range(lanes):
        w, x, y, z = A[k, k, i], A[k, k + 1, i], A[k + 1, k, i], A[k + 1, k + 1, i]
        over = 1.0 / (w * z - x * y)
        A[k, k, i], A[k, k + 1, i], A[k + 1, k, i], A[k + 1, k + 1, i] = z * over, -x * over, -y * over, w * over
        one, two = b[k, i], b[k + 1, i]
        b[k, i] = A[k, k, i] * one + A[k, k + 1, i] * two
        b[k + 1, i] = A[k + 1, k, i] * one + A[k + 1, k + 1, i] * two
    for j in range(k):
        for i in range(lanes):
            one, two = A[k, j, i], A[k + 1, j, i]
            A[k, j, i] = A[k, k, i] * one + A[k, k + 1, i] * two
            A[k + 1, j, i] = A[k + 1, k, i] * one + A[k + 1, k + 1, i] * two
    for row in range(k):
        for j in range(k):
            for i in range(lanes):
                A[row, j, i] -= A[row, k, i] * A[k, j, i] + A[row, k + 1, i] * A[k + 1, j, i]
        for i in range(lanes):
            b[row, i] -= A[row, k, i] * b[k, i] + A[row, k + 1, i] * b[k + 1, i]
