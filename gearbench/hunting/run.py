"""Dataset of a hunting cycle, for a pair or a train whose meshes form one contact problem."""

from __future__ import annotations

import time

import numpy as np

from gearbench.contact.assemble import assemble
from gearbench.contact.batch import prepare
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.transitions import mesh_phases
from gearbench.errors import InputError
from gearbench.hunting.cycles import (
    ORDERS,
    check_cycles,
    cycle_gap_amounts,
    cycle_gap_modes,
    known_orders,
    order_coefficients,
    require_cycles_memory,
    solve_cycles,
    tooth_to_tooth_effects,
)
from gearbench.lazy import xr
from gearbench.results.cycle import MeshCycle, Phases
from gearbench.results.origin import with_grids
from gearbench.results.points import Columns
from gearbench.results.provenance import provenance
from gearbench.results.responses import described
from gearbench.scene import Scene, check_scene
from gearbench.threads import single_threaded_blas
from gearbench.trains.cycles import train_cycles


@single_threaded_blas()
def hunting_cycle(scene: Scene, *, orders: float = ORDERS, threads: int = 1) -> xr.Dataset:
    """Static transmission error and its spectrum over all mesh cycles until the same teeth meet again.

    Parameters
    ----------
    scene
        A scene with effects that differ from tooth to tooth: pitch errors or waviness. A planetary set needs none of
        them: its members may be eccentric, and its planets always pass a sensor on the ring.
    orders
        Highest mesh order of the spectrum.
    threads
        Threads of the solver.

    Returns
    -------
    Dataset with ``transmission_error`` and ``mesh_stiffness`` (cycle, position), and their amplitudes over
    ``mesh_order``. The orders are the multiples of the frequency at which the same teeth meet, and are also given as
    orders of either shaft. With x(t) = c_0 + Σ Re(2 c_ν e^{2πiνt}), t in mesh periods, the amplitude is 2|c_ν|. For
    parallel paths and planetary sets the Dataset has ``train_transmission_error`` and ``load_sharing`` of each mesh
    instead. Planetary sets also have ``passing_force``, the force of the passing planets at a sensor on the ring.
    ``member_order`` gives the orders as orders of the rotation of a member relative to the carrier.

    Raises
    ------
    InputError
        If no effect differs from tooth to tooth, the gears are on shafts, there are more than 100 000 mesh cycles, or
        no order up to ``orders`` is known.
    """
    check_scene(scene)
    start = time.perf_counter()
    phases, coords, variables = (_of_train if scene.coupled else _of_pair)(scene, orders, threads)
    coords = {name: (("position",), values) for name, values in phases.coordinates.items()} | coords
    attrs = provenance(scene, wall_time=time.perf_counter() - start)
    return with_grids(xr.Dataset(described(variables), coords=described(coords), attrs=attrs), scene)


def _of_pair(scene: Scene, orders: float, threads: int) -> tuple[Phases, Columns, Columns]:
    """Phases of a mesh cycle, coordinates and variables of the Dataset of a pair."""
    cycle = _all_cycles(scene, orders, threads)
    curves = {"transmission_error": cycle.transmission_error, "mesh_stiffness": cycle.mesh_stiffness}
    variables: Columns = {name: (("cycle", "position"), values) for name, values in curves.items()}
    coords, amplitudes = _spectra(cycle.phases, variables, orders)
    order = coords["mesh_order"][1]
    for name, gear in zip(("pinion_order", "wheel_order"), scene.pair.gears, strict=True):
        coords[name] = ("mesh_order",), order * abs(gear.teeth)
    return cycle.phases, coords, variables | amplitudes


def _of_train(scene: Scene, orders: float, threads: int) -> tuple[Phases, Columns, Columns]:
    """Phases of a mesh cycle, coordinates and variables of the Dataset of a train."""
    train = train_cycles(scene, orders, threads)
    solved, linkage = train.solved, train.solved.linkage
    sharing = np.moveaxis(train.cycle.sharing, -1, 0)
    variables: Columns = {"train_transmission_error": (("cycle", "position"), train.cycle.transmission_error)}
    variables["load_sharing"] = ("mesh", "cycle", "position"), sharing
    if (passing := train.passing) is not None:
        variables["passing_force"] = ("cycle", "position"), passing
    coords, amplitudes = _spectra(solved.phases, variables, orders)
    first = linkage.train.meshes[0].pair.gears[0].teeth
    rates = [abs(linkage.rates.get(name, 0.0)) / first for name in linkage.bodies]
    turning = {name: 1 / rate for name, rate in zip(linkage.bodies, rates, strict=True) if rate}
    coords |= {"mesh": (("mesh",), np.array(list(solved.meshes))), "member": (("member",), np.array(list(turning)))}
    coords["member_order"] = ("member", "mesh_order"), np.outer(list(turning.values()), coords["mesh_order"][1])
    factor: Columns = {"mesh_load_factor": ((), np.array(sharing.max()))}
    return solved.phases, coords, variables | factor | amplitudes


def _spectra(phases: Phases, curves: Columns, orders: float) -> tuple[Columns, Columns]:
    """Coordinates ``cycle`` and ``mesh_order``, and the order amplitudes of the ``curves``."""
    amplitudes: Columns = {}
    count = next(iter(curves.values()))[1].shape[-2]
    order = np.arange(1, known_orders(phases, count, orders) + 1) / (count * phases.length)
    for name, (dims, values) in curves.items():
        stacked = values.reshape(-1, *values.shape[-2:])
        spectra = [2 * np.abs(order_coefficients(phases, curve, len(order))) for curve in stacked]
        amplitude = np.reshape(spectra, (*values.shape[:-2], len(order)))
        amplitudes[f"{name}_order_amplitude"] = (*dims[:-2], "mesh_order"), amplitude
    return {"cycle": (("cycle",), np.arange(count)), "mesh_order": (("mesh_order",), order)}, amplitudes


def _all_cycles(scene: Scene, orders: float, threads: int) -> MeshCycle:
    """Transmission error and mesh stiffness of a pair in all mesh cycles, (cycle, position)."""
    if scene.has_shafts:
        raise InputError("system.shafts", "given", "is not supported by hunting: remove the shafts")
    count = check_cycles(scene.pair.gears)
    phase, weight = mesh_phases(scene)
    tooth_effects = tooth_to_tooth_effects(scene)
    if not tooth_effects:
        raise InputError("effects", "all teeth are alike", "must have pitch_errors, random_pitch or waviness")
    require_cycles_memory(scene, tooth_effects, len(phase), count, orders)
    lines = scene_lines(scene, phase)
    amounts = cycle_gap_amounts(tooth_effects, lines, count)
    others = tuple(effect for effect in scene.flank_effects if effect not in tooth_effects)
    batch = prepare(assemble(scene, lines, others), cycle_gap_modes(tooth_effects, lines))
    phases = Phases(phase=phase, weight=weight, size=scene.resolution.panel_size)
    return solve_cycles(scene, phases, batch, amounts, threads)
