"""Shafts and bearings of a REXS file: scene of a stage with the other stages as further meshes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from gearbench.errors import InputError, naming
from gearbench.exchange.rexs import Stage, find_stage, scene_of, stage_scene, stages
from gearbench.exchange.rexs_document import Component, RexsDocument, read_document
from gearbench.exchange.rexs_gear import read_gear, read_material
from gearbench.exchange.rexs_torque import check_case, drives
from gearbench.exchange.rexs_units import LENGTH, SPEED, STIFFNESS, Dimension
from gearbench.geometry.names import PAIR
from gearbench.scene import Scene
from gearbench.schema import read
from gearbench.system.schema import System

FORCE = Dimension("kN", {"N": 1e-3, "kN": 1.0})
#: Stiffness from which a value in the file means "rigid" instead of a real bearing [N/µm].
_RIGID = 1e6
#: Type of bearing in the file → kind of rolling bearing.
_KINDS = {
    "radial_grooved_ball_bearing": "deep_groove_ball",
    "radial_roller_bearing": "cylindrical_roller",
    "cylindrical_roller_bearing": "cylindrical_roller",
    "angular_contact_ball_bearing": "angular_contact_ball",
    "taper_roller_bearing": "tapered_roller",
    "tapered_roller_bearing": "tapered_roller",
}


def read_rexs_system(
    path: str | Path, stage: str | int | None = None, *, torque: float | None = None, load_case: int | None = None
) -> tuple[Scene, tuple[str, ...]]:
    """Read the scene of a stage of a REXS file with its shafts and bearings, and notes on assumptions.

    Parameters and errors are as in ``read_rexs``. The other stages of the file become further meshes.
    """
    return system_scene(read_document(path), stage, torque=torque, load_case=load_case)


def system_scene(
    document: RexsDocument, stage: str | int | None = None, *, torque: float | None = None, load_case: int | None = None
) -> tuple[Scene, tuple[str, ...]]:
    """Make the scene of a stage on its shafts, with the other stages as further meshes, and notes on assumptions.

    Parameters
    ----------
    document
        The file.
    stage, torque, load_case
        As in ``read_rexs``.

    Raises
    ------
    InputError
        If the system cannot be read; names file, component and attribute.
    """
    first = find_stage(document, stage)
    stage_data = stage_scene(document, first, torque=torque, load_case=load_case)
    if first.planetary is not None:
        return scene_of(document, stage_data), stage_data.notes
    others = [other for other in stages(document) if other.number != first.number]
    if sets := [str(other.number) for other in others if other.planetary is not None]:
        allowed = "all stages on the shafts must be pairs: simulate one stage with --stage"
        raise InputError("stage", f"with planetary stage {', '.join(sets)}", allowed, str(document.path))
    further = [stage_scene(document, other, load_case=load_case) for other in others]
    scene = scene_of(document, stage_data)
    with naming(document.path):
        tables, notes = _tables(document, first, others, load_case)
        system = read(System, tables)
    scenes = tuple(scene_of(document, one) for one in further)
    return replace(scene, system=system, further=scenes), (*stage_data.notes, *notes)


def _tables(
    document: RexsDocument, own: Stage, others: list[Stage], load_case: int | None
) -> tuple[dict[str, Any], list[str]]:
    """Make the tables of ``[system]``, and notes."""
    case, notes = check_case(document, load_case), []
    driven = drives(document, case)
    meshes = [(PAIR, own), *((f"stage {other.number}", other) for other in others)]
    shafts: dict[int, dict[str, Any]] = {}
    hands: dict[str, str] = {}
    for name, stage in meshes:
        drive = driven.get(stage.component.id)
        pair = stage.gears[::-1] if drive is not None and drive.gear == stage.gears[1].id else stage.gears
        middle = _common_middle(document, pair)
        hands[name] = "left" if read_gear(document, pair[0]).helix_angle < 0 else "right"
        for gear, role in zip(pair, ("pinion", "wheel"), strict=True):
            owner = _shaft_of(document, gear)
            if owner.id not in shafts:
                shafts[owner.id] = _shaft(document, owner, notes)
            position = middle - float(document.vector(owner, "support_vector")[0])
            shafts[owner.id]["gears"].append({"gear": role, "mesh": name, "position": position})
    first = stages(document)[0]
    flips = abs(first.number - own.number) % 2
    clockwise = _clockwise(document, case) != bool(flips)
    tables = {
        "rotation": "clockwise" if clockwise else "counterclockwise",
        "hand": hands[PAIR],
        "shafts": list(shafts.values()),
        "meshes": [
            {"name": name, "scene": f"{document.path.name} stage {stage.number}", "hand": hands[name]}
            for name, stage in meshes[1:]
        ],
    }
    return tables, notes


def _common_middle(document: RexsDocument, pair: tuple[Component, ...]) -> float:
    """Middle of the common face width of both gears, along the axes of the gearbox [mm]."""
    spans = []
    for gear in pair:
        middle = float(document.vector(gear, "support_vector")[0])
        half = document.require(gear, "face_width", LENGTH) / 2
        spans.append((middle - half, middle + half))
    return (max(a for a, _ in spans) + min(b for _, b in spans)) / 2


def _shaft_of(document: RexsDocument, gear: Component) -> Component:
    owners = [c for c in document.related("assembly", "part", gear.id, "assembly") if c.kind == "shaft"]
    if len(owners) != 1:
        raise InputError(gear.label, f"on {len(owners)} shafts", "must be on one")
    return owners[0]


def _shaft(document: RexsDocument, shaft: Component, notes: list[str]) -> dict[str, Any]:
    """Make the table of a shaft, still without gears."""
    pieces = [c for c in document.related("assembly", "assembly", shaft.id, "part") if c.kind == "shaft_section"]
    if not pieces:
        raise InputError(shaft.label, "no shaft_section", "must have sections")
    pieces.sort(key=lambda piece: document.number(piece, "u_coordinate_on_shaft", LENGTH) or 0.0)
    support = document.vector(shaft, "support_vector")
    material = read_material(document, shaft)
    table: dict[str, Any] = {
        "name": f"{shaft.name or shaft.label}",
        "axis": [float(support[1]), float(support[2])],
        "sections": [_section(document, piece) for piece in pieces],
        "gears": [],
        "bearings": [
            _bearing(document, bearing, notes)
            for bearing in document.related("side", "inner_part", shaft.id, "assembly")
        ],
    }
    if material is not None:
        table["material"] = {"youngs_modulus": material[0], "poisson_ratio": material[1]}
    for load in document.related("assembly", "assembly", shaft.id, "part"):
        if load.kind == "external_load":
            table["coupling"] = {"position": document.require(load, "u_coordinate_on_shaft", LENGTH)}
    return table


def _section(document: RexsDocument, piece: Component) -> dict[str, float]:
    start, end = (document.require(piece, f"outer_diameter_{side}", LENGTH) for side in ("begin", "end"))
    bore = document.number(piece, "inner_diameter_begin", LENGTH) or 0.0
    length = document.require(piece, "length", LENGTH)
    return {"length": length, "diameter": start, "end_diameter": end, "bore": bore}


def _bearing(document: RexsDocument, bearing: Component, notes: list[str]) -> dict[str, Any]:
    """Make the table of a bearing: with its stiffness if the file gives a finite one, else with its dimensions."""
    table: dict[str, Any] = {
        "name": bearing.name or bearing.label,
        "position": document.require(bearing, "u_coordinate_on_shaft_inner_side", LENGTH),
    }
    radial = document.number(bearing, "radial_stiffness", STIFFNESS)
    if radial is not None and 0 < radial < _RIGID:
        axial = document.number(bearing, "axial_stiffness", STIFFNESS) or 0.0
        return table | {"radial_stiffness": radial, "axial_stiffness": axial}
    text = document.text(bearing, "bearing_type")
    kind = _KINDS.get(text[0] if text else "")
    if kind is None:
        allowed = f"must be one of {', '.join(_KINDS)}, or have a radial_stiffness below {_RIGID:g} N/µm"
        raise InputError(f"{bearing.label}.bearing_type", text[0] if text else "missing", allowed)
    absorbs = document.text(bearing, "axial_force_absorption")
    rolling: dict[str, Any] = {
        "kind": kind,
        "bore": document.require(bearing, "inner_diameter", LENGTH),
        "outside": document.require(bearing, "outer_diameter", LENGTH),
        "width": document.require(bearing, "width", LENGTH),
        "clearance": 1e3 * (document.number(bearing, "radial_backlash", LENGTH) or 0.0),
        "floating": absorbs is not None and absorbs[0] == "no_direction",
    }
    capacity = document.number(bearing, "static_capacity", FORCE)
    if capacity is not None:
        rolling["static_capacity"] = capacity
    notes.append(f"{table['name']}: stiffness from its catalogue dimensions, not in the file")
    return table | {"rolling": rolling}


def _clockwise(document: RexsDocument, case: int | None) -> bool:
    """Whether the first shaft with a given speed turns clockwise, seen along the axes; True if none is given."""
    for shaft in document.of_kind("shaft"):
        speed = document.number(shaft, "rotational_speed", SPEED, case)
        if speed:
            return speed > 0
    return True
