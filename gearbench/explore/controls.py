"""Sliders of the picked gear."""

from __future__ import annotations

from typing import Any

from bokeh.models import Slider

from gearbench.explore.look import PALETTE, SIDE
from gearbench.explore.settings import Settings
from gearbench.scene import Scene

#: Setting → title, greatest value, step. Length and torque follow from the gear.
_FIXED = {
    "crowning": ("crowning C_β [µm]", 15.0, 0.1),
    "relief_amount": ("tip relief f [µm]", 15.0, 0.1),
    "relief_length": ("tip relief length L [mm]", 1.0, 0.01),
    "torque": ("torque on the pinion T [N·m]", 1.0, 0.1),
    "iso_class": ("ISO 1328 class of the errors", 12, 1),
}


class Controls:
    """A slider for each setting; ``show`` sets them to a scene."""

    def __init__(self) -> None:
        self.sliders = {
            name: Slider(
                start=0, end=end, step=step, value=0, title=title, width=SIDE - 50, name=name, bar_color=PALETTE[5],
                format="0[.]00",
            )
            for name, (title, end, step) in _FIXED.items()
        }  # fmt: skip

    def show(self, scene: Scene) -> None:
        """Set the sliders to a scene; one whose error class cannot be changed gets a slider that does not move."""
        settings = Settings.of(scene)
        height = min(gear.tooth_height for gear in scene.pair.gears)
        torque = round_up(scene.load.torque)
        ends = {
            "crowning": max(15.0, 2 * settings.crowning),
            "relief_amount": max(15.0, 2 * settings.relief_amount),
            "relief_length": max(0.6 * height, settings.relief_length),
            "torque": 3 * torque,
        }
        starts = {"torque": 0.05 * torque, "crowning": min(0.0, 2 * settings.crowning)}
        for name, slider in self.sliders.items():
            value = getattr(settings, name)
            slider.disabled = value is None
            if name in ends:
                start, end = starts.get(name, 0.0), ends[name]
                slider.update(start=start, end=end, step=(end - start) / 150)
            slider.value = 6 if value is None else value

    def settings(self, scene: Scene) -> Settings:
        """What the sliders say; a slider that was not moved says exactly what the scene does."""
        was = Settings.of(scene)
        values: dict[str, Any] = {name: slider.value for name, slider in self.sliders.items()}
        values["iso_class"] = None if was.iso_class is None else int(values["iso_class"])
        return Settings(**values)


def round_up(value: float) -> float:
    """The least of 1, 2, 5, 10, 20, … that is not below ``value``."""
    power = 1e-6
    while True:
        for step in (1, 2, 5):
            if step * power >= value * (1 - 1e-12):
                return step * power
        power *= 10
