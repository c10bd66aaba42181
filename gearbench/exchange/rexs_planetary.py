"""Planetary stages of REXS files with one sun, equal planets and one ring, read as ``[planetary]``.

Other planetary stages (stepped planets, several suns, no ring) are read as separate pairs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearbench.errors import InputError
from gearbench.exchange.rexs_document import Component, RexsDocument
from gearbench.exchange.rexs_torque import loads_of
from gearbench.exchange.rexs_units import LENGTH, NUMBER, STIFFNESS

#: Tolerance for planets to count as evenly spaced [rad].
EVEN = 1e-4
#: Default material of a scene, which is not written into its tables [GPa, –].
STEEL = {"youngs_modulus": 210.0, "poisson_ratio": 0.3}
#: Radial stiffness from which a bearing counts as rigid [N/µm].
RIGID = 1e6


@dataclass(frozen=True, kw_only=True)
class PlanetaryStage:
    """Planetary stage of a file.

    Parameters
    ----------
    component
        Component of the stage.
    sun, planets, ring
        Components of the gears.
    at_sun, at_ring
        Cylindrical stages sun-planet and planet-ring, in the order of the planets.
    """

    component: Component
    sun: Component
    planets: tuple[Component, ...]
    ring: Component
    at_sun: tuple[Component, ...]
    at_ring: tuple[Component, ...]

    @property
    def parts(self) -> tuple[Component, ...]:
        """All cylindrical stages, in the order of the meshes of a scene."""
        return (*self.at_sun, *self.at_ring)

    @property
    def gears(self) -> tuple[Component, ...]:
        """Sun, first planet and ring."""
        return self.sun, self.planets[0], self.ring


def planetary_stages(document: RexsDocument) -> tuple[PlanetaryStage, ...]:
    """Find the planetary stages with one sun, planets of equal tooth counts, and one ring."""
    meshes = {
        relation.ids("stage")[0]: [document.components[relation.ids(role)[0]] for role in ("gear_1", "gear_2")]
        for relation in document.relations
        if relation.kind == "stage" and all(len(relation.ids(role)) == 1 for role in ("stage", "gear_1", "gear_2"))
    }
    sets = []
    for component in document.of_kind("planetary_stage"):
        parts = document.related("assembly", "assembly", component.id, "part")
        parts_of_set = [part for part in parts if part.kind == "cylindrical_stage" and part.id in meshes]
        internal = {part.id: part for part in parts_of_set if any(gear.kind == "ring_gear" for gear in meshes[part.id])}
        external = {part.id: part for part in parts_of_set if part.id not in internal}
        rings = {gear.id: gear for number in internal for gear in meshes[number] if gear.kind == "ring_gear"}
        planets = {gear.id: gear for number in internal for gear in meshes[number] if gear.id not in rings}
        suns = {gear.id: gear for number in external for gear in meshes[number] if gear.id not in planets}
        teeth = {document.number(planet, "number_of_teeth", NUMBER) for planet in planets.values()}
        if not (len(suns) == len(rings) == len(teeth) == 1 and len(internal) == len(external) == len(planets)):
            continue
        at_sun, at_ring = (
            tuple(
                part for planet in planets for part in side.values() if planet in [gear.id for gear in meshes[part.id]]
            )
            for side in (external, internal)
        )
        if len(at_sun) == len(at_ring) == len(planets):
            one, ring = next(iter(suns.values())), next(iter(rings.values()))
            every = tuple(planets.values())
            sets.append(
                PlanetaryStage(component=component, sun=one, planets=every, ring=ring, at_sun=at_sun, at_ring=at_ring)
            )
    return tuple(sets)


def planetary_tables(
    document: RexsDocument, stage: PlanetaryStage, pairs: tuple[Mapping[str, Any], Mapping[str, Any]], case: int | None
) -> tuple[dict[str, Any], float | None, list[str]]:
    """Make the table ``[planetary]`` from those of both pairs; return it, the torque on the sun if known, and notes."""
    at_sun, at_ring = pairs
    notes: list[str] = []
    gears = {"sun": dict(at_sun["pinion"]), "planet": dict(at_sun["wheel"]), "ring": dict(at_ring["wheel"])}
    materials = (at_sun["material"], at_sun["wheel"].get("material"), at_ring["wheel"].get("material"))
    ring_material = materials[2] or at_ring["material"]
    for gear, material, component in zip(
        gears.values(), (materials[0], materials[1] or materials[0], ring_material), stage.gears, strict=True
    ):
        gear.pop("material", None)
        gear |= {} if material == STEEL else {"material": dict(material)}
        gear["face_width"] = document.require(component, "face_width", LENGTH)
    shared = ("normal_module", "pressure_angle", "helix_angle", "centre_distance")
    width = gears["planet"].pop("face_width")
    for gear in (gears["sun"], gears["ring"]):
        if gear["face_width"] == width:
            del gear["face_width"]
    table: dict[str, Any] = {key: at_sun[key] for key in shared} | {"face_width": width}
    table |= {"planets": len(stage.planets)} | _positions(document, stage)
    table["held"] = _held(document, stage, notes)
    planet_shafts = document.related("assembly", "part", stage.planets[0].id, "assembly")
    if pins := _radial(document, [joint for shaft in planet_shafts for joint, _ in _beside(document, shaft)]):
        table["pin_stiffness"] = pins
    table |= _supports(document, stage, notes)
    return table | gears, _torque(document, stage, table["held"], case), notes


def _shafts(document: RexsDocument, stage: PlanetaryStage) -> dict[str, list[Component]]:
    """Central member → its shafts."""
    shafts = {
        name: document.related("assembly", "part", gear.id, "assembly")
        for name, gear in (("sun", stage.sun), ("ring", stage.ring))
    }
    carrier = document.related("planet_carrier_shaft", "planetary_stage", stage.component.id, "shaft")
    return shafts | {"carrier": carrier}


def _beside(document: RexsDocument, shaft: Component) -> list[tuple[Component, Component]]:
    """Connections of a shaft: bearings or couplings, with the part on the other side."""
    neighbours = []
    for relation in document.relations:
        ids = {role: relation.ids(role) for role in ("outer_part", "inner_part", "assembly")}
        if relation.kind == "side" and all(ids.values()):
            ends = [ids["outer_part"][0], ids["inner_part"][0]]
            if shaft.id in ends:
                other = ends[1 - ends.index(shaft.id)]
                neighbours.append((document.components[ids["assembly"][0]], document.components[other]))
    return neighbours


def _held(document: RexsDocument, stage: PlanetaryStage, notes: list[str]) -> str:
    """Find the member that a coupling joins to the casing; the ring if there is none."""
    for name, shafts in _shafts(document, stage).items():
        for shaft in shafts:
            for joint, other in _beside(document, shaft):
                if "coupling" in joint.kind and other.kind == "gear_casing":
                    return name
    notes.append("no member is coupled to the casing: the ring is taken to be held")
    return "ring"


def _radial(document: RexsDocument, joints: list[Component]) -> float | None:
    """Total radial stiffness of the bearings among the joints [N/µm]; None if they are rigid, or there are none."""
    bearings = [joint for joint in joints if "bearing" in joint.kind]
    total = sum(document.number(each, "radial_stiffness", STIFFNESS) or math.inf for each in bearings)
    return total if 0 < total < RIGID else None


def _supports(document: RexsDocument, stage: PlanetaryStage, notes: list[str]) -> dict[str, Any]:
    """Supports of the central members; the sun floats if only the others are connected to the casing."""
    joints = {
        name: [joint for shaft in shafts for joint, other in _beside(document, shaft) if other.kind == "gear_casing"]
        for name, shafts in _shafts(document, stage).items()
    }
    table: dict[str, Any] = {}
    for name, bearings in joints.items():
        if (stiffness := _radial(document, bearings)) is not None:
            table[f"{name}_support"] = stiffness
    if any(joints.values()) and not joints["sun"]:
        table["floating"] = ["sun"]
        notes.append("the sun has no bearing: it floats")
    return table


def _positions(document: RexsDocument, stage: PlanetaryStage) -> dict[str, Any]:
    """Key "positions" with the angles of the planets from the first one [°]; no key if they are evenly spaced."""
    try:
        centre, *places = (document.vector(gear, "support_vector")[1:] for gear in (stage.sun, *stage.planets))
    except InputError:
        return {}
    way = np.array(places) - centre
    angle = np.arctan2(way[:, 1], way[:, 0])
    angle = (angle - angle[0]) % (2 * math.pi)
    even = 2 * math.pi * np.arange(len(angle)) / len(angle)
    if np.allclose(np.sort(angle), even, atol=EVEN) or np.allclose(np.sort(-angle % (2 * math.pi)), even, atol=EVEN):
        return {}
    return {"positions": np.degrees(angle).round(6).tolist()}


def _torque(document: RexsDocument, stage: PlanetaryStage, held: str, case: int | None) -> float | None:
    """Torque on the sun that balances the only load of the stage [N·m]; None without a load or with several."""
    z_s, z_r = (document.require(gear, "number_of_teeth", NUMBER) for gear in (stage.sun, stage.ring))
    share = {"sun": 1.0, "ring": abs(z_s / z_r), "carrier": abs(z_s) / (abs(z_s) + abs(z_r))}
    shafts = {shaft.id: name for name, own in _shafts(document, stage).items() for shaft in own}
    known = [(load, shafts[load.shaft]) for load in loads_of(document, case) if load.shaft in shafts and load.torque]
    known = [each for each in known if each[1] != held]
    chosen = [each for each in known if each[0].defines] or known
    return chosen[0][0].torque * share[chosen[0][1]] if len(chosen) == 1 else None
