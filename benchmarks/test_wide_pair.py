"""A wide helical pair on its bodies, of an electric axle: against named alternatives, as ratios within one run.

Processor times, minima over repeats that take turns: other programs on the machine do not count.
"""

from dataclasses import replace

import numpy as np
import pytest

from gearbench.contact import batch as batching
from gearbench.contact.assemble import assemble, scene_lines
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.effects.tooth_bending import ToothBending
from gearbench.effort.clock import quickest, unseen
from gearbench.robustness.montecarlo import RobustProblem, prepare_scene, respond
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene
from gearbench.simulation import simulate

SAMPLES, POSITIONS = 1000, 32
MEMBER = {"addendum": 1.15, "dedendum": 1.5}
#: The input stage of an electric axle as it is designed: ε_γ 4.1.
AXLE = {
    "pair": {
        "normal_module": 1.8, "pressure_angle": 17.5, "helix_angle": 27.0, "face_width": 30.0,
        "centre_distance": 109.446,
        "pinion": {**MEMBER, "teeth": 25, "bore_diameter": 22.0, "profile_shift": 0.25},
        "wheel": {**MEMBER, "teeth": 83, "bore_diameter": 70.0, "profile_shift": -0.05},
    },
    "load": {"torque": 130.0},
    "effects": {
        "tooth_bending": {"model": "solid"}, "gear_body": {}, "hertz": {},
        "crowning": {"amount": 3.0}, "tip_relief": {"amount": 8.0, "length": 0.7},
    },
}  # fmt: skip


def axle(positions: int, *, plate: bool = False, errors: bool = False) -> Scene:
    scene = parse_scene({**AXLE, "resolution": {"positions": positions}})
    effects = scene.effects
    if plate:
        effects = (ToothBending(), *(e for e in effects if e.name not in ("tooth_bending", "gear_body")))
    return replace(scene, effects=(*effects, *([ManufacturingErrors(preset="garambois2017")] if errors else [])))


def test_1000_samples_by_conjugate_gradients_and_by_elimination(benchmark, monkeypatch):
    def prepared(rank: int) -> RobustProblem:
        monkeypatch.setattr(batching, "COUPLED_RANK", rank)
        return prepare_scene(axle(POSITIONS, errors=True))

    iterative, eliminated = prepared(batching.COUPLED_RANK), prepared(1000)
    errors = iterative.draw(SAMPLES, 0, "sobol")
    works = [lambda p=p: respond(p, errors, 1) for p in (iterative, eliminated)]
    fast, slow = quickest(works, 3)
    benchmark.extra_info |= {"target_s": 0.2, "processor_s": fast, "times_faster_than_elimination": slow / fast}
    print(f"\nprocessor time {fast:.3f} s, × {slow / fast:.1f} faster than elimination")
    assert slow > 2 * fast
    benchmark.pedantic(respond, args=(iterative, errors, 2), rounds=3)


@pytest.mark.parametrize("known", [True, False], ids=["known pair", "new pair"])
def test_64_phases_on_the_bodies_and_with_the_plate(benchmark, known):
    solid, plate = axle(64), axle(64, plate=True)
    fresh = iter(range(1, 10_000))
    works = [lambda s=s: simulate(s if known else unseen(s, next(fresh))) for s in (solid, plate)]
    for work in works:
        work()
    body, thin = quickest(works, 7)
    benchmark.extra_info |= {"target_s": 25e-3 if known else None, "processor_s": body, "times_the_plate": body / thin}
    print(f"\nprocessor time {1e3 * body:.0f} ms, {body / thin:.1f} × the plate's")
    benchmark.pedantic(works[0], rounds=5)


def test_compliance_of_a_new_pair_and_of_a_known_one(benchmark):
    scene, fresh = axle(1), iter(range(20_000, 30_000))  # none that another benchmark has left behind

    def compliance(of: Scene) -> None:
        assemble(of, scene_lines(of, np.array([0.3])))

    compliance(scene)
    new, known = quickest([lambda: compliance(unseen(scene, next(fresh))), lambda: compliance(scene)], 7)
    benchmark.extra_info |= {"target_s": 60e-3, "processor_s": new, "times_a_known_pair": new / known}
    print(f"\nprocessor time {1e3 * new:.0f} ms, {new / known:.0f} × a known pair's")
    benchmark.pedantic(lambda: compliance(unseen(scene, next(fresh))), rounds=5)
