"""Worker processes of a search: the same results, whatever becomes of them."""

from __future__ import annotations

import random
import time
from dataclasses import replace

import numpy as np
import pytest

from gearbench import load_study
from gearbench.budget import VARIABLE, MemoryBudgetError, memory_limit
from gearbench.optimisation import processes
from gearbench.optimisation.front import non_dominated
from gearbench.optimisation.problem import NO_GEAR, Evaluation, evaluate
from gearbench.optimisation.processes import ALONE, Processes, Shares
from gearbench.optimisation.racing import Rivals
from gearbench.optimisation.study import Robustness
from gearbench.optimisation.worker import LostError, Worker
from tests.support.paths import EXAMPLES

STUDY = replace(
    load_study(EXAMPLES / "optimise_small.toml"),
    robustness=Robustness(samples=256, racing=True),
)
DESIGNS = [(z, h, b, 2, 3, 3) for z in (1, 2, 3) for h in range(0, 11, 3) for b in (0, 4)]


@pytest.fixture(scope="module")
def expected() -> dict:
    return {design: evaluate(STUDY, design) for design in DESIGNS}


@pytest.fixture(scope="module")
def rivals(expected) -> Rivals:
    """Those that no other dominates."""
    feasible = [result for result in expected.values() if result.feasible]
    best = non_dominated(np.array([result.objectives(STUDY) for result in feasible]))
    found = [result for result, kept in zip(feasible, best, strict=True) if kept]
    made = Rivals.of(STUDY, [r.values for r in found], [r.statistics for r in found])
    assert made is not None
    return made


def assert_same(found: Evaluation, other: Evaluation) -> None:
    assert (found.violation, found.reason, found.samples) == (other.violation, other.reason, other.samples)
    np.testing.assert_array_equal(found.statistics, other.statistics)
    np.testing.assert_array_equal(found.constraints, other.constraints)
    assert (found.values is None) == (other.values is None)
    if found.values is not None:
        np.testing.assert_array_equal(found.values, other.values)


def on_workers(engine: Processes, monkeypatch, rivals: Rivals | None = None) -> dict:
    """The designs, evaluated by worker processes alone."""
    for _ in range(600):
        here = []
        monkeypatch.setattr(processes, "evaluate", lambda *given: (here.append(given), evaluate(*given))[1])  # noqa: B023
        found = dict(engine.evaluate(STUDY, DESIGNS, rivals))
        if not here:
            return found
        time.sleep(0.1)
    raise AssertionError("no worker became ready")


def test_workers_evaluate_as_this_process_does_and_a_lost_one_costs_nothing(expected, rivals, monkeypatch):
    with Processes(2, after=0.0) as engine:
        found = on_workers(engine, monkeypatch)
        assert found.keys() == expected.keys()
        for design in DESIGNS:
            assert_same(found[design], expected[design])
        raced = dict(engine.evaluate(STUDY, DESIGNS, rivals))
        assert {result.samples for result in raced.values()} >= {0, 128, 256}
        for design in DESIGNS:
            assert_same(raced[design], evaluate(STUDY, design, rivals))
        first = engine.workers[0]
        answers = engine.evaluate(STUDY, DESIGNS)
        found = dict([next(answers)])
        first.end()
        found |= dict(answers)
        assert found.keys() == expected.keys()
        assert engine.workers == engine.workers[-1:] != [first]
        engine.workers[0].end()
        with pytest.raises(LostError, match=r"^all worker processes have ended: with --threads 1 there are none$"):
            dict(engine.evaluate(STUDY, DESIGNS))


def test_a_worker_says_what_this_process_would_and_goes_on(expected, monkeypatch):
    """A design that needs more memory than there may be raises; the budget is shared by the workers."""
    monkeypatch.setenv(VARIABLE, "6e8")
    huge = replace(STUDY, base=STUDY.base | {"resolution": {"positions": 20_000, "segments": 400}})
    design = (2, 3, 4, 2, 3, 3)
    worker = Worker(2)
    try:
        with pytest.raises(MemoryBudgetError, match="300 MB are allowed"):
            worker.evaluate((huge, None), design)
        assert_same(worker.evaluate((STUDY, None), design), expected[design])
    finally:
        worker.end()
    with pytest.raises(LostError, match="a worker process has ended"):
        worker.evaluate((STUDY, None), design)


@pytest.mark.parametrize(
    ("violation", "alone"),
    [({}, 1), ({0: NO_GEAR, 1: 0.3}, 3), (dict.fromkeys(range(30), 0.3), ALONE)],
)
def test_workers_are_started_once_all_kernels_are_compiled(monkeypatch, violation, alone):
    """With the first feasible design, after a few that exist and are not feasible; once."""
    started, seen = [], []

    def evaluated(study, design, rivals=None) -> Evaluation:
        seen.append(design)
        return Evaluation(violation=violation.get(design[0], 0.0), reason="", constraints=(), statistics=())

    class Never:
        def __init__(self, share: int) -> None:
            started.append((share, seen[-1], memory_limit()))

        def evaluate(self, common: object, design: object) -> Evaluation:
            time.sleep(0.2)  # while this process goes on
            raise LostError("never")

        def end(self) -> None:
            pass

    monkeypatch.setattr(processes, "evaluate", evaluated)
    monkeypatch.setattr(processes, "Worker", Never)
    monkeypatch.setattr(processes, "by_geometry", lambda study, designs: designs)
    designs = [(i, 0, 0, 0, 0, 0) for i in range(30)]
    with Processes(3, after=0.0) as engine:
        assert {design for design, _ in engine.evaluate(STUDY, designs)} == {*designs}
    assert started == [(3, seen[alone - 1], pytest.approx(memory_limit(), rel=0.1))] * 3
    with Processes(1, after=0.0) as engine:
        assert {design for design, _ in engine.evaluate(STUDY, designs)} == {*designs}
    assert len(started) == 3


def test_shares_are_runs_of_designs_and_each_is_taken_once():
    rng = random.Random(0)
    for count, many in ((1, 5), (2, 0), (3, 2), (2, 31), (5, 40)):
        shares, taken = Shares([(i,) for i in range(many)], count), [[] for _ in range(count)]
        while (design := shares.take(number := rng.randrange(count))) is not None:
            taken[number].append(design[0])
            assert len(shares) == many - sum(map(len, taken))
        assert sorted(x for run in taken for x in run) == [*range(many)]
    shares = Shares([(i,) for i in range(8)], 2)
    assert [shares.take(0) for _ in range(4)] == [(0,), (1,), (2,), (3,)]
    assert [shares.take(0), shares.take(1), shares.take(1)] == [(7,), (4,), (5,)]
    shares.put_back((4,))
    assert {shares.take(1), shares.take(1)} == {(6,), (4,)}
    assert shares.take(0) is None
