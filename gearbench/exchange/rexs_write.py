"""Writer of a pair or a planetary set as a REXS 1.1 file: stages, gears, shafts, load; carrier and bearings of sets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ElementTree, SubElement, indent

from gearbench.errors import InputError
from gearbench.exchange import PLAIN
from gearbench.files import check_target, replacing
from gearbench.geometry.cutter import standard_cutter
from gearbench.geometry.names import CARRIER, PAIR, RING, SUN
from gearbench.geometry.planetary import PlanetarySet
from gearbench.geometry.train import Mesh, Train
from gearbench.scene import Scene

#: REXS version of the files, and stiffness that represents a rigid connection [N/m].
VERSION, STIFF = "1.1", 1e20
#: Keys of a set, a pair and a gear that are not written.
_SET_KEYS = ("pin_tangential", "pin_radial", "planet_thickness", "run_out", "scatter")
_PAIR_KEYS = ("centre_distance_upper", "centre_distance_lower", "temperature")
_GEAR_KEYS = (
    "support", "rim_thickness", "web_thickness", "web_offset", "hub_diameter", "tip_rounding", "tip_chamfer",
    "axial_offset", "protuberance", "grinding_stock",
)  # fmt: skip


class _Model:
    """XML model with components and relations, numbered in the order they are added."""

    def __init__(self) -> None:
        self.root = Element("model", applicationId="gearbench", version=VERSION)
        self.relations, self.components = SubElement(self.root, "relations"), SubElement(self.root, "components")
        self.kinds: dict[int, str] = {}

    def component(self, kind: str, name: str = "", **attributes: Any) -> int:
        """Add a component; an attribute is a text or number, or a tuple of a number or vector and its unit."""
        number = len(self.kinds) + 1
        self.kinds[number] = kind
        element = SubElement(self.components, "component", id=str(number), type=kind, name=name)
        for key, given in attributes.items():
            value, unit = given if isinstance(given, tuple) else (given, "none")
            attribute = SubElement(element, "attribute", id=key, unit=unit)
            if isinstance(value, Sequence) and not isinstance(value, str):
                array = SubElement(attribute, "array")
                for each in value:
                    SubElement(array, "c").text = repr(float(each))
            else:
                attribute.text = value if isinstance(value, str) else repr(value)
        return number

    def relate(self, kind: str, **roles: int) -> None:
        """Add a relation between components, given by role."""
        relation = SubElement(self.relations, "relation", id=str(len(self.relations) + 1), type=kind)
        for role, number in roles.items():
            SubElement(relation, "ref", id=str(number), role=role, hint=self.kinds[number])


def write_rexs(scene: Scene, target: str | Path) -> tuple[Path, tuple[str, ...]]:
    """Write the pair or planetary set of a scene as a REXS file; return the file, and notes on what is not written.

    Raises
    ------
    InputError
        If the scene is another train, or the target cannot be written.
    """
    target = check_target(target)
    if not target.name.lower().endswith(PLAIN):
        raise InputError("output", str(target), "must end in .rexs")
    short = scene.planetary
    if scene.train is not None and short is None:
        raise InputError("meshes", "given", "only pairs and planetary sets can be written as REXS files")
    if short is not None and short.stepped:
        raise InputError(
            "planetary.planet_at_ring", "given", "sets with stepped planets cannot be written as REXS files"
        )
    train = Train(meshes=(Mesh(pair=scene.pair),)) if short is None else scene.geometry
    model = _Model()
    unit, casing = model.component("gear_unit", scene.name), model.component("gear_casing")
    model.relate("assembly", assembly=unit, part=casing)
    shafts: dict[str, int] = {}
    if short is None:
        assembly = unit
    else:
        assembly = model.component("planetary_stage", scene.name)
        model.relate("assembly", assembly=unit, part=assembly)
        shafts = _members(model, short, assembly, casing)
    gears = _gears(model, train, shafts)
    if short is not None:
        _planets(model, short, assembly, shafts)
    for mesh in train.meshes:
        part = model.component("cylindrical_stage", mesh.name, center_distance=(abs(mesh.pair.centre_distance), "mm"))
        model.relate("assembly", assembly=assembly, part=part)
        model.relate("stage", stage=part, gear_1=gears[mesh.driver], gear_2=gears[mesh.driven])
    load = model.component(
        "external_load",
        torque_around_u_axis=(abs(scene.load.torque), "N m"),
        transmits_torque="true",
        defines_torque="true",
    )
    model.relate("assembly", assembly=shafts[train.meshes[0].driver], part=load)
    indent(model.root)
    with replacing(target) as part:
        ElementTree(model.root).write(part, encoding="utf-8", xml_declaration=True)
    return target, _left_out(scene, train, short)


def _members(model: _Model, short: PlanetarySet, stage: int, casing: int) -> dict[str, int]:
    """Add the carrier and the shafts of sun, ring and carrier; return the shafts by name."""
    carrier = model.component("planet_carrier")
    model.relate("assembly", assembly=stage, part=carrier)
    shafts = {name: _central(model, short, name, casing) for name in (SUN, RING, CARRIER)}
    for name in (SUN, RING):
        model.relate("central_shaft", planetary_stage=stage, shaft=shafts[name])
    model.relate("planet_carrier_shaft", planetary_stage=stage, shaft=shafts[CARRIER])
    return shafts


def _central(model: _Model, short: PlanetarySet, name: str, casing: int) -> int:
    """Add the shaft of a central member, with a coupling to the casing if held, and a bearing unless floating."""
    shaft = model.component("shaft", name, support_vector=([0.0, 0.0, 0.0], "mm"))
    if name == short.keys.held:
        joint = model.component("coupling", f"{name} held", rotational_stiffness=(STIFF, "N mm / rad"))
        model.relate("side", outer_part=casing, inner_part=shaft, assembly=joint)
    if name not in short.keys.floating:
        given = getattr(short.keys, f"{name}_support")
        radial = STIFF if given is None else 1e6 * given
        joint = model.component("concept_bearing", f"{name} bearing", radial_stiffness=(radial, "N / m"))
        model.relate("side", outer_part=casing, inner_part=shaft, assembly=joint)
    return shaft


def _gears(model: _Model, train: Train, shafts: dict[str, int]) -> dict[str, int]:
    """Add the gears with flanks, tools and materials, and ``shafts`` that are missing; return the gears by name."""
    numbers: dict[str, int] = {}
    hands = train.hands({mesh.name: "right" for mesh in train.meshes})
    for mesh in train.meshes:
        for index, (name, gear) in enumerate(zip(mesh.gears, mesh.pair.gears, strict=True)):
            if name in numbers:
                continue
            place = train.places[train.shaft(name)]
            sense = 1 if hands[mesh.name] == "right" else -1
            if index == 1 and not mesh.pair.is_internal:
                sense = -sense
            numbers[name] = number = model.component(
                "ring_gear" if gear.teeth < 0 else "cylindrical_gear",
                name,
                number_of_teeth=abs(gear.teeth),
                normal_module=(gear.normal_module, "mm"),
                face_width=(gear.face_width, "mm"),
                helix_angle_reference_diameter=(sense * math.degrees(gear.beta) or 0.0, "°"),
                tip_diameter=(2 * abs(gear.tip_radius), "mm"),
                root_diameter=(2 * abs(gear.root_radius), "mm"),
                u_coordinate_on_shaft=(0.0, "mm"),
                support_vector=([0.0, *place], "mm"),
            )
            flanks = [
                model.component(
                    "flank_geometry",
                    normal_pressure_angle=(mesh.pair.pressure_angle, "°"),
                    addendum_modification_coefficient=gear.profile_shift,
                )
                for _ in range(2)
            ]
            model.relate("flank", gear=number, left=flanks[0], right=flanks[1])
            member = mesh.pair.members[index]
            if gear.teeth < 0:
                teeth = (member.cutter or standard_cutter(gear.teeth)).teeth
                cutter = {"tip_radius_factor": gear.fillet_radius, "number_of_teeth": teeth}
                tool = model.component("cutter_wheel_tool", **cutter)
            else:
                tool = model.component("rack_shaped_tool", tip_radius_factor=gear.fillet_radius)
            model.relate("ordered_reference", origin=number, referenced=tool)
            material_of_gear = mesh.pair.materials[index]
            modulus = (1e3 * material_of_gear.youngs_modulus, "N / mm^2")
            material = model.component(
                "material", elastic_modulus=modulus, poisson_ratio=material_of_gear.poisson_ratio
            )
            model.relate("reference", origin=number, referenced=material)
            if name not in shafts:
                shafts[name] = model.component("shaft", name, support_vector=([0.0, *place], "mm"))
            model.relate("assembly", assembly=shafts[name], part=number)
            if seat := member.outer_diameter if gear.teeth < 0 else member.bore_diameter:
                section = model.component(
                    "shaft_section",
                    u_coordinate_on_shaft=(-gear.face_width / 2, "mm"),
                    length=(gear.face_width, "mm"),
                    outer_diameter_begin=(seat, "mm"),
                    outer_diameter_end=(seat, "mm"),
                )
                model.relate("assembly", assembly=shafts[name], part=section)
    return numbers


def _planets(model: _Model, short: PlanetarySet, stage: int, shafts: dict[str, int]) -> None:
    """Add the pins of the planets with their bearings."""
    stiffness = STIFF if short.keys.pin_stiffness is None else 1e6 * short.keys.pin_stiffness
    for name in short.keys.names:
        pin = model.component("shaft", f"pin of {name}", support_vector=([0.0, *short.axes[name]], "mm"))
        bearing = model.component("concept_bearing", f"bearing of {name}", radial_stiffness=(stiffness, "N / m"))
        model.relate("side", outer_part=shafts[name], inner_part=pin, assembly=bearing)
        model.relate("planet_pin", planetary_stage=stage, shaft=pin)
        model.relate("planet_shaft", planetary_stage=stage, shaft=shafts[name])


def _left_out(scene: Scene, train: Train, short: PlanetarySet | None) -> tuple[str, ...]:
    left = [key for key in ("loads", "operation", "system") if getattr(scene, key)]
    if scene.load.coast:
        left.append("the sign of load.torque")
    if short is not None:
        left += [f"planetary.{key}" for key in _SET_KEYS if getattr(short.keys, key)]
    table = PAIR if short is None else "planetary"
    for mesh in train.meshes:
        left += [f"{table}.{key}" for key in _PAIR_KEYS if getattr(mesh.pair, key)]
        for name, member in zip(mesh.gears, mesh.pair.members, strict=True):
            gear = f"{table}.{name.split()[0]}"  # planets are alike
            left += [f"{gear}.{key}" for key in _GEAR_KEYS if getattr(member, key)]
            left += [f"{gear}.cutter.profile_shift"] if member.cutter and member.cutter.profile_shift else []
    left += sorted({f"effects.{effect.name}" for mesh in scene.meshes.values() for effect in mesh.effects})
    return (f"not written: {', '.join(dict.fromkeys(left))}",) if left else ()
