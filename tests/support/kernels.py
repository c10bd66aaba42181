"""Compile and store all kernels, in two processes: ``python -m tests.support.kernels``."""

from __future__ import annotations

import logging
import tomllib
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from typing import Any

from gearbench import nonlinear_response, revolution_response, robust, robust_response, simulate, sweep
from gearbench.effects.teeth import clear_tooth_cache
from gearbench.library.garambois2017 import case
from gearbench.scene import Resolution, Scene
from gearbench.scene_file import parse_scene
from tests.support.paths import EXAMPLES
from tests.support.systems import spur_scene

ERRORS: dict[str, Any] = {"manufacturing_errors": {"preset": "garambois2017"}}


def small(name: str, **effects: Any) -> Scene:
    """An example with more effects, at few phases."""
    given = tomllib.loads((EXAMPLES / name).read_text(encoding="utf-8"))
    return parse_scene(given | {"effects": given["effects"] | effects, "resolution": {"positions": 6, "segments": 9}})


def driven(effects: dict[str, Any]) -> Scene:
    """Two rigid wheels that turn."""
    return spur_scene({}, effects=effects, segments=4, gauss_points=2)


def of_clamped_teeth() -> None:
    """Kernels of pairs with clamped teeth, and of their response."""
    for size in ({"positions": 1}, {"positions": 4}, {"positions": 4, "segments": 1}):
        simulate(case(2, Resolution(**size)))
    simulate(scene := small("sc.toml", **ERRORS))
    robust(scene, samples=3)
    for scene in (driven({"hertz": {"law": "yang_sun"}} | ERRORS), small("shafts.toml", **ERRORS)):
        robust_response(scene, speed=900.0, harmonics=1, samples=2)
    pitch = {"pitch_errors": {"pinion": [0.0, 1.0] * 12 + [0.0]}}
    revolution_response(driven({"hertz": {}} | pitch), speed=900.0, harmonics=1)


def of_elastic_bodies() -> None:
    """Kernels of pairs whose segments share amplitudes, and of loss of contact."""
    spur = small("gears/hcr_spur.toml", gear_body={})
    wheel = replace(spur.pair.wheel, rim_thickness=6.0, web_thickness=8.0)
    simulate(replace(spur, pair=replace(spur.pair, wheel=wheel)))
    simulate(scene := small("gears/hcr_spur.toml", gear_body={}, **ERRORS))
    robust(scene, samples=3)
    sweep(spur, torque=[50.0, 60.0])
    scene = driven({"hertz": {}})
    nonlinear_response(replace(scene, pair=replace(scene.pair, backlash=0.15)), speed=[900.0], harmonics=1)


#: Each takes about as long as the other.
JOBS = (of_clamped_teeth, of_elastic_bodies)


def run(job: Callable[[], None]) -> None:
    clear_tooth_cache()  # what it holds was built by compiled code too
    job()


if __name__ == "__main__":
    logging.disable()  # few phases resolve no harmonics
    with ProcessPoolExecutor(len(JOBS)) as processes:
        list(processes.map(run, JOBS))
