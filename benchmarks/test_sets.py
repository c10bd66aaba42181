"""Time of a planetary set against that of its sun pair and ring pair alone."""

import math
import time

import pytest

from gearbench.scene_file import parse_scene
from gearbench.solution import solve_scene
from gearbench.trains.solve import solve_train

RELIEF = {"tip_relief": {"amount": 10.0, "length": 0.8}}


def tables(torque: float, helix: float, off_line: bool) -> dict:
    """Three planets in sequence on elastic bodies; the sun floats."""
    outer = 202.0 / math.cos(math.radians(helix)) + 38.0
    gears = {
        "sun": {"teeth": 37, "bore_diameter": 40.0, **RELIEF},
        "planet": {"teeth": 32, "bore_diameter": 30.0, **RELIEF},
        "ring": {"teeth": -101, "addendum": 0.9, "outer_diameter": outer},
    }
    own = {"normal_module": 2.0, "face_width": 20.0, "helix_angle": helix, "planets": 3, "pin_stiffness": 300.0}
    effects = {"tooth_bending": {"model": "solid"}, "hertz": {}, "gear_body": {}}
    effects |= {"off_line_contact": {}} if off_line else {}
    return {"planetary": {**own, **gears, "floating": ["sun"]}, "load": {"torque": torque}, "effects": effects}


@pytest.mark.parametrize("off_line", [False, True], ids=["line", "off"])
@pytest.mark.parametrize("helix", [0.0, 25.0], ids=["spur", "helical"])
def test_a_set_at_a_further_torque(benchmark, helix, off_line):
    """Six meshes at the phases of all: six times as many solutions as both pairs at their own phases."""
    scenes = [parse_scene(tables(torque, helix, off_line)) for torque in range(150, 250, 5)]
    solve_train(scenes.pop())
    taken: dict[str, list[float]] = {"set": [], "pairs": []}
    # pairs and set have different torques, because transitions are cached
    for of_pairs, of_set in zip(scenes[:16:2], scenes[1:16:2], strict=True):
        sun, *_, ring = of_pairs.meshes.values()
        works = {
            "pairs": lambda m=(sun, ring): [solve_scene(each) for each in m],
            "set": lambda s=of_set: solve_train(s),
        }
        for name, work in works.items():
            start = time.process_time()
            work()
            taken[name].append(time.process_time() - start)
    least = {name: min(times) for name, times in taken.items()}
    ratio = least["set"] / least["pairs"]
    benchmark.extra_info |= {"set_s": least["set"], "ratio": ratio}
    print(f"\nset {least['set']:.3f} s, {ratio:.1f} times its two pairs")
    assert ratio < 6
    benchmark.pedantic(solve_train, setup=lambda: ((scenes.pop(),), {}), rounds=3)
