"""Workers of a search: the same results as in one process, whatever becomes of the workers."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from gearbench import optimise, read_study
from gearbench.budget import memory_limit
from gearbench.errors import GearbenchError, InputError
from gearbench.optimisation import workers
from gearbench.optimisation.front import non_dominated
from gearbench.optimisation.problem import Evaluation, evaluate
from gearbench.optimisation.racing import Incumbents
from gearbench.optimisation.study import Algorithm, Design, Robustness
from gearbench.optimisation.workers import evaluations, identity, require_same, side_by_side, worker_processes
from tests.support.paths import ROOT

STUDY = replace(read_study(ROOT / "examples" / "optimise_small.toml"), robustness=Robustness(samples=256, racing=True))
SMALL = replace(STUDY, algorithm=Algorithm(population=8, generations=3, seed=2), robustness=Robustness(samples=8))
DESIGNS = [(z, h, b, 2, 3, 3) for z in (1, 2, 3) for h in range(0, 11, 3) for b in (0, 4)]


def assert_same(found: Evaluation, other: Evaluation) -> None:
    assert (found.violation, found.reason, found.samples) == (other.violation, other.reason, other.samples)
    np.testing.assert_array_equal(found.statistics, other.statistics)
    np.testing.assert_array_equal(found.constraints, other.constraints)
    assert (found.values is None) == (other.values is None)
    if found.values is not None:
        np.testing.assert_array_equal(found.values, other.values)


def test_workers_evaluate_as_this_process_does_and_share_the_memory():
    expected = {design: evaluate(STUDY, design) for design in DESIGNS}
    feasible = [result for result in expected.values() if result.feasible]
    best = non_dominated(np.array([result.objectives(STUDY) for result in feasible]))
    front = [result for result, kept in zip(feasible, best, strict=True) if kept]
    incumbents = Incumbents.of(STUDY, [r.values for r in front if r.values is not None], [r.statistics for r in front])
    with worker_processes(2) as some:
        assert some is not None
        found, raced = dict(evaluations(some, STUDY, DESIGNS)), dict(evaluations(some, STUDY, DESIGNS, incumbents))
        assert some.submit(memory_limit).result() == pytest.approx(memory_limit() / 2, rel=1e-6)
    assert found.keys() == raced.keys() == expected.keys()
    assert {result.samples for result in raced.values()} >= {0, 128, 256}
    for design in DESIGNS:
        assert_same(found[design], expected[design])
        assert_same(raced[design], evaluate(STUDY, design, incumbents))


def test_any_executor_gives_the_same_result():
    with ThreadPoolExecutor(2) as threads:
        assert optimise(SMALL, executor=threads).equals(optimise(SMALL, threads=1))


def first(design: Design) -> int:
    return int(design[0])


def deadly(folder: Path, how: str, design: Design) -> int:
    """Kill the process that works: on one design the first time, on another one each time if so told."""
    if (design == DESIGNS[3] and not (folder / "killed").exists()) or (design == DESIGNS[7] and how == "twice"):
        (folder / "killed").write_text("")
        os.kill(os.getpid(), signal.SIGKILL)
    return first(design)


@pytest.mark.slow  # starts eight processes
def test_workers_that_are_killed_lose_no_design_and_a_design_that_kills_two_is_named(tmp_path):
    shares = [[design] for design in DESIGNS]
    with worker_processes(2) as some:
        found = side_by_side(some, STUDY, partial(deadly, tmp_path, "once"), shares)
        assert sorted(found) == [(design, design[0]) for design in DESIGNS]
        assert (tmp_path / "killed").exists()
        values = ", ".join(f"{name} = {value}" for name, value in STUDY.values(DESIGNS[7]).items())
        with pytest.raises(GearbenchError, match=f"^the design {re.escape(values)} ended two worker processes"):
            dict(side_by_side(some, STUDY, partial(deadly, tmp_path, "twice"), shares))
        assert dict(side_by_side(some, STUDY, first, shares[:1])) == {DESIGNS[0]: DESIGNS[0][0]}


def test_an_executor_that_ends_with_its_worker_is_one_line():
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        assert pool.submit(os.abort).exception() is not None
        with pytest.raises(GearbenchError, match=r"^a worker process has ended: too little memory\?"):
            dict(evaluations(pool, SMALL, DESIGNS[:2]))


@pytest.mark.parametrize(
    ("name", "value", "line"),
    [
        ("versions", "numpy 1.26", r"has python 3.* gearbench .*, the search numpy 1\.26: install"),
        ("sources", "0", "has other source files of gearb"),
    ],
)
def test_a_worker_refuses_to_work_for_other_code(monkeypatch, name, value, line):
    asked_by = identity() | {name: value}
    require_same(identity())
    with pytest.raises(InputError, match=line) as fault:
        require_same(asked_by)
    assert len(str(fault.value)) < 290
    with ThreadPoolExecutor(1) as thread:
        thread.submit(lambda: None).result()
        monkeypatch.setattr(workers, "identity", iter([asked_by, identity()]).__next__)
        with pytest.raises(InputError, match=line):
            dict(evaluations(thread, SMALL, DESIGNS[:1]))


@pytest.mark.parametrize("how", [signal.SIGKILL, pytest.param(signal.SIGINT, marks=pytest.mark.slow)])
def test_workers_end_with_a_program_that_has_no_guard(tmp_path, how):
    """The program is not run again by its workers, and ends with them."""
    program = tmp_path / "program.py"
    program.write_text(
        "import os, time\nfrom gearbench.optimisation.workers import worker_processes\n"
        "with worker_processes(2) as some:\n"
        "    print(some.submit(os.getpid).result(), flush=True)\n"
        "    time.sleep(60)\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
    # a shell starts what runs in the background with Ctrl-C ignored, and that is handed down
    heard = partial(signal.signal, signal.SIGINT, signal.default_int_handler)
    with subprocess.Popen([sys.executable, program], env=environment, preexec_fn=heard, **pipes) as parent:
        assert parent.stdout is not None
        child = Path(f"/proc/{int(parent.stdout.readline())}")
        assert child.exists()
        parent.send_signal(how)
        parent.wait(20)
    deadline = time.monotonic() + 20
    while child.exists():
        assert time.monotonic() < deadline
        time.sleep(0.1)
