"""All shafts of a system and how they mesh: axes, senses of rotation, speeds and torques."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.geometry.pair import Pair
from gearbench.geometry.role import Role
from gearbench.system.frame import MeshFrame
from gearbench.system.schema import Seat, System
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
        Name of each mesh → its pair; "" is the scene's own, and comes first.
    torque
        On the pinion of the scene's own pair [N·m].
    wished
        Torque on the pinion of each further mesh, where the shafts leave a choice [N·m].

    Raises
    ------
    InputError
        Where axes, ratios or torques do not fit each other.
    """

    system: System
    pairs: Mapping[str, Pair]
    torque: float
    wished: Mapping[str, float] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the meshes."""
        return tuple(self.pairs)

    @cached_property
    def seats(self) -> dict[tuple[str, Role], tuple[int, Seat]]:
        """(mesh, gear) → number of its shaft, and its seat there."""
        return {
            (seat.mesh, Role[seat.gear.upper()]): (number, seat)
            for number, shaft in enumerate(self.system.shafts)
            for seat in shaft.gears
        }

    @cached_property
    def _rates(self) -> dict[int, float]:
        """Speed of each shaft over that of the first pinion, with its sense."""
        first = self.seats[("", Role.PINION)][0]
        rates = {first: 1.0}
        for mesh, one, two in self._walk(first):
            pair = self.pairs[mesh]
            ratio = -pair.pinion.teeth / pair.wheel.teeth
            p, w = self.seats[(mesh, Role.PINION)][0], self.seats[(mesh, Role.WHEEL)][0]
            known, new = (p, w) if p == one else (w, p)
            rate = rates[known] * (ratio if known == p else 1 / ratio)
            if not math.isclose(rates.setdefault(new, rate), rate, rel_tol=1e-9):
                name = self.system.shafts[two].name
                raise InputError(f"system.shafts.{name}", f"speeds {rates[new]:g} and {rate:g}", "must be one speed")
        return rates

    @cached_property
    def axes(self) -> dict[int, NDArray]:
        """Axis (2,) of each shaft in the transverse plane [mm]."""
        given = {k: np.array(s.axis) for k, s in enumerate(self.system.shafts) if s.axis is not None}
        first = self.seats[("", Role.PINION)][0]
        axes = {first: given.get(first, np.zeros(2))}
        for mesh, one, two in self._walk(first):
            a = self.pairs[mesh].centre_distance
            step = a if self.seats[(mesh, Role.PINION)][0] == one else -a
            axes.setdefault(two, given.get(two, axes[one] + np.array([step, 0.0])))
            distance = float(np.linalg.norm(axes[two] - axes[one]))
            if not math.isclose(distance, a, rel_tol=1e-4):
                name = self.system.shafts[two].name
                raise InputError(f"system.shafts.{name}.axis", distance, f"must be {a:g} mm from the axis of its mate")
        return axes

    def _walk(self, first: int) -> list[tuple[str, int, int]]:
        """Meshes in the order in which the shafts are reached, each with the shaft known and the other."""
        known, left, order = {first}, list(self.pairs), []
        while left:
            for mesh in left:
                ends = [self.seats[(mesh, role)][0] for role in Role]
                if ends[0] == ends[1]:
                    raise InputError("system.shafts", f"both gears of a mesh {mesh!r} on one shaft", "must be on two")
                if ends[0] in known or ends[1] in known:
                    one, two = ends if ends[0] in known else ends[::-1]
                    known.add(two)
                    order.append((mesh, one, two))
                    left.remove(mesh)
                    break
            else:
                raise InputError("system.meshes", ", ".join(left), "no shaft connects it with the scene's own pair")
        return order

    @cached_property
    def frames(self) -> dict[str, MeshFrame]:
        """How each pair stands between its shafts."""
        clockwise = 1 if self.system.rotation == "clockwise" else -1
        hands = {"": self.system.hand} | {mesh.name: mesh.hand for mesh in self.system.meshes}
        frames = {}
        for mesh, pair in self.pairs.items():
            (p, pinion), (w, wheel) = self.seats[(mesh, Role.PINION)], self.seats[(mesh, Role.WHEEL)]
            way = self.axes[w] - self.axes[p]
            x, y = way / np.linalg.norm(way)
            frames[mesh] = MeshFrame(
                pair=pair,
                across=(float(x), float(y)),
                turn=clockwise if self._rates[p] > 0 else -clockwise,
                hand=1 if hands[mesh] == "right" else -1,
                middle=(pinion.position, wheel.position),
            )
        return frames

    @cached_property
    def models(self) -> tuple[ShaftModel, ...]:
        """Beam models of the shafts."""
        models = []
        for shaft in self.system.shafts:
            faces = []
            for seat in shaft.gears:
                b = self.pairs[seat.mesh].gears[Role[seat.gear.upper()]].face_width
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

        Where that leaves a choice, as in split paths, they are as near as can be to those wished.
        """
        others = [name for name in self.pairs if name]
        rows, known = [], []
        for number, shaft in enumerate(self.system.shafts):
            if shaft.coupling is not None or len(shaft.gears) < 2:
                continue
            factor = dict.fromkeys(self.pairs, 0.0)
            for (mesh, role), (here, _) in self.seats.items():
                if here == number:
                    pair = self.pairs[mesh]
                    factor[mesh] += pair.wheel.teeth / pair.pinion.teeth if role == Role.WHEEL else -1.0
            rows.append([factor[name] for name in others])
            known.append(-factor[""] * self.torque)
        found: dict[str, float] = {"": self.torque}
        if others:
            A, b = np.array(rows).reshape(-1, len(others)), np.array(known)
            T = np.array([self.wished.get(name, 0.0) for name in others])
            T = T + (np.linalg.lstsq(A, b - A @ T, rcond=None)[0] if len(b) else 0.0)
            if not np.allclose(A @ T, b, atol=1e-9 * self.torque) or np.any(T <= 0):
                raise InputError("system.meshes", "torques do not balance", "each mesh's pinion must drive its wheel")
            found |= dict(zip(others, (float(t) for t in T), strict=True))
        return found

    def force(self, mesh: str) -> float:
        """Transverse force along the line of action of a mesh [N]."""
        return 1e3 * self.torques[mesh] / self.pairs[mesh].gears[0].base_radius

    def mesh_rate(self, mesh: str) -> float:
        """Mesh frequency over the frequency of rotation of the first pinion."""
        return abs(self._rates[self.seats[(mesh, Role.PINION)][0]]) * self.pairs[mesh].pinion.teeth

    def phase(self, mesh: str) -> float:
        """Mesh phase of a mesh when that of the scene's own pair is zero [mesh periods] (D8)."""
        given = {item.name: item.phase for item in self.system.meshes}.get(mesh)
        if given is not None or not mesh:
            return given or 0.0
        for role in Role:
            (here, own), (there, other) = self.seats[("", role)], self.seats[(mesh, role)]
            teeth = (self.pairs[name].gears[role].teeth for name in ("", mesh))
            if here == there and own.position == other.position and len(set(teeth)) == 1:
                return self._shared_gear_phase(role, mesh)
        return 0.0

    def _shared_gear_phase(self, role: Role, mesh: str) -> float:
        """Mesh phase of a mesh that shares one of the gears of the scene's own pair: its flanks pass both lines."""
        first, second = self.frames[""], self.frames[mesh]
        one, two = first.pair.meshing, second.pair.meshing
        turned = first.pair.gears[role].teeth * (second.foot(role) - first.foot(role)) / (2 * math.pi)
        starts = one.path_start - two.path_start
        if role == Role.WHEEL:
            # the flank's distance from the wheel's own interference point shrinks as the wheel turns
            starts += two.tangent_length - one.tangent_length
        return (starts / one.base_pitch - turned) % 1.0

    def face_rows(self, mesh: str, role: Role, model: ShaftModel) -> NDArray:
        """Rows (point, size) of the model's motions: work of a unit force at each of the points of the face (W8)."""
        frame, η = self.frames[mesh], FACE_POINTS[0]
        y = frame.pair.meshing.face_width * (η + 1) / 2
        return model.rows(frame.position(role, y), frame.wrench(role, np.full(len(y), frame.pair.meshing.pitch_point)))

    def wrench(self, mesh: str, role: Role, model: ShaftModel) -> NDArray:
        """Row (size,) of the model's motions: work of a unit transverse force spread evenly over the face."""
        return FACE_POINTS[1] / 2 @ self.face_rows(mesh, role, model)

    def torque_from(self, mesh: str, role: Role) -> float:
        """Position on its shaft where the torque of a gear comes from or goes to [mm]."""
        number, own = self.seats[(mesh, role)]
        shaft = self.system.shafts[number]
        if shaft.coupling is not None:
            return shaft.coupling.position
        others = [seat.position for seat in shaft.gears if seat is not own]
        return float(np.mean(others)) if others else 0.0

    def face_nodes(self, mesh: str, role: Role, model: ShaftModel) -> NDArray:
        """Nodes of the model under the face of a gear."""
        half = self.pairs[mesh].gears[role].face_width / 2
        first, last = (model.node(self.seats[(mesh, role)][1].position + s * half) for s in (-1, 1))
        return np.arange(first, last + 1)

    def spin(self, mesh: str, role: Role, model: ShaftModel) -> NDArray:
        """Row (size,) of the model's motions: what the spin of a gear adds to the transmission error.

        It is that of the section of its face where its torque enters.
        """
        nodes, frame, row = self.face_nodes(mesh, role, model), self.frames[mesh], np.zeros(model.size)
        at = nodes[np.argmin(np.abs(model.nodes[nodes] - self.torque_from(mesh, role)))]
        row[6 * at + 5] = frame.wrench(role, frame.pair.meshing.pitch_point)[5]
        return row
