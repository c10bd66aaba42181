"""Response over whole revolutions: differing teeth and flank waves excite sidebands of the mesh orders.

(D11) is an equation of docs/theory.md.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.budget import require_each, speed_memory
from gearbench.contact.assemble import assemble
from gearbench.contact.batch import chunks, prepare, solve_one_chunk
from gearbench.dynamics import waves
from gearbench.dynamics.analysis import (
    HARMONICS,
    check_harmonics,
    check_speeds,
    only_excited_by,
    response_dataset,
    spans,
)
from gearbench.dynamics.balance import Excitation, solve
from gearbench.dynamics.loaded_mesh import FlankState, LoadedMesh
from gearbench.dynamics.model import Group, Model
from gearbench.effects.base import GapEffect
from gearbench.errors import InputError
from gearbench.hunting.cycles import (
    check_cycles,
    cycle_gap_amounts,
    cycle_gap_modes,
    order_coefficients,
    require_cycles_memory,
    tooth_to_tooth_effects,
    with_equal_teeth,
)
from gearbench.lazy import xr
from gearbench.results.cycle import MICROMETRES
from gearbench.scene import Scene
from gearbench.threads import single_threaded_blas

#: Bearing forces are left out if a revolution has more mesh cycles than this, because of their many orders.
_LONG = 400


@dataclass(frozen=True, kw_only=True)
class Revolution:
    """Excitation over one period of several mesh cycles.

    Parameters
    ----------
    cycles
        Number P of mesh cycles after which the gaps repeat: 1, the teeth of one gear, or the pairs of teeth that meet.
    excitation
        x̂_s and f̂_s at the orders 0, 1/P, 2/P … H of the mesh frequency (row, H·P + 1), and K̂ at the whole orders
        0 … 2H as the mean of all cycles.
    """

    cycles: int
    excitation: Excitation

    @property
    def harmonics(self) -> int:
        """Number H of orders of the mesh frequency."""
        return (self.excitation.stiffness.shape[-1] - 1) // 2


def revolution(mesh: LoadedMesh, effects: Sequence[GapEffect], harmonics: int) -> Revolution:
    """Excitation by a mesh over a revolution; one prepared contact problem is solved with the gaps of every mesh cycle.

    Parameters
    ----------
    mesh
        The mesh without the effects that differ from cycle to cycle.
    effects
        Effects that differ from cycle to cycle.
    harmonics
        H.

    Raises
    ------
    InputError
        If the gaps repeat only after more than 100 000 mesh cycles.
    """
    scene, lines = mesh.scene, mesh.solved.lines
    teeth = (abs(gear.teeth) for gear in scene.pair.gears)
    amounts = cycle_gap_amounts(effects, lines, check_cycles(scene.pair.gears))
    cycles = next(P for P in (1, *sorted(teeth), len(amounts)) if _repeats(amounts, P))
    require_cycles_memory(scene, effects, len(lines.mesh_phase), cycles, harmonics)
    batch = prepare(assemble(scene, lines, mesh.effects), cycle_gap_modes(effects, lines))
    solutions = (solve_one_chunk(batch, chunk, segments=mesh.rows > 1) for chunk in chunks(amounts[:cycles]))
    samples = [mesh.samples(batch, lines, solution) for solution in solutions]
    # [:cycles]: the last chunk is padded with surplus cycles
    motion, force, stiffness = (
        np.concatenate([getattr(part, name) for part in samples])[:cycles] for name in ("motion", "force", "stiffness")
    )
    mean = FlankState(force=force.mean(axis=0), motion=motion.mean(axis=0), stiffness=stiffness.mean(axis=0))
    by_mean = mean.excitation(mesh.waves(2 * harmonics))
    motion, force = (
        np.stack([_orders(mesh, row, harmonics) for row in np.moveaxis(values, -1, 0)]) for values in (motion, force)
    )
    return Revolution(cycles=cycles, excitation=replace(by_mean, motion=motion, force=force))


def _repeats(amounts: NDArray, cycles: int) -> bool:
    """Whether the gap ``amounts`` (cycle, mode) repeat after ``cycles``, up to rounding of the angles."""
    return len(amounts) % cycles == 0 and np.allclose(
        amounts.reshape(-1, cycles, amounts.shape[-1]), amounts[:cycles], rtol=0, atol=1e-9 * np.abs(amounts).max()
    )


def _orders(mesh: LoadedMesh, curves: NDArray, harmonics: int) -> NDArray:
    """Orders 0, 1/P … H (H·P + 1,) of a curve over P mesh cycles, (cycle, position), one after the other."""
    phases = mesh.cycle.phases
    positive_orders = order_coefficients(phases, curves, harmonics * len(curves))
    return np.concatenate([[curves.mean(axis=0) @ phases.weight], positive_orders])


def revolution_of_error(mesh: LoadedMesh, error: ArrayLike, harmonics: int) -> Revolution:
    """Excitation by a transmission error given at equal steps of one revolution of the pinion, (step,) [µm].

    Raises
    ------
    InputError
        If there are too few steps to resolve the orders.
    """
    values, P = np.asarray(error, dtype=float), mesh.scene.pair.gears[0].teeth
    if values.ndim != 1 or len(values) <= 2 * harmonics * P or not np.isfinite(values).all():
        allowed = f"must be finite numbers in a list, more than {2 * harmonics * P} for {harmonics} orders of the mesh"
        raise InputError("error", f"shape {values.shape}", allowed)
    orders = np.fft.rfft(values / MICROMETRES)[: harmonics * P + 1] / len(values)
    by_mesh = mesh.flanks.excitation(mesh.waves(2 * harmonics))
    motion, force = np.zeros((2, mesh.rows, len(orders)), dtype=complex)
    # approach = transmission error minus deflection of the shafts under the forces of the mesh cycle
    motion[:, ::P], force[:, ::P] = by_mesh.motion, by_mesh.force
    motion[0] = orders
    motion[0] -= mesh.compliance[0] @ force
    return Revolution(cycles=P, excitation=replace(by_mesh, motion=motion, force=force))


def side_bands(revolution: Revolution, h: NDArray, mean: NDArray) -> tuple[NDArray, NDArray]:
    """Motions [mm] and forces [N] of the orders 0, 1/P … H, (row, order), at one speed.

    The stiffness couples only orders that differ by integers, so each fraction s/P is a separate problem (D11).

    Parameters
    ----------
    revolution
        Excitation.
    h
        Receptance ĥ of the system with its mean stiffness at the orders 0, 1/P … H (order, row, row) [mm/N].
    mean
        Mean stiffness K̄ (row, row) [N/mm].
    """
    P, H, excitation, M = revolution.cycles, revolution.harmonics, revolution.excitation, len(mean)
    x, f = excitation.motion.copy(), excitation.force.copy()
    mesh_orders = replace(excitation, motion=x[:, ::P], force=f[:, ::P])
    x[:, ::P], f[:, ::P] = (values[0] for values in solve(mesh_orders, h[None, ::P], mean))
    # orders n + s/P with n = −H … H − 1 for s = 1 … P/2; negative orders are conjugates
    n, s = np.arange(-H, H), np.arange(1, P // 2 + 1)[:, None]
    position, size, identity = n * P + s + H * P, M * 2 * H, np.eye(2 * H)
    K = np.swapaxes(_with_negative_orders(excitation.stiffness)[..., n[:, None] - n + 2 * H], 1, 2).reshape(size, size)
    receptance = np.einsum(
        "ijsn,nm->sinjm", _with_negative_orders(np.moveaxis(h, 0, -1))[..., position], identity
    ).reshape(len(s), size, size)
    x_s, f_s = (
        np.swapaxes(_with_negative_orders(values)[:, position], 0, 1).reshape(len(s), size) for values in (x, f)
    )
    p_s = f_s - x_s @ np.kron(mean, identity)
    right = -x_s[..., None] - receptance @ p_s[..., None]
    y = np.linalg.solve(np.eye(size) + receptance @ (K - np.kron(mean, identity)), right)[..., 0]
    for values, target in ((x_s + y, x), (f_s + y @ K.T, f)):
        values = np.swapaxes(values.reshape(len(s), M, 2 * H), 0, 1)
        target[:, position[:, H:] - H * P], target[:, H * P - position[:, :H]] = (
            values[..., H:],
            np.conj(values[..., :H]),
        )
    return x, f


def _with_negative_orders(values: NDArray) -> NDArray:
    """Orders −n … n (…, 2n + 1) from the orders 0 … n (…, n + 1)."""
    return np.concatenate([np.conj(values[..., :0:-1]), values], axis=-1)


def _over_speed(
    model: Model, group: Group, revolution: Revolution, speeds: NDArray
) -> tuple[dict[str, tuple[tuple[str, ...], NDArray]], NDArray]:
    """Variables of the Dataset, and their orders of the mesh frequency (order,)."""
    motions = revolution.excitation.motion
    mesh, order = group.meshes[0], np.arange(1, motions.shape[-1]) / revolution.cycles
    rows, force = model.rows_of(group.meshes), float(model.force[mesh])
    mean = model.stiffness_of(group.meshes)
    bearings = len(model.mechanics.bearing_names) if revolution.cycles <= _LONG else 0
    require_each(speed_memory(len(order), 1, bearings), len(speeds), "speed", f"{len(order)} orders")
    te, forces = (np.zeros((len(speeds), len(order) + 1), dtype=complex) for _ in range(2))
    at_bearings = np.empty((len(speeds), bearings, 3, len(order)), dtype=complex)
    for k, omega in enumerate(model.omega(group, speeds)):
        x, f = side_bands(revolution, model.modes.mesh_receptance(omega * np.append(0.0, order), rows), mean)
        push = (f - mean @ x)[:, 1:].T
        te_of_meshes, _, bearing = model.modes.response_to_forces(omega * order, push, model.modes.mesh[rows])
        te[k, 1:], forces[k] = te_of_meshes[:, mesh], f[0]
        if bearings:
            at_bearings[k] = np.moveaxis(bearing, 0, -1)
    over_time = waves.curve(forces, revolution.cycles * waves.points(revolution.harmonics))
    dims = ("speed", "mesh")
    variables = {
        "dynamic_transmission_error_amplitude": ((*dims, "order"), 1e3 * waves.amplitude(te)[:, None]),
        "dynamic_transmission_error_rms": (dims, 1e3 * waves.rms(te)[:, None]),
        **waves.spectrum("mesh_force", (*dims, "order"), forces[:, None, 1:]),
        "mesh_force_rms": (dims, waves.rms(forces)[:, None]),
        "mean_force": (("mesh",), np.array([force])),
        "dynamic_factor": (dims, over_time.max(axis=-1)[:, None] / force),
        "contact_kept": (dims, (over_time.min(axis=-1) > 0)[:, None]),
    }
    if bearings:
        amplitude = waves.amplitude(waves.with_mean(at_bearings))
        variables["bearing_force_amplitude"] = (("speed", "mesh", "bearing", "direction", "order"), amplitude[:, None])
    return variables, order


@single_threaded_blas()
def revolution_response(
    scene: Scene, *, speed: ArrayLike, harmonics: int = HARMONICS, error: ArrayLike | None = None
) -> xr.Dataset:
    """Response of the scene's own pair over whole revolutions, with sidebands from differences between teeth.

    The model is the same as in ``response``. The stiffness over a mesh cycle is the mean over all teeth. Other meshes
    are replaced by springs with their mean stiffness.

    Parameters
    ----------
    scene
        A scene with ``[system]``, and with effects that differ from tooth to tooth unless ``error`` is given.
    speed
        Speeds of the pinion [1/min].
    harmonics
        Number of orders of the mesh frequency.
    error
        Transmission error under the mean force at equal steps of one revolution of the pinion [µm]; replaces the
        transmission error of the scene's teeth.

    Returns
    -------
    Dataset with the dimensions ``speed``, ``mesh``, ``order``, ``bearing``, ``direction``. ``order`` is a
    multiple of the mesh frequency, in steps of 1/P for a revolution of P mesh cycles.

    Raises
    ------
    InputError
        As ``response``, or if no effect differs from tooth to tooth and no ``error`` is given.
    """
    start, speeds = time.perf_counter(), check_speeds(speed)
    check_harmonics(harmonics)
    tooth_effects = tooth_to_tooth_effects(scene)
    if error is None and not tooth_effects:
        allowed = (
            "a revolution needs [effects.pitch_errors], [effects.random_pitch], [effects.waviness] or a given error"
        )
        raise InputError("effects", "all teeth alike", allowed)
    model = Model(scene=scene if scene.coupled else with_equal_teeth(scene))
    mesh = model.loaded_meshes[0]
    excited = (
        revolution(mesh, tooth_effects, harmonics) if error is None else revolution_of_error(mesh, error, harmonics)
    )
    first = model.groups[0]
    group = Group(meshes=first.meshes[:1], rate=first.rate, phase=first.phase[:1])
    variables, order = _over_speed(model, group, excited, speeds)
    lines = [*only_excited_by(model, group.meshes), *_remarks(model, excited, speeds, variables)]
    return response_dataset(model, speeds, variables, lines, start, scene, mesh=model.names[:1], order=order)


def _remarks(model: Model, revolution: Revolution, speeds: NDArray, variables: Mapping[str, Any]) -> list[str]:
    """Notes for the reader of the result, one line each."""
    lines = []
    if "bearing_force_amplitude" not in variables and model.mechanics.bearing_names:
        lines.append(
            f"bearing forces are left out: a revolution of {revolution.cycles} mesh cycles has too many orders"
        )
    kept = variables["contact_kept"][1][:, 0]
    if not kept.all():
        lines.append(f"flanks separate: the linear response does not hold at {spans(speeds, ~kept)} 1/min")
    return lines
