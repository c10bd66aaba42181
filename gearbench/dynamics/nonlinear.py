"""Response with loss of contact and impact on back flanks, integrated over time for rising and for falling speed."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from gearbench.budget import nonlinear_memory, require_each
from gearbench.dynamics import waves
from gearbench.dynamics.analysis import (
    HARMONICS,
    check_harmonics,
    check_speeds,
    modal_variables,
    only_excited_by,
    response_dataset,
    spans,
)
from gearbench.dynamics.force_curve import ForceCurve, force_curve, train_force_curves
from gearbench.dynamics.model import Group, LinearModel, Model, Variables, Vibration
from gearbench.dynamics.size import bearings
from gearbench.dynamics.stability import free_motion
from gearbench.dynamics.train_model import TrainModel, train_model
from gearbench.errors import InputError
from gearbench.lazy import xr
from gearbench.results.cycle import Phases
from gearbench.scene import Scene
from gearbench.threads import single_threaded_blas
from gearbench.trains.solve import check_train

if TYPE_CHECKING:
    from gearbench.dynamics._kernels import ForceTable, MeanState

#: Labels of the sweeps, and their names in texts.
SWEEPS = {"up": "rising speed", "down": "falling speed"}
#: A note is written if the RMS forces of the two sweeps differ by more than this share of the mean force.
APART = 0.01
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
    """Meshes with their force curves, acting on the modes of a system, (D10) of docs/theory.md.

    Parameters
    ----------
    model
        The dynamic model; meshes that are not in the group are springs with their mean stiffness.
    group
        The meshes that may lose contact.
    curves
        F(d, τ) of each mesh of the group.
    mean
        x̄ [mm] and f̄ [N] of the rows of the group, (row,) each.
    kept
        Indices of the modes that are integrated over time.
    offset
        g (phase, mesh) [mm] over the cycle of the group, by which the approach d that the teeth see exceeds x.
    between
        C (phase, mesh, mesh) [mm/N]: d = x + g − C f; no phases without bodies that several meshes load.
    """

    model: LinearModel
    group: Group
    curves: Sequence[ForceCurve]
    mean: tuple[NDArray, NDArray]
    kept: NDArray
    offset: NDArray
    between: NDArray

    @property
    def steps(self) -> int:
        """Number of phases of the cycle."""
        return len(self.offset)

    @cached_property
    def rows(self) -> NDArray:
        """Indices of the rows of the meshes."""
        return self.model.rows_of(self.group.meshes)

    @cached_property
    def stiffness(self) -> NDArray:
        """K̄ (row, row) [N/mm]."""
        return self.model.stiffness_of(self.group.meshes)

    @cached_property
    def force(self) -> NDArray:
        """Mean force of each mesh (mesh,) [N]."""
        return self.model.force[self.group.meshes]

    @property
    def deflection(self) -> float:
        """Mean deflection of the meshes [mm]."""
        return float(self.force.mean() / self.stiffness.diagonal()[:: self.model.rows_per_mesh].mean())

    @cached_property
    def compiled(self) -> tuple[ForceTable, MeanState]:
        """Arguments of the compiled time integration."""
        from gearbench.dynamics._kernels import ForceTable, MeanState

        model, phases = self.model, np.array([curve.steps for curve in self.curves])
        others = np.setdiff1d(np.flatnonzero(model.modes.frequency > 0), self.kept)
        mesh_motion = model.modes.mesh[np.ix_(self.rows, others)] / model.modes.frequency[others]

        def stacked(parts: Sequence[Any], *names: str) -> dict[str, NDArray]:
            """Arrays (mesh, phase, …) by name; shorter periods are repeated up to the length of the longest."""
            most, fields = phases.max(), {name: [getattr(part, name) for part in parts] for name in names}
            return {
                name: np.stack([a if len(a) == most else np.resize(a, (most, *a.shape[1:])) for a in arrays])
                for name, arrays in fields.items()
            }

        return ForceTable(
            **stacked(self.curves, "begin", "table", "back_phase"),
            **stacked([c.tilt_and_bending for c in self.curves], "coupling", "motion", "force", "stiffness"),
            spacing=np.array([curve.spacing for curve in self.curves]),
            backlash=np.array([curve.backlash for curve in self.curves]),
            phases=phases, mean=self.force, offset=self.offset, between=self.between,
        ), MeanState(*self.mean, self.stiffness, mesh_motion @ mesh_motion.T, self.deflection)  # fmt: skip

    def over(self, speeds: NDArray) -> tuple[NDArray, NDArray]:
        """Integrate to the steady motion at one speed after the other, each time from the motion at the speed before.

        Returns
        -------
        Number of periods after which the motion repeats (speed,), 0 if it does not; and x [mm] and f [N] over the last
        ``REPEATS`` periods (speed, 2, row, period, phase).
        """
        from gearbench.dynamics._kernels import run

        modes, steps = self.model.modes, self.steps
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
            # by which the dampers reduce the modal speeds in a time step
            damper_factors = np.ascontiguousarray(expm(-dt * damping)) if len(constants) else np.zeros((0, 0))
            limits = np.array([dt, substeps, most, SAME, NEAR])
            periods[k] = run(state, free, damper_factors, mesh_motion, *self.compiled, record[k], limits)
        return periods, record


def integrated_modes(model: LinearModel, group: Group, highest: float) -> NDArray:
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
    share, most = modes.participation[group.meshes].max(axis=0)[slow], MODES * len(group.meshes)
    integrated = np.sort(slow[np.argsort(-share, kind="stable")[:most]])
    if (modes.damping_ratio[integrated] == 0).any():
        raise InputError("system.damping_ratio", 0.0, "must be above 0: free vibration would not decay")
    return integrated


def nonlinear_pair(model: Model, steps: int, highest: float) -> NonlinearModel:
    """The scene's own pair, at ``steps`` phases; ``highest`` [rad/s] is as in ``integrated_modes``."""
    mesh, first = model.loaded_meshes[0], model.groups[0]
    group = Group(meshes=first.meshes[:1], rate=first.rate, phase=first.phase[:1])
    return NonlinearModel(
        model=model,
        group=group,
        curves=[force_curve(mesh, steps)],
        mean=(mesh.solved.weight @ mesh.flanks.motion, mesh.solved.weight @ mesh.flanks.force),
        kept=integrated_modes(model, group, highest),
        offset=np.zeros((steps, 1)),
        between=np.zeros((0, 1, 1)),
    )


def nonlinear_train(model: TrainModel, highest: float) -> NonlinearModel:
    """All meshes of a train, at the uniform phases of ``model``; ``highest`` is as in ``integrated_modes``."""
    solved, (group,), count = model.solved, model.groups, len(model.names)
    phases, statics = len(solved.phases.phase), solved.statics(np.zeros(count))  # no additional offset
    deflection = float(solved.even.mean() / model.stiffness.diagonal().mean())
    between = np.zeros((0, count, count)) if statics.between is None else statics.between
    return NonlinearModel(
        model=model,
        group=group,
        curves=train_force_curves(solved, deflection),
        mean=(solved.phases.weight @ model.approach(solved.balance.motion), model.force),
        kept=integrated_modes(model, group, highest),
        offset=np.array(np.broadcast_to(statics.offset, (phases, count))),
        between=np.array(np.broadcast_to(between, (phases if len(between) else 0, count, count))),
    )


def train_at_uniform_phases(scene: Scene, steps: int) -> TrainModel:
    """Model of a ``coupled`` scene, at least at ``steps`` phases in a period of each mesh, uniform in each period."""
    periods = tuple(check_train(scene).train.periods.values())
    common = math.lcm(*periods)
    count = common * math.ceil(steps * max(periods) / common)
    phase, weight = periods[0] * np.arange(count) / count, np.full(count, 1 / count)
    return train_model(scene, Phases(phase=phase, weight=weight, size=None, length=periods[0]))


@single_threaded_blas()
def nonlinear_response(scene: Scene, *, speed: ArrayLike, harmonics: int = HARMONICS) -> xr.Dataset:
    """Steady response with loss of contact, as the speed rises and as it falls.

    The motion is integrated over time until it repeats after one to eight mesh periods. It starts from rest at the
    first speed, and from the motion at the previous speed afterwards. Of several pairs on shafts only the scene's own
    may lose contact; the others are springs of their mean stiffness. Tilt and bending of gears on shafts are linearised
    about the contact under the mean force; their forces and moments vanish when contact is lost. All meshes of a
    planetary set or of parallel paths may lose contact; their back flanks do not touch.

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
    ``periods`` is the number of periods of the first mesh after which the motion repeats, or 0 if it does not; the
    orders are then those of the last eight periods. If mesh frequencies differ, a period is the cycle after which all
    phases repeat.

    Raises
    ------
    InputError
        As ``response``, or if a mode is undamped.
    ConvergenceError
        As ``response``.
    """
    start = time.perf_counter()
    speeds = check_speeds(speed)
    check_harmonics(harmonics)
    steps = max(STEPS, PER_ORDER * harmonics)
    model = train_at_uniform_phases(scene.single_load, steps) if scene.coupled else Model(scene=scene)
    orders, rows = model.groups[0].orders(harmonics), model.rows_per_mesh
    if isinstance(model, TrainModel):
        rows, steps = len(model.names), len(model.solved.phases.phase)
    speed_bytes = nonlinear_memory(steps, len(orders) - 1, bearings(scene), rows)
    require_each(speed_bytes, len(speeds), "speed", f"{steps} steps of the period")
    highest = FASTEST * float(orders[-1] * model.omega(model.groups[0], speeds).max())
    sweep = nonlinear_train(model, highest) if isinstance(model, TrainModel) else nonlinear_pair(model, steps, highest)
    order = np.argsort(speeds, kind="stable")
    runs = []
    for direction in (order, order[::-1]):
        periods, record = sweep.over(speeds[direction])
        original = np.argsort(direction)
        runs.append((periods[original], record[original]))
    periods, record = (np.stack(part) for part in zip(*runs, strict=True))
    return _dataset(sweep, speeds, harmonics, periods, record, start)


def _orders(values: NDArray, orders: NDArray) -> NDArray:
    """Complex ``orders`` (multiples of the lowest frequency) of ``values`` (…, period, phase)."""
    flat = values.reshape(len(values), -1)
    return np.fft.rfft(flat)[:, orders] / flat.shape[1]


def variables_at(sweep: NonlinearModel, speed: float, harmonics: int, periods: int, record: NDArray) -> Variables:
    """Variables of the Dataset at one speed, from the ``record`` of x and f (2, row, period, phase).

    ``periods`` is as in ``NonlinearModel.over``. Amplitudes of the orders of the meshes are kept; RMS values hold those
    between them too, which motions have that repeat after several periods.
    """
    model, group, count = sweep.model, sweep.group, periods or REPEATS
    # only the last periods count, as many as the motion takes to repeat
    record = record[:, :, -count:]
    mesh_orders = model.groups[0].orders(harmonics)[1:]
    multiples, kept = np.arange(1, count * mesh_orders[-1] + 1), count * mesh_orders - 1
    x, f = (_orders(values, multiples) for values in record)
    omega = float(model.omega(group, np.array(speed))) * multiples / count
    te, _, at_bearings = model.modes.response_to_forces(
        omega, (f - sweep.stiffness @ x).T, model.modes.mesh[sweep.rows]
    )
    te, f = te[:, group.meshes].T, f[:: model.rows_per_mesh]
    over_time = record[1, :: model.rows_per_mesh].reshape(len(f), -1)
    vibration = Vibration(
        harmonics=harmonics,
        index=multiples[:, None] / count,
        omega=omega[None],
        largest=over_time.max(axis=1)[None],
        force=f[None],
        at_bearings=np.moveaxis(at_bearings, 0, -1)[None],
    )
    loads, dims = model.on_bearings(vibration), ("mesh", "harmonic")
    variables: Variables = {
        **waves.spectrum("dynamic_transmission_error", dims, te[:, kept], 1e3),
        "dynamic_transmission_error_rms": (dims[:1], 1e3 * waves.rms(waves.with_mean(te))),
        **waves.spectrum("mesh_force", dims, f[:, kept]),
        "mesh_force_rms": (dims[:1], over_time.std(axis=1)),
        "dynamic_factor": (dims[:1], over_time.max(axis=1) / sweep.force),
        "contact_kept": (dims[:1], over_time.min(axis=1) > 0),
        "periods": ((), periods * group.periods[0]),
    }
    if model.mechanics.bearing_names:
        # all meshes of a train have one frequency or cycle; its orders are listed at the first mesh
        forces = np.zeros((len(f), *loads[0, :, : len(model.directions), kept].shape), dtype=complex)
        forces[0] = loads[0, :, : len(model.directions), kept]
        forces = np.moveaxis(forces, 1, -1)
        variables |= waves.spectrum("bearing_force", ("mesh", "bearing", "direction", "harmonic"), forces)
    if isinstance(model, TrainModel):
        others = model.other_variables(vibration, loads, np.array([speed]))
        for name, ((_, *own_dims), (values,)) in others.items():
            along = own_dims.index("harmonic") if "harmonic" in own_dims else None
            variables[name] = tuple(own_dims), values if along is None else values.take(kept, along)
    return variables


def _dataset(
    sweep: NonlinearModel, speeds: NDArray, harmonics: int, periods: NDArray, record: NDArray, start: float
) -> xr.Dataset:
    """Dataset of both sweeps; ``periods`` and ``record`` are as in ``NonlinearModel.over``, sweeps first."""
    model, names = sweep.model, [sweep.model.names[mesh] for mesh in sweep.group.meshes]
    at_speeds = [
        variables_at(sweep, float(speeds[k]), harmonics, int(periods[s, k]), record[s, k])
        for s, k in np.ndindex(*periods.shape)
    ]
    variables: Variables = {
        name: (
            ("sweep", "speed", *dims),
            np.stack([each[name][1] for each in at_speeds]).reshape(*periods.shape, *np.shape(value)),
        )
        for name, (dims, value) in at_speeds[0].items()
    }
    variables["mean_force"] = ("mesh",), sweep.force
    modal, lines = modal_variables(model, speeds, harmonics), []
    if isinstance(model, TrainModel):
        variables |= {**modal, "bearing_load": (("bearing", "direction"), model.mechanics.bearing_load)}
        lines += [*model.remarks(speeds, harmonics), "back flanks: their contact is left out"]
    else:
        variables["natural_frequency"] = modal["natural_frequency"]
    lines += [*only_excited_by(model, sweep.group.meshes), *_remarks(sweep, speeds, variables)]
    labels = {"mesh": names, "sweep": list(SWEEPS), "harmonic": model.harmonics(harmonics)}
    return response_dataset(model, speeds, variables, lines, start, **labels)


def _remarks(sweep: NonlinearModel, speeds: NDArray, variables: Variables) -> list[str]:
    """Notes for the reader of the sweeps, one line each."""
    lines, names = [], [sweep.model.names[mesh] for mesh in sweep.group.meshes]
    periods, kept, rms = (variables[name][1] for name in ("periods", "contact_kept", "mesh_force_rms"))
    for sweep_name, of_sweep, is_kept in zip(SWEEPS.values(), periods, kept, strict=True):
        for count in sorted({int(p) for p in of_sweep} - {sweep.group.periods[0]}):
            most = REPEATS * sweep.group.periods[0]
            text = f"repeats after {count} mesh periods" if count else f"does not repeat within {most} mesh periods"
            lines.append(f"{sweep_name}: the motion {text} at {spans(speeds, of_sweep == count)} 1/min")
        for name, parted in zip(names, ~is_kept.T, strict=True):
            lines += (
                [f"{sweep_name}: flanks of {name} separate at {spans(speeds, parted)} 1/min"] if parted.any() else []
            )
    differ = (np.abs(rms[0] - rms[1]) > APART * sweep.force).any(axis=1)
    if differ.any():
        lines.append(f"rising and falling speed give different responses at {spans(speeds, differ)} 1/min")
    if min(curve.backlash for curve in sweep.curves) <= 0:
        lines.append("no backlash: back flanks touch as soon as drive flanks separate")
    return lines
