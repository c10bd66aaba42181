"""The solid tooth and its gear body: a new pair, all positions of a known one, a thousand errors of it."""

from dataclasses import replace

import numpy as np
import pytest

from gearbench.contact.assemble import assemble, mesh_phases, scene_lines
from gearbench.contact.solver import solve
from gearbench.effects.base import Effect
from gearbench.effects.hertz import Hertz
from gearbench.effects.neighbour_teeth import NeighbourTeeth
from gearbench.effects.tooth_bending import ToothBending
from gearbench.library.garambois2017 import case, gear
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.scene import Resolution, Scene
from gearbench.simulation import simulate
from gearbench.stopwatch import times, unseen
from gearbench.validation.timing import smooth_compliance

PAIRS, POSITIONS, SAMPLES = 40, 32, 1000
COARSE = (4, 5, 5)
#: Tooth model and the time allowed for its compliance at all positions of a new pair [s].
MODELS: dict[str, tuple[tuple[Effect, ...], float | None]] = {
    "plate": ((ToothBending(basis="paper"),), None),
    "solid 4 5 5": ((ToothBending(model="solid", order=COARSE),), 10e-3),
    "solid": ((ToothBending(model="solid"),), None),
    "solid and ring": ((ToothBending(model="solid"), NeighbourTeeth()), None),
}
BOTH = pytest.mark.parametrize("number", [1, 2])


def paper_pair(number: int, model: str) -> Scene:
    """Pair 1 or 2 of the paper at 32 positions, bores of 0.6 root circles."""
    scene = case(number, Resolution(positions=POSITIONS))
    bores = [round(1.2 * g.root_radius, 1) for g in scene.pair.gears]
    members = [replace(m, bore_diameter=d) for m, d in zip((scene.pair.pinion, scene.pair.wheel), bores, strict=True)]
    pair = replace(scene.pair, pinion=members[0], wheel=members[1])
    return replace(scene, pair=pair, effects=(*MODELS[model][0], Hertz()))


@BOTH
@pytest.mark.parametrize("model", MODELS)
def test_compliance_of_a_new_pair(benchmark, model, number):
    scene = paper_pair(number, model)
    fresh = iter([unseen(scene, i + 1) for i in range(PAIRS + 3)])
    smooth_compliance(next(fresh))
    benchmark.extra_info["target_s"] = MODELS[model][1]
    benchmark.pedantic(lambda: smooth_compliance(next(fresh)), rounds=PAIRS)


@BOTH
@pytest.mark.parametrize("model", MODELS)
def test_all_positions_of_a_known_pair(benchmark, model, number):
    scene = paper_pair(number, model)
    simulate(scene)
    benchmark.extra_info["target_s"] = 10e-3
    benchmark(simulate, scene)


@pytest.mark.parametrize("name", ["SC", "36", "19", "7"])
def test_1000_samples_of_a_solid_tooth(benchmark, name):
    """On two threads; against the solver of single scenes, one sample after the other."""
    scene = gear(name).scene(errors=True, resolution=Resolution(positions=POSITIONS))
    teeth = ToothBending(model="solid", order=COARSE)
    effects = tuple(teeth if isinstance(e, ToothBending) else e for e in scene.effects)
    scene = replace(scene, effects=effects)
    problem = prepare_scene(scene)
    errors = problem.draw(SAMPLES, 0, "sobol")
    respond(problem, errors, 2)
    lines = scene_lines(scene, mesh_phases(scene)[0])
    base = assemble(problem.scene, lines)
    modes = problem.errors.modes(lines).reshape(*base.gap.shape, -1) / base.length_scale
    gap = base.gap + np.einsum("pnm,sm->spn", modes, errors[:10] - problem.mean)
    single = times(lambda: [solve(replace(base, gap=g)) for g in gap], 5)["seconds"] / len(gap)
    batch = times(lambda: respond(problem, errors, 2), 5)["seconds"] / SAMPLES
    benchmark.extra_info |= {"target_s": 80e-3, "times_faster_than_single_scenes": single / batch}
    print(f"\ngear {name}: {1e6 * batch:.0f} µs a sample, × {single / batch:.0f} faster than scene by scene")
    benchmark(respond, problem, errors, 2)
