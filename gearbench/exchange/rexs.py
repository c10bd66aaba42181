"""Stages of REXS files, and their conversion to scenes.

Values missing in a file are derived (profile shifts from the centre distance), assumed with a note (basic rack ISO 53
A, steel), or required (all others). Flank modifications in the file are not read.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gearbench.errors import InputError, naming
from gearbench.exchange.rexs_document import Component, RexsDocument, read_document
from gearbench.exchange.rexs_gear import RexsGear, read_cutter_teeth, read_gear, read_material, read_outside, read_seat
from gearbench.exchange.rexs_planetary import PlanetaryStage, planetary_stages, planetary_tables
from gearbench.exchange.rexs_torque import Drive, check_case, drives
from gearbench.exchange.rexs_units import LENGTH
from gearbench.geometry.meshing import profile_shift_sum
from gearbench.geometry.pair import Pair
from gearbench.geometry.rack import STANDARD_FILLET_RADIUS
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene
from gearbench.schema import read

#: Effects in the scene of a stage; gear_body is added if the bores are known.
EFFECTS: dict[str, dict[str, Any]] = {
    "tooth_bending": {"model": "solid"},
    "hertz": {},
}
#: If the sum of the profile shifts is too large by less than this, the file has rounded them [normal modules].
ROUNDING = 1e-3
#: Minimum rim thickness for which the shaft diameter is used as the bore of the gear body [normal modules].
LEAST_RIM = 0.5


@dataclass(frozen=True)
class Stage:
    """A stage of a file.

    Parameters
    ----------
    number
        Number in the list of stages, from 1.
    component
        Component of the stage.
    gears
        ``gear_1`` and ``gear_2``; in a planetary stage, sun, first planet and ring.
    planetary
        The planetary stage; None for two gears.
    """

    number: int
    component: Component
    gears: tuple[Component, ...]
    planetary: PlanetaryStage | None = None


@dataclass(frozen=True)
class StageScene:
    """Tables of a scene file for a stage, and notes on values assumed, derived or left out."""

    stage: Stage
    tables: dict[str, Any]
    notes: tuple[str, ...]


def stages(document: RexsDocument) -> tuple[Stage, ...]:
    """List cylindrical stages with two gears, and planetary stages instead of their parts, in file order.

    Raises
    ------
    InputError
        If there are none.
    """
    sets = {part.id: each for each in planetary_stages(document) for part in each.parts}
    stages: list[Stage] = []
    for relation in document.relations:
        if relation.kind != "stage":
            continue
        names, first, second = (relation.ids(role) for role in ("stage", "gear_1", "gear_2"))
        if not (len(names) == len(first) == len(second) == 1):
            continue
        stage, one, two = (document.components[ids[0]] for ids in (names, first, second))
        if (owner := sets.get(stage.id)) is not None:
            if owner.component not in [each.component for each in stages]:
                stages.append(Stage(len(stages) + 1, owner.component, owner.gears, owner))
        elif stage.kind == "cylindrical_stage":
            stages.append(Stage(len(stages) + 1, stage, (one, two)))
    if not stages:
        raise InputError("relations", "no cylindrical stage", "must hold one with two gears", str(document.path))
    return tuple(stages)


def find_stage(document: RexsDocument, name: str | int | None) -> Stage:
    """Find a stage by its number in the list ("2"), or else by its id; "id:37" is always an id.

    Raises
    ------
    InputError
        If there is no such stage, or ``name`` is None and there are several.
    """
    all_stages = stages(document)
    known = ", ".join(f"{stage.number} (id {stage.component.id})" for stage in all_stages)
    if name is None:
        if len(all_stages) == 1:
            return all_stages[0]
        raise InputError("stage", "missing", f"choose one of {known}", str(document.path))
    text = str(name)
    for stage in () if text.startswith("id:") else all_stages:
        if text == str(stage.number):
            return stage
    for stage in all_stages:
        if text.removeprefix("id:") == str(stage.component.id):
            return stage
    raise InputError("stage", text, f"must be one of {known}", str(document.path))


def read_rexs(
    path: str | Path, stage: str | int | None = None, *, torque: float | None = None, load_case: int | None = None
) -> Scene:
    """Read the scene of a stage of a REXS file.

    Parameters
    ----------
    path
        ``.rexs`` or ``.rexsz``, versions 1.0 to 1.7.
    stage
        Number in the list of stages, from 1, or id; optional if there is only one stage.
    torque
        Torque on the driving gear [N·m]; by default from the loads in the file.
    load_case
        Number of the load case to read; by default the first.

    Raises
    ------
    InputError
        If the file or the stage cannot be read; names file, component and attribute.
    """
    document = read_document(path)
    return scene_of(document, stage_scene(document, find_stage(document, stage), torque=torque, load_case=load_case))


def scene_of(document: RexsDocument, stage_data: StageScene) -> Scene:
    """Make the scene of a stage; errors name file and stage."""
    if "load" not in stage_data.tables:
        drive = "its torque does not follow from the external loads: give it (--torque)"
        raise InputError(f"component {stage_data.stage.component.id}.torque", "missing", drive, str(document.path))
    with naming(document.path, below=f"stage {stage_data.stage.number}"):
        return parse_scene(stage_data.tables)


def pair_of(document: RexsDocument, stage_data: StageScene) -> Pair:
    """Make the pair of a stage (sun-planet in a set), for which no torque is needed; errors name file and stage."""
    if stage_data.stage.planetary is not None:
        return scene_of(document, replace(stage_data, tables={"load": {"torque": 1.0}, **stage_data.tables})).pair
    with naming(document.path, below=f"stage {stage_data.stage.number}.pair"):
        return read(Pair, stage_data.tables["pair"])


def stage_scene(
    document: RexsDocument, stage: Stage, *, torque: float | None = None, load_case: int | None = None
) -> StageScene:
    """Make the tables of a scene file for ``stage``; without ``[load]`` if no torque is known.

    Raises
    ------
    InputError
        If the stage cannot be read; names file, component and attribute.
    """
    with naming(document.path):
        return _stage_scene(document, stage, torque, load_case)


def _stage_scene(document: RexsDocument, stage: Stage, torque: float | None, load_case: int | None) -> StageScene:
    if stage.planetary is not None:
        return _set_scene(document, stage, stage.planetary, torque, load_case)
    notes: list[str] = []
    drive = drives(document, check_case(document, load_case)).get(stage.component.id)
    gears = _driver_first(stage, drive)
    pinion, wheel = (read_gear(document, gear) for gear in gears)
    _check_mates(pinion, wheel)
    distance = document.require(stage.component, "center_distance", LENGTH)
    centre_distance = math.copysign(distance, pinion.teeth + wheel.teeth) if pinion.sign * wheel.sign < 0 else distance
    pair: dict[str, Any] = {
        "normal_module": pinion.normal_module,
        "pressure_angle": pinion.pressure_angle,
        "helix_angle": abs(pinion.helix_angle),
        "face_width": min(pinion.face_width, wheel.face_width),
        "centre_distance": centre_distance,
    }
    given = _profile_shifts(pinion, wheel, centre_distance, notes)
    shifts = _all_shifts(given, _shift_sum(pinion, wheel, centre_distance))
    for name, gear, shift_given, x in zip(("pinion", "wheel"), (pinion, wheel), given, shifts, strict=True):
        pair[name] = _member(gear, shift_given, x)
        if gear.face_width > pair["face_width"]:
            pair[name]["face_width"] = gear.face_width
        if gear.teeth < 0 and (teeth := read_cutter_teeth(document, gear.component)):
            pair[name]["cutter"] = {"teeth": teeth}
    _note_rack((pinion, wheel), (pair["pinion"], pair["wheel"]), notes)
    _bores(document, (pinion, wheel), (pair["pinion"], pair["wheel"]), shifts, notes)
    _materials(document, gears, pair, notes)
    _note_modifications(document, notes)
    name = f"{document.path.name.split('.rexs')[0]} stage {stage.number}"
    effects = {effect: dict(table) for effect, table in EFFECTS.items()}
    if all({"bore_diameter", "outer_diameter"} & pair[role].keys() for role in ("pinion", "wheel")):
        effects["gear_body"] = {}
    tables: dict[str, Any] = {"name": name, "pair": pair, "effects": effects}
    if torque is not None:
        tables["load"] = {"torque": float(torque)}
    elif drive is not None:
        tables["load"] = {"torque": drive.torque}
    return StageScene(stage, tables, tuple(notes))


def _set_scene(
    document: RexsDocument, stage: Stage, of: PlanetaryStage, torque: float | None, load_case: int | None
) -> StageScene:
    """Make the tables of a planetary stage from those of its sun-planet and planet-ring pairs."""
    sun, planet, ring = stage.gears
    pairs = [
        _stage_scene(document, Stage(stage.number, component, gears), None, load_case)
        for component, gears in ((of.at_sun[0], (sun, planet)), (of.at_ring[0], (planet, ring)))
    ]
    one, two = (pair.tables["pair"] for pair in pairs)
    table, torque_of_file, more = planetary_tables(document, of, (one, two), check_case(document, load_case))
    effects = {effect: dict(keys) for effect, keys in EFFECTS.items()}
    sizes = (("sun", "bore_diameter"), ("planet", "bore_diameter"), ("ring", "outer_diameter"))
    if all(size in table[gear] for gear, size in sizes):
        effects["gear_body"] = {}
    tables: dict[str, Any] = {"name": pairs[0].tables["name"], "planetary": table, "effects": effects}
    if (known := torque if torque is not None else torque_of_file) is not None:
        tables["load"] = {"torque": float(known)}
    notes = dict.fromkeys(note for pair in pairs for note in pair.notes)
    return StageScene(stage, tables, (*notes, *more))


def _driver_first(stage: Stage, drive: Drive | None) -> tuple[Component, Component]:
    one, two = stage.gears[:2]
    return (two, one) if drive is not None and drive.gear == two.id else (one, two)


def _check_mates(one: RexsGear, two: RexsGear) -> None:
    """Refuse gears that cannot mesh on parallel axes."""
    key = f"{two.component.label}"
    mate = one.component.label
    if not math.isclose(one.normal_module, two.normal_module, rel_tol=1e-6):
        raise InputError(f"{key}.normal_module", two.normal_module, f"must be that of {mate}, {one.normal_module:g}")
    if not math.isclose(one.pressure_angle, two.pressure_angle, rel_tol=1e-6):
        raise InputError(f"{key}.normal_pressure_angle", two.pressure_angle, f"must be that of {mate}")
    internal = one.sign * two.sign < 0
    if not math.isclose(one.helix_angle, two.helix_angle * (1 if internal else -1), rel_tol=1e-6, abs_tol=1e-9):
        allowed = f"must be {'equal' if internal else 'opposite'} to that of {mate}, {one.helix_angle:g}°"
        raise InputError(f"{key}.helix_angle_reference_diameter", two.helix_angle, allowed)


def _shift_sum(one: RexsGear, two: RexsGear, centre_distance: float) -> float:
    """Sum x_1 + x_2 for zero backlash."""
    if abs(one.base_radius + two.base_radius) >= abs(centre_distance):
        return 0.0  # ``Pair`` will refuse this distance
    return profile_shift_sum((one, two), centre_distance)


def _profile_shifts(
    one: RexsGear, two: RexsGear, centre_distance: float, notes: list[str]
) -> tuple[float | None, float | None]:
    """Profile shifts from the file; the wheel's becomes None, to be derived, if rounding makes the teeth overlap."""
    x1, x2 = one.profile_shift, two.profile_shift
    if x1 is None or x2 is None:
        missing = [g.component.label for g, x in ((one, x1), (two, x2)) if x is None]
        notes.append(f"profile shift of {' and '.join(missing)} derived from the centre distance, without backlash")
        return x1, x2
    excess = x1 + x2 - _shift_sum(one, two, centre_distance)
    if not 0 < excess <= ROUNDING:
        return x1, x2
    notes.append(
        f"profile shift of {two.component.label} derived from the centre distance: the two given are rounded, "
        f"their sum {excess:.1e} above the one without backlash"
    )
    return x1, None


def _all_shifts(given: tuple[float | None, float | None], total: float) -> tuple[float, float]:
    x1, x2 = given
    if x1 is None and x2 is None:
        return total / 2, total / 2
    return (total - (x2 or 0.0) if x1 is None else x1), (total - (x1 or 0.0) if x2 is None else x2)


def _member(gear: RexsGear, shift: float | None, x: float) -> dict[str, Any]:
    """Table of one gear; values missing in the file get the defaults of a scene, ISO 53 A.

    Raises
    ------
    InputError
        If the tip circle lies inside the circle of the reference line, or the root circle outside of it.
    """
    circle = gear.pitch_radius + x * gear.normal_module
    for name, radius, side in (("tip", gear.tip_radius, 1), ("root", gear.root_radius, -1)):
        if radius is not None and side * (radius - circle) <= 0:
            limit = f"must be {'larger' if side * gear.sign > 0 else 'smaller'} than {2 * abs(circle):.4g} mm"
            raise InputError(
                f"{gear.component.label}.{name}_diameter", 2 * abs(radius), f"{limit}, the reference line's"
            )
    if gear.teeth < 0 and gear.root_radius is not None:
        own_root = {"root_diameter": 2 * abs(gear.root_radius)}
    else:
        own_root = {"dedendum": gear.dedendum(x)}
    sizes = {
        "profile_shift": shift,
        "addendum": gear.addendum(x),
        **own_root,
        "fillet_radius": gear.fillet_radius,
    }
    return {"teeth": gear.teeth} | {name: value for name, value in sizes.items() if value is not None}


def _note_rack(gears: tuple[RexsGear, ...], members: tuple[dict[str, Any], ...], notes: list[str]) -> None:
    for name, default in (("addendum", 1.0), ("dedendum", 1.25), ("fillet radius", STANDARD_FILLET_RADIUS)):
        key = name.replace(" ", "_")
        other = "root_diameter" if key == "dedendum" else key
        both = zip(gears, members, strict=True)
        without = [gear.component.label for gear, member in both if key not in member and other not in member]
        if without:
            notes.append(f"{name} of {' and '.join(without)} not in the file: {default} m_n assumed (ISO 53 A)")


def _bores(
    document: RexsDocument,
    gears: tuple[RexsGear, ...],
    members: tuple[dict[str, Any], ...],
    shifts: tuple[float, float],
    notes: list[str],
) -> None:
    """Add bores, and outsides of rings, from the shafts to ``members`` if the rim is thick enough; bodies need them."""
    for gear, member, x in zip(gears, members, shifts, strict=True):
        ring = gear.teeth < 0
        seat = (read_outside if ring else read_seat)(document, gear.component)
        dedendum = gear.dedendum(x)
        root = 2 * (gear.pitch_radius + gear.normal_module * (x - (1.25 if dedendum is None else dedendum)))
        key, name = ("outer_diameter", "outside") if ring else ("bore_diameter", "bore")
        if seat is not None and seat > 0 and root - gear.sign * seat > 2 * LEAST_RIM * gear.normal_module:
            member[key] = seat
            notes.append(f"{name} of {gear.component.label}: {seat:g} mm, from its shaft")
        elif ring:
            notes.append(f"outside of {gear.component.label} not known: give outer_diameter for its body")


def _materials(
    document: RexsDocument, gears: tuple[Component, Component], pair: dict[str, Any], notes: list[str]
) -> None:
    """Add the material to the tables of the pair, and of the wheel if it has another."""
    tables = [
        None if material is None else {"youngs_modulus": material[0], "poisson_ratio": material[1]}
        for material in (read_material(document, gear) for gear in gears)
    ]
    known = [table for table in tables if table is not None]
    if not known:
        notes.append("material not in the file: steel, 210 GPa, 0.3, assumed")
    pair["material"] = known[0] if known else {"youngs_modulus": 210.0, "poisson_ratio": 0.3}
    if known and known[-1] != known[0]:
        pair["wheel"]["material"] = known[-1]


def _note_modifications(document: RexsDocument, notes: list[str]) -> None:
    kinds = sorted({c.kind for c in document.components.values() if "modification" in c.kind or "deviation" in c.kind})
    if kinds:
        notes.append(f"not read: {', '.join(kinds)}")
