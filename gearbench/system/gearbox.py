"""All shafts of a system and how they mesh: axes, senses of rotation, speeds and torques."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.names import GEARS, PAIR
from gearbench.geometry.pair import Pair
from gearbench.geometry.train import Mesh, Train
from gearbench.system.frame import MeshFrame
from gearbench.system.schema import FurtherMesh, Hand, Seat, System
from gearbench.system.shaft_model import Face, ShaftModel
from gearbench.system.structure import Structure, structures

#: Gauss points η over the face, from −1 to 1, and their weights, which sum to 2.
FACE_POINTS = np.polynomial.legendre.leggauss(32)


@dataclass(frozen=True, kw_only=True)
class Gearbox:
    """A system with shafts, and the pairs that mesh in it.

    Parameters
    ----------
    system
        ``[system]`` of the scene; it has shafts.
    pairs
        Name of each mesh → its pair; "pair" is the scene's own, and comes first.
    torque
        On the pinion of the scene's own pair [N·m].
    preferred
        Torque on the pinion of each further mesh, where the shafts leave a choice [N·m].

    Raises
    ------
    InputError
        Where axes, ratios or torques do not fit each other.
    """

    system: System
    pairs: Mapping[str, Pair]
    torque: float
    preferred: Mapping[str, float] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the meshes."""
        return tuple(self.pairs)

    @cached_property
    def seats(self) -> dict[tuple[str, int], tuple[int, Seat]]:
        """(mesh, gear) → number of its shaft, and its seat there."""
        return {
            (seat.mesh, GEARS.index(seat.gear)): (number, seat)
            for number, shaft in enumerate(self.system.shafts)
            for seat in shaft.gears
        }

    @cached_property
    def train(self) -> Train:
        """Gears and meshes; without names, one number of teeth at one position of a shaft is one gear."""
        gears, given = {}, {item.name: item.phase for item in self.system.meshes}
        for (mesh, index), (number, seat) in self.seats.items():
            body = self.pairs[mesh].gears[index]
            alike = f"gear of {body.teeth} teeth on {self._name(number)} at {seat.position:g} mm"
            gears[mesh, index] = seat.name or alike, number
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
        return self.system.shafts[number].name

    @property
    def coast(self) -> bool:
        """Whether the torque loads the coast flanks."""
        return self.torque < 0

    @property
    def _hands(self) -> dict[str, Hand]:
        return {PAIR: self.system.hand, **{mesh.name: mesh.hand for mesh in self.system.meshes}}

    @cached_property
    def frames(self) -> dict[str, MeshFrame]:
        """Orientation of each pair between its shafts; for coast flanks as if it turned the other way."""
        hands = self._hands
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
            here = tuple(joint.position for joint in joints if joint.shaft == shaft.name)
            models.append(ShaftModel(shaft=shaft, faces=tuple(faces), joints=here))
        return tuple(models)

    @cached_property
    def structures(self) -> tuple[Structure, ...]:
        """Sets of shafts that bodies connect: each shaft by itself where there are none."""
        return structures(dict(enumerate(self.models)), self.system.bodies)

    @cached_property
    def torques(self) -> dict[str, float]:
        """Torque on the pinion of each mesh [N·m], from the balance of the shafts that no coupling drives.

        Where that leaves a choice, as in split paths, they are as near as can be to those preferred.
        """
        free = [shaft.name for shaft in self.system.shafts if shaft.coupling is not None]
        preferred = {name: abs(torque / self.torque) for name, torque in self.preferred.items()}
        return {name: share * self.torque for name, share in self.train.torques(free, preferred).items()}

    def seen_from(self, mesh: str) -> System:
        """The system with a further ``mesh`` as the scene's own pair, and that one as a further mesh."""
        own = "the scene's own pair"
        names = dict(zip(self.names, self.names, strict=True)) | {PAIR: own, mesh: PAIR}
        hands = self._hands
        shafts = tuple(
            replace(
                shaft,
                axis=tuple(map(float, self.train.places[shaft.name])),
                gears=tuple(replace(seat, mesh=names[seat.mesh]) for seat in shaft.gears),
            )
            for shaft in self.system.shafts
        )
        return replace(
            self.system,
            shafts=shafts,
            hand=hands[mesh],
            rotation="clockwise" if self.train.turn(mesh) > 0 else "counterclockwise",
            meshes=tuple(
                FurtherMesh(name=names[name], scene="", hand=hands[name]) for name in self.names if name != mesh
            ),
        )

    def force(self, mesh: str) -> float:
        """Transverse force along the line of action of a mesh [N]."""
        return 1e3 * abs(self.torques[mesh]) / self.pairs[mesh].gears[0].base_radius

    @cached_property
    def phases(self) -> dict[str, float]:
        """Mesh phase of each mesh when that of the scene's own pair is zero [mesh periods] (D8)."""
        return self.train.phases(coast=self.coast)

    def face_rows(self, mesh: str, index: int, model: ShaftModel) -> NDArray:
        """Rows (point, size) of the model's motions: work of a unit force at each of the points of the face (W8)."""
        frame, η = self.frames[mesh], FACE_POINTS[0]
        y = frame.pair.meshing.face_width * (η + 1) / 2
        return model.rows(
            frame.position(index, y), frame.wrench(index, np.full(len(y), frame.pair.meshing.pitch_point))
        )

    def wrench(self, mesh: str, index: int, model: ShaftModel) -> NDArray:
        """Row (size,) of the model's motions: work of a unit transverse force spread evenly over the face."""
        return FACE_POINTS[1] / 2 @ self.face_rows(mesh, index, model)

    def torque_from(self, mesh: str, index: int) -> float:
        """Position on its shaft where the torque of a gear comes from or goes to [mm]."""
        number, own = self.seats[(mesh, index)]
        shaft = self.system.shafts[number]
        if shaft.coupling is not None:
            return shaft.coupling.position
        others = [seat.position for seat in shaft.gears if seat is not own]
        return float(np.mean(others)) if others else 0.0

    def face_nodes(self, mesh: str, index: int, model: ShaftModel) -> NDArray:
        """Nodes of the model under the face of a gear."""
        half = self.pairs[mesh].gears[index].face_width / 2
        first, last = (model.node(self.seats[(mesh, index)][1].position + s * half) for s in (-1, 1))
        return np.arange(first, last + 1)

    def spin(self, mesh: str, index: int, model: ShaftModel) -> NDArray:
        """Row (size,) of the model's motions: what the spin of a gear adds to the transmission error.

        It is that of the section of its face where its torque enters.
        """
        nodes, frame, row = self.face_nodes(mesh, index, model), self.frames[mesh], np.zeros(model.size)
        at = nodes[np.argmin(np.abs(model.nodes[nodes] - self.torque_from(mesh, index)))]
        row[6 * at + 5] = frame.wrench(index, frame.pair.meshing.pitch_point)[5]
        return row
