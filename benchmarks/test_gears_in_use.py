"""The gears in use with default settings or an accuracy, and Table 2 on its bodies: against named alternatives.

Processor times of this thread, minima over repeats that take turns: other programs on the machine do not count.
"""

from dataclasses import replace

import pytest

from benchmarks.pairs import GEARS, on_line, other_torques
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.gear_body import GearBody
from gearbench.effects.tooth_bending import ToothBending
from gearbench.effort.clock import quickest, unseen
from gearbench.library.garambois2017 import gear
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.scene import Resolution, Scene
from gearbench.simulation import simulate

EACH_GEAR = pytest.mark.parametrize("path", GEARS, ids=lambda path: path.stem)
#: The wide helical pair that has limits of its own.
AXLE = "e_drive_input"


@EACH_GEAR
def test_a_new_pair_with_default_settings(benchmark, path):
    """Against the same pair known, and against plates for its teeth, without its body."""
    scene, fresh = on_line(path), iter(range(40_000, 50_000))
    others = (e for e in scene.effects if e.name not in ("tooth_bending", "gear_body"))
    plate = replace(scene, effects=(ToothBending(), *others))
    works = [lambda s=s: simulate(unseen(s, next(fresh))) for s in (scene, plate)]
    works.append(lambda: simulate(scene))
    for work in works:
        work()
    new, thin, known = quickest(works, 7)
    benchmark.extra_info |= {"target_s": 60e-3 if path.stem == AXLE else None, "processor_s": new}
    benchmark.extra_info |= {"times_a_known_pair": new / known, "times_the_plate": new / thin}
    print(f"\n{path.stem}: {1e3 * new:.0f} ms, × {new / known:.1f} a known pair's, × {new / thin:.1f} the plate's")
    benchmark.pedantic(works[0], rounds=3)


@EACH_GEAR
def test_default_phases_against_uniform_ones(benchmark, path):
    """At another torque each time: the phases follow the load.

    Uniform phases are as many as Gauss points between transitions that do not follow the load.
    """
    scene = on_line(path)
    uniform = replace(scene, resolution=Resolution(positions=len(mesh_phases(scene)[0])))
    works = [lambda made=made: simulate(made()) for made in map(other_torques, (scene, uniform))]
    for work in works:
        work()
    default, fixed = quickest(works, 9)
    benchmark.extra_info |= {"target_times": 1.3, "times_uniform_phases": default / fixed, "processor_s": default}
    print(f"\n{path.stem}: {1e3 * default:.1f} ms, × {default / fixed:.2f} that of uniform phases")
    benchmark.pedantic(works[0], rounds=3)


@EACH_GEAR
def test_an_accuracy_of_one_percent_against_default_settings(benchmark, path):
    """New pairs; choosing counts."""
    scene, fresh = on_line(path), iter(range(50_000, 60_000))
    asked = replace(scene, resolution=Resolution(accuracy=0.01))
    works = [lambda s=s: simulate(unseen(s, next(fresh))) for s in (asked, scene)]
    for work in works:
        work()
    chosen, default = quickest(works, 3)
    benchmark.extra_info |= {"target_s": 1.0, "processor_s": chosen, "times_default_settings": chosen / default}
    print(f"\n{path.stem}: {1e3 * chosen:.0f} ms, × {chosen / default:.1f} that of default settings")
    assert chosen < 30 * default
    benchmark.pedantic(works[0], rounds=1)


def on_plate_and_body(name: str) -> tuple[Scene, Scene]:
    """A row of Table 2 with its errors at 32 phases: on the paper's plate, and solid teeth on their bodies."""
    plate = gear(name).scene(errors=True, resolution=Resolution(positions=32))
    bores = [round(1.2 * g.root_radius, 1) for g in plate.pair.gears]
    members = (plate.pair.pinion, plate.pair.wheel)
    pinion, wheel = (replace(m, bore_diameter=d) for m, d in zip(members, bores, strict=True))
    others = tuple(e for e in plate.effects if e.name != "tooth_bending")
    effects = (ToothBending(model="solid"), GearBody(), *others)
    return plate, replace(plate, pair=replace(plate.pair, pinion=pinion, wheel=wheel), effects=effects)


@pytest.mark.parametrize("name", ["SC", "36", "19", "7"])
def test_1000_samples_of_table_2_on_bodies_and_on_plates(benchmark, name):
    problems = [prepare_scene(scene) for scene in on_plate_and_body(name)]
    draws = [problem.draw(1000, 0, "sobol") for problem in problems]
    works = [lambda p=p, e=e: respond(p, e, 1) for p, e in zip(problems, draws, strict=True)]
    for work in works:
        work()
    plate, body = quickest(works, 7)
    benchmark.extra_info |= {"target_plate_s": 12e-3, "target_body_s": 35e-3, "plate_s": plate, "body_s": body}
    benchmark.extra_info["times_the_plate"] = body / plate
    print(f"\ngear {name}: plate {1e3 * plate:.0f} ms, body {1e3 * body:.0f} ms, × {body / plate:.1f}")
    benchmark.pedantic(works[1], rounds=5)
