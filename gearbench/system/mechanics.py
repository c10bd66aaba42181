"""Matrices of a system about its point of rest, and its rows: how meshes load it, how bearings feel it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.geometry.names import PAIR
from gearbench.geometry.pair import Pair
from gearbench.system.gearbox import Gearbox
from gearbench.system.schema import Disc, Ripple, Seat, System
from gearbench.system.shaft_model import DENSITY, DYNAMIC_ELEMENTS, INERTIA, METRE, ShaftModel, add_disc
from gearbench.system.static import Settled, external_load
from gearbench.system.structure import Structure

#: Directions in which the force on a bearing is given.
DIRECTIONS = ("x", "y", "axial")


@dataclass(frozen=True, kw_only=True)
class Part:
    """A spring of a system, of any number of motions: a shaft or a bearing.

    Parameters
    ----------
    name
        Name in results.
    rows
        Its motions by those of the system (m, n).
    stiffness
        Matrix (m, m) of these.
    """

    name: str
    rows: NDArray
    stiffness: NDArray


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
        a_m, one or two rows for each mesh (row, n): relative motion along the line of action, and relative tilt, are
        −a_m · q.
    spin
        The same of the transmission error, for each mesh (mesh, n).
    bearing
        Force on each bearing per motion, (bearing, 3, n) [N/mm].
    bearing_names
        Of the bearings, in order.
    bearing_load
        Mean force on each (bearing, 3) [N].
    push
        Load of the amplitude of each ripple (ripple, n) [N, N·mm].
    parts
        Shafts and bearings.
    """

    mass: NDArray
    stiffness: NDArray
    damping: tuple[NDArray, NDArray]
    mesh: NDArray
    spin: NDArray
    bearing: NDArray
    bearing_names: tuple[str, ...]
    bearing_load: NDArray = field(default_factory=lambda: np.zeros((0, 3)))
    push: NDArray | None = None
    parts: tuple[Part, ...] = ()


def two_wheels(system: System, pair: Pair) -> Mechanics:
    """Two rigid wheels that only turn: the motions are their rotations times their base radii [mm] (D2)."""
    masses, inertias = [], (system.pinion.inertia, system.wheel.inertia)
    for index, (gear, inertia) in enumerate(zip(pair.gears, inertias, strict=True)):
        J = INERTIA * inertia if inertia is not None else steel_gear(pair, index, 0.0)[1]
        masses.append(J / gear.base_radius**2)
    return Mechanics(
        mass=np.diag(masses),
        stiffness=np.zeros((2, 2)),
        damping=(np.zeros((0, 2)), np.zeros(0)),
        mesh=np.array([[-1.0, 1.0]]),
        spin=np.array([[-1.0, 1.0]]),
        bearing=np.zeros((0, 3, 2)),
        bearing_names=(),
    )


def steel_disc(radius: float, hole: float, width: float) -> tuple[float, float, float]:
    """Mass [t], inertia about the axis and about a diameter [t·mm²] of a steel disc with a hole [mm]."""
    m = 7.85 * DENSITY * math.pi * (radius**2 - hole**2) * width
    squares = radius**2 + hole**2
    return m, m * squares / 2, m * (squares / 4 + width**2 / 12)


def shafts_at_rest(box: Gearbox, own: tuple[NDArray, NDArray] | None = None) -> tuple[Settled, ...]:
    """Each shaft in its bearings under the mean forces of its meshes and its other loads.

    Shafts that bodies connect are settled together, and share their answer. ``own`` are the loads of the scene's own
    pair on the nodes of its pinion's and its wheel's shaft, (size,); forces are spread evenly over the face otherwise.
    """
    settled: dict[int, Settled] = {}
    for structure in box.structures:
        load = np.zeros(structure.size)
        for number, model in structure.shafts.items():
            here = structure.motions(number)
            load[here] = external_load(model)
            for (name, index), (seat, _) in box.seats.items():
                if seat == number:
                    load[here] += (
                        own[index]
                        if own is not None and name == PAIR
                        else box.force(name) * box.wrench(name, index, model)
                    )
        settled |= dict.fromkeys(structure.shafts, Settled(structure=structure, load=load))
    return tuple(settled[number] for number in range(len(box.models)))


def mechanics(box: Gearbox, settled: tuple[Settled, ...], spread: Sequence[NDArray]) -> Mechanics:
    """Matrices of all shafts and bodies, bearings as stiff as they are where they settled, and the couplings' inertias.

    ``spread``: loads at the points of the face (row, point) per force and moment, of each mesh.

    Raises
    ------
    InputError
        If bearings share a name, or a body without mass carries a damped bearing.
    """
    models = {number: replace(model, face_elements=DYNAMIC_ELEMENTS) for number, model in enumerate(box.models)}
    whole = Structure(shafts=models, bodies=box.system.bodies)
    couplings = [c for m in models.values() if (c := m.shaft.coupling) and c.torsional_stiffness and c.inertia]
    n, extra = whole.size + len(couplings), whole.size
    M, K = np.zeros((n, n)), np.zeros((n, n))
    M[:extra, :extra] = whole.assembled({k: _mass(box, k, model) for k, model in models.items()}, "mass")
    K[:extra, :extra] = whole.stiffness
    parts, dampers, constants = _supports(whole, settled, K)
    push = []
    for number, model in models.items():
        coupling = model.shaft.coupling
        push += [_push(ripple, model, whole.motions(number), n) for ripple in model.shaft.ripples]
        if coupling is None:
            continue
        spin = whole.starts[number] + 6 * model.node(coupling.position) + 5
        if coupling.torsional_stiffness and coupling.inertia:
            k = coupling.torsional_stiffness * METRE
            K[np.ix_([spin, extra], [spin, extra])] += k * np.array([[1, -1], [-1, 1]])
            spin, extra = extra, extra + 1
        M[spin, spin] += coupling.inertia * INERTIA
        for row, ripple in zip(push[len(push) - len(model.shaft.ripples) :], model.shaft.ripples, strict=True):
            row[spin] += ripple.torque * METRE if ripple.position is None else 0.0
    mesh, spin = np.zeros((len(box.names), len(spread[0]), n)), np.zeros((len(box.names), n))
    for k, name in enumerate(box.names):
        for index in (0, 1):
            number = box.seats[(name, index)][0]
            mesh[k, :, whole.motions(number)] += spread[k] @ box.face_rows(name, index, models[number])
            spin[k, whole.motions(number)] += box.spin(name, index, models[number])
    found = Mechanics(
        mass=M,
        stiffness=K,
        damping=(dampers, constants),
        mesh=mesh.reshape(-1, n),
        spin=spin,
        bearing=np.array([part.stiffness[:3] @ part.rows for part in parts]).reshape(-1, 3, n),
        bearing_names=tuple(part.name for part in parts),
        bearing_load=np.array(
            [force[:3] for number in models for force in settled[number].bearing_force(number)]
        ).reshape(-1, 3),
        push=np.array(push).reshape(-1, n),
        parts=(
            *(
                Part(name=model.shaft.name, rows=np.eye(n)[whole.motions(k)], stiffness=model.stiffness)
                for k, model in models.items()
            ),
            *parts,
        ),
    )
    return _without_massless(found, whole)


def _push(ripple: Ripple, model: ShaftModel, motions: slice, size: int) -> NDArray:
    """Load (size,) of the amplitude of a ripple on the motions of its shaft; torque on a coupling comes later."""
    load = np.zeros(size)
    at, torque = ripple.position, ripple.torque * METRE
    if at is None:
        assert model.shaft.coupling is not None
        at, torque = model.shaft.coupling.position, 0.0
    load[motions] = model.rows(np.array(at), np.array([*ripple.force, 0.0, 0.0, torque]))
    return load


def _supports(whole: Structure, settled: tuple[Settled, ...], K: NDArray) -> tuple[list[Part], NDArray, NDArray]:
    """The bearings, and rows and constants of dampers; the bearings' stiffness is added to ``K``."""
    n, names, parts, dampers, constants = len(K), [], [], [], []
    for number, model in whole.shafts.items():
        mine = (support for support in whole.supports if support.shaft == number)
        for k, (support, K_b) in enumerate(zip(mine, settled[number].bearing_stiffness(number), strict=True)):
            support.add(K, K_b)
            names.append(support.bearing.name or f"{model.shaft.name} {k + 1}")
            D = support.rows @ np.eye(n)[support.index]
            parts.append(Part(name=names[-1], rows=D, stiffness=K_b))
            if support.bearing.damping:
                dampers += list(D[:3])
                constants += [support.bearing.damping / METRE] * 3
    for k, name in enumerate(names):
        if names.index(name) != k:
            raise InputError("system.shafts.bearings.name", name, "given twice: each name at most once")
    return parts, np.array(dampers).reshape(-1, n), np.array(constants)


def _without_massless(found: Mechanics, whole: Structure) -> Mechanics:
    """The same system without coordinates of bodies that have no mass: they follow the others at once."""
    own = np.concatenate([np.empty(0, int), *whole.own_coordinates.values()])
    light = own[~found.mass[own].any(axis=1)]
    if not len(light):
        return found
    if np.abs(found.damping[0][:, light]).max(initial=0.0) > 0:
        allowed = "a damper on a body without mass: give the body its mass, or no damping"
        raise InputError("system.shafts.bearings.damping", "given", allowed)
    keep = np.setdiff1d(np.arange(len(found.mass)), light)
    # statics is solved with the body as it is: what nothing holds was refused there
    follow = -np.linalg.solve(found.stiffness[np.ix_(light, light)], found.stiffness[np.ix_(light, keep)])
    T = np.zeros((len(found.mass), len(keep)))
    T[keep, range(len(keep))], T[light] = 1.0, follow
    return replace(
        found,
        mass=T.T @ found.mass @ T,
        stiffness=T.T @ found.stiffness @ T,
        damping=(found.damping[0] @ T, found.damping[1]),
        mesh=found.mesh @ T,
        spin=found.spin @ T,
        bearing=found.bearing @ T,
        push=None if found.push is None else found.push @ T,
        parts=tuple(replace(part, rows=part.rows @ T) for part in found.parts),
    )


def _mass(box: Gearbox, number: int, model: ShaftModel) -> NDArray:
    """Mass of a shaft with its gears, each gear once even if it meshes twice."""
    M, seen = model.mass.copy(), set()
    for (mesh, index), (here, seat) in box.seats.items():
        gear = box.train[mesh].gears[index]
        if here == number and gear not in seen:
            seen.add(gear)
            nodes = box.face_nodes(mesh, index, model)
            z = model.nodes[nodes] - model.nodes[nodes].mean()
            share = np.convolve(np.diff(z), [0.5, 0.5]) / np.ptp(z)
            disc = _gear_disc(box.pairs, mesh, index, seat, model)
            # the body moves with the sections of the shaft under it: its slices tilt, and move, as they do
            across = max(disc.transverse_inertia - disc.mass * (share @ z**2) / METRE**2, 0.0)
            for node, part in zip(nodes, share, strict=True):
                add_disc(
                    M,
                    6 * node,
                    replace(disc, mass=part * disc.mass, inertia=part * disc.inertia, transverse_inertia=part * across),
                )
    return M


def steel_gear(pair: Pair, index: int, hole: float) -> tuple[float, float, float]:
    """Steel disc from the ``hole`` to the pitch circle; from there to the outside, or the root circle, of a ring."""
    gear, outside = pair.gears[index], pair.members[index].outer_diameter
    if gear.teeth < 0:
        return steel_disc(outside / 2 if outside else -gear.root_radius, -gear.pitch_radius, gear.face_width)
    return steel_disc(gear.pitch_radius, min(hole, gear.pitch_radius), gear.face_width)


def _gear_disc(pairs: Mapping[str, Pair], mesh: str, index: int, seat: Seat, model: ShaftModel) -> Disc:
    at = int(np.clip(np.searchsorted(model.nodes, seat.position) - 1, 0, len(model.beams) - 1))
    m, axial, across = steel_gear(pairs[mesh], index, model.beams[at].diameter[1] / 2)
    given = (seat.mass, seat.inertia, seat.transverse_inertia)
    found = (m * 1e3, axial / INERTIA, across / INERTIA)
    mass, inertia, transverse = (f if g is None else g for g, f in zip(given, found, strict=True))
    return Disc(position=seat.position, mass=mass, inertia=inertia, transverse_inertia=transverse)
