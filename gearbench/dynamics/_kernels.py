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


@part()
def _flank(table, spacing, row, x):
    """Force of a flank x beyond where it begins, and its slope; linear between the points and beyond."""
    at = x / spacing
    if at <= 0.0:
        return 0.0, 0.0
    j = min(int(at), table.shape[1] - 2)
    slope = table[row, j + 1] - table[row, j]
    return table[row, j] + (at - j) * slope, slope / spacing


@part()
def _mesh_force(table, begin, back, law, row, x):
    """Force and stiffness of both flanks at a phase."""
    f, k = _flank(table, law[0], row, x - begin[row])
    steps = len(begin)
    low = int(back[row])
    for more in range(2):
        weight = back[row] - low if more else 1.0 - back[row] + low
        other = (low + more) % steps
        fb, kb = _flank(table, law[0], other, -x - law[1] - begin[other])
        f, k = f - weight * fb, k + weight * kb
    return f, k


@part()
def _motion(table, begin, back, law, row, share, free):
    """x, f with x = x_free − c (f − F̄ − K̄ (x − x̄)), between two phases: Newton's method on a rising function."""
    mean_x, mean_f, mean_k, c = law[2], law[3], law[4], law[5]
    x, f, after = free, 0.0, (row + 1) % len(begin)
    for _ in range(20):
        f, k = _mesh_force(table, begin, back, law, row, x)
        if share > 0.0:
            f1, k1 = _mesh_force(table, begin, back, law, after, x)
            f, k = f + share * (f1 - f), k + share * (k1 - k)
        left = x - free + c * (f - mean_f - mean_k * (x - mean_x))
        if abs(left) <= 1e-9 * law[6]:
            break
        x -= left / (1.0 + c * (k - mean_k))
    return x, f


@part()
def _step(p, v, free, brake, kick, scratch):
    """Kicks of the speeds, dampers, free motion."""
    n = len(p)
    for j in range(n):
        v[j] += kick[j]
    if len(brake):
        for j in range(n):
            scratch[j] = 0.0
            for i in range(n):
                scratch[j] += brake[j, i] * v[i]
        v[:] = scratch
    for j in range(n):
        here, speed = p[j], v[j]
        p[j], v[j] = free[0, j] * here + free[1, j] * speed, free[2, j] * here + free[3, j] * speed


@part()
def _change(ends, reach, inverse, repeats):
    """Largest change of the modes, as motions of the mesh, over the last periods."""
    change = 0.0
    for j in range(len(reach)):
        change = max(change, abs(reach[j] * (ends[-1, 0, j] - ends[-1 - repeats, 0, j])))
        change = max(change, abs(reach[j] * inverse[j] * (ends[-1, 1, j] - ends[-1 - repeats, 1, j])))
    return change


@entry()
def run(state, free, brake, reach, table, begin, back, law, record, limits):
    """Integrate until the motion repeats; the number of periods after which it does, 0 where it does not.

    Parameters
    ----------
    state
        Modal motions and speeds (2, mode), changed in place.
    free, brake
        Free motion over a step and 1/ω (5, mode), and what dampers leave of the speeds (mode, mode), or nothing (0, 0).
    reach
        a (mode,).
    table, begin, back
        Force of a flank at equal steps of the phase (phase, point), where it begins, and the phase of the back flanks.
    law
        Spacing of the points, backlash, x̄, F̄, K̄, compliance of the modes left out, unit of motion, time step.
    record
        x and f over the last periods (2, period, phase).
    limits
        Steps between phases, most periods, change in units at which a motion repeats, and at which it may.
    """
    steps, kept, within = len(begin), record.shape[1], int(limits[0])
    p, v = state
    ends, scratch, found = np.zeros((kept + 1, 2, len(p))), np.zeros(len(p)), 0
    for period in range(int(limits[1])):
        record[:, :-1] = record[:, 1:].copy()
        for step in range(steps * within):
            row, share = step // within, (step % within) / within
            low = law[2]
            for j in range(len(p)):
                low -= reach[j] * p[j]
            x, f = _motion(table, begin, back, law, row, share, low)
            if share == 0.0:
                record[0, -1, row], record[1, -1, row] = x, f
            _step(p, v, free, brake, reach * (law[7] * (f - law[3] - law[4] * (x - law[2]))), scratch)
        ends[:-1] = ends[1:].copy()
        ends[-1] = state
        found = 0
        # it fades slowly where it nearly repeats, and may by chance be closer after several periods
        for repeats in range(1, min(kept, period) + 1):
            change = _change(ends, reach, free[4], repeats) / law[6]
            if change <= limits[3]:
                found = repeats
                if change <= limits[2]:
                    return found
                break
    return found
