"""Memory that ``gearbench plan`` predicts, within a factor of two of what is measured; no plan takes two seconds.

Each run is on a pair that nothing has been kept of.
"""

import tracemalloc
from dataclasses import replace
from itertools import count

import pytest

from gearbench.effects.crowning import Crowning
from gearbench.effects.end_relief import EndRelief
from gearbench.effects.hertz import Hertz
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.effects.misalignment import Misalignment
from gearbench.effects.profile_slope import ProfileSlope
from gearbench.effects.tip_relief import TipRelief
from gearbench.effects.tooth_bending import ToothBending
from gearbench.effort.clock import timed
from gearbench.effort.plan import plan
from gearbench.library.garambois2017 import case, gear
from gearbench.loads import WeightedLoad, greatest_load
from gearbench.scene import Resolution, Scene
from gearbench.simulation import simulate

ERRORS = ManufacturingErrors(preset="garambois2017")
GAPS = (Crowning(amount=4.0), TipRelief(amount=5.0, length=0.2), ProfileSlope(pinion=3.0), Misalignment(deviation=4.0))


def with_effects(scene: Scene, *effects) -> Scene:
    return replace(scene, effects=effects)


def under_loads(scene: Scene, *torques: float) -> Scene:
    loads = tuple(WeightedLoad(torque=torque) for torque in torques)
    return replace(scene, load=greatest_load(loads), loads=loads)


SCENES = {
    "case 1": case(1),
    "case 2": case(2),
    "gear SC": gear("SC").scene(),
    "gear 36": gear("36").scene(),
    "case 1, 16 positions": case(1, Resolution(positions=16)),
    "case 1, 64 positions": case(1, Resolution(positions=64)),
    "case 1, 256 positions": case(1, Resolution(positions=256)),
    "case 1, 2048 positions": case(1, Resolution(positions=2048)),
    "case 2, 512 positions": case(2, Resolution(positions=512)),
    "case 2, 2 Gauss points": case(2, Resolution(gauss_points=2)),
    "case 2, 64 Gauss points": case(2, Resolution(gauss_points=64)),
    "case 1, 1 segment": case(1, Resolution(positions=128, segments=1)),
    "case 1, 100 segments": case(1, Resolution(segments=100)),
    "case 2, 300 segments": case(2, Resolution(positions=100, segments=300)),
    "Hertz alone": with_effects(case(2), Hertz()),
    "Yang-Sun alone": with_effects(case(2, Resolution(positions=1000)), Hertz(law="yang_sun")),
    "Yang-Sun with plate": with_effects(case(1), ToothBending(), Hertz(law="yang_sun")),
    "plate of order (3, 3)": with_effects(case(2), ToothBending(order=(3, 3)), Hertz()),
    "plate of order (8, 8)": with_effects(case(2), ToothBending(order=(8, 8)), Hertz()),
    "plate of order (5, 5), 500 positions": with_effects(
        case(2, Resolution(positions=500)), ToothBending(order=(5, 5)), Hertz()
    ),
    "solid tooth": with_effects(case(1), ToothBending(model="solid"), Hertz()),
    "solid helical tooth": with_effects(case(2), ToothBending(model="solid", order=(4, 5, 5)), Hertz()),
    "many gaps": with_effects(case(2), ToothBending(), Hertz(), *GAPS, EndRelief(amount=4.0, length=3.0)),
    "many gaps, 1000 positions": with_effects(case(2, Resolution(positions=1000)), ToothBending(), Hertz(), *GAPS),
    "case 1 under four loads": under_loads(case(1), 2000.0, 5000.0, 9000.0, 13200.0),
    "case 2 driven and on the coast": under_loads(case(2), -500.0, 500.0, 1000.0),
    "errors at their mean": with_effects(case(1), ToothBending(), Hertz(), ERRORS),
}
_different = count(1)


def fresh(scene: Scene) -> Scene:
    """The scene with a pair that nothing has been kept of."""
    return replace(scene, pair=replace(scene.pair, face_width=scene.pair.face_width * (1 + 1e-8 * next(_different))))


def megabytes(scene: Scene) -> float:
    tracemalloc.start()
    try:
        simulate(scene)
        return tracemalloc.get_traced_memory()[1] / 1e6
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("name", SCENES)
def test_simulate_takes_the_memory_of_its_plan(benchmark, name):
    scene = SCENES[name]
    simulate(scene)
    made, cost = benchmark.pedantic(timed, args=(lambda: plan(scene),), rounds=1)
    predicted, measured = made.megabytes["simulate"], megabytes(fresh(scene))
    benchmark.extra_info |= {"megabytes": predicted / measured}
    print(
        f"\n{name}: predicted {predicted:.2f} MB, measured {measured:.2f} MB, planned in {cost.processor_seconds:.2f} s"
    )
    # a megabyte is what any Python program takes
    assert 0.5 * measured - 1 <= predicted <= 2 * measured + 1
    assert cost.processor_seconds <= 2
