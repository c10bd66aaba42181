"""Sliders of the picked gear."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from bokeh.models import Slider

from gearbench.explore.look import PALETTE, SIDE
from gearbench.explore.settings import Settings
from gearbench.scene import Scene

#: Setting → title, step. The other steps follow from the gear.
_TITLES = {
    "crowning": ("crowning C_β [µm]", 0.1),
    "relief_amount": ("tip relief f [µm]", 0.1),
    "relief_length": ("tip relief length L [mm]", 0.01),
    "torque": ("torque on the pinion T [N·m]", 0.1),
    "iso_class": ("ISO 1328 class of the errors", 1),
}


def sliders(scene: Scene) -> list[Slider]:
    """A slider for each setting, set to ``scene``."""
    found = positions(scene)
    return [
        Slider(
            title=title, width=SIDE - 50, name=name, bar_color=PALETTE[5], format="0[.]00",
            **{"step": step, **found[name]},
        )
        for name, (title, step) in _TITLES.items()
    ]  # fmt: skip


def positions(scene: Scene) -> dict[str, dict[str, Any]]:
    """Range, step and value of each slider for a scene; one that cannot be changed does not move."""
    settings = Settings.of(scene)
    height = min(gear.tooth_height for gear in scene.pair.gears)
    torque = math.copysign(round_up(abs(scene.load.torque)), scene.load.torque)
    ends = {
        "crowning": (min(0.0, 2 * settings.crowning), max(15.0, 2 * settings.crowning)),
        "relief_amount": (0.0, max(15.0, 2 * settings.relief_amount)),
        "relief_length": (0.0, max(0.6 * height, settings.relief_length)),
        # never through 0, where neither flank carries
        "torque": tuple(sorted((0.05 * torque, 3 * torque))),
    }
    found: dict[str, dict[str, Any]] = {
        name: {"start": start, "end": end, "step": (end - start) / 150, "value": getattr(settings, name)}
        for name, (start, end) in ends.items()
    }
    iso = settings.iso_class
    found["iso_class"] = {"start": 0, "end": 12, "value": 6 if iso is None else iso, "disabled": iso is None}
    return found


def settings_of(scene: Scene, values: Mapping[str, Any]) -> Settings:
    """Values of the sliders; a slider that was not moved has exactly that of the scene.

    Raises
    ------
    KeyError, TypeError, ValueError
        If ``values`` are not those of all sliders.
    """
    iso = Settings.of(scene).iso_class
    return Settings(
        crowning=float(values["crowning"]),
        relief_amount=float(values["relief_amount"]),
        relief_length=float(values["relief_length"]),
        torque=float(values["torque"]),
        iso_class=None if iso is None else int(values["iso_class"]),
    )


def round_up(value: float) -> float:
    """The least of 1, 2, 5, 10, 20, … that is not below ``value``."""
    power = 1e-6
    while True:
        for step in (1, 2, 5):
            if step * power >= value * (1 - 1e-12):
                return step * power
        power *= 10
