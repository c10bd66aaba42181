"""Dynamic model of a train whose meshes are one contact problem: a planetary set, or parallel paths.

Bodies are rigid and move as in ``gearbench.geometry.linkage``, in the frame of the carrier. All bodies turn unless they
are held. Supports that are rigid in the contact solution are rigid here too, so the response at low speed equals the
simulation. (D12) is an equation of docs/theory.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics import waves
from gearbench.dynamics.balance import Excitation
from gearbench.dynamics.loaded_mesh import order_rows
from gearbench.dynamics.model import Group, LinearModel, Variables, Vibration
from gearbench.errors import InputError
from gearbench.geometry.linkage import AXES, Linkage
from gearbench.geometry.planetary_members import PlanetaryDynamics
from gearbench.geometry.train_tables import TrainTables
from gearbench.results.cycle import Phases
from gearbench.scene import Scene
from gearbench.system.mechanics import Mechanics, steel_disc, steel_gear
from gearbench.system.shaft_model import INERTIA, METRE
from gearbench.trains.solve import SolvedTrain, solve_train

#: A mode is of kind ``PLANET`` if the central members have less than this share of its kinetic energy.
CENTRAL_SHARE = 1e-3
#: A mode is of kind ``MIXED`` if both rotation and motion across the axis have more than this share of the kinetic
#: energy of the central members. In computed modes these shares are never exactly 0: unequally loaded planets differ.
MIXED_SHARE = 0.02
#: Kinds of modes: central members only turn; central members move across the axis; only planets move; others.
ROTATIONAL, TRANSLATIONAL, PLANET, MIXED = "rotational", "translational", "planet", "mixed"
#: Maximum number of lobes of force waves round the ring, per planet.
LOBES_PER_PLANET = 2
#: A note gives the speed from which gyroscopic effects shift a natural frequency by this share.
GYROSCOPIC = 0.02


@dataclass(frozen=True, kw_only=True)
class RigidBody:
    """A body of a train.

    Parameters
    ----------
    mass, inertia
        Mass [t], and moment of inertia about the axis [t·mm²].
    torsion
        Torsional stiffness of the support, or of a twisted gear to its shaft [N·mm/rad]: 0 for a body that turns
        freely, infinite for a body that is held.
    """

    mass: float
    inertia: float
    torsion: float = 0.0


def rigid_bodies(tables: TrainTables, linkage: Linkage) -> dict[str, RigidBody]:
    """Bodies by name; gears are steel discs and rings unless the file gives masses and inertias.

    A gear of ``linkage.twisted`` is on its shaft through a torsional spring (stepped planets). Its mass is
    part of the shaft, with which it moves across the axis. A given inertia of a planet is that of both gears, and is
    divided between them as between steel discs.
    """
    train, twisted = linkage.train, linkage.twisted
    masses, inertias = dict.fromkeys(linkage.bodies, 0.0), dict.fromkeys(linkage.bodies, 0.0)
    for gear in train.gears:
        mesh = next(mesh for mesh in train.meshes if gear in mesh.gears)
        index = mesh.gears.index(gear)
        mass, inertia, _ = steel_gear(mesh.pair, index, (mesh.pair.members[index].bore_diameter or 0.0) / 2)
        masses[train.shaft(gear)] += mass
        inertias[linkage.body(gear)] += inertia
    if linkage.carrier is not None:
        pair = train.meshes[0].pair
        masses[linkage.carrier], inertias[linkage.carrier], _ = steel_disc(
            pair.centre_distance, 0.0, pair.meshing.face_width / 2
        )
    torsion = {name: twisted.get(name, 0.0) for name in linkage.bodies}
    if (planetary := tables.planetary) is not None:
        torsion[planetary.keys.held] = math.inf
        for name in (name for name in linkage.bodies if name not in twisted):
            given = getattr(planetary.keys.dynamics, "planet" if name in planetary.keys.names else name)
            masses[name] = masses[name] if given.mass is None else 1e-3 * given.mass
            if given.inertia is not None:
                both = [name, *(gear for gear in twisted if train.shaft(gear) == name)]
                share = INERTIA * given.inertia / sum(inertias[each] for each in both)
                inertias |= {each: share * inertias[each] for each in both}
            torsion[name] = torsion[name] if given.torsional_stiffness is None else METRE * given.torsional_stiffness
    return {n: RigidBody(mass=masses[n], inertia=inertias[n], torsion=torsion[n]) for n in linkage.bodies}


def train_mechanics(linkage: Linkage, bodies: Mapping[str, RigidBody]) -> Mechanics:
    """Matrices of the free motions.

    The bodies take the place of bearings, here and in the dimension ``bearing`` of Datasets, so that gearboxes on
    shafts and trains share their code; each has the rows x, y and rotation.
    """
    names, elastic = linkage.bodies, linkage.additional_motions
    turning = [name for name in names if bodies[name].torsion < math.inf]
    motions = np.zeros((len(turning) + len(elastic), len(names), len(AXES)))
    for row, name in zip(motions, turning, strict=False):
        row[names.index(name), 2] = 1.0
        for carried in linkage.carried if name == linkage.carrier else ():
            x, y = linkage.train.places[carried]
            row[names.index(carried), :2] = -y, x
    # the last motions of the linkage are the elastic ones
    motions[len(turning) :] = linkage.moved[len(linkage.motions) - len(elastic) :]
    approach = np.einsum("mba,qba->mq", linkage.of_bodies, motions)
    moved = motions.copy()
    for gear in linkage.twisted:  # they turn relative to their shafts
        moved[:, names.index(gear)] += motions[:, names.index(linkage.train.shaft(gear))]
    stiffness = [*(bodies[name].torsion for name in turning), *(motion.stiffness for motion in elastic)]
    return Mechanics(
        mass=np.einsum("qba,ba,pba->qp", moved, _inertia(bodies, names), moved),
        stiffness=np.diag(stiffness),
        damping=(np.zeros((0, len(motions))), np.zeros(0)),
        mesh=-approach,
        rotation=np.where(np.arange(len(motions)) < len(turning), -approach, 0.0),
        bearing=np.moveaxis(moved, 0, -1),
        bearing_names=names,
    )


def _inertia(bodies: Mapping[str, RigidBody], names: Sequence[str]) -> NDArray:
    """Inertia of the motions x, y and rotation of bodies (body, 3) [t; t·mm²]."""
    return np.array([(bodies[name].mass, bodies[name].mass, bodies[name].inertia) for name in names])


def kinds(shape: NDArray, bodies: Mapping[str, RigidBody], carried: tuple[str, ...]) -> tuple[str, ...]:
    """Kind of each mode by its kinetic energy, from the motions of the bodies (body, 3, mode) at unit modal mass."""
    inertia = _inertia(bodies, list(bodies))
    central = [name not in carried for name in bodies]
    x, y, turning = np.einsum("ba,bar->ar", inertia[central], shape[central] ** 2)
    across = x + y
    names = np.where(turning > across, ROTATIONAL, TRANSLATIONAL)
    names = np.where(np.minimum(across, turning) > MIXED_SHARE * (across + turning), MIXED, names)
    return tuple(np.where(across + turning < CENTRAL_SHARE, PLANET, names).tolist())


@dataclass(frozen=True, kw_only=True, eq=False)
class TrainModel(LinearModel):
    """Model of a ``coupled`` scene (all meshes are one contact problem), at any speed.

    Parameters
    ----------
    solved
        Contact of the train over the mesh cycle.
    """

    solved: SolvedTrain

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the meshes."""
        return tuple(self.solved.meshes)

    @property
    def linkage(self) -> Linkage:
        """Kinematics that couple the meshes."""
        return self.solved.linkage

    @cached_property
    def bodies(self) -> dict[str, RigidBody]:
        """Bodies by name."""
        assert self.scene.train is not None
        return rigid_bodies(self.scene.train, self.linkage)

    @property
    def force(self) -> NDArray:
        """Mean force of each mesh along the line of action (mesh,) [N]."""
        return self.solved.phases.weight @ self.solved.balance.force

    @cached_property
    def mechanics(self) -> Mechanics:
        """Matrices of the bodies; their supports carry the mean forces of the meshes."""
        matrices = train_mechanics(self.linkage, self.bodies)
        return replace(matrices, bearing_load=self.linkage.on_bodies(self.force)[:, :2])

    @property
    def damping_ratio(self) -> float:
        """ζ of every mode."""
        planetary = self.scene.planetary
        return (PlanetaryDynamics() if planetary is None else planetary.keys.dynamics).damping_ratio

    @cached_property
    def stiffness(self) -> NDArray:
        """K̄ of all meshes (mesh, mesh) [N/mm], the mean of (1/k + C)⁻¹ with mesh stiffnesses k and bodies C."""
        tangent = self.solved.coupling.tangent(self.solved.balance.stiffness)
        return np.einsum("p,pmn->mn", self.solved.phases.weight, tangent)

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """One group of all meshes: a period of its order 1 is the cycle after which all phases repeat.

        Its phases are all 0: the joint contact solution already contains the mesh phasing.
        """
        count, train = len(self.names), self.linkage.train
        rate = float(train.mesh_rate(self.names[0])) / self.solved.phases.length
        periods = tuple(train.periods.values())
        return (Group(meshes=np.arange(count), rate=rate, phase=np.zeros(count), periods=periods),)

    def excitation(self, group: Group, harmonics: int) -> Excitation:
        """Excitation by the meshes of the group: approach and force of the balanced contact at each phase."""
        balance = self.solved.balance
        return self.excitation_by(group, harmonics, self.approach(balance.motion), balance.force, balance.stiffness)

    def approach(self, motion: NDArray) -> NDArray:
        """Approach of the meshes (…, mesh) [mm] due to free motions q (…, motion), without gaps from errors."""
        return motion @ self.linkage.rows.T

    def excitation_by(self, group: Group, harmonics: int, x: NDArray, F: NDArray, k: NDArray) -> Excitation:
        """Excitation by contact at the approaches x with forces F and stiffnesses k, all (…, position, mesh)."""
        kept = group.orders(harmonics)
        rows = order_rows(self.solved.phases, 2 * kept[-1])

        def orders(values: NDArray, rows: NDArray, axis: int) -> NDArray:
            return np.moveaxis(np.tensordot(rows, values, (1, axis)), 0, -1)

        return Excitation(
            stiffness=orders(self.solved.coupling.tangent(k), rows, -3),
            motion=orders(x, rows[kept], -2),
            force=orders(F, rows[kept], -2),
            kept=kept,
        )

    def quasi_static_approach(self, orders: int) -> NDArray:
        """Orders 0 … n of the quasi-static approach of each mesh, (mesh, n + 1) [mm]."""
        periods, rows = self.groups[0].periods, order_rows(self.solved.phases, max(self.groups[0].periods) * orders)
        all_orders = (rows @ self.solved.balance.motion @ self.linkage.rows.T).T
        # order n of a mesh is the order n · period of the common cycle
        return np.stack([row[: period * orders + 1 : period] for row, period in zip(all_orders, periods, strict=True)])

    # -- forces around the meshes -------------------------------------------------------------------------------------
    @property
    def directions(self) -> tuple[str, ...]:
        """Directions of the forces on bearings, in the frame of the carrier."""
        return AXES[:2]

    def on_bearings(self, vibration: Vibration) -> NDArray:
        """Forces of each body on its support, and of planets on their pins, (speed, body, 3, order) [N; N·mm].

        A spring passes on its stiffness times its deflection, without damping. A rigid support passes on the forces of
        the meshes minus the forces that accelerate the body.
        """
        linkage, names = self.linkage, list(self.bodies)
        inertia = _inertia(self.bodies, names)
        force, motions = np.moveaxis(vibration.force, 1, -1), np.moveaxis(vibration.at_bearings, -1, 1)
        loads = -np.einsum("snm,mba->snba", force, linkage.of_bodies)
        loads = loads + vibration.omega[..., None, None] ** 2 * inertia * motions
        springs = [
            (names.index(motion.moved[0][0]), AXES.index(motion.moved[0][1]), motion.stiffness)
            for motion in linkage.additional_motions
        ]
        springs += [
            (number, 2, body.torsion) for number, body in enumerate(self.bodies.values()) if body.torsion < math.inf
        ]
        pins, deflection = [names.index(name) for name in linkage.carried], motions.copy()
        carrier = motions[..., -1, :]  # the carrier is the last body
        for pin in pins:
            x, y = linkage.train.places[names[pin]]
            deflection[..., pin, :2] -= carrier[..., :2] + carrier[..., 2:] * np.array([-y, x])
        for gear in linkage.twisted:
            deflection[..., names.index(gear), :] -= motions[..., names.index(linkage.train.shaft(gear)), :]
        for on_planets in (True, False):  # planets first, since they load the carrier
            for number, axis, stiffness in springs:
                if (number in pins) == on_planets:
                    loads[..., number, axis] = stiffness * deflection[..., number, axis]
            loads = linkage.carried_on(loads) if on_planets else loads
        return np.moveaxis(loads, 1, -1)

    def other_variables(self, vibration: Vibration, loads: NDArray, speeds: NDArray) -> Variables:
        """Transmission error of the train, load shares, torques on the supports, force waves round the ring."""
        error = np.einsum("b,sbn->sn", self._transmission_error_rows, vibration.at_bearings[:, :, 2])
        share = vibration.largest / self.solved.even  # relative to the force under equal sharing
        variables: Variables = {
            **waves.spectrum("train_dynamic_transmission_error", ("speed", "harmonic"), error, 1e3),
            "train_dynamic_transmission_error_rms": (("speed",), 1e3 * waves.rms(waves.with_mean(error))),
            "load_sharing_greatest": (("speed", "mesh"), share),
            "mesh_load_factor": (("speed",), share.max(axis=1)),
            "bearing_torque_amplitude": (("speed", "bearing", "harmonic"), 2e-3 * np.abs(loads[:, :, 2])),
        }
        return variables | self._ring_waves(vibration, speeds)

    @property
    def _transmission_error_rows(self) -> NDArray:
        """Transmission error of the train, at the first base circle, per rotation of each body (body,) [mm/rad]."""
        linkage = self.linkage
        enters, leaves = linkage.ends
        ratio = 1 / linkage.rates[leaves]
        # θ_in − ratio θ_out, with the rotations relative to the carrier
        turn = {enters: 1.0, leaves: -ratio} | ({} if linkage.carrier is None else {linkage.carrier: ratio - 1.0})
        radius = linkage.train.meshes[0].pair.gears[0].base_radius
        return linkage.sense * radius * np.array([turn.get(name, 0.0) for name in linkage.bodies])

    def _ring_waves(self, vibration: Vibration, speeds: NDArray) -> Variables:
        """Forces of the meshes at the ring as waves that run round it, by number of lobes (D12)."""
        train, carrier = self.linkage.train, self.linkage.carrier
        if carrier is None:
            return {}
        ring = self.linkage.ends[1]
        # rotation of the carrier relative to the ring per revolution of the first gear, positive from x to y
        rate = float(train.rates[carrier] - train.rates[ring]) * (1 if train.clockwise else -1)
        at_ring = [number for number, mesh in enumerate(train.meshes) if mesh.driven == ring]
        places = np.array([train.places[train.shaft(train.meshes[number].driver)] for number in at_ring])
        lobes, orders = self.lobes, vibration.index[:, 0]
        turn = np.exp(1j * np.sign(rate) * np.outer(lobes, np.arctan2(places[:, 1], places[:, 0])))
        wave = np.einsum("kj,sjn->snk", turn, vibration.force[:, at_ring])
        frequency = np.abs(self.groups[0].rate * orders[:, None] + abs(rate) * lobes)
        dims = ("speed", "harmonic", "lobes")
        return {
            "ring_wave_amplitude": (dims, 2 * np.abs(wave)),
            "ring_wave_frequency": (dims, np.multiply.outer(speeds / 60, frequency)),
        }

    @property
    def lobes(self) -> NDArray:
        """Numbers of lobes of force waves round the ring; negative for waves that fall behind the planets."""
        most = LOBES_PER_PLANET * len(self.linkage.carried)
        return np.arange(-most, most + 1)

    @property
    def coords(self) -> dict[str, Any]:
        """Coordinates of ``other_variables`` and ``mode_variables``."""
        coordinates: dict[str, Any] = {"component": ("component", list(AXES))}
        return coordinates if self.linkage.carrier is None else coordinates | {"lobes": ("lobes", self.lobes)}

    def mode_variables(self, which: NDArray) -> Variables:
        """Kind and shape of modes; rotation is an arc on the base circle, or on the circle of pins for the carrier."""
        arc = np.array([(1.0, 1.0, radius) for radius in self.linkage.radii.values()])
        shape = self.modes.bearing[..., which] * arc[..., None]
        shape = np.moveaxis(shape / np.abs(shape).max(axis=(0, 1)), -1, 0)
        return {
            "mode_kind": (("mode",), [self._kinds[mode] for mode in which]),
            "mode_shape": (("mode", "bearing", "component"), shape),
        }

    @cached_property
    def _kinds(self) -> tuple[str, ...]:
        """Kind of each mode."""
        return kinds(self.modes.bearing, self.bodies, (*self.linkage.carried, *self.linkage.twisted))

    def remarks(self, speeds: NDArray, harmonics: int) -> list[str]:
        """Omissions and assumptions of the model, one line each."""
        lines, periods = [], self.linkage.train.periods
        first = self.names[0]
        if others := {name: count for name, count in periods.items() if count != periods[first]}:
            rates = ", ".join(dict.fromkeys(f"{count}/{periods[first]}" for count in others.values()))
            lines.append(
                f"meshes of different frequencies: harmonics are multiples of the mesh frequency of {first}; the "
                f"mesh frequency of {', '.join(others)} is {rates} of it"
            )
        if self.linkage.carrier is None:
            return lines
        planetary = self.scene.planetary
        carrier = None if planetary is None else planetary.keys.dynamics.carrier
        if carrier and None in (carrier.mass, carrier.inertia):
            body = self.bodies["carrier"]
            lines.append(
                f"carrier: assumed to be a steel disc up to the pins, half a gear wide, {1e3 * body.mass:.3g} kg: "
                "give mass and inertia in [planetary.dynamics.carrier]"
            )
        rotation = abs(float(self.linkage.train.rates[self.linkage.carrier])) / 60  # of the carrier [Hz] at 1/min
        frequencies = self.modes.frequency / (2 * np.pi)
        across = [f for f, kind in zip(frequencies, self._kinds, strict=True) if kind != ROTATIONAL]
        if across and rotation:
            low, top = min(across), rotation * float(speeds.max())
            lines.append(
                f"gyroscopic effects of the turning carrier are left out: they shift the mode at {low:.4g} Hz by up to "
                f"{100 * top / low:.2g} % at {speeds.max():.5g} 1/min; "
                f"{100 * GYROSCOPIC:g} % is reached at {GYROSCOPIC * low / rotation:.0f} 1/min"
            )
        return lines


def train_model(scene: Scene, phases: Phases | None = None) -> TrainModel:
    """Solve the contact of a ``coupled`` scene, by default as ``simulate`` does, and build its model.

    Raises
    ------
    InputError, ConvergenceError
        As ``simulate``, or if a mesh never has contact.
    """
    solved = solve_train(scene, phases=phases)
    idle = [name for name, force in zip(solved.meshes, solved.balance.force.T, strict=True) if not force.any()]
    if idle:
        raise InputError(
            "load.torque", scene.load.torque, f"leaves {', '.join(idle)} without contact at every position"
        )
    return TrainModel(scene=scene, solved=solved)
