"""Matrices of a system about its point of rest, and its rows: how meshes load it, how bearings feel it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.geometry.pair import Pair
from gearbench.geometry.role import Role
from gearbench.system.gearbox import Gearbox
from gearbench.system.schema import Disc, Seat, System
from gearbench.system.shaft_model import DENSITY, DYNAMIC_ELEMENTS, INERTIA, METRE, ShaftModel, add_disc
from gearbench.system.static import Settled, external_load

#: Directions in which the force on a bearing is given.
DIRECTIONS = ("x", "y", "axial")


@dataclass(frozen=True, kw_only=True)
class Mechanics:
    """M q̈ + K q = Σ a_m f_m + loads, of the system whose meshes are cut: each f_m presses both its gears apart.

    Parameters
    ----------
    mass, stiffness
        (n, n) [t, N/mm and rad alike].
    damping
        Viscous dampers of the bearings: rows (d, n) and their constants (d,) [N·s/mm].
    mesh
        a_m, (mesh, n): relative motion along the line of action is −a_m · q.
    bearing
        Force on each bearing per motion, (bearing, 3, n) [N/mm].
    bearing_names
        Of the bearings, in order.
    """

    mass: NDArray
    stiffness: NDArray
    damping: tuple[NDArray, NDArray]
    mesh: NDArray
    bearing: NDArray
    bearing_names: tuple[str, ...]


def two_wheels(system: System, pair: Pair) -> Mechanics:
    """Two rigid wheels that only turn: the motions are their rotations times their base radii [mm] (D2)."""
    masses, inertias = [], (system.pinion.inertia, system.wheel.inertia)
    for gear, inertia in zip(pair.gears, inertias, strict=True):
        J = INERTIA * inertia if inertia is not None else steel_disc(gear.pitch_radius, 0.0, gear.face_width)[1]
        masses.append(J / gear.base_radius**2)
    return Mechanics(
        mass=np.diag(masses),
        stiffness=np.zeros((2, 2)),
        damping=(np.zeros((0, 2)), np.zeros(0)),
        mesh=np.array([[-1.0, 1.0]]),
        bearing=np.zeros((0, 3, 2)),
        bearing_names=(),
    )


def steel_disc(radius: float, hole: float, width: float) -> tuple[float, float, float]:
    """Mass [t], inertia about the axis and about a diameter [t·mm²] of a steel disc with a hole [mm]."""
    m = 7.85 * DENSITY * math.pi * (radius**2 - hole**2) * width
    squares = radius**2 + hole**2
    return m, m * squares / 2, m * (squares / 4 + width**2 / 12)


def shafts_at_rest(box: Gearbox, mesh: str = "", own: tuple[NDArray, NDArray] | None = None) -> tuple[Settled, ...]:
    """Each shaft in its bearings under the mean forces of its meshes and its other loads.

    ``own`` are the loads of one ``mesh`` on the nodes of its pinion's and its wheel's shaft, (size,); forces are spread
    evenly over the face otherwise.
    """
    settled = []
    for number, model in enumerate(box.models):
        load = external_load(model)
        for (name, role), (here, _) in box.seats.items():
            if here == number:
                given = own is not None and name == mesh
                load = load + (own[role] if own and given else box.force(name) * box.wrench(name, role, model))
        settled.append(Settled(model=model, load=load))
    return tuple(settled)


def mechanics(box: Gearbox, settled: tuple[Settled, ...]) -> Mechanics:
    """Matrices of all shafts, bearings as stiff as they are where they settled, and the couplings' inertias."""
    models = tuple(replace(model, face_elements=DYNAMIC_ELEMENTS) for model in box.models)
    starts = np.cumsum([0, *(model.size for model in models)])
    couplings = [c for c in (m.shaft.coupling for m in models) if c is not None and c.torsional_stiffness and c.inertia]
    n = int(starts[-1]) + len(couplings)
    M, K = np.zeros((n, n)), np.zeros((n, n))
    extra = int(starts[-1])
    names, rows, dampers, constants = [], [], [], []
    for number, (model, rest, start) in enumerate(zip(models, settled, starts[:-1], strict=True)):
        here = slice(int(start), int(start) + model.size)
        M[here, here], K[here, here] = _mass(box, number, model), model.stiffness
        for k, (bearing, K_b) in enumerate(zip(model.shaft.bearings, rest.bearing_stiffness, strict=True)):
            at = int(start) + 6 * model.node(bearing.position)
            K[at : at + 5, at : at + 5] += K_b
            names.append(bearing.name or f"{model.shaft.name} {k + 1}")
            row = np.zeros((3, n))
            row[:, at : at + 5] = K_b[:3]
            rows.append(row)
            for direction in range(3 if bearing.damping else 0):
                dampers.append(np.eye(1, n, at + direction)[0])
                constants.append(bearing.damping / METRE)
        coupling = model.shaft.coupling
        if coupling is None:
            continue
        spin = int(start) + 6 * model.node(coupling.position) + 5
        if coupling.torsional_stiffness and coupling.inertia:
            k = coupling.torsional_stiffness * METRE
            K[np.ix_([spin, extra], [spin, extra])] += k * np.array([[1, -1], [-1, 1]])
            spin, extra = extra, extra + 1
        M[spin, spin] += coupling.inertia * INERTIA
    mesh = np.zeros((len(box.names), n))
    for k, name in enumerate(box.names):
        for role in Role:
            number = box.seats[(name, role)][0]
            mesh[k, starts[number] : starts[number + 1]] += box.wrench(name, role, models[number])
    for k, name in enumerate(names):
        if names.index(name) != k:
            raise InputError("system.shafts.bearings.name", name, "given twice: each name at most once")
    return Mechanics(
        mass=M,
        stiffness=K,
        damping=(np.array(dampers).reshape(-1, n), np.array(constants)),
        mesh=mesh,
        bearing=np.array(rows).reshape(-1, 3, n),
        bearing_names=tuple(names),
    )


def _mass(box: Gearbox, number: int, model: ShaftModel) -> NDArray:
    """Mass of a shaft with its gears, each gear once even if it meshes twice."""
    M, seen = model.mass.copy(), []
    for (mesh, role), (here, seat) in box.seats.items():
        known = (seat.position, box.pairs[mesh].gears[role].teeth)
        if here == number and known not in seen:
            seen.append(known)
            disc = _gear_disc(box.pairs, mesh, role, seat, model)
            add_disc(M, 6 * model.node(seat.position), disc)
    return M


def _gear_disc(pairs: Mapping[str, Pair], mesh: str, role: Role, seat: Seat, model: ShaftModel) -> Disc:
    body = pairs[mesh].gears[role]
    at = int(np.clip(np.searchsorted(model.nodes, seat.position) - 1, 0, len(model.beams) - 1))
    hole = min(model.beams[at].diameter[1] / 2, body.pitch_radius)
    m, axial, across = steel_disc(body.pitch_radius, hole, body.face_width)
    given = (seat.mass, seat.inertia, seat.transverse_inertia)
    found = (m * 1e3, axial / INERTIA, across / INERTIA)
    mass, inertia, transverse = (f if g is None else g for g, f in zip(given, found, strict=True))
    return Disc(position=seat.position, mass=mass, inertia=inertia, transverse_inertia=transverse)
