"""Table ``[planetary]`` of a file: the short form of a train of sun, planets and ring."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass as table

from gearbench.errors import InputError
from gearbench.geometry.linkage import Linkage, Motion
from gearbench.geometry.names import AT_RING, CARRIER, MEMBERS, PLANET, RING, SHARED, SUN
from gearbench.geometry.pair import Pair
from gearbench.geometry.planetary_members import PlanetaryDynamics
from gearbench.geometry.train import Train
from gearbench.schema import STRICT, as_table, read

#: Keys that give one deviation per planet.
DEVIATIONS = ("pin_tangential", "pin_radial", "planet_thickness", "planet_timing")
#: A given planet position this close to an angle at which the teeth fit is moved there [steps between these angles].
_NEAR = 2e-3

#: Deviation of a member [µm].
Deviation = Annotated[float, Field(ge=-1000.0, le=1000.0)]
Amplitude = Annotated[float, Field(gt=0.0, le=1000.0)]
#: Stiffness [N/µm].
Stiffness = Annotated[float, Field(gt=0.0, le=1e6)]


@table(frozen=True, kw_only=True, config=STRICT)
class PlanetaryRunOut:
    """Eccentricities that turn with their members; at the beginning of the revolution all point to the angle 0.

    Parameters
    ----------
    sun, ring, carrier, planet
        F_r, twice the eccentricity [µm]; a list for the planets.
    """

    sun: Deviation = 0.0
    ring: Deviation = 0.0
    carrier: Deviation = 0.0
    planet: tuple[Deviation, ...] = ()


@table(frozen=True, kw_only=True, config=STRICT)
class PlanetaryScatter:
    """Random errors of a set, independent, and symmetric about the values of the scene.

    Parameters
    ----------
    pin_tangential, pin_radial, planet_thickness, planet_timing
        f of each planet [µm]; errors are within ± f.
    sun_run_out, ring_run_out, carrier_run_out, planet_run_out
        F_r, twice the eccentricity [µm], uniform on [0, F_r] at a random phase.
    distribution
        Distribution within ± f: "normal_two_sided" (cut at 3 σ = f) or "uniform_two_sided".
    """

    pin_tangential: Amplitude | None = None
    pin_radial: Amplitude | None = None
    planet_thickness: Amplitude | None = None
    planet_timing: Amplitude | None = None
    sun_run_out: Amplitude | None = None
    ring_run_out: Amplitude | None = None
    carrier_run_out: Amplitude | None = None
    planet_run_out: Amplitude | None = None
    distribution: Literal["normal_two_sided", "uniform_two_sided"] = "normal_two_sided"


@table(frozen=True, kw_only=True, config=STRICT)
class Planetary:
    """A planetary set: a sun, planets on a carrier, a ring. The load is the torque on the sun.

    ``[planetary.sun]``, ``[planetary.planet]`` and ``[planetary.ring]`` hold the keys of a gear of the pair, and
    effects of its flanks; by default the ring has z_r = −(z_s + 2 z_p) teeth. Results name the gears sun, "planet 1",
    …, ring. With a positive torque the sun drives the planets, and these the ring, in the frame of the carrier; the
    choice of the held member only changes speeds. ``response`` takes the speed of the sun, or that of the carrier if
    the sun is held.

    Stepped planets carry a second gear, which meshes with the ring: ``[planetary.planet_at_ring]``, with the keys of a
    gear, and its own module and angles, which the ring shares. A tooth of the first gear is in line with a tooth of the
    second. Results name the second gears "planet 1 at ring", ….

    Parameters
    ----------
    normal_module, face_width
        m_n, and the default face width b of the gears [mm].
    centre_distance
        Distance of the planets from the axis [mm]; by default the mean of the reference distances of both meshes,
        m_n (z_s + |z_r|)/(4 cos β) if the planets are not stepped.
    pressure_angle, helix_angle
        α_n and β [°].
    planets
        Number of planets.
    positions
        Angles of the planets [°]; by default as evenly spaced as the teeth allow.
    held
        Member that stands still.
    floating
        Central members that move freely across the axis: "sun", "ring", "carrier".
    sun_support, ring_support, carrier_support
        Stiffness of an elastic support of the member across the axis [N/µm].
    pin_stiffness
        Stiffness of each pin with its bearing, equal in all directions across the axis [N/µm]; rigid by default.
    planet_torsional_stiffness
        Torsional stiffness of a stepped planet between its gears [N·m/rad]; rigid by default.
    pin_tangential, pin_radial
        Position error of each pin, in the sun's direction of rotation and outwards [µm].
    planet_thickness
        Deviation of the normal tooth thickness of each planet [µm].
    planet_timing
        Angle by which the second gear of each stepped planet is ahead of the first, in the planet's sense of rotation,
        as an arc on the reference circle of the second gear [µm].
    run_out
        Eccentric members, for load sharing over a revolution of the carrier relative to the ring.
    scatter
        Random errors.
    dynamics
        Masses, torsional supports and damping, for ``response``.
    """

    normal_module: Annotated[float, Field(ge=0.05, le=200.0)]
    face_width: Annotated[float, Field(gt=0.0, le=20000.0)]
    centre_distance: Annotated[float, Field(gt=0.0, le=20000.0)] | None = None
    pressure_angle: Annotated[float, Field(ge=5.0, le=40.0)] = 20.0
    helix_angle: Annotated[float, Field(ge=0.0, le=60.0)] = 0.0
    planets: Annotated[int, Field(ge=1, le=24)] = 3
    positions: tuple[Annotated[float, Field(ge=-360.0, le=360.0)], ...] | None = None
    held: Literal["ring", "sun", "carrier"] = RING
    floating: tuple[Literal["sun", "ring", "carrier"], ...] = ()
    sun_support: Stiffness | None = None
    ring_support: Stiffness | None = None
    carrier_support: Stiffness | None = None
    pin_stiffness: Stiffness | None = None
    planet_torsional_stiffness: Annotated[float, Field(gt=0.0, le=1e12)] | None = None
    pin_tangential: tuple[Deviation, ...] = ()
    pin_radial: tuple[Deviation, ...] = ()
    planet_thickness: tuple[Deviation, ...] = ()
    planet_timing: tuple[Deviation, ...] = ()
    run_out: PlanetaryRunOut | None = None
    scatter: PlanetaryScatter | None = None
    dynamics: PlanetaryDynamics = PlanetaryDynamics()

    def __post_init__(self) -> None:
        if self.positions == ():
            raise InputError("positions", [], "must hold at least one angle, or be left out")
        for name in DEVIATIONS:
            if (given := getattr(self, name)) and len(given) != self.number:
                raise InputError(name, f"{len(given)} numbers", f"must be one for each of the {self.number} planets")
        if self.run_out is not None and len(self.run_out.planet) not in (0, self.number):
            given = f"{len(self.run_out.planet)} numbers"
            raise InputError("run_out.planet", given, f"must be one for each of the {self.number} planets")
        for name in (SUN, RING, CARRIER):
            if name in self.floating and getattr(self, f"{name}_support") is not None:
                raise InputError("floating", name, f"conflicts with {name}_support: give one of the two")

    @property
    def number(self) -> int:
        """Number of planets."""
        return self.planets if self.positions is None else len(self.positions)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the planets."""
        return tuple(f"planet {n + 1}" for n in range(self.number))

    def motions(self) -> tuple[Motion, ...]:
        """Free translations of members, in addition to the rotations of the shafts."""
        supports: list[tuple[str, tuple[str, ...], float]] = []
        for name in (SUN, RING, CARRIER):
            support = getattr(self, f"{name}_support")
            if name in self.floating or support is not None:
                supports.append((name, (name, *(self.names if name == CARRIER else ())), support or 0.0))
        if self.pin_stiffness is not None:
            supports += [(name, (name,), self.pin_stiffness) for name in self.names]
        return tuple(
            Motion(name=f"{name} {axis}", moved=tuple((body, axis) for body in bodies), stiffness=1e3 * stiffness)
            for name, bodies, stiffness in supports
            for axis in "xy"
        )

    def each(self, name: str) -> tuple[float, ...]:
        """Deviation ``name`` of each planet [µm]; 0 if not given."""
        return getattr(self, name) or (0.0,) * self.number


@dataclass(frozen=True, kw_only=True)
class PlanetarySet:
    """A planetary set with known tooth numbers.

    Parameters
    ----------
    keys
        The table ``[planetary]``.
    teeth
        z_s, z_p of the gear at the sun, z_q of the gear at the ring (z_p if not stepped), z_r.
    modules
        Transverse modules of the meshes with sun and ring [mm].
    stepped
        Whether the planets carry two gears.
    """

    keys: Planetary
    teeth: tuple[int, int, int, int]
    modules: tuple[float, float]
    stepped: bool = False

    @property
    def steps(self) -> int:
        """Number of angles around the axis at which the teeth of a planet fit: z_s + |z_r| if not stepped.

        Equation (M5) of docs/theory.md.
        """
        z_s, z_p, z_q, z_r = self.teeth
        return (z_s * z_q - z_r * z_p) // math.gcd(z_p, z_q)

    @property
    def centre_distance(self) -> float:
        """Distance of the planets from the axis [mm]."""
        z_s, z_p, z_q, z_r = self.teeth
        return self.keys.centre_distance or (self.modules[0] * (z_s + z_p) - self.modules[1] * (z_r + z_q)) / 4

    @property
    def angles(self) -> tuple[float, ...]:
        """Angles of the planets [rad]: by default multiples of 360° over ``steps``, where teeth fit; else as given."""
        if self.keys.positions is None:
            even = (Fraction(n * self.steps, self.keys.planets) for n in range(self.keys.planets))
            return tuple(2 * math.pi * math.ceil(step - Fraction(1, 2)) / self.steps for step in even)
        given = [angle * self.steps / 360.0 for angle in self.keys.positions]
        return tuple(2 * math.pi * (round(x) if abs(x - round(x)) < _NEAR else x) / self.steps for x in given)

    @property
    def fitting(self) -> str:
        """Text for messages: the angles at which teeth fit."""
        return f"they fit at steps of 360°/{self.steps} = {360 / self.steps:.6g}° from the first planet"

    @property
    def second_gears(self) -> dict[str, str]:
        """Second gear of each stepped planet → the planet."""
        return {f"{name} at ring": name for name in self.keys.names} if self.stepped else {}

    @property
    def axes(self) -> dict[str, tuple[float, float]]:
        """Gear → (x, y) of its axis in the frame of the carrier [mm]."""
        a = self.centre_distance
        planets = {
            name: (a * math.cos(x), a * math.sin(x)) for name, x in zip(self.keys.names, self.angles, strict=True)
        }
        return {SUN: (0.0, 0.0), RING: (0.0, 0.0)} | planets

    @property
    def spacing_error(self) -> float:
        """Largest deviation of a planet from even spacing, counted from the first planet [°]."""
        angles = np.sort(np.mod(np.subtract(self.angles, self.angles[0]), 2 * math.pi))
        return float(np.degrees(np.abs(angles - 2 * math.pi * np.arange(len(angles)) / len(angles)).max()))

    def share_that_adds_up(self, sun_teeth: int, waves: int) -> float:
        """Share of the first mesh harmonic that adds up over the planets, as torsion (``waves`` 0) or radial force (1).

        It is 1 if the forces of all planets add up, and 0 if they cancel.
        """
        orders = [sun_teeth + waves, sun_teeth - waves]
        return float(np.abs(np.exp(1j * np.outer(orders, self.angles)).mean(axis=1)).max())

    def room(self, pairs: Iterable[Pair]) -> float:
        """Smallest clearance [mm] between the tips of neighbouring planets in the ``pairs``; negative: they collide."""
        tip_radius = max(pair.gears[0 if pair.is_internal else 1].tip_radius for pair in pairs)
        angles = np.sort(np.mod(self.angles, 2 * math.pi))
        least_angle = np.diff(angles, append=angles[0] + 2 * math.pi).min() if self.keys.number > 1 else math.pi
        return 2 * self.centre_distance * math.sin(min(least_angle, math.pi) / 2) - 2 * tip_radius

    def check(self, pairs: Iterable[Pair]) -> None:
        """Refuse planets that collide, in the ``pairs`` of the meshes.

        Raises
        ------
        InputError
            With the overlap, if planets collide.
        """
        if (room := self.room(pairs)) <= 0:
            key = "planets" if self.keys.positions is None else "positions"
            allowed = f"planets collide: their tips overlap by {-room:.4g} mm"
            raise InputError(f"planetary.{key}", getattr(self.keys, key), allowed)

    def linkage(self, train: Train, *, coast: bool) -> Linkage:
        """Coupling of the meshes."""
        keys, k = self.keys, self.keys.planet_torsional_stiffness
        return Linkage(
            train=train,
            additional_motions=keys.motions(),
            carrier=CARRIER,
            carried=keys.names,
            coast=coast,
            twisted={} if k is None else dict.fromkeys(self.second_gears, 1e3 * k),
        )

    def modes(self, linkage: Linkage) -> dict[str, NDArray]:
        """Name of a deviation → approach of each mesh due to 1 µm of it, (mesh,) [mm].

        Deviations of planets are named by key and planet ("pin_radial planet 1"), displacements of bodies from their
        axes "sun x" and so on.
        """
        train, meshes = linkage.train, linkage.train.meshes
        sense = train.turn(meshes[0].name)
        modes = {}
        for name, angle in zip(self.keys.names, self.angles, strict=True):
            outwards = np.array([math.cos(angle), math.sin(angle)])
            ahead = sense * np.array([-outwards[1], outwards[0]])
            modes[f"pin_tangential {name}"] = 1e-3 * linkage.displaced({name: ahead})
            modes[f"pin_radial {name}"] = 1e-3 * linkage.displaced({name: outwards})
            # each flank gets half of the thickness deviation, projected on the line of action
            flanks = ((name in map(train.shaft, mesh.gears), mesh.pair.gears[0]) for mesh in meshes)
            half = [on_flank * math.cos(gear.alpha_t) / math.cos(gear.beta) / 2 for on_flank, gear in flanks]
            modes[f"planet_thickness {name}"] = 1e-3 * np.array(half)
            turns = [train.turn(m.name) * (m.driven == RING) / m.pair.gears[0].pitch_radius for m in meshes]
            modes[f"planet_timing {name}"] = (
                1e-3 * np.array(turns) * linkage.of_bodies[:, linkage.bodies.index(name), 2]
            )
        for name in (SUN, RING, CARRIER, *self.keys.names):
            for axis, direction in zip("xy", np.eye(2), strict=True):
                bodies = self.keys.names if name == CARRIER else (name,)
                modes[f"{name} {axis}"] = 1e-3 * linkage.displaced(dict.fromkeys(bodies, direction))
        return modes

    @property
    def eccentricities(self) -> dict[str, float]:
        """Eccentricity of each eccentric member [µm]."""
        run_out = self.keys.run_out or PlanetaryRunOut()
        planets = zip(self.keys.names, run_out.planet or (0.0,) * self.keys.number, strict=True)
        amounts = {SUN: run_out.sun, RING: run_out.ring, CARRIER: run_out.carrier} | dict(planets)
        return {name: amount / 2 for name, amount in amounts.items() if amount}

    def offset(self, linkage: Linkage) -> NDArray:
        """Approach at time 0 due to deviations of the planets and run-out, (mesh,) [mm]."""
        modes, approach = self.modes(linkage), np.zeros(len(linkage.train.meshes))
        for key in DEVIATIONS:
            for name, amount in zip(self.keys.names, self.keys.each(key), strict=True):
                approach += amount * modes[f"{key} {name}"]
        for name, amount in self.eccentricities.items():
            approach += amount * modes[f"{name} x"]
        return approach


def _of_planet(table: Mapping[str, Any], number: int) -> dict[str, Any]:
    """Table of one planet: random pitch errors get the seed of the first planet plus ``number``."""
    pitch = table.get("random_pitch")
    if not isinstance(pitch, Mapping) or not isinstance(pitch.get("seed", 0), int):
        return dict(table)
    return {**table, "random_pitch": {**pitch, "seed": pitch.get("seed", 0) + number}}


def expanded(given: Any) -> tuple[PlanetarySet, dict[str, Any]]:
    """Read a table ``[planetary]``: the set, and the equivalent tables "gears" and "meshes".

    Raises
    ------
    InputError
        If a key is missing or wrong; the error names the key.
    """
    table_of_set = dict(as_table("planetary", given))
    members = {}
    for name in MEMBERS:
        if name == AT_RING and name not in table_of_set:
            continue
        if name not in table_of_set:
            raise InputError(f"planetary.{name}", "missing", "is required: a table with the keys of a gear")
        members[name] = dict(as_table(f"planetary.{name}", table_of_set.pop(name)))
        for key in ("shaft",) if name == AT_RING else (*SHARED, "shaft"):
            if key in members[name]:
                raise InputError(f"planetary.{name}.{key}", members[name][key], "is not for a single gear of a set")
        teeth = members[name].get("teeth", "missing")
        if name != RING and (not isinstance(teeth, int) or teeth < 1):
            raise InputError(f"planetary.{name}.teeth", str(teeth), "must be a whole number, 1 or more")
    keys, stepped = read(Planetary, table_of_set, "planetary"), AT_RING in members
    only_stepped = {key: getattr(keys, key) for key in ("planet_timing", "planet_torsional_stiffness")}
    only_stepped["scatter.planet_timing"] = keys.scatter and keys.scatter.planet_timing
    if alone := [key for key, value in only_stepped.items() if value and not stepped]:
        raise InputError(f"planetary.{alone[0]}", "given", "is for stepped planets: give planetary.planet_at_ring too")
    second = {key: members[AT_RING].pop(key) for key in SHARED if key in members.get(AT_RING, {})}
    at_ring = read(Planetary, table_of_set | second, f"planetary.{AT_RING}") if stepped else keys
    m_s, m_r = (each.normal_module / math.cos(math.radians(each.helix_angle)) for each in (keys, at_ring))
    z_s, z_p, z_q = (members[name]["teeth"] for name in (SUN, PLANET, AT_RING if stepped else PLANET))
    z_r = members[RING].setdefault("teeth", -(round((z_s + z_p) * m_s / m_r) + z_q))
    if not isinstance(z_r, int) or z_r >= 0:
        raise InputError("planetary.ring.teeth", z_r, "must be negative: an internal gear (ISO 21771)")
    if "planets" in table_of_set and keys.planets != keys.number:
        allowed = f"conflicts with positions of {keys.number} planets: give one of the two"
        raise InputError("planetary.planets", keys.planets, allowed)
    at_sun, at_ring_mesh = ({key: getattr(each, key) for key in (*SHARED, "face_width")} for each in (keys, at_ring))
    planetary_set = PlanetarySet(keys=keys, teeth=(z_s, z_p, z_q, z_r), modules=(m_s, m_r), stepped=stepped)
    gears: dict[str, Mapping[str, Any]] = {SUN: {**at_sun, **members[SUN]}}
    gears |= {name: {**at_sun, **_of_planet(members[PLANET], n)} for n, name in enumerate(keys.names)}
    seconds = enumerate(planetary_set.second_gears.items())
    gears |= {name: {**at_ring_mesh, "shaft": on, **_of_planet(members[AT_RING], n)} for n, (name, on) in seconds}
    gears[RING] = {**at_ring_mesh, **members[RING]}
    a = planetary_set.centre_distance
    meshes = [{"driver": SUN, "driven": name, "centre_distance": a} for name in keys.names]
    drivers = planetary_set.second_gears or keys.names
    meshes += [{"driver": name, "driven": RING, "centre_distance": a} for name in drivers]
    return planetary_set, {"gears": gears, "meshes": meshes}
