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
    """Forces of the meshes over approach and phase, for compiled code; the first axis of most arrays is the mesh.

    Fields of ``ForceCurve`` and ``TiltAndBending`` under the same names, with the number of ``phases`` in a period of
    each mesh, which divides that of the cycle, and the ``mean`` forces [N]. ``offset`` g [mm] (phase, mesh) and
    ``between`` C [mm/N] (phase, mesh, mesh) couple the meshes over the phases of the cycle; without C it has no phases.
    """

    begin: NDArray
    table: NDArray
    spacing: NDArray
    backlash: NDArray
    back_phase: NDArray
    coupling: NDArray
    motion: NDArray
    force: NDArray
    stiffness: NDArray
    phases: NDArray
    mean: NDArray
    offset: NDArray
    between: NDArray


class MeanState(NamedTuple):
    """Mean state of the meshes, about which their motion is integrated.

    x̄ [mm] and f̄ [N] (row,), K̄ [N/mm] and the compliance of the modes that follow quasi-statically [mm/N] (row, row),
    and the mean deflection [mm].
    """

    motion: NDArray
    force: NDArray
    stiffness: NDArray
    residual_compliance: NDArray
    deflection: float


class Workspace(NamedTuple):
    """Scratch arrays of the balance of a step.

    Vectors (row,): the motion d seen by the teeth, f, x, the residual, the ``excess`` f − f̄ − K̄ (x − x̄), g. Matrices
    (row, row): ∂f/∂d, the derivative of the residual, C.
    """

    d: NDArray
    f: NDArray
    x: NDArray
    residual: NDArray
    excess: NDArray
    offset: NDArray
    slope: NDArray
    derivative: NDArray
    between: NDArray


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
def _flank(curve, m, row, x):
    """Force of a flank of mesh m and its slope at its phase ``row`` and the approach x beyond first contact.

    The force is linear between the points of the table and beyond them.
    """
    table, spacing = curve.table, curve.spacing[m]
    position = x / spacing
    if position <= 0.0:
        return 0.0, 0.0
    interval = min(int(position), table.shape[2] - 2)
    slope = table[m, row, interval + 1] - table[m, row, interval]
    return table[m, row, interval] + (position - interval) * slope, slope / spacing


@part()
def _approached(curve, m, row, x):
    """Force and stiffness of drive and back flanks of mesh m together, at its phase ``row`` and the approach x."""
    begin, back = curve.begin, curve.back_phase[m, row]
    f, k = _flank(curve, m, row, x - begin[m, row])
    below = int(back)
    for side in range(2):
        weight = back - below if side else 1.0 - back + below
        phase = (below + side) % curve.phases[m]
        fb, kb = _flank(curve, m, phase, -x - curve.backlash[m] - begin[m, phase])
        f, k = f - weight * fb, k + weight * kb
    return f, k


@part()
def _add_force(curve, m, cycle_row, x, weight, f, J):
    """Add the resultants of mesh m at a phase of the cycle and motions x to f, their derivatives to J: (D9), (D13).

    Both are multiplied by ``weight``.
    """
    row, mean = cycle_row % curve.phases[m], curve.mean[m]
    coupling, mean_motion, rows = curve.coupling, curve.motion, curve.coupling.shape[2]
    first = m * (1 + rows)
    approach = x[first]
    for j in range(rows):
        approach += coupling[m, row, j] * (x[first + j + 1] - mean_motion[m, row, j])
    force, k = _approached(curve, m, row, approach)
    loaded = min(max(force / mean, 0.0), 1.0)
    f[first] += weight * force
    J[first, first] += weight * k
    for j in range(rows):
        # m_j(F) and its slope
        resultant, slope = curve.force[m, row, j] + coupling[m, row, j] * (force - mean), coupling[m, row, j]
        if loaded < 1.0:
            # below the mean force: a parabola through zero that keeps the slope at the mean force
            bend = coupling[m, row, j] - curve.force[m, row, j] / mean
            slope = slope - 2.0 * bend * (1.0 - loaded) if loaded > 0.0 else 0.0
            resultant = loaded * (curve.force[m, row, j] + bend * (force - mean))
        here = first + j + 1
        f[here] += weight * resultant
        J[first, here] += weight * k * coupling[m, row, j]
        J[here, first] += weight * slope * k
        for i in range(rows):
            stiffness = loaded * curve.stiffness[m, row, j, i]
            f[here] += weight * stiffness * (x[first + i + 1] - mean_motion[m, row, i])
            J[here, first + i + 1] += weight * (stiffness + slope * k * coupling[m, row, i])


@part()
def _couple(curve, row, share, work):
    """Write g and C of the meshes between two phases of the cycle to ``work``, at the rows of their approach."""
    g, C = work.offset, work.between
    next_row, meshes = (row + 1) % len(curve.offset), len(curve.mean)
    size = len(g) // meshes
    for m in range(meshes):
        g[size * m] = (1.0 - share) * curve.offset[row, m] + share * curve.offset[next_row, m]
        for n in range(meshes if len(curve.between) else 0):
            between = (1.0 - share) * curve.between[row, m, n] + share * curve.between[next_row, m, n]
            C[size * m, size * n] = between


@part()
def _residual(curve, mean_state, row, share, free_motion, work):
    """Residual of the balance of ``_motion`` at d, and what it follows from, written to ``work``; return its size."""
    d, f, x, residual, excess, g = work.d, work.f, work.x, work.residual, work.excess, work.offset
    J, C, size, largest = work.slope, work.between, len(free_motion), 0.0
    f[:], J[:] = 0.0, 0.0
    for m in range(len(curve.mean)):
        _add_force(curve, m, row, d, 1.0 - share, f, J)
        if share > 0.0:
            _add_force(curve, m, (row + 1) % len(curve.offset), d, share, f, J)
    for i in range(size):
        x[i] = d[i] - g[i]
        for j in range(size if len(curve.between) else 0):
            x[i] += C[i, j] * f[j]
    for i in range(size):
        excess[i] = f[i] - mean_state.force[i]
        for j in range(size):
            excess[i] -= mean_state.stiffness[i, j] * (x[j] - mean_state.motion[j])
    for i in range(size):
        residual[i] = free_motion[i] - x[i]
        for j in range(size):
            residual[i] -= mean_state.residual_compliance[i, j] * excess[j]
        largest = max(largest, abs(residual[i]))
    return largest


@part()
def _add_product(A, B, weight, out):
    """Add ``weight`` A B of square matrices to ``out``."""
    size = len(A)
    for i in range(size):
        for n in range(size):
            for j in range(size):
                out[i, j] += weight * A[i, n] * B[n, j]


@part()
def _motion(curve, mean_state, row, share, free_motion, work):
    """Solve x = x_free − c (f(d) − f̄ − K̄ (x − x̄)) with d = x + g − C f(d) by Newton's method for d, (D14).

    c is the residual compliance, C the compliance of the gear bodies between the meshes. f is interpolated between the
    phase ``row`` of the cycle and the next one, to which the weight ``share`` belongs. The results are in ``work``,
    whose f of the step before gives the first guess.
    """
    d, f, residual, g = work.d, work.f, work.residual, work.offset
    J, A, C = work.slope, work.derivative, work.between
    size, coupled = len(free_motion), len(curve.between) > 0
    _couple(curve, row, share, work)
    for i in range(size):
        d[i] = free_motion[i] + g[i]
        for j in range(size if coupled else 0):
            d[i] -= C[i, j] * f[j]
    for _ in range(MOST_STEPS):
        if _residual(curve, mean_state, row, share, free_motion, work) <= RESIDUAL * mean_state.deflection:
            break
        # first A = ∂x/∂d = 1 + C J, then A = ∂x/∂d + c (J − K̄ ∂x/∂d)
        for i in range(size):
            for j in range(size):
                A[i, j] = 1.0 if i == j else 0.0
        if coupled:
            _add_product(C, J, 1.0, A)
            _add_product(mean_state.stiffness, A, -1.0, J)
        else:
            J -= mean_state.stiffness
        _add_product(mean_state.residual_compliance, J, 1.0, A)
        _solve(A, residual)
        for i in range(size):
            d[i] += residual[i]


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
    """Largest change of a mode over the last ``repeats`` periods, as the approach [mm] of a mesh that it causes.

    ``ends`` (period, 2, mode) holds p and v at the ends of periods; ``inverse`` (mode,) is 1/ω, ``mesh_motion`` (mesh,
    mode) the approach per modal displacement.
    """
    change = 0.0
    for m in range(len(mesh_motion)):
        for j in range(mesh_motion.shape[1]):
            change = max(change, abs(mesh_motion[m, j] * (ends[-1, 0, j] - ends[-1 - repeats, 0, j])))
            change = max(change, abs(mesh_motion[m, j] * inverse[j] * (ends[-1, 1, j] - ends[-1 - repeats, 1, j])))
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
    phases, kept, substeps = len(curve.offset), record.shape[2], int(limits[1])
    dt, same, near = limits[0], limits[3], limits[4]
    p, v = state
    vectors, matrices = np.zeros((6, rows)), np.zeros((3, rows, rows))
    d, f, x, residual, excess, offset = vectors
    slope, derivative, between = matrices
    work = Workspace(d, f, x, residual, excess, offset, slope, derivative, between)
    kick, free_motion, approaches = np.zeros(modes), np.zeros(rows), mesh_motion[:: rows // len(curve.mean)]
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
                record[0, :, -1, row], record[1, :, -1, row] = x, f
            kick[:] = 0.0
            for i in range(rows):
                for j in range(modes):
                    kick[j] += dt * mesh_motion[i, j] * excess[i]
            _step(p, v, free, damper_factors, kick, scratch)
        ends[:-1] = ends[1:].copy()
        ends[-1] = state
        period_count = 0
        # the shortest period counts: a motion that settles slowly may by chance agree better with a longer one
        for repeats in range(1, min(kept, period) + 1):
            change = _change(ends, approaches, free[4], repeats) / mean_state.deflection
            if change <= near:
                period_count = repeats
                if change <= same:
                    return period_count
                break
    return period_count
