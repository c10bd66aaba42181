"""Response with loss of contact and impact on back flanks, integrated over time for rising and for falling speed."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.budget import nonlinear_memory, require_each
from gearbench.dynamics.analysis import (
    HARMONICS,
    check_harmonics,
    check_speeds,
    modal_variables,
    response_dataset,
    spans,
)
from gearbench.dynamics.force_curve import ForceCurve, force_curve
from gearbench.dynamics.model import Group, Model
from gearbench.dynamics.size import bearings
from gearbench.dynamics.stability import free_motion
from gearbench.dynamics.train_nonlinear import SWEEPS, nonlinear_train_response, note_differing_sweeps
from gearbench.errors import InputError
from gearbench.scene import Scene
from gearbench.threads import single_threaded_blas

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.dynamics._kernels import ForceTable, MeanState

#: Smallest number of phases of the force table, and number of phases per order.
STEPS, PER_ORDER = 128, 8
#: Maximum number of modes integrated over time, and their highest frequency divided by that of the highest excited
#: order. Modes with the largest shares in the mesh compliance are taken; the others follow quasi-statically.
MODES, FASTEST = 12, 1.5
#: Maximum angle by which a mode turns in a time step [rad]; minimum number of time steps from one phase of the force
#: table to the next.
RESOLVED, WITHIN = 0.3, 2
#: Maximum number of mesh periods after which a motion may repeat. It repeats if the motions that many periods apart
#: differ by less than ``SAME`` mean deflections, which ends the integration, or by less than ``NEAR`` at its end.
REPEATS, SAME, NEAR = 8, 1e-7, 3e-4
#: The integration ends at the latest when the mode that decays most slowly has faded to e^−FADED; minimum and maximum
#: of the number of mesh periods until then.
FADED, LEAST, MOST = 40.0, 300, 20_000


@dataclass(frozen=True, kw_only=True)
class NonlinearModel:
    """One mesh with its force curve, acting on the modes of a system, (D10) of docs/theory.md.

    Parameters
    ----------
    model
        The dynamic model; its other meshes are springs with their mean stiffness.
    curve
        F(x, τ).
    kept
        Indices of the modes that are integrated over time.
    """

    model: Model
    curve: ForceCurve
    kept: NDArray

    @property
    def group(self) -> Group:
        """A group of this mesh alone."""
        first = self.model.groups[0]
        return Group(meshes=first.meshes[:1], rate=first.rate, phase=first.phase[:1])

    @cached_property
    def mean(self) -> tuple[NDArray, NDArray]:
        """x̄ [mm] and f̄ [N] of the rows (row,)."""
        mesh = self.model.loaded_meshes[0]
        return mesh.solved.weight @ mesh.flanks.motion, mesh.solved.weight @ mesh.flanks.force

    @cached_property
    def rows(self) -> NDArray:
        """Indices of the rows of the mesh."""
        return self.model.rows_of(self.group.meshes)

    @cached_property
    def stiffness(self) -> NDArray:
        """K̄ (row, row) [N/mm]."""
        return self.model.stiffness_of(self.group.meshes)

    @cached_property
    def compiled(self) -> tuple[ForceTable, MeanState]:
        """Arguments of the compiled time integration."""
        from gearbench.dynamics._kernels import ForceTable, MeanState

        model, curve, resultants = self.model, self.curve, self.curve.tilt_and_bending
        others = np.setdiff1d(np.flatnonzero(model.modes.frequency > 0), self.kept)
        mesh_motion = model.modes.mesh[np.ix_(self.rows, others)] / model.modes.frequency[others]
        force, deflection = float(model.force[0]), float(model.force[0]) / self.stiffness[0, 0]
        return ForceTable(
            curve.begin, curve.table, curve.spacing, curve.backlash, curve.back_phase, force,
            resultants.coupling, resultants.motion, resultants.force, resultants.stiffness,
        ), MeanState(*self.mean, self.stiffness, mesh_motion @ mesh_motion.T, deflection)  # fmt: skip

    def over(self, speeds: NDArray) -> tuple[NDArray, NDArray]:
        """Integrate to the steady motion at one speed after the other, each time from the motion at the speed before.

        Returns
        -------
        Number of periods after which the motion repeats (speed,), 0 if it does not; and x [mm] and f [N] over the last
        ``REPEATS`` periods (speed, 2, row, period, phase).
        """
        from gearbench.dynamics._kernels import run

        modes, steps = self.model.modes, self.curve.steps
        r, zeta = modes.frequency[self.kept], modes.damping_ratio[self.kept]
        state, mesh_motion = np.zeros((2, len(r))), np.ascontiguousarray(modes.mesh[np.ix_(self.rows, self.kept)])
        periods, record = np.zeros(len(speeds), dtype=int), np.zeros((len(speeds), 2, len(mesh_motion), REPEATS, steps))
        rows, constants = modes.dampers
        damping = (rows[:, self.kept].T * constants) @ rows[:, self.kept]
        for k, omega in enumerate(self.model.omega(self.group, speeds)):
            period = 2 * math.pi / omega
            substeps = max(WITHIN, math.ceil(r.max() * period / steps / RESOLVED))
            dt = period / steps / substeps
            free = np.vstack([free_motion(r, zeta, np.array(dt)), 1 / r])
            most = np.clip(FADED / max((zeta * r).min() * period, 1e-12), LEAST, MOST)
            damper_factors = _damper_factors(damping, dt) if len(constants) else np.zeros((0, 0))
            limits = np.array([dt, substeps, most, SAME, NEAR])
            periods[k] = run(state, free, damper_factors, mesh_motion, *self.compiled, record[k], limits)
        return periods, record


def _damper_factors(damping: NDArray, dt: float) -> NDArray:
    """Matrix (mode, mode) by which the dampers reduce the modal speeds in a time step dt [s]."""
    from scipy.linalg import expm

    return np.ascontiguousarray(expm(-dt * damping))


def integrated_modes(model: Model, highest: float) -> NDArray:
    """Indices of the modes to integrate: among those up to ``highest`` [rad/s], those with the largest shares.

    Raises
    ------
    InputError
        If one of them is undamped, because its free motion would never fade.
    """
    modes = model.modes
    slow = np.flatnonzero((modes.frequency > 0) & (modes.frequency <= highest))
    if not len(slow):
        slow = np.flatnonzero(modes.frequency > 0)[:1]
    integrated = np.sort(slow[np.argsort(-modes.participation[0, slow], kind="stable")[:MODES]])
    if (modes.damping_ratio[integrated] == 0).any():
        raise InputError("system.damping_ratio", 0.0, "must be above 0: free vibration would not decay")
    return integrated


@single_threaded_blas()
def nonlinear_response(scene: Scene, *, speed: ArrayLike, harmonics: int = HARMONICS) -> xr.Dataset:
    """Steady response of the scene's own pair with loss of contact, as the speed rises and as it falls.

    The motion is integrated over time until it repeats after one to eight mesh periods. It starts from rest at the
    first speed, and from the motion at the previous speed afterwards. Other meshes are springs of their mean stiffness.
    Tilt and bending of gears on shafts are linearised about the contact under the mean force; their forces and
    moments vanish when contact is lost.

    Meshes of a planetary set or of parallel paths are solved together, by harmonic balance: their motions repeat with
    the mesh cycle, and back flanks do not touch.

    Parameters
    ----------
    scene
        A scene with ``[system]``, or with meshes solved as one contact problem.
    speed
        Speeds of the pinion, for planetary sets as in ``response`` [1/min].
    harmonics
        Number of orders of the mesh frequency.

    Returns
    -------
    Dataset with the dimensions ``sweep`` ("up", "down"), ``speed``, ``mesh``, ``harmonic``, ``bearing``, ``direction``.
    ``periods`` is the number of mesh periods after which the motion repeats, or 0 if it does not; the orders are then
    those of the last eight periods.

    Raises
    ------
    InputError
        As ``response``, or if a mode is undamped.
    """
    start = time.perf_counter()
    speeds = check_speeds(speed)
    check_harmonics(harmonics)
    if scene.coupled:
        return nonlinear_train_response(scene, speeds, harmonics)
    model, steps = Model(scene=scene), max(STEPS, PER_ORDER * harmonics)
    speed_bytes = nonlinear_memory(steps, harmonics, bearings(scene), model.loaded_meshes[0].rows)
    require_each(speed_bytes, len(speeds), "speed", f"{steps} steps of the period")
    highest = FASTEST * harmonics * float(model.omega(model.groups[0], speeds).max())
    sweep = NonlinearModel(
        model=model, curve=force_curve(model.loaded_meshes[0], steps), kept=integrated_modes(model, highest)
    )
    order = np.argsort(speeds, kind="stable")
    runs = []
    for direction in (order, order[::-1]):
        periods, record = sweep.over(speeds[direction])
        original = np.argsort(direction)
        runs.append((periods[original], record[original]))
    periods, record = (np.stack(part) for part in zip(*runs, strict=True))
    return _dataset(sweep, speeds, harmonics, periods, record, start)


def _orders(values: NDArray, periods: int, orders: NDArray) -> NDArray:
    """Complex ``orders`` of the mesh frequency in the last ``periods`` of ``values`` (period, phase)."""
    last = values[-periods:].ravel()
    return np.fft.rfft(last)[np.round(orders * periods).astype(int)] / len(last)


def _dataset(
    sweep: NonlinearModel, speeds: NDArray, harmonics: int, periods: NDArray, record: NDArray, start: float
) -> xr.Dataset:
    """Dataset of both sweeps; ``periods`` and ``record`` are as in ``NonlinearModel.over``, sweeps first."""
    model, group, mesh_orders = sweep.model, sweep.group, np.arange(1, harmonics + 1)
    names, mean = model.mechanics.bearing_names, float(model.force[0])
    shape = (len(SWEEPS), len(speeds), harmonics)
    te, force = np.zeros((2, *shape), dtype=complex)
    at_bearings, rms = np.zeros((*shape, len(names), 3), dtype=complex), np.zeros(shape[:2])
    for s, k in np.ndindex(shape[:2]):
        period_count = int(periods[s, k]) or REPEATS
        # a motion that repeats after several periods also has fractional orders
        order = np.arange(1, period_count * harmonics + 1) / period_count
        x, f = (np.stack([_orders(row, period_count, order) for row in values]) for values in record[s, k])
        omega = float(model.omega(group, speeds[k])) * order
        te_of_meshes, _, bearing = model.modes.response_to_mesh_forces(omega, (f - sweep.stiffness @ x).T, sweep.rows)
        te_orders, positions = te_of_meshes[:, 0], period_count * mesh_orders - 1
        te[s, k], force[s, k], at_bearings[s, k] = te_orders[positions], f[0, positions], bearing[positions]
        rms[s, k] = math.sqrt(2 * float((np.abs(te_orders) ** 2).sum()))
    # only the last periods count, as many as the motion takes to repeat
    counted = np.where(periods > 0, periods, REPEATS)[..., None, None] >= REPEATS - np.arange(REPEATS)[:, None]
    f = np.where(counted, record[:, :, 1, 0], np.nan)
    flat = f.reshape(*shape[:2], -1)
    dims = ("sweep", "speed", "mesh")
    variables: dict[str, tuple[tuple[str, ...], Any]] = {
        "dynamic_transmission_error_amplitude": ((*dims, "harmonic"), 2e3 * np.abs(te)[:, :, None]),
        "dynamic_transmission_error_phase": ((*dims, "harmonic"), np.angle(te)[:, :, None]),
        "dynamic_transmission_error_rms": (dims, 1e3 * rms[:, :, None]),
        "mesh_force_amplitude": ((*dims, "harmonic"), 2 * np.abs(force)[:, :, None]),
        "mesh_force_phase": ((*dims, "harmonic"), np.angle(force)[:, :, None]),
        "mesh_force_rms": (dims, np.nanstd(flat, axis=-1)[:, :, None]),
        "mean_force": (("mesh",), np.array([mean])),
        "dynamic_factor": (dims, np.nanmax(flat, axis=-1)[:, :, None] / mean),
        "contact_kept": (dims, np.nanmin(flat, axis=-1)[:, :, None] > 0),
        "periods": (dims[:2], periods),
    }
    if names:
        forces = np.moveaxis(at_bearings, 2, -1)[:, :, None]
        dims = (*dims, "bearing", "direction", "harmonic")
        variables |= {
            "bearing_force_amplitude": (dims, 2 * np.abs(forces)),
            "bearing_force_phase": (dims, np.angle(forces)),
        }
    variables |= {k: v for k, v in modal_variables(model, speeds, harmonics).items() if k == "natural_frequency"}
    lines = _remarks(sweep, speeds, periods, variables["mesh_force_rms"][1])
    labels = {"mesh": model.names[:1], "sweep": list(SWEEPS), "harmonic": mesh_orders}
    return response_dataset(model, speeds, variables, lines, start, **labels)


def _remarks(sweep: NonlinearModel, speeds: NDArray, periods: NDArray, rms: NDArray) -> list[str]:
    """Notes for the reader of the sweeps, one line each."""
    lines = []
    for sweep_name, of_sweep in zip(SWEEPS.values(), periods, strict=True):
        for count in sorted({int(p) for p in of_sweep} - {1}):
            text = f"repeats after {count} mesh periods" if count else f"does not repeat within {REPEATS} mesh periods"
            lines.append(f"{sweep_name}: the motion {text} at {spans(speeds, of_sweep == count)} 1/min")
    lines += note_differing_sweeps(speeds, rms, sweep.model.force[:1])
    if sweep.curve.backlash <= 0:
        lines.append("no backlash: back flanks touch as soon as drive flanks separate")
    return lines
