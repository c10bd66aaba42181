"""Trains of gears: speeds, axes, torques and mesh phases. A pair is a train of one mesh.

The transverse plane is viewed in the direction of increasing positions on the shafts, with x to the right and y down.
Angles count clockwise from x.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.geometry.names import PAIR
from gearbench.geometry.pair import Pair

#: Tolerance of the distance between given axes, relative to the centre distance.
_AXES = 1e-4
#: Tolerance for the fit of the teeth of a gear in the tooth spaces of its mates [pitches].
_TEETH = 1e-3


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Two gears of a train in mesh.

    Parameters
    ----------
    name
        Name in results and messages.
    driver, driven
        Names of the gears.
    pair
        The two gears as a pair, with the driver as pinion.
    direction
        Direction from the axis of the driver to that of the driven gear, if the axes are not given [°].
    phase
        Mesh phase at phase 0 of the first mesh [mesh periods]; None if it follows from the teeth.
    carrier
        Shaft that carries one axis around the other; None if both axes are fixed.
    """

    name: str = PAIR
    driver: str = "pinion"
    driven: str = "wheel"
    pair: Pair
    direction: float = 0.0
    phase: float | None = None
    carrier: str | None = None

    @property
    def gears(self) -> tuple[str, str]:
        """Names of both gears, the driver first."""
        return self.driver, self.driven

    def lead(self, gear: str, towards: float, *, coast: bool = False) -> float:
        """Angle of the leading flank of a gear at mesh phase 0 [pitches], modulo 1 (D8).

        The angle is that of the point where the leading flank of pair 0 meets the base circle, at the end y = 0 of the
        face of this gear. It counts in the gear's sense of rotation. ``towards`` is the direction from the driver's
        axis to the pitch point [rad], in the driver's sense of rotation. ``coast``: the coast flanks touch (mirrored).
        """
        meshing, index = self.pair.meshing, self.gears.index(gear)
        body = meshing.gears[index]
        foot = towards - meshing.alpha_wt  # direction in which the line of action touches the driver's base circle
        if index == 1 and meshing.gears[0].teeth * body.teeth > 0:
            foot = math.pi - foot  # opposite side, opposite sense of rotation
        # contact point at y = 0, along the path of contact; on a helical gear it depends on y
        u = meshing.path_start - self.pair.overhangs[index][int(coast)] * math.tan(meshing.beta_b)
        lead = abs(body.teeth) * foot / (2 * math.pi)
        if index == 0:
            return lead + u / meshing.base_pitch
        # the driven gear is pushed at the trailing flank of a tooth, 2ψ_b behind the leading one
        thickness = body.teeth * float(body.involute_half_angle(body.base_radius)) / math.pi
        return lead + (u - meshing.tangent_length) / meshing.base_pitch + thickness


@dataclass(frozen=True, kw_only=True)
class Train:
    """Gears on shafts, and how they mesh.

    Parameters
    ----------
    meshes
        All meshes. The driver of the first has the speed 1; if it is held, its carrier has the speed −1.
    shafts
        Gear → its shaft. A gear that is not listed has a separate shaft of the same name.
    axes
        Shaft → (x, y) of its axis [mm]; missing axes follow from the directions of the meshes.
    clockwise
        Whether the driver of the first mesh turns clockwise.
    held
        Fixed shafts.
    timed
        Gear → gear of the same shaft with which a tooth of it is in line: the middles of both teeth, each at the end
        y = 0 of its face, have the same angle.

    Raises
    ------
    InputError
        If names, speeds, axes or torques contradict each other. Some checks run only when a property is used.
    """

    meshes: tuple[Mesh, ...]
    shafts: Mapping[str, str] = field(default_factory=dict)
    axes: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    clockwise: bool = True
    held: tuple[str, ...] = ()
    timed: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        names = [mesh.name for mesh in self.meshes]
        for number, mesh in enumerate(self.meshes):
            if names.index(mesh.name) != number:
                raise InputError(f"meshes.{number}.name", mesh.name, "given twice: each name at most once")
            if self.shaft(mesh.driver) == self.shaft(mesh.driven):
                raise InputError(f"meshes.{mesh.name}", self.shaft(mesh.driver), "carries both gears: must be on two")
            for gear, member in zip(mesh.gears, mesh.pair.members, strict=True):
                if len(self.meshes) > 1 and member.support is not None and member.support.lugs:
                    raise InputError(f"gears.{gear}.support.lugs", list(member.support.lugs), "are of a single pair")

    def shaft(self, gear: str) -> str:
        """Shaft of a gear."""
        return self.shafts.get(gear, gear)

    def __getitem__(self, name: str) -> Mesh:
        return next(mesh for mesh in self.meshes if mesh.name == name)

    @property
    def gears(self) -> tuple[str, ...]:
        """Names of the gears, in the order of the meshes."""
        return tuple(dict.fromkeys(gear for mesh in self.meshes for gear in mesh.gears))

    # -- speeds -------------------------------------------------------------------------------------------------------
    @property
    def reference(self) -> str:
        """Shaft whose speed is given: that of the first driver, or the carrier if the driver is held."""
        mesh = self.meshes[0]
        first = self.shaft(mesh.driver)
        return first if first not in self.held or mesh.carrier is None else mesh.carrier

    @cached_property
    def rates(self) -> dict[str, Fraction]:
        """Shaft → signed speed relative to the first driver.

        The speeds solve one linear system, z_1 (n_1 − n_c) + z_2 (n_2 − n_c) = 0 for each mesh with the carrier c
        (Willis). Tooth numbers of internal gears are negative.
        """
        shafts = list(dict.fromkeys(self.shaft(gear) for gear in self.gears))
        shafts += [c for c in dict.fromkeys(m.carrier for m in self.meshes) if c is not None and c not in shafts]
        # relative to its carrier, a held driver turns with the same speed
        first = self.shaft(self.meshes[0].driver)
        equations: list[tuple[dict[str, int], int]] = [({self.reference: 1 if self.reference == first else -1}, 1)]
        equations += [({name: 1}, 0) for name in self.held]
        for mesh in self.meshes:
            z = [gear.teeth for gear in mesh.pair.gears]
            factors = dict(zip(map(self.shaft, mesh.gears), z, strict=True))
            if mesh.carrier is not None:
                factors[mesh.carrier] = factors.get(mesh.carrier, 0) - sum(z)
            equations.append((factors, 0))
        rates = _solved([[*(Fraction(row.get(name, 0)) for name in shafts), Fraction(b)] for row, b in equations])
        if None in rates:
            list(self._walk(shafts[0]))  # raises an error if a shaft is not connected with the first
            name = shafts[rates.index(None)]
            raise InputError("meshes", f"speed of {name}", "is not determined by the speed of the first driver")
        return dict(zip(shafts, (rate for rate in rates if rate is not None), strict=True))

    def mesh_rate(self, name: str) -> Fraction:
        """Mesh frequency divided by the rotation frequency of the first driver."""
        return abs(self.own_rate(name) * self[name].pair.gears[0].teeth)

    @cached_property
    def periods(self) -> dict[str, int]:
        """Mesh → its mesh periods in the shortest cycle after which all meshes have their phases again."""
        rates = {mesh.name: self.mesh_rate(mesh.name) / self.mesh_rate(self.meshes[0].name) for mesh in self.meshes}
        denominator = math.lcm(*(rate.denominator for rate in rates.values()))
        return {name: int(rate * denominator) for name, rate in rates.items()}

    def own_rate(self, name: str) -> Fraction:
        """Signed speed of the driver of a mesh relative to the carrier of the mesh, over that of the first driver."""
        mesh = self[name]
        carrier = 0 if mesh.carrier is None else self.rates[mesh.carrier]
        return self.rates[self.shaft(mesh.driver)] - carrier

    def turn(self, name: str) -> int:
        """Sense of rotation of the driver of a mesh: +1 if it turns clockwise, −1 otherwise."""
        return 1 if (self.own_rate(name) > 0) == self.clockwise else -1

    # -- axes ---------------------------------------------------------------------------------------------------------
    @cached_property
    def places(self) -> dict[str, NDArray]:
        """Shaft → its axis (2,) in the transverse plane [mm]."""
        first = self.shaft(self.meshes[0].driver)
        places = {first: np.array(self.axes.get(first, (0.0, 0.0)), dtype=float)}
        for mesh, placed, new in self._walk(first):
            a, angle = mesh.pair.centre_distance, math.radians(mesh.direction)
            step = a * np.array([math.cos(angle), math.sin(angle)]) * (1 if placed == self.shaft(mesh.driver) else -1)
            places.setdefault(new, np.array(self.axes.get(new, places[placed] + step), dtype=float))
            distance = float(np.linalg.norm(places[new] - places[placed]))
            if not math.isclose(distance, abs(a), rel_tol=_AXES):
                raise InputError(f"axis of {new}", distance, f"must be {abs(a):g} mm from the axis of its mate")
        return places

    def _walk(self, first: str) -> Iterator[tuple[Mesh, str, str]]:
        """Meshes in the order in which they connect shafts: (mesh, shaft already reached, new shaft)."""
        known, left = {first}, list(self.meshes)
        while left:
            mesh = next((mesh for mesh in left if known & set(map(self.shaft, mesh.gears))), None)
            if mesh is None:
                raise InputError("meshes", ", ".join(mesh.name for mesh in left), "no shaft connects it with the first")
            one, two = map(self.shaft, mesh.gears)
            yield (mesh, one, two) if one in known else (mesh, two, one)
            known |= {one, two}
            left.remove(mesh)

    def across(self, name: str) -> NDArray:
        """Unit vector (2,) from the axis of the driver of a mesh to the pitch point."""
        mesh = self[name]
        way = self.places[self.shaft(mesh.driven)] - self.places[self.shaft(mesh.driver)]
        return math.copysign(1.0, mesh.pair.centre_distance) * way / np.linalg.norm(way)

    def pitch_point(self, name: str) -> NDArray:
        """Pitch point (2,) of a mesh [mm]."""
        mesh = self[name]
        radius = mesh.pair.gears[0].base_radius / math.cos(mesh.pair.meshing.alpha_wt)
        return self.places[self.shaft(mesh.driver)] + radius * self.across(name)

    def check_room(self) -> None:
        """Refuse gears that overlap and are not in mesh, among gears whose places along the axes meshes connect.

        Raises
        ------
        InputError
            With both gears and the overlap of their tips.
        """
        bodies, planes = {}, []
        for mesh in self.meshes:
            bodies |= zip(mesh.gears, zip(mesh.pair.gears, mesh.pair.faces.ends, strict=True), strict=True)
            joined = [plane for plane in planes if not plane.isdisjoint(mesh.gears)]
            planes = [plane for plane in planes if plane not in joined] + [set(mesh.gears).union(*joined)]
        in_mesh = {frozenset(mesh.gears) for mesh in self.meshes}
        for one, other in combinations(self.gears, 2):
            if {one, other} in in_mesh or not any({one, other} <= plane for plane in planes):
                continue
            (gear_1, face_1), (gear_2, face_2) = bodies[one], bodies[other]
            distance = float(np.linalg.norm(self.places[self.shaft(one)] - self.places[self.shaft(other)]))
            # a ring, of negative tip radius, surrounds the other gear
            overlap = gear_1.tip_radius + gear_2.tip_radius - min(gear_1.sign, gear_2.sign) * distance
            if overlap > 0 and max(face_1[0], face_2[0]) < min(face_1[1], face_2[1]):
                allowed = "must be apart, as they are not in mesh: change a direction of the meshes or an axial_offset"
                raise InputError(f"gears.{other}", f"tips overlap those of {one} by {overlap:.4g} mm", allowed)

    # -- phases and flanks --------------------------------------------------------------------------------------------
    @cached_property
    def coast(self) -> dict[str, bool]:
        """Mesh → whether its coast flanks touch, if the drive flanks of the first mesh do.

        A gear that drives in several meshes, or is driven in several, uses the same flank in all of them. An idler is
        driven in one mesh and drives in the other, so both its flanks carry load.
        """
        touches: dict[str, bool] = {}
        for mesh, gear, other in self._shared():
            same = other is None or mesh.gears.index(gear) == other.gears.index(gear)
            touches[mesh.name] = False if other is None else touches[other.name] == same
        return touches

    def hands(self, given: Mapping[str, str]) -> dict[str, str]:
        """Mesh → hand of its driver's helix, "right" or "left".

        A gear shared with an earlier mesh determines the hand; otherwise it is as ``given``. Mating gears have opposite
        hands, or the same hand if one of them is internal.
        """

        def across(mesh: Mesh, gear: str, hand: str) -> str:
            """Hand of the driver from the hand of ``gear``, or vice versa."""
            alike = gear == mesh.driver or mesh.pair.is_internal
            return hand if alike else {"right": "left", "left": "right"}[hand]

        hands: dict[str, str] = {}
        for mesh, gear, other in self._shared():
            if other is None:
                hands[mesh.name] = given[mesh.name]
            else:
                hands[mesh.name] = across(mesh, gear, across(other, gear, hands[other.name]))
        return hands

    def phases(self, *, coast: bool = False) -> dict[str, float]:
        """Mesh → its mesh phase at phase 0 of the first mesh [mesh periods] (D8).

        A phase that is not given follows from the teeth of a gear shared with an earlier mesh, or of the gear with
        which the driver is ``timed``; otherwise it is 0. ``coast``: the torque loads the other flanks.
        """
        phases: dict[str, float] = {}
        for mesh, gear, other in self._shared():
            if mesh.phase is not None or (other is None and mesh.driver not in self.timed):
                phases[mesh.name] = mesh.phase or 0.0
                continue
            if other is None:
                ahead = self._angle(self.timed[mesh.driver], phases, coast)
                ahead -= self._angle(mesh.driver, {mesh.name: 0.0}, coast)
                phase = ahead * mesh.pair.pinion.teeth
            else:
                leads = [m.lead(gear, self._towards(m, coast), coast=coast) for m in (other, mesh)]
                phase = phases[other.name] + leads[0] - leads[1]
            # rounded, so that planets in phase have equal phases
            phases[mesh.name] = round(phase % 1.0, 12) % 1.0
        return phases

    def middle(self, name: str, gear: str, phase: float, *, coast: bool = False) -> float:
        """Angle of the middle of the tooth behind the leading flank, see ``leading`` [pitches]."""
        mesh = self[name]
        body = mesh.pair.gears[mesh.gears.index(gear)]
        half = body.teeth * float(body.involute_half_angle(body.base_radius)) / (2 * math.pi)
        return self.leading(name, gear, phase, coast=coast) - half

    def _angle(self, gear: str, phases: Mapping[str, float], coast: bool) -> float:
        """``middle`` of a gear in its first mesh among those with known ``phases`` [turns]."""
        mesh = next(mesh for mesh in self.meshes if mesh.name in phases and gear in mesh.gears)
        teeth = abs(mesh.pair.gears[mesh.gears.index(gear)].teeth)
        return self.middle(mesh.name, gear, phases[mesh.name], coast=coast) / teeth

    def check_assembly(self, *, coast: bool = False) -> None:
        """Refuse gears whose teeth do not fit into all their meshes at once. Meshes with a given phase are not checked.

        ``timed`` gears with z_1 and z_2 teeth fit if one of the z_1 z_2/gcd(z_1, z_2) angles between their teeth is 0
        (M5).

        Raises
        ------
        InputError
            With the gear and the misfit of its teeth in pitches.
        """
        phases, leads = self.phases(coast=coast), {}
        for mesh in self.meshes:
            for gear in mesh.gears if mesh.phase is None else ():
                lead = self.leading(mesh.name, gear, phases[mesh.name], coast=coast)
                off = (lead - leads.setdefault(gear, lead) + 0.5) % 1.0 - 0.5
                if abs(off) > _TEETH:
                    allowed = f"does not assemble: in {mesh.name} its teeth are {off:+.3f} pitches away from the gaps"
                    raise InputError("gears", gear, allowed)
        teeth = {g: abs(body.teeth) for m in self.meshes for g, body in zip(m.gears, m.pair.gears, strict=True)}
        for gear, other in self.timed.items():
            angles = math.lcm(teeth[gear], teeth[other])
            off = (angles * (self._angle(gear, phases, coast) - self._angle(other, phases, coast)) + 0.5) % 1.0 - 0.5
            if abs(off) > _TEETH:
                misfit = f"{off * teeth[gear] / angles:+.3g} pitches away from the gaps"
                raise InputError("gears", gear, f"does not assemble: its teeth are {misfit}")

    def begun(self, *, coast: bool = False) -> dict[str, tuple[int, int]]:
        """Mesh → numbers of teeth by which its driver and its driven gear begin later than in their first meshes."""
        phases, leads, begun = self.phases(coast=coast), {}, {}
        for mesh in self.meshes:
            lead = [self.leading(mesh.name, gear, phases[mesh.name], coast=coast) for gear in mesh.gears]
            first = [leads.setdefault(gear, angle) for gear, angle in zip(mesh.gears, lead, strict=True)]
            sense = -1 if coast else 1  # coast flanks are those of a mirrored train, in which later teeth are ahead
            begun[mesh.name] = tuple(sense * round(a - b) for a, b in zip(first, lead, strict=True))
        return begun

    def leading(self, name: str, gear: str, phase: float, *, coast: bool = False) -> float:
        """Angle of the leading flank of a gear at the ``phase`` of the mesh ``name`` [pitches], see ``Mesh.lead``."""
        mesh = self[name]
        return phase + mesh.lead(gear, self._towards(mesh, coast), coast=coast)

    def _towards(self, mesh: Mesh, coast: bool) -> float:
        """Direction from the driver's axis to the pitch point, in the driver's sense of rotation [rad]."""
        x, y = self.across(mesh.name)
        return self.turn(mesh.name) * (-1 if coast else 1) * math.atan2(y, x)

    def _shared(self) -> Iterator[tuple[Mesh, str, Mesh | None]]:
        """All meshes as (mesh, gear, earlier mesh with the same gear, or None if no gear is shared)."""
        done: list[Mesh] = []
        left = list(self.meshes)
        while left:
            links = (
                (mesh, gear, other) for mesh in left for other in done for gear in mesh.gears if gear in other.gears
            )
            mesh, gear, other = next(links, (left[0], left[0].driver, None))
            yield mesh, gear, other
            done.append(mesh)
            left.remove(mesh)

    # -- torques ------------------------------------------------------------------------------------------------------
    def _balance(self, free: Sequence[str] | None) -> NDArray:
        """Matrix (shaft, mesh) that maps the driver torques of the meshes to the net torque on each shaft.

        It has a row for each shaft at which no torque enters or leaves; ``free`` as in ``torques``.
        """
        rows = []
        for shaft in dict.fromkeys(map(self.shaft, self.gears)):
            touching = [mesh for mesh in self.meshes if shaft in map(self.shaft, mesh.gears)]
            drives = {shaft == self.shaft(mesh.driver) for mesh in touching}
            if len(touching) < 2 or (len(drives) < 2 if free is None else shaft in free):
                continue
            row = dict.fromkeys((mesh.name for mesh in self.meshes), 0.0)
            for mesh in touching:
                z_1, z_2 = (gear.teeth for gear in mesh.pair.gears)
                row[mesh.name] += z_2 / z_1 if shaft == self.shaft(mesh.driven) else -1.0
            rows.append(list(row.values()))
        return np.array(rows).reshape(-1, len(self.meshes))

    @cached_property
    def parallel(self) -> bool:
        """Whether there are parallel paths: the torque balance of the shafts does not determine the mesh torques."""
        _ = self.rates
        return bool(np.linalg.matrix_rank(self._balance(None)[:, 1:]) < len(self.meshes) - 1)

    def torques(
        self, free: Sequence[str] | None = None, preferred: Mapping[str, float] | None = None
    ) -> dict[str, float]:
        """Mesh → torque on its driver relative to the first driver, from the torque balance of the shafts.

        Parameters
        ----------
        free
            Shafts where torque enters or leaves, in addition to those with one mesh. By default these are the shafts
            whose gears all drive or are all driven.
        preferred
            Torques to which the result is as close as possible if the balance leaves a choice. By default such a choice
            is an error.
        """
        first, *others = names = [mesh.name for mesh in self.meshes]
        _ = self.rates  # raises unless every shaft has exactly one speed
        rows = self._balance(free)
        if not others:
            return {first: 1.0}
        b, A = -rows[:, 0], rows[:, 1:]
        if preferred is None and np.linalg.matrix_rank(A) < len(others):
            allowed = "paths are parallel: the balance of the shafts does not determine how they share the torque"
            raise InputError("meshes", ", ".join(names), allowed)
        T = np.array([(preferred or {}).get(name, 0.0) for name in others])
        T = T + (np.linalg.lstsq(A, b - A @ T, rcond=None)[0] if len(b) else 0.0)
        if not np.allclose(A @ T, b, atol=1e-9) or np.any(T <= 0):
            raise InputError(
                "meshes", "torques do not balance", "in every mesh torque must flow from the driver to the driven gear"
            )
        return {first: 1.0} | dict(zip(others, (float(t) for t in T), strict=True))


def _solved(rows: list[list[Fraction]]) -> list[Fraction | None]:
    """Solve linear equations by Gauss–Jordan elimination; the last column is the right side.

    Undetermined unknowns are None.

    Raises
    ------
    InputError
        If the equations contradict each other.
    """
    count = len(rows[0]) - 1
    pivots: dict[int, list[Fraction]] = {}
    for row in rows:
        for k, other in pivots.items():
            row = [x - row[k] * y for x, y in zip(row, other, strict=True)]
        k = next((k for k in range(count) if row[k]), None)
        if k is None:
            if row[-1]:
                raise InputError("meshes", "speeds contradict each other", "each shaft must have one speed")
            continue
        row = [x / row[k] for x in row]
        pivots = {n: [x - y[k] * z for x, z in zip(y, row, strict=True)] for n, y in pivots.items()} | {k: row}
    return [
        pivots[k][-1] if k in pivots and not any(pivots[k][n] for n in range(count) if n != k) else None
        for k in range(count)
    ]
