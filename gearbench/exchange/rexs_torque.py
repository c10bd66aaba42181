"""Torque on the stages of a REXS model, followed along the shafts from the external load that defines it.

Losses are neglected. If a shaft carries several further stages, or another load that takes torque, the shares are not
known: beyond this shaft the torque of a stage must be given by the user.
"""

from __future__ import annotations

from dataclasses import dataclass

from gearbench.errors import InputError
from gearbench.exchange.rexs_document import Component, RexsDocument
from gearbench.exchange.rexs_units import NUMBER, SPEED, TORQUE


@dataclass(frozen=True)
class Drive:
    """Driving gear of a stage, and the torque on it [N·m]."""

    gear: int
    torque: float


@dataclass(frozen=True)
class ExternalLoad:
    """External load on a shaft: absolute torque [N·m], whether it drives, and whether it defines the torque."""

    shaft: int
    component: Component
    torque: float
    drives: bool
    defines: bool


def drives(document: RexsDocument, case: int | None = None) -> dict[int, Drive]:
    """Find driving gear and torque of all stages that the defining load determines, by component number of the stage.

    Power flows in if torque and speed of the shaft have the same sign or the speed is not given; else it flows out.

    Raises
    ------
    InputError
        If a torque, speed or number of teeth is not a number, or has an unknown unit.
    """
    load = _defining_load(document, case)
    if load is None:
        return {}
    drives: dict[int, Drive] = {}
    shaft, torque, visited = load.shaft, load.torque, set[int]()
    while True:
        ways = [(stage, gear) for gear in _gears_on(document, shaft) for stage in _stages_of(document, gear)]
        ways = [(stage, gear) for stage, gear in ways if stage not in visited]
        taken = any(other.shaft == shaft for other in loads_of(document, case) if other.component is not load.component)
        if len(ways) != 1 or (taken and ways):
            return drives
        (stage, near) = ways[0]
        gears = [ref for relation in document.relations if relation.kind == "stage" and stage in relation.ids("stage")
                 for role in ("gear_1", "gear_2") for ref in relation.ids(role)]  # fmt: skip
        far = next((gear for gear in gears if gear != near), None)
        teeth = [
            document.number(document.components[g], "number_of_teeth", NUMBER) for g in (near, far) if g is not None
        ]
        if len(teeth) != 2 or not teeth[0] or not teeth[1] or far is None:
            return drives
        beyond = torque * abs(teeth[1] / teeth[0])
        drives[stage] = Drive(near, torque) if load.drives else Drive(far, beyond)
        visited.add(stage)
        shafts = document.related("assembly", "part", far, "assembly")
        if len(shafts) != 1:
            return drives
        shaft, torque = shafts[0].id, beyond


def _defining_load(document: RexsDocument, case: int | None) -> ExternalLoad | None:
    """Find the load that defines the torque: the one marked so, else the only load with a torque; None if ambiguous."""
    loads = [load for load in loads_of(document, case) if load.torque != 0]
    defining = [load for load in loads if load.defines]
    chosen = defining or loads
    return chosen[0] if len(chosen) == 1 else None


def loads_of(document: RexsDocument, case: int | None) -> list[ExternalLoad]:
    """List the external loads that transmit torque, with their shafts."""
    loads = []
    for component in document.of_kind("external_load"):
        torque = document.number(component, "torque_around_u_axis", TORQUE, case) or 0.0
        if torque == 0 and not _true(document, component, "transmits_torque", case):
            continue
        defines = _true(document, component, "defines_torque", case)
        for shaft in document.related("assembly", "part", component.id, "assembly"):
            speed = document.number(shaft, "rotational_speed", SPEED, case) or 0.0
            loads.append(ExternalLoad(shaft.id, component, abs(torque), torque * speed >= 0, defines))
    return loads


def _true(document: RexsDocument, component: Component, name: str, case: int | None) -> bool:
    text = document.text(component, name, case)
    return text is not None and text[0].lower() == "true"


def _gears_on(document: RexsDocument, shaft: int) -> list[int]:
    parts = document.related("assembly", "assembly", shaft, "part")
    return [part.id for part in parts if part.kind in {"cylindrical_gear", "bevel_gear", "ring_gear", "worm_gear"}]


def _stages_of(document: RexsDocument, gear: int) -> list[int]:
    roles = ("gear_1", "gear_2")
    return [stage.id for role in roles for stage in document.related("stage", role, gear, "stage")]


def check_case(document: RexsDocument, case: int | None) -> int | None:
    """Choose the load case to read: ``case``, or by default the first of the file; None if it has none.

    Raises
    ------
    InputError
        If the file has no such load case.
    """
    if case is not None and case not in document.load_cases:
        known = ", ".join(map(str, document.load_cases)) or "none"
        raise InputError("load_case", case, f"load cases in this file: {known}")
    return next(iter(document.load_cases), None) if case is None else case
