"""Shafts of a system and their meshes: axes, senses of rotation, speeds and torques."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.names import GEARS, PAIR
from gearbench.geometry.pair import Pair
from gearbench.geometry.train import Mesh, Train
from gearbench.system.frame import MeshFrame
from gearbench.system.schema import Seat, System
from gearbench.system.shaft_model import Face, ShaftModel
from gearbench.system.static import StaticState
from gearbench.system.structure import Structure, structures

#: Gauss points η over the face, from −1 to 1, and their weights, which sum to 2.
FACE_POINTS = np.polynomial.legendre.leggauss(32)


# compared by identity: part of scenes, which are keys of caches
@dataclass(frozen=True, kw_only=True, eq=False)
class MeshLoads:
    """Mean loads of all meshes of a gearbox on its shafts.

    Parameters
    ----------
    of_mesh
        Name of a mesh → loads (size,) [N, N·mm] on the nodes of the shafts of its pinion and its wheel.
    settled
        Equilibrium of each shaft under these loads, in the order of the shafts.
    """

    of_mesh: Mapping[str, tuple[NDArray, NDArray]]
    settled: tuple[StaticState, ...]


# compared by identity: results of a gearbox are cached
@dataclass(frozen=True, kw_only=True, eq=False)
class Gearbox:
    """A system with shafts, and the gear pairs in mesh on them.

    Parameters
    ----------
    system
        Table ``[system]`` of the scene, with shafts.
    pairs
        Name of a mesh → its pair. The table ``[system]`` counts from the first, "pair".
    torque
        Torque on the pinion of the mesh ``own`` [N·m].
    preferred
        Preferred torque on the pinion of each other mesh [N·m], used if the shafts leave a choice.
    own
        Name of the mesh whose contact is solved; the others load its shafts.
    loads
        Mean loads of the meshes on the shafts; by default every mesh loads its face evenly, at the pitch point.

    Raises
    ------
    InputError
        If axes, ratios or torques contradict each other.
    """

    system: System
    pairs: Mapping[str, Pair]
    torque: float
    preferred: Mapping[str, float] = field(default_factory=dict)
    own: str = PAIR
    loads: MeshLoads | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the meshes."""
        return tuple(self.pairs)

    @cached_property
    def seats(self) -> dict[tuple[str, int], tuple[int, Seat]]:
        """(mesh, index of the gear) → number of its shaft, and its seat on the shaft."""
        return {
            (seat.mesh, GEARS.index(seat.gear)): (number, seat)
            for number, shaft in enumerate(self.system.shafts)
            for seat in shaft.gears
        }

    @cached_property
    def train(self) -> Train:
        """Gears and meshes. Unnamed seats with equal teeth at the same position of a shaft are the same gear."""
        gears, given = {}, {item.name: item.phase for item in self.system.meshes}
        for (mesh, index), (number, seat) in self.seats.items():
            body = self.pairs[mesh].gears[index]
            common_name = f"gear of {body.teeth} teeth on {self._name(number)} at {seat.position:g} mm"
            gears[mesh, index] = seat.name or common_name, number
        meshes = (
            Mesh(
                name=mesh,
                driver=gears[mesh, 0][0],
                driven=gears[mesh, 1][0],
                pair=pair,
                phase=given.get(mesh),
            )
            for mesh, pair in self.pairs.items()
        )
        return Train(
            meshes=tuple(meshes),
            shafts={gear: self._name(number) for gear, number in gears.values()},
            axes={shaft.name: shaft.axis for shaft in self.system.shafts if shaft.axis is not None},
            clockwise=self.system.rotation == "clockwise",
        )

    def _name(self, number: int) -> str:
        """Name of a shaft."""
        return self.system.shafts[number].name

    @property
    def coast(self) -> bool:
        """Whether the torque loads the coast flanks."""
        return self.torque < 0

    @cached_property
    def frames(self) -> dict[str, MeshFrame]:
        """Mesh → orientation of its pair between the shafts; for coast flanks with reversed sense of rotation."""
        hands = {PAIR: self.system.hand, **{mesh.name: mesh.hand for mesh in self.system.meshes}}
        frames = {}
        for mesh, pair in self.pairs.items():
            x, y = self.train.across(mesh)
            frames[mesh] = MeshFrame(
                pair=pair,
                across=(float(x), float(y)),
                turn=-self.train.turn(mesh) if self.coast else self.train.turn(mesh),
                hand=1 if hands[mesh] == "right" else -1,
                middle=(self.seats[(mesh, 0)][1].position, self.seats[(mesh, 1)][1].position),
                coast=self.coast,
            )
        return frames

    @cached_property
    def models(self) -> tuple[ShaftModel, ...]:
        """Beam models of the shafts."""
        models = []
        for shaft in self.system.shafts:
            faces = []
            for seat in shaft.gears:
                b = self.pairs[seat.mesh].gears[GEARS.index(seat.gear)].face_width
                faces.append(Face(start=seat.position - b / 2, end=seat.position + b / 2, diameter=seat.diameter))
            joints = (joint for body in self.system.bodies for joint in body.joints)
            joint_positions = tuple(joint.position for joint in joints if joint.shaft == shaft.name)
            models.append(ShaftModel(shaft=shaft, faces=tuple(faces), joints=joint_positions))
        return tuple(models)

    @cached_property
    def structures(self) -> tuple[Structure, ...]:
        """Groups of shafts connected by bodies; without bodies every shaft is a separate group."""
        return structures(dict(enumerate(self.models)), self.system.bodies)

    @cached_property
    def torques(self) -> dict[str, float]:
        """Torque on the pinion of each mesh [N·m], from the torque balance of shafts without coupling.

        If this leaves a choice, as with split paths, the torques are as close as possible to ``preferred``.
        """
        free = [shaft.name for shaft in self.system.shafts if shaft.coupling is not None]
        loads = {**self.preferred, self.own: self.torque}
        preferred = {name: abs(torque / loads[PAIR]) for name, torque in loads.items()}
        shares = self.train.torques(free, preferred)
        return {name: share / shares[self.own] * self.torque for name, share in shares.items()}

    def force(self, mesh: str) -> float:
        """Transverse force along the line of action of a mesh [N]."""
        return 1e3 * abs(self.torques[mesh]) / self.pairs[mesh].gears[0].base_radius

    @cached_property
    def phases(self) -> dict[str, float]:
        """Mesh → its mesh phase at phase 0 of "pair" [mesh periods] (D8)."""
        return self.train.phases(coast=self.coast)

    def face_rows(self, mesh: str, index: int, model: ShaftModel) -> NDArray:
        """Rows (point, size): work of a unit transverse force at each point of the face on the model's motions (W8)."""
        frame, η = self.frames[mesh], FACE_POINTS[0]
        y = frame.pair.meshing.face_width * (η + 1) / 2
        return model.rows(
            frame.position(index, y), frame.wrench(index, np.full(len(y), frame.pair.meshing.pitch_point))
        )

    def load(self, mesh: str, index: int) -> NDArray:
        """Mean load (size,) of a mesh on the nodes of the shaft of its pinion (0) or wheel (1) [N, N·mm]."""
        if self.loads is not None:
            return self.loads.of_mesh[mesh][index]
        model = self.models[self.seats[(mesh, index)][0]]
        return self.force(mesh) * FACE_POINTS[1] / 2 @ self.face_rows(mesh, index, model)

    def torque_from(self, mesh: str, index: int) -> float:
        """Position on the shaft from which the torque of a gear comes, or to which it goes [mm]."""
        number, seat_of_gear = self.seats[(mesh, index)]
        shaft = self.system.shafts[number]
        if shaft.coupling is not None:
            return shaft.coupling.position
        others = [seat.position for seat in shaft.gears if seat is not seat_of_gear]
        return float(np.mean(others)) if others else 0.0

    def face_nodes(self, mesh: str, index: int, model: ShaftModel) -> NDArray:
        """Nodes of the model under the face of a gear."""
        half = self.pairs[mesh].gears[index].face_width / 2
        first, last = (model.node(self.seats[(mesh, index)][1].position + s * half) for s in (-1, 1))
        return np.arange(first, last + 1)

    def rotation(self, mesh: str, index: int, model: ShaftModel) -> NDArray:
        """Row (size,): contribution of the spin of a gear to the transmission error, per unit of the model's motions.

        The spin is that of the section of the face at which the torque enters.
        """
        nodes, frame, row = self.face_nodes(mesh, index, model), self.frames[mesh], np.zeros(model.size)
        node = nodes[np.argmin(np.abs(model.nodes[nodes] - self.torque_from(mesh, index)))]
        row[6 * node + 5] = frame.wrench(index, frame.pair.meshing.pitch_point)[5]
        return row
