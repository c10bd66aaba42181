"""Sliders of the picked gear, and the scene that follows from their positions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from bokeh.models import Slider

from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.explore.look import PALETTE, SIDE
from gearbench.keys import value_at
from gearbench.scene import Scene
from gearbench.scene_file import scene_at

#: Slider → key of the scene, title, step; ``positions`` replaces the step of all but the ISO class.
_SLIDERS = {
    "crowning": ("effects.crowning.amount", "crowning C_β [µm]", 0.1),
    "relief_amount": ("effects.tip_relief.amount", "tip relief f [µm]", 0.1),
    "relief_length": ("effects.tip_relief.length", "tip relief length L [mm]", 0.01),
    "torque": ("load.torque", "torque on the pinion T [N·m]", 0.1),
    "iso_class": ("effects.manufacturing_errors.iso_class", "ISO 1328 class of the errors", 1),
}


def sliders(scene: Scene) -> list[Slider]:
    """Make a slider for every entry of ``values``, set to ``scene``."""
    found = positions(scene)
    return [
        Slider(
            title=title, width=SIDE - 50, name=name, bar_color=PALETTE[5], format="0[.]00",
            **{"step": step, **found[name]},
        )
        for name, (_, title, step) in _SLIDERS.items()
    ]  # fmt: skip


def values(scene: Scene) -> dict[str, Any]:
    """Slider values of a scene: 0 for an absent modification, None for the ISO class if no errors follow from one."""
    found = {name: value_at(scene, path) or 0.0 for name, (path, _, _) in _SLIDERS.items()}
    if not (found["relief_amount"] and found["relief_length"]):
        found |= {"relief_amount": 0.0, "relief_length": 0.0}
    errors = scene.effect("manufacturing_errors")
    return found | {"iso_class": errors.convention().iso_class if isinstance(errors, ManufacturingErrors) else None}


def positions(scene: Scene) -> dict[str, dict[str, Any]]:
    """Range, step and value of every slider for a scene; the ISO class is disabled if no errors follow from it."""
    now = values(scene)
    height = min(gear.tooth_height for gear in scene.pair.gears)
    torque = math.copysign(round_up(abs(scene.load.torque)), scene.load.torque)
    ends = {
        "crowning": (min(0.0, 2 * now["crowning"]), max(15.0, 2 * now["crowning"])),
        "relief_amount": (0.0, max(15.0, 2 * now["relief_amount"])),
        "relief_length": (0.0, max(0.6 * height, now["relief_length"])),
        # never through 0, where neither flank carries load
        "torque": tuple(sorted((0.05 * torque, 3 * torque))),
    }
    found: dict[str, dict[str, Any]] = {
        name: {"start": start, "end": end, "step": (end - start) / 150, "value": now[name]}
        for name, (start, end) in ends.items()
    }
    iso = now["iso_class"]
    found["iso_class"] = {"start": 0, "end": 12, "value": 6 if iso is None else iso, "disabled": iso is None}
    return found


def moved(scene: Scene, places: Mapping[str, Any]) -> Scene:
    """Return ``scene`` changed to the slider values ``places``, or ``scene`` itself if no slider was moved.

    An effect with amount or length 0 is removed.

    Raises
    ------
    InputError
        If the values do not fit the pair. pydantic may wrap it in a ``ValidationError``.
    KeyError, TypeError, ValueError
        If ``places`` does not hold a valid value for every slider.
    """
    now = values(scene)
    wanted = {name: float(places[name]) for name in now} | {"iso_class": now["iso_class"]}
    if now["iso_class"] is not None:
        wanted["iso_class"] = int(places["iso_class"])
    changed = {name for name in now if wanted[name] != now[name]}
    if not changed:
        return scene
    absent = set() if wanted["crowning"] else {"crowning"} & changed
    if changed & {"relief_amount", "relief_length"}:
        changed |= {"relief_amount", "relief_length"}
        absent |= set() if wanted["relief_amount"] and wanted["relief_length"] else {"tip_relief"}
    effects = [
        replace(effect.convention(), iso_class=wanted["iso_class"])
        if isinstance(effect, ManufacturingErrors) and "iso_class" in changed
        else effect
        for effect in scene.effects
        if effect.name not in absent
    ]
    paths = {_SLIDERS[name][0]: wanted[name] for name in changed - {"iso_class"}}
    kept = {path: value for path, value in paths.items() if path.split(".")[1] not in absent}
    return scene_at(replace(scene, loads=(), effects=tuple(effects)), kept)


def round_up(value: float) -> float:
    """Least of 1, 2, 5 times a power of ten (from 1e-6) that is not below ``value``."""
    power = 1e-6
    while True:
        for step in (1, 2, 5):
            if step * power >= value * (1 - 1e-12):
                return step * power
        power *= 10
