"""Designs a second: threads and workers of dask against one thread, on the same designs of the paper's third tool."""

import random
import time
from pathlib import Path

import pytest

from gearbench import load_study
from gearbench.optimisation.engine import Dask, Engine, Threads
from gearbench.optimisation.study import Design, OptimisationStudy

STUDY = Path(__file__).parents[1] / "examples" / "optimise_tool3.toml"
DESIGNS = 400
ENGINES = {
    "two threads": lambda: Threads(2),
    "one worker of dask": lambda: Dask("local:1"),
    "two workers of dask": lambda: Dask("local:2"),
}


def designs(study: OptimisationStudy, seed: int) -> list[Design]:
    """Random designs; most of them are refused by their geometry, as in the first generation of a search."""
    rng = random.Random(seed)
    return [
        tuple(rng.uniform(*v.bounds) if v.kind == "real" else rng.randint(*map(int, v.bounds)) for v in study.variables)
        for _ in range(DESIGNS)
    ]


def seconds(engine: Engine, study: OptimisationStudy, some: list[Design]) -> tuple[float, int]:
    """Wall time, and the number of feasible designs."""
    start = time.perf_counter()
    feasible = sum(found.feasible for _, found in engine.evaluate(study, some))
    return time.perf_counter() - start, feasible


@pytest.mark.parametrize("name", ENGINES)
def test_designs_a_second(benchmark, name):
    study = load_study(STUDY)
    some, warm = designs(study, 1), designs(study, 2)
    with Threads(1) as one:
        seconds(one, study, warm[:200])
        alone, feasible = seconds(one, study, some)
    found = []
    with ENGINES[name]() as engine:
        seconds(engine, study, warm)
        benchmark.pedantic(lambda: found.append(seconds(engine, study, some)), rounds=3)
    taken = min(t for t, _ in found)
    assert {count for _, count in found} == {feasible}
    benchmark.extra_info |= {"feasible_a_second": feasible / taken, "times_one_thread": alone / taken}
    print(f"\n{name}: {feasible / taken:.0f} feasible designs a second, × {alone / taken:.2f} one thread")
