"""Linear dynamic response of a scene over speed, by harmonic balance."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.budget import require_each, speed_memory
from gearbench.dynamics import waves
from gearbench.dynamics.model import Group, LinearModel, Model, Variables, Vibration
from gearbench.dynamics.size import bearings
from gearbench.dynamics.stability import is_proven_stable, multipliers
from gearbench.dynamics.steady import MOST_COMBINATIONS, SETTLED, steady
from gearbench.dynamics.train_model import train_model
from gearbench.errors import InputError
from gearbench.hunting.cycles import tooth_to_tooth_effects
from gearbench.lazy import xr
from gearbench.results.origin import with_grids
from gearbench.results.provenance import provenance
from gearbench.results.responses import described
from gearbench.scene import Scene, check_scene
from gearbench.threads import single_threaded_blas

_LOG = logging.getLogger(__name__)

#: Number of orders of the mesh frequency: default and maximum.
HARMONICS, MOST_HARMONICS = 10, 200
#: Minimum number of time steps in a period for the Floquet multipliers.
STEPS = 256
#: Orders solved beyond those in the result, if the meshes have several frequencies.
EXTRA_ORDERS = 2
#: A Floquet multiplier up to 1 plus this is stable; the excess is rounding.
GROWTH_TOLERANCE = 1e-6
#: A note is written if omitted orders have more than this share of the quasi-static motion.
OMITTED_SHARE = 0.1
#: Reason why a response is NaN.
UNSTABLE = "parametric instability: no steady linear response"
#: The notes mention a mode if its share of the compliance at a mesh exceeds this.
NOTED = 0.02
#: Modes are reported up to this multiple of the highest excited frequency.
ABOVE_EXCITED = 1.2


@single_threaded_blas()
def response(scene: Scene, *, speed: ArrayLike, harmonics: int = HARMONICS) -> xr.Dataset:
    """Dynamic transmission error, mesh and bearing forces of ``scene`` over speed, by harmonic balance.

    Stiffness and transmission error vary over the mesh cycle as in the contact under the mean force. The system of
    shafts, bearings and inertias, or of the members of a planetary set, is linear about its equilibrium. The variable
    ``contact_kept`` is False where flanks separate; the response is not valid there.

    Parameters
    ----------
    scene
        A scene with ``[system]``, or with meshes solved as one contact problem: ``[planetary]`` or parallel paths.
    speed
        Speed or speeds of the pinion [1/min]. For a planetary set: of the sun, or of the carrier if the sun is held.
    harmonics
        Number of orders of the mesh frequency.

    Returns
    -------
    Dataset with the dimensions ``speed``, ``mesh``, ``harmonic``, ``bearing``, ``direction``, ``mode``; names and units
    as in ``gearbench.results``; the attribute ``notes`` holds remarks, one per line.

    Raises
    ------
    InputError
        If the scene has no system, a part of it is unconnected, or speeds or harmonics are invalid.
    """
    check_scene(scene)
    start = time.perf_counter()
    speeds = check_speeds(speed)
    check_harmonics(harmonics)
    model = train_model(scene.single_load) if scene.coupled else Model(scene=scene)
    orders = len(model.harmonics(harmonics)) + (EXTRA_ORDERS + MOST_COMBINATIONS if len(model.groups) > 1 else 0)
    speed_bytes = speed_memory(orders, len(model.names), bearings(scene))
    require_each(speed_bytes, len(speeds), "speed", f"{harmonics} orders")
    variables = speed_variables(model, speeds, harmonics)
    variables |= modal_variables(model, speeds, harmonics)
    lines = notes(model, speeds, harmonics, variables)
    return response_dataset(model, speeds, variables, lines, start, harmonic=model.harmonics(harmonics))


def check_speeds(speed: ArrayLike) -> NDArray:
    """Check speeds and return them as an array (speed,) [1/min].

    Raises
    ------
    InputError
        If one of them is not positive and finite.
    """
    speeds = np.atleast_1d(np.asarray(speed, dtype=float))
    if speeds.ndim != 1 or not len(speeds):
        raise InputError("speed", str(speeds.shape), "must be one number or a list")
    for value in speeds:
        if not (np.isfinite(value) and value > 0):
            raise InputError("speed", float(value), "must be positive [1/min]")
    return speeds


def check_harmonics(harmonics: int) -> None:
    """Raise ``InputError`` unless ``harmonics`` is a whole number from 1 to ``MOST_HARMONICS``."""
    if not (isinstance(harmonics, (int, np.integer)) and 1 <= harmonics <= MOST_HARMONICS):
        raise InputError("harmonics", harmonics, f"must be a whole number, 1 to {MOST_HARMONICS}")


def speed_variables(model: LinearModel, speeds: NDArray, harmonics: int) -> Variables:
    """Variables of the Dataset that depend on speed, by name."""
    # with several frequencies the truncated products make the last orders inaccurate: solve a few more than returned
    solved = harmonics + (EXTRA_ORDERS if len(model.groups) > 1 else 0)
    solution, stability = steady(model, speeds, solved), _stability(model, speeds, harmonics)
    index, equivalent_force = solution.multiples[1:], np.moveaxis(solution.equivalent_force, 1, 2)
    # transmission errors (speed, order, mesh), motions (speed, order, row), bearings (speed, order, bearing, 3)
    te, motion, at_bearings = model.modes.response_to_forces(solution.omega, equivalent_force, model.modes.mesh)
    # mesh force: equivalent force f − K̄ x, plus K̄ x; only that along the approach, the first row of each mesh
    force = (equivalent_force + motion @ model.stiffness.T)[..., :: model.rows_per_mesh]
    # an unstable motion has no steady response
    unstable = (stability > 1 + GROWTH_TOLERANCE).any(axis=1)
    te[unstable], force[unstable], at_bearings[unstable] = np.nan, np.nan, np.nan
    # order zero shifts mean load from one parallel path to another
    mean = model.force + np.real(force[:, 0])
    te, force, at_bearings = (np.moveaxis(values[:, 1:], 1, -1) for values in (te, force, at_bearings))
    points = waves.points(index.max())
    peak, least = (mean + sign * waves.highest(sign * force, index, points) for sign in (1, -1))
    omega = solution.omega[:, 1:]
    vibration = Vibration(
        harmonics=harmonics, index=index, omega=omega, largest=peak, force=force, at_bearings=at_bearings
    )
    mesh_orders, dims = _orders_of_group(model, solved, harmonics), ("speed", "mesh", "harmonic")
    mesh_index = np.arange(len(model.names))[:, None]
    te_at_mesh_orders, force_at_mesh_orders = te[:, mesh_index, mesh_orders], force[:, mesh_index, mesh_orders]
    # 1e3 converts mm to µm
    variables: Variables = {
        **waves.spectrum("dynamic_transmission_error", dims, te_at_mesh_orders, 1e3),
        "dynamic_transmission_error_rms": (dims[:2], 1e3 * waves.rms(waves.with_mean(te))),
        **waves.spectrum("mesh_force", dims, force_at_mesh_orders),
        "mesh_force_rms": (dims[:2], waves.rms(waves.with_mean(force))),
        "mean_force": (("mesh",), model.force),
        "dynamic_factor": (dims[:2], peak / model.force),
        # True at unstable speeds too, where the force is NaN
        "contact_kept": (dims[:2], ~(least <= 0)),
        "floquet_multiplier": (dims[:2], stability),
    }
    if len(model.groups) > 1:
        first_combination = len(model.groups) * solved
        group_names = [model.names[group.meshes[0]] for group in model.groups]
        # (speed, source, mesh, harmonic): forces of all meshes at the frequency of the source, first mesh of its group
        mesh_by_source = np.where(model.is_source[:, None, None], np.moveaxis(force[..., mesh_orders], 2, 1), 0.0)
        variables |= {
            "mesh_force_by_source_amplitude": (("speed", "source", "mesh", "harmonic"), 2 * np.abs(mesh_by_source)),
            "mesh_force_combination_amplitude": (
                ("speed", "mesh", "combination"),
                2 * np.abs(force[..., first_combination:]),
            ),
            "combination": (
                ("combination",),
                [_combination(group_names, multiples) for multiples in index[first_combination:]],
            ),
            "combination_residual": (("speed",), solution.residual),
            "combination_frequency": (
                ("speed", "combination"),
                np.abs(solution.omega[:, 1 + first_combination :]) / (2 * np.pi),
            ),
        }
    loads = model.on_bearings(vibration)
    if model.mechanics.bearing_names:
        dims = ("speed", "mesh", "bearing", "direction", "harmonic")
        # without the torques, which follow the directions in trains; first (speed, bearing, direction, mesh, harmonic),
        # then as ``dims``
        bearing_by_source = np.moveaxis(loads[:, :, : len(model.directions), mesh_orders], 3, 1)
        bearing_by_source[:, ~model.is_source] = 0.0
        variables |= waves.spectrum("bearing_force", dims, bearing_by_source)
        variables["bearing_load"] = (("bearing", "direction"), model.mechanics.bearing_load)
    return variables | model.other_variables(vibration, loads, speeds)


def _stability(model: LinearModel, speeds: NDArray, harmonics: int) -> NDArray:
    """Largest Floquet multipliers (speed, mesh), see ``growth``."""
    stability = np.full((len(speeds), len(model.names)), np.nan)
    for group in model.groups:
        stability[:, group.meshes] = growth(model, group, speeds, harmonics)[:, None]
    return stability


def _combination(names: Sequence[str], index: NDArray) -> str:
    """Name of a combination of orders, such as "2 × pair − 1 × second"."""
    (a, b), (n, m) = (names[int(g)] for g in np.flatnonzero(index)), index[index != 0]
    return f"{n} × {a} {'+' if m > 0 else '−'} {abs(m)} × {b}"


def growth(model: LinearModel, group: Group, speeds: NDArray, harmonics: int) -> NDArray:
    """Largest Floquet multiplier of a group (speed,); NaN if the group is proven to be stable at any speed."""
    rows, excitation = model.rows_of(group.meshes), model.excitation(group, harmonics)
    points = max(STEPS, waves.points(excitation.orders[-1]))
    stiffness = np.moveaxis(waves.curve(excitation.stiffness, points), -1, 0)  # (time, row, row)
    if is_proven_stable(model.modes, rows, stiffness):
        return np.full(len(speeds), np.nan)
    return multipliers(model.modes, rows, model.omega(group, speeds), stiffness[None])


def _orders_of_group(model: LinearModel, solved: int, harmonics: int) -> NDArray:
    """Positions (mesh, harmonic) of the orders of each mesh's group among all orders solved, order zero left out."""
    first, count = np.empty(len(model.names), dtype=int), 0
    for group in model.groups:
        first[group.meshes] = count
        count += len(group.orders(solved)) - 1
    return first[:, None] + np.arange(len(model.harmonics(harmonics)))


def modal_variables(model: LinearModel, speeds: NDArray, harmonics: int) -> Variables:
    """Elastic modes up to a little above the highest excited frequency, and speeds at which orders meet them."""
    modes = model.modes
    n, rate = model.harmonics(harmonics), model.rates
    highest = 2 * np.pi / 60 * float(speeds.max() * rate.max() * n[-1])
    excited = np.flatnonzero((modes.frequency > 0) & (modes.frequency <= ABOVE_EXCITED * highest))
    f = modes.frequency[excited] / (2 * np.pi)
    return {
        "natural_frequency": (("mode",), f),
        "mode_participation": (("mesh", "mode"), modes.participation[:, excited]),
        "critical_speed": (("mesh", "mode", "harmonic"), 60 * f[:, None] / (rate[:, None, None] * n)),
        **model.mode_variables(excited),
    }


def only_excited_by(model: LinearModel, meshes: NDArray) -> list[str]:
    """Note that only ``meshes`` excite and the others have their mean stiffness; none if there are no others."""
    names = np.array(model.names)
    others = np.delete(names, meshes)
    own = ", ".join(names[meshes])
    return [f"excited by mesh {own} alone: {', '.join(others)} with mean stiffness"] if others.size else []


def notes(model: LinearModel, speeds: NDArray, harmonics: int, variables: Variables) -> list[str]:
    """Notes for the reader of the result, one line each."""
    lines = model.remarks(speeds, harmonics)
    if tooth_to_tooth_effects(model.scene):
        lines.append(
            "teeth differ from one another: the response uses one mesh cycle for all; for sidebands use response "
            "--revolution"
        )
    if len(model.groups) > 1:
        lines.append("meshes of different frequencies: force peaks are maxima over all relative phases")
        if (unsolved := variables["combination_residual"][1] > SETTLED).any():
            lines.append(
                f"meshes of different frequencies: harmonic balance not converged at {spans(speeds, unsolved)} 1/min"
            )
    kept, multiplier = variables["contact_kept"][1], variables["floquet_multiplier"][1]
    separated = "flanks separate: the linear response does not hold, use response --nonlinear"
    meshes_of: dict[str, list[str]] = {}
    quasi_static = model.quasi_static_approach(2 * harmonics)[:, 1:]
    for mesh, (name, approach) in enumerate(zip(model.names, quasi_static, strict=True)):
        for where, text in ((multiplier[:, mesh] > 1 + GROWTH_TOLERANCE, UNSTABLE), (~kept[:, mesh], separated)):
            if where.any():
                meshes_of.setdefault(f"{text} at {spans(speeds, where)} 1/min", []).append(name)
        share = float(np.linalg.norm(approach[harmonics:]) / max(np.linalg.norm(approach), 1e-300))
        if share > OMITTED_SHARE:
            text = (
                f"{100 * share:.0f} % of the quasi-static motion is in orders above {harmonics}, which are not "
                "computed: peaks are too low; raise harmonics"
            )
            meshes_of.setdefault(text, []).append(name)
    lines += [f"mesh {', '.join(names)}: {text}" for text, names in meshes_of.items()]
    modes = model.modes
    for group in model.groups:
        slowest = float(model.omega(group, speeds).min())
        share = modes.participation[group.meshes].max(axis=0)
        highest = group.orders(harmonics)[-1]
        omitted = np.flatnonzero((share > NOTED) & (modes.frequency > highest * slowest))
        if len(omitted):
            f = modes.frequency[omitted[0]] / (2 * np.pi)
            speed = 60 * f / group.rate / highest
            name = model.names[group.meshes[0]]
            lines.append(
                f"mesh {name}: below {speed:.4g} 1/min only orders above {model.harmonics(harmonics)[-1]:.4g}, which "
                f"are not computed, excite the mode at {f:.4g} Hz: raise harmonics"
            )
    return lines


def spans(speeds: NDArray, holds: NDArray) -> str:
    """Ranges of speed in which a condition holds, such as "900, 1200 to 1350"."""
    order = np.argsort(speeds)
    s, t = speeds[order], np.concatenate([[False], holds[order], [False]])
    edges = np.flatnonzero(np.diff(t.astype(int)))
    ranges = zip(edges[::2], edges[1::2] - 1, strict=True)
    return ", ".join(f"{s[a]:.5g}" if a == b else f"{s[a]:.5g} to {s[b]:.5g}" for a, b in ranges)


def response_dataset(
    model: LinearModel,
    speeds: NDArray,
    variables: Variables,
    lines: Sequence[str],
    start: float,
    scene: Scene | None = None,
    seed: int | None = None,
    **labels: Sequence | NDArray,
) -> xr.Dataset:
    """Dataset of a response with ``variables``, their coordinates, and ``lines`` as its notes.

    ``start`` is the time at which the run began, ``scene`` by default that of the model, ``seed`` that of samples.
    ``labels`` holds the labels of further dimensions by name, and those of ``mesh`` if the response omits meshes.
    """
    meshes = labels.pop("mesh", model.names)
    known: Variables = {
        "mesh": (("mesh",), list(meshes)),
        "speed": (("speed",), speeds),
        "mesh_frequency": (("speed", "mesh"), speeds[:, None] / 60 * model.rates[: len(meshes)]),
        "source": (("source",), list(model.names)),
        "bearing": (("bearing",), list(model.mechanics.bearing_names)),
        "direction": (("direction",), list(model.directions)),
        **{name: ((name,), values) for name, values in labels.items()},
    }
    used = {dim for dims, _ in variables.values() for dim in dims}
    coords = {name: (dims, values) for name, (dims, values) in known.items() if used.issuperset(dims)}
    coords |= {name: (dim, values) for name, (dim, values) in model.coords.items() if dim in used}
    scene = scene or model.scene
    attrs = provenance(scene, wall_time=time.perf_counter() - start, seed=seed) | {"notes": "\n".join(lines)}
    for line in lines:
        _LOG.info("%s", line)
    # where multipliers are NaN, the reason is another one
    floquet = {name: variables.pop(name) for name in ("floquet_multiplier",) if name in variables}
    data = described(variables, UNSTABLE) | described(floquet, "stability is proven without it, at any speed")
    result = xr.Dataset(data, coords=described(coords), attrs=attrs)
    if scene.coupled:
        result["speed"].attrs["long_name"] = f"speed of {scene.geometry.reference}"
    return with_grids(result, scene)
