"""The solid tooth and its gear body: a new pair, all positions of a known one, a thousand errors of it."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.pairs import paper_pair
from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.solver import solve
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.base import Effect
from gearbench.effects.gear_body import GearBody
from gearbench.effects.tooth_bending import ToothBending
from gearbench.effort.clock import times, unseen
from gearbench.library.garambois2017 import gear
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.scene import Resolution
from gearbench.simulation import simulate
from gearbench.validation.comparison import smooth_compliance

PAIRS, POSITIONS, SAMPLES = 40, 32, 1000
COARSE = (4, 5, 5)
#: Tooth model and the time allowed for its compliance at all positions of a new pair [s].
MODELS: dict[str, tuple[tuple[Effect, ...], float | None]] = {
    "plate": ((ToothBending(basis="paper"),), None),
    "solid 4 5 5": ((ToothBending(model="solid", order=COARSE),), 10e-3),
    "solid": ((ToothBending(model="solid"),), None),
    "solid and ring": ((ToothBending(model="solid"), GearBody()), None),
}
BOTH = pytest.mark.parametrize("number", [1, 2])


@BOTH
@pytest.mark.parametrize("model", MODELS)
def test_compliance_of_a_new_pair(benchmark, model, number):
    scene = paper_pair(number, MODELS[model][0], Resolution(positions=POSITIONS))
    fresh = iter([unseen(scene, i + 1) for i in range(PAIRS + 3)])
    smooth_compliance(next(fresh))
    benchmark.extra_info["target_s"] = MODELS[model][1]
    benchmark.pedantic(lambda: smooth_compliance(next(fresh)), rounds=PAIRS)


@BOTH
@pytest.mark.parametrize("model", MODELS)
def test_all_positions_of_a_known_pair(benchmark, model, number):
    scene = paper_pair(number, MODELS[model][0], Resolution(positions=POSITIONS))
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
    single = times(lambda: [solve(replace(base, gap=g)) for g in gap], 5).seconds / len(gap)
    batch = times(lambda: respond(problem, errors, 2), 5).seconds / SAMPLES
    benchmark.extra_info |= {"target_s": 80e-3, "times_faster_than_single_scenes": single / batch}
    print(f"\ngear {name}: {1e6 * batch:.0f} µs a sample, × {single / batch:.0f} faster than scene by scene")
    benchmark(respond, problem, errors, 2)
