"""Compiled loops of the dynamics: stability (D7) for ``stability``, integration over time (D10) for ``nonlinear``.

p and v are modal displacements and velocities. A row is a relative motion of the gears of a mesh: the approach, then
tilt and bending (``ForceCurve``). The tests compare the loops with readable NumPy versions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.compiled import entry, part

#: Newton's method for the motion of the meshes: maximum number of steps, and residual relative to the mean deflection.
MOST_STEPS, RESIDUAL = 20, 1e-9


class ForceTable(NamedTuple):
    """Force of a mesh over approach and phase, for compiled code.

    Fields of ``ForceCurve`` and ``TiltAndBending`` under the same names, and the ``mean`` force of the mesh [N].
    """

    begin: NDArray
    table: NDArray
    spacing: float
    backlash: float
    back_phase: NDArray
    mean: float
    coupling: NDArray
    motion: NDArray
    force: NDArray
    stiffness: NDArray


class MeanState(NamedTuple):
    """Mean state of a mesh, about which its motion is integrated.

    x̄ [mm] and f̄ [N] (row,), K̄ [N/mm] and the compliance of the modes that follow quasi-statically [mm/N] (row, row),
    and the mean deflection [mm].
    """

    motion: NDArray
    force: NDArray
    stiffness: NDArray
    residual_compliance: NDArray
    deflection: float


class Workspace(NamedTuple):
    """Scratch arrays: x, f, the residual of the balance and f − f̄ − K̄ (x − x̄) as rows (4, row); two matrices."""

    vectors: NDArray
    matrices: NDArray


@part()
def _free(coefficients, s, count, p, v):
    """Free motion of the first ``count`` modes over a step at speed s; p and v (mode, column) change in place."""
    for r in range(count):
        pp, pv, vp, vv = coefficients[0, s, r], coefficients[1, s, r], coefficients[2, s, r], coefficients[3, s, r]
        for j in range(p.shape[1]):
            position, velocity = p[r, j], v[r, j]
            p[r, j] = pp * position + pv * velocity
            v[r, j] = vp * position + vv * velocity


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
                factor = stiffness[m, n] * dt * a[m, i]
                for j in range(columns):
                    v[i, j] -= factor * motion[n, j]


@entry()
def monodromy(full, half, a, kick, dt, r, counts):
    """Matrix (speed, 2·mode, 2·mode) that maps (p, v/ω_r) over one period: free motion alternates with kicks.

    ``full`` and ``half`` (4, speed, mode) are ``stability.free_motion`` over a step and half a step, a (row, mode) the
    relative motions per modal displacement, ``kick`` (1 or speed, step, row, row) is K(t) − K̄, dt (speed,) the step, r
    (mode,) is ω_r. At each speed the first ``counts`` modes (speed,) move; the others stand still.
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
                _free(full, s, count, p, v)
        _free(half, s, count, p, v)
        out[s, :size] = p
        for i in range(count):
            out[s, size + i] = v[i] / r[i]
    return out


@part()
def _flank(table, spacing, row, x):
    """Force of a flank and its slope at the approach x beyond first contact, at the phase ``row`` of the ``table``.

    The force is linear between the points of the table and beyond them.
    """
    position = x / spacing
    if position <= 0.0:
        return 0.0, 0.0
    interval = min(int(position), table.shape[1] - 2)
    slope = table[row, interval + 1] - table[row, interval]
    return table[row, interval] + (position - interval) * slope, slope / spacing


@part()
def _approached(curve, row, x):
    """Force and stiffness of drive and back flanks together, at the phase ``row`` and the approach x."""
    begin, back = curve.begin, curve.back_phase
    f, k = _flank(curve.table, curve.spacing, row, x - begin[row])
    steps = len(begin)
    below = int(back[row])
    for side in range(2):
        weight = back[row] - below if side else 1.0 - back[row] + below
        phase = (below + side) % steps
        fb, kb = _flank(curve.table, curve.spacing, phase, -x - curve.backlash - begin[phase])
        f, k = f - weight * fb, k + weight * kb
    return f, k


@part()
def _add_force(curve, row, x, weight, f, J):
    """Add the resultants at the phase ``row`` and motions x to f, their derivatives to J, times ``weight`` (D9)."""
    mean, coupling, mean_motion = curve.mean, curve.coupling[row], curve.motion[row]
    approach = x[0]
    for j in range(len(coupling)):
        approach += coupling[j] * (x[j + 1] - mean_motion[j])
    force, k = _approached(curve, row, approach)
    loaded = min(max(force / mean, 0.0), 1.0)
    f[0] += weight * force
    J[0, 0] += weight * k
    for j in range(len(coupling)):
        # m_j(F) and its slope
        resultant, slope = curve.force[row, j] + coupling[j] * (force - mean), coupling[j]
        if loaded < 1.0:
            # below the mean force: a parabola through zero that keeps the slope at the mean force
            bend = coupling[j] - curve.force[row, j] / mean
            slope = slope - 2.0 * bend * (1.0 - loaded) if loaded > 0.0 else 0.0
            resultant = loaded * (curve.force[row, j] + bend * (force - mean))
        f[j + 1] += weight * resultant
        J[0, j + 1] += weight * k * coupling[j]
        J[j + 1, 0] += weight * slope * k
        for i in range(len(coupling)):
            stiffness = loaded * curve.stiffness[row, j, i]
            f[j + 1] += weight * stiffness * (x[i + 1] - mean_motion[i])
            J[j + 1, i + 1] += weight * (stiffness + slope * k * coupling[i])


@part()
def _motion(curve, mean_state, row, share, free_motion, work):
    """Solve x = x_free − c (f(x) − f̄ − K̄ (x − x̄)) for x by Newton's method, starting from x_free.

    c is the residual compliance. f is interpolated between the phase ``row`` and the next one, to which the weight
    ``share`` belongs. The results are in ``work``.
    """
    x, f, residual, excess = work.vectors[0], work.vectors[1], work.vectors[2], work.vectors[3]
    J, A = work.matrices
    next_row, size = (row + 1) % len(curve.begin), len(free_motion)
    x[:] = free_motion
    for _ in range(MOST_STEPS):
        f[:], J[:] = 0.0, 0.0
        _add_force(curve, row, x, 1.0 - share, f, J)
        if share > 0.0:
            _add_force(curve, next_row, x, share, f, J)
        largest = 0.0
        for i in range(size):
            excess[i] = f[i] - mean_state.force[i]
            for j in range(size):
                excess[i] -= mean_state.stiffness[i, j] * (x[j] - mean_state.motion[j])
        for i in range(size):
            residual[i] = free_motion[i] - x[i]
            for j in range(size):
                residual[i] -= mean_state.residual_compliance[i, j] * excess[j]
                A[i, j] = 1.0 if i == j else 0.0
                for m in range(size):
                    A[i, j] += mean_state.residual_compliance[i, m] * (J[m, j] - mean_state.stiffness[m, j])
            largest = max(largest, abs(residual[i]))
        if largest <= RESIDUAL * mean_state.deflection:
            break
        _solve(A, residual)
        for i in range(size):
            x[i] += residual[i]


@part()
def _solve(A, b):
    """b ← A⁻¹ b for a few unknowns, without pivoting because A is close to the identity."""
    size = len(b)
    for k in range(size):
        for i in range(k + 1, size):
            factor = A[i, k] / A[k, k]
            for j in range(k, size):
                A[i, j] -= factor * A[k, j]
            b[i] -= factor * b[k]
    for k in range(size - 1, -1, -1):
        for j in range(k + 1, size):
            b[k] -= A[k, j] * b[j]
        b[k] /= A[k, k]


@part()
def _step(p, v, free, damper_factors, kick, scratch):
    """Advance the modes by one step: kick the velocities, reduce them by the dampers, then move freely."""
    n = len(p)
    for j in range(n):
        v[j] += kick[j]
    if len(damper_factors):
        for j in range(n):
            scratch[j] = 0.0
            for i in range(n):
                scratch[j] += damper_factors[j, i] * v[i]
        v[:] = scratch
    for j in range(n):
        position, velocity = p[j], v[j]
        p[j], v[j] = free[0, j] * position + free[1, j] * velocity, free[2, j] * position + free[3, j] * velocity


@part()
def _change(ends, mesh_motion, inverse, repeats):
    """Largest change of a mode over the last ``repeats`` periods, as the approach [mm] of the mesh that it causes.

    ``ends`` (period, 2, mode) holds p and v at the ends of periods; ``inverse`` (mode,) is 1/ω.
    """
    change = 0.0
    for j in range(mesh_motion.shape[1]):
        change = max(change, abs(mesh_motion[0, j] * (ends[-1, 0, j] - ends[-1 - repeats, 0, j])))
        change = max(change, abs(mesh_motion[0, j] * inverse[j] * (ends[-1, 1, j] - ends[-1 - repeats, 1, j])))
    return change


@entry()
def run(state, free, damper_factors, mesh_motion, curve, mean_state, record, limits):
    """Integrate until the motion repeats, and return the number of periods after which it does, or 0 if it does not.

    Parameters
    ----------
    state
        Modal displacements and velocities (2, mode), changed in place.
    free, damper_factors
        Free motion over a step and 1/ω (5, mode); matrix by which dampers reduce the velocities in a step (mode, mode),
        or an empty array (0, 0).
    mesh_motion
        Relative motion of the mesh rows per modal displacement, a (row, mode).
    curve, mean_state
        ``ForceTable`` and ``MeanState``.
    record
        x and f over the last periods (2, row, period, phase), filled.
    limits
        Time step [s], steps between phases, maximum number of periods, and two changes relative to the mean deflection:
        below the first the motion repeats, and the integration ends; after the last period the second is enough.
    """
    rows, modes = mesh_motion.shape
    phases, kept, substeps = len(curve.begin), record.shape[2], int(limits[1])
    dt, same, near = limits[0], limits[3], limits[4]
    p, v = state
    work = Workspace(np.zeros((4, rows)), np.zeros((2, rows, rows)))
    kick, free_motion = np.zeros(modes), np.zeros(rows)
    ends, scratch, period_count = np.zeros((kept + 1, 2, len(p))), np.zeros(len(p)), 0
    for period in range(int(limits[2])):
        record[:, :, :-1] = record[:, :, 1:].copy()
        for step in range(phases * substeps):
            row, share = step // substeps, (step % substeps) / substeps
            for i in range(rows):
                free_motion[i] = mean_state.motion[i]
                for j in range(modes):
                    free_motion[i] -= mesh_motion[i, j] * p[j]
            _motion(curve, mean_state, row, share, free_motion, work)
            if share == 0.0:
                record[0, :, -1, row], record[1, :, -1, row] = work.vectors[0], work.vectors[1]
            for j in range(modes):
                kick[j] = 0.0
                for i in range(rows):
                    kick[j] += dt * mesh_motion[i, j] * work.vectors[3, i]
            _step(p, v, free, damper_factors, kick, scratch)
        ends[:-1] = ends[1:].copy()
        ends[-1] = state
        period_count = 0
        # the shortest period counts: a motion that settles slowly may by chance agree better with a longer one
        for repeats in range(1, min(kept, period) + 1):
            change = _change(ends, mesh_motion, free[4], repeats) / mean_state.deflection
            if change <= near:
                period_count = repeats
                if change <= same:
                    return period_count
                break
    return period_count
