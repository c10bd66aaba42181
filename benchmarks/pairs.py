"""The paper's pairs and the gears in use as the benchmarks take them."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from gearbench.effects.base import Effect
from gearbench.effects.hertz import Hertz
from gearbench.library.garambois2017 import case
from gearbench.scene import Load, Resolution, Scene
from gearbench.scene_file import read_scene

GEARS = sorted((Path(__file__).parents[1] / "examples" / "gears").glob("*.toml"))


def paper_pair(number: int, teeth: tuple[Effect, ...], resolution: Resolution | None = None) -> Scene:
    """Pair 1 or 2 of the paper on other teeth, bores of 0.6 root circles."""
    scene = case(number, resolution)
    bores = [round(1.2 * g.root_radius, 1) for g in scene.pair.gears]
    members = [replace(m, bore_diameter=d) for m, d in zip((scene.pair.pinion, scene.pair.wheel), bores, strict=True)]
    pair = replace(scene.pair, pinion=members[0], wheel=members[1])
    return replace(scene, pair=pair, effects=(*teeth, Hertz()))


def on_line(path: Path) -> Scene:
    """The gear pair of a scene file, with contact on the line of action."""
    return read_scene(path).without("off_line_contact")


def other_torques(scene: Scene) -> Callable[[], Scene]:
    """The scene under torques that were not solved before."""
    factors = iter(1.0 + 1e-4 * np.arange(1, 10_000))
    return lambda: replace(scene, load=Load(torque=scene.load.torque * float(next(factors))))
