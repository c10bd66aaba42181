"""Designs of the paper's third tool: processes against one thread, solid teeth against plates."""

import math
import random
import time
from concurrent.futures import Executor
from pathlib import Path

from gearbench import read_study
from gearbench.contact.smooth import clear_compliance_cache
from gearbench.effects.teeth import clear_tooth_cache
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.optimisation.workers import evaluations, worker_processes

STUDY = Path(__file__).parents[1] / "examples" / "optimise_tool3.toml"
DESIGNS = 400


def designs(study: OptimisationStudy, seed: int) -> list[Design]:
    """Random designs; most of them are refused by their geometry, as in the first generation of a search."""
    rng = random.Random(seed)
    return [
        tuple(rng.uniform(*v.bounds) if v.kind == "real" else rng.randint(*map(int, v.bounds)) for v in study.variables)
        for _ in range(DESIGNS)
    ]


def seconds(workers: Executor | None, study: OptimisationStudy, some: list[Design]) -> tuple[float, int]:
    """Wall time, and the number of feasible designs."""
    start = time.perf_counter()
    feasible = sum(found.feasible for _, found in evaluations(workers, study, some))
    return time.perf_counter() - start, feasible


def test_designs_a_second(benchmark):
    study = read_study(STUDY)
    some, warm = designs(study, 1), designs(study, 2)
    seconds(None, study, warm[:200])
    alone, feasible = seconds(None, study, some)
    found = []
    with worker_processes(2) as workers:
        seconds(workers, study, warm)
        benchmark.pedantic(lambda: found.append(seconds(workers, study, some)), rounds=3)
    taken = min(t for t, _ in found)
    assert {count for _, count in found} == {feasible}
    benchmark.extra_info |= {"feasible_a_second": feasible / taken, "times_one_thread": alone / taken}
    print(f"\ntwo processes: {feasible / taken:.0f} feasible designs a second, × {alone / taken:.2f} one thread")


def test_solid_teeth_on_their_bodies_against_plates(benchmark, tmp_path):
    """Processor time of the same designs: each pair is new, and so are its teeth."""
    text = STUDY.read_text(encoding="utf-8")
    bores = "[base.pair.pinion]\nbore_diameter = 15.0\n\n[base.pair.wheel]\nbore_diameter = 15.0\n\n"
    solid = text.replace('basis = "paper"', 'model = "solid"\n\n[base.effects.gear_body]')
    path = tmp_path / "solid.toml"
    path.write_text(solid.replace("[base.load]", bores + "[base.load]"), encoding="utf-8")
    studies = read_study(STUDY), read_study(path)
    seconds_each, feasible = [math.inf, math.inf], set()
    for _ in range(3):
        for i, study in enumerate(studies):
            clear_tooth_cache()
            clear_compliance_cache()
            start = time.process_time()
            feasible.add(seconds(None, study, designs(study, 1))[1])
            seconds_each[i] = min(seconds_each[i], time.process_time() - start)
    plate, body = seconds_each
    benchmark.extra_info |= {"target_times": 1.5, "times_the_plate": body / plate, "processor_s": body}
    print(f"\n{feasible} feasible designs: {body:.2f} s, × {body / plate:.2f} the plate's")
    benchmark.pedantic(lambda: seconds(None, studies[1], designs(studies[1], 2)), rounds=1)
