"""Matrices of a system about its static equilibrium, and rows for mesh forces and bearing forces."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.geometry.pair import Pair
from gearbench.system.gearbox import Gearbox
from gearbench.system.schema import Disc, Ripple, Seat, System
from gearbench.system.shaft_model import DENSITY, DYNAMIC_ELEMENTS, INERTIA, MASS, METRE, ShaftModel, add_disc
from gearbench.system.static import StaticState, external_load
from gearbench.system.structure import Structure

#: Directions of the force on a bearing.
DIRECTIONS = ("x", "y", "axial")
#: Density of steel [g/cm³].
STEEL = 7.85


@dataclass(frozen=True, kw_only=True)
class ElasticPart:
    """An elastic part of a system: a shaft or a bearing.

    Parameters
    ----------
    name
        Name in results.
    rows
        Motions of the part per unit motion of the system, (m, n).
    stiffness
        Stiffness (m, m) against the motions of the part.
    """

    name: str
    rows: NDArray
    stiffness: NDArray


@dataclass(frozen=True, kw_only=True)
class Mechanics:
    """Equations of motion M q̈ + K q = Σ a_m f_m + loads of a system without its meshes.

    The mesh force f_m pushes the two gears of mesh m apart.

    Parameters
    ----------
    mass, stiffness
        M and K, (n, n), in t, N, mm and rad.
    damping
        Viscous dampers of the bearings: rows (d, n) and constants (d,) [N·s/mm].
    mesh
        a_m, one or more rows per mesh, (row, n). −a_m · q is the relative motion of the gears: in the first row their
        approach along the line of action, in further rows tilt and bending over the face.
    rotation
        Rows (mesh, n) for the part of each approach that is due to the rotation of the gears, with the same sign.
    bearing
        Force on each bearing per unit motion, (bearing, 3, n) [N/mm].
    bearing_names
        Names of the bearings, in order.
    bearing_load
        Mean force on each bearing, (bearing, 3) [N].
    ripples
        Load amplitude of each ripple, (ripple, n) [N, N·mm].
    parts
        Elastic parts: shafts and bearings.
    """

    mass: NDArray
    stiffness: NDArray
    damping: tuple[NDArray, NDArray]
    mesh: NDArray
    rotation: NDArray
    bearing: NDArray
    bearing_names: tuple[str, ...]
    bearing_load: NDArray = field(default_factory=lambda: np.zeros((0, 3)))
    ripples: NDArray | None = None
    parts: tuple[ElasticPart, ...] = ()


def two_wheels(system: System, pair: Pair) -> Mechanics:
    """Two rigid wheels that only rotate; motions are rotations times base radii [mm] (D2)."""
    masses, inertias = [], (system.pinion.inertia, system.wheel.inertia)
    for index, (gear, inertia) in enumerate(zip(pair.gears, inertias, strict=True)):
        J = INERTIA * inertia if inertia is not None else steel_gear(pair, index, 0.0)[1]
        masses.append(J / gear.base_radius**2)
    return Mechanics(
        mass=np.diag(masses),
        stiffness=np.zeros((2, 2)),
        damping=(np.zeros((0, 2)), np.zeros(0)),
        mesh=np.array([[-1.0, 1.0]]),
        rotation=np.array([[-1.0, 1.0]]),
        bearing=np.zeros((0, 3, 2)),
        bearing_names=(),
    )


def steel_disc(radius: float, hole: float, width: float) -> tuple[float, float, float]:
    """Mass [t], axial inertia and inertia about a diameter [t·mm²] of a steel disc; sizes in mm, ``hole`` a radius."""
    m = STEEL * DENSITY * math.pi * (radius**2 - hole**2) * width
    squares = radius**2 + hole**2
    return m, m * squares / 2, m * (squares / 4 + width**2 / 12)


def static_equilibrium(
    box: Gearbox,
    of_flanks: Mapping[str, tuple[NDArray, NDArray]] = MappingProxyType({}),
    near: Mapping[int, StaticState] = MappingProxyType({}),
) -> tuple[StaticState, ...]:
    """Equilibrium of each shaft in its bearings under mean mesh forces and other loads, in the order of the shafts.

    Shafts connected by bodies share one equilibrium. ``of_flanks`` are the nodal loads (size,) of a mesh on the shafts
    of its pinion and wheel, by the name of the mesh; other meshes load the shafts by ``Gearbox.load``. Newton's method
    starts from the equilibria ``near``, by the number of the shaft.
    """
    states: dict[int, StaticState] = {}
    for structure in box.structures:
        load = np.zeros(structure.size)
        for number, model in structure.shafts.items():
            motions = structure.motions(number)
            load[motions] = external_load(model)
            for (name, index), (shaft, _) in box.seats.items():
                if shaft == number:
                    load[motions] += of_flanks[name][index] if name in of_flanks else box.load(name, index)
        start = next((near[number].motion for number in structure.shafts if number in near), None)
        states |= dict.fromkeys(structure.shafts, StaticState(structure=structure, load=load, start=start))
    return tuple(states[number] for number in range(len(box.models)))


@lru_cache(maxsize=16)
def resting_states(box: Gearbox) -> tuple[StaticState, ...]:
    """Equilibrium of each shaft of ``box`` under the mean loads of all meshes, see ``static_equilibrium``."""
    return static_equilibrium(box) if box.loads is None else box.loads.settled


def mechanics(box: Gearbox, static_states: tuple[StaticState, ...], spread: Sequence[NDArray]) -> Mechanics:
    """Equations of motion of all shafts, bodies and couplings, with the bearing stiffness at equilibrium.

    ``spread``: for each mesh, loads at the points of the face per unit of force and moment, (row, point).

    Raises
    ------
    InputError
        If bearings share a name, or a body without mass carries a damped bearing.
    """
    models = {number: replace(model, face_elements=DYNAMIC_ELEMENTS) for number, model in enumerate(box.models)}
    structure = Structure(shafts=models, bodies=box.system.bodies)
    couplings = [c for m in models.values() if (c := m.shaft.coupling) and c.torsional_stiffness and c.inertia]
    # the motions of shafts and bodies, then the rotation of each inertia behind an elastic coupling
    n, coupled = structure.size + len(couplings), structure.size
    M, K = np.zeros((n, n)), np.zeros((n, n))
    M[:coupled, :coupled] = structure.assembled({k: _mass(box, k, model) for k, model in models.items()}, "mass")
    K[:coupled, :coupled] = structure.stiffness
    parts, dampers, constants = _supports(structure, static_states, K)
    ripples = []
    for number, model in models.items():
        coupling = model.shaft.coupling
        ripples += [_ripple_load(ripple, model, structure.motions(number), n) for ripple in model.shaft.ripples]
        if coupling is None:
            continue
        spin = structure.starts[number] + 6 * model.node(coupling.position) + 5
        if coupling.torsional_stiffness and coupling.inertia:
            k = coupling.torsional_stiffness * METRE
            K[np.ix_([spin, coupled], [spin, coupled])] += k * np.array([[1, -1], [-1, 1]])
            spin, coupled = coupled, coupled + 1
        M[spin, spin] += coupling.inertia * INERTIA
        for row, ripple in zip(ripples[len(ripples) - len(model.shaft.ripples) :], model.shaft.ripples, strict=True):
            row[spin] += ripple.torque * METRE if ripple.position is None else 0.0
    mesh, rotation = np.zeros((len(box.names), len(spread[0]), n)), np.zeros((len(box.names), n))
    for k, name in enumerate(box.names):
        for index in (0, 1):
            number = box.seats[(name, index)][0]
            mesh[k, :, structure.motions(number)] += spread[k] @ box.face_rows(name, index, models[number])
            rotation[k, structure.motions(number)] += box.rotation(name, index, models[number])
    whole = Mechanics(
        mass=M,
        stiffness=K,
        damping=(dampers, constants),
        mesh=mesh.reshape(-1, n),
        rotation=rotation,
        bearing=np.array([part.stiffness[:3] @ part.rows for part in parts]).reshape(-1, 3, n),
        bearing_names=tuple(part.name for part in parts),
        bearing_load=np.array(
            [force[:3] for number in models for force, _ in static_states[number].bearings(number)]
        ).reshape(-1, 3),
        ripples=np.array(ripples).reshape(-1, n),
        parts=(
            *(
                ElasticPart(name=model.shaft.name, rows=np.eye(n)[structure.motions(k)], stiffness=model.stiffness)
                for k, model in models.items()
            ),
            *parts,
        ),
    )
    return _without_massless(whole, structure)


def _ripple_load(ripple: Ripple, model: ShaftModel, motions: slice, size: int) -> NDArray:
    """Load amplitude (size,) of a ripple on its shaft; the caller adds a torque on the coupling."""
    load = np.zeros(size)
    position, torque = ripple.position, ripple.torque * METRE
    if position is None:
        assert model.shaft.coupling is not None
        position, torque = model.shaft.coupling.position, 0.0
    load[motions] = model.rows(np.array(position), np.array([*ripple.force, 0.0, 0.0, torque]))
    return load


def _supports(
    structure: Structure, static_states: tuple[StaticState, ...], K: NDArray
) -> tuple[list[ElasticPart], NDArray, NDArray]:
    """Bearings as parts, and rows and constants of their dampers. Adds the bearing stiffness to ``K``."""
    n, names, parts, dampers, constants = len(K), [], [], [], []
    for number, model in structure.shafts.items():
        supports = (support for support in structure.supports if support.shaft == number)
        for k, (support, (_, K_b)) in enumerate(zip(supports, static_states[number].bearings(number), strict=True)):
            support.add(K, K_b)
            names.append(support.bearing.name or f"{model.shaft.name} {k + 1}")
            D = support.rows @ np.eye(n)[support.index]
            parts.append(ElasticPart(name=names[-1], rows=D, stiffness=K_b))
            if support.bearing.damping:
                dampers += list(D[:3])
                constants += [support.bearing.damping / METRE] * 3
    for k, name in enumerate(names):
        if names.index(name) != k:
            raise InputError("system.shafts.bearings.name", name, "given twice: each name at most once")
    return parts, np.array(dampers).reshape(-1, n), np.array(constants)


def _without_massless(whole: Mechanics, structure: Structure) -> Mechanics:
    """Eliminate coordinates of bodies without mass by static condensation."""
    body_coordinates = np.concatenate([np.empty(0, int), *structure.own_coordinates.values()])
    massless = body_coordinates[~whole.mass[body_coordinates].any(axis=1)]
    if not len(massless):
        return whole
    if np.abs(whole.damping[0][:, massless]).max(initial=0.0) > 0:
        allowed = "a damper on a body without mass: give the body its mass, or no damping"
        raise InputError("system.shafts.bearings.damping", "given", allowed)
    kept = np.setdiff1d(np.arange(len(whole.mass)), massless)
    # the block is regular: statics already refused unsupported bodies
    condensation = -np.linalg.solve(
        whole.stiffness[np.ix_(massless, massless)], whole.stiffness[np.ix_(massless, kept)]
    )
    T = np.zeros((len(whole.mass), len(kept)))
    T[kept, range(len(kept))], T[massless] = 1.0, condensation
    return replace(
        whole,
        mass=T.T @ whole.mass @ T,
        stiffness=T.T @ whole.stiffness @ T,
        damping=(whole.damping[0] @ T, whole.damping[1]),
        mesh=whole.mesh @ T,
        rotation=whole.rotation @ T,
        bearing=whole.bearing @ T,
        ripples=None if whole.ripples is None else whole.ripples @ T,
        parts=tuple(replace(part, rows=part.rows @ T) for part in whole.parts),
    )


def _mass(box: Gearbox, number: int, model: ShaftModel) -> NDArray:
    """Mass matrix of a shaft with its gears; a gear in several meshes counts once."""
    M, seen = model.mass.copy(), set()
    for (mesh, index), (shaft, seat) in box.seats.items():
        gear = box.train[mesh].gears[index]
        if shaft == number and gear not in seen:
            seen.add(gear)
            nodes = box.face_nodes(mesh, index, model)
            z = model.nodes[nodes] - model.nodes[nodes].mean()
            share = np.convolve(np.diff(z), [0.5, 0.5]) / np.ptp(z)
            disc = _gear_disc(box.pairs, mesh, index, seat, model)
            # slices of the gear body move and tilt with the shaft sections under them
            across = max(disc.transverse_inertia - disc.mass * (share @ z**2) / METRE**2, 0.0)
            for node, part in zip(nodes, share, strict=True):
                add_disc(
                    M,
                    6 * node,
                    replace(disc, mass=part * disc.mass, inertia=part * disc.inertia, transverse_inertia=part * across),
                )
    return M


def steel_gear(pair: Pair, index: int, hole: float) -> tuple[float, float, float]:
    """Mass and inertias, as of ``steel_disc``, of a gear as a steel disc from the ``hole`` to the pitch circle.

    A ring reaches from the pitch circle to its outer diameter, or to the root circle if none is given.
    """
    gear, outside = pair.gears[index], pair.members[index].outer_diameter
    if gear.teeth < 0:
        return steel_disc(outside / 2 if outside else -gear.root_radius, -gear.pitch_radius, gear.face_width)
    return steel_disc(gear.pitch_radius, min(hole, gear.pitch_radius), gear.face_width)


def _gear_disc(pairs: Mapping[str, Pair], mesh: str, index: int, seat: Seat, model: ShaftModel) -> Disc:
    """Gear body as a disc: mass and inertias of its seat, where missing those of a steel disc on the shaft."""
    element = int(np.clip(np.searchsorted(model.nodes, seat.position) - 1, 0, len(model.beams) - 1))
    m, axial, across = steel_gear(pairs[mesh], index, model.beams[element].diameter[1] / 2)
    given = (seat.mass, seat.inertia, seat.transverse_inertia)
    of_steel = (m / MASS, axial / INERTIA, across / INERTIA)
    mass, inertia, transverse = (s if g is None else g for g, s in zip(given, of_steel, strict=True))
    return Disc(position=seat.position, mass=mass, inertia=inertia, transverse_inertia=transverse)
