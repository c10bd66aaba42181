"""Workers of a search: the same results, whatever becomes of them; a wrong scheduler is one line."""

from __future__ import annotations

import logging
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Future
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil
import pytest

from gearbench import optimise, read_study
from gearbench.budget import VARIABLE, MemoryBudgetError, memory_limit
from gearbench.errors import GearbenchError, InputError
from gearbench.optimisation import workers
from gearbench.optimisation.front import non_dominated
from gearbench.optimisation.problem import Evaluation, evaluate
from gearbench.optimisation.racing import Incumbents
from gearbench.optimisation.study import Algorithm, Robustness
from gearbench.optimisation.workers import (
    LostError,
    Pool,
    Workers,
    check_scheduler,
    evaluations,
    identity,
    open_workers,
    require_same,
)
from tests.support.dask_processes import dask, scheduler
from tests.support.paths import ROOT

STUDY = replace(read_study(ROOT / "examples" / "optimise_small.toml"), robustness=Robustness(samples=256, racing=True))
SMALL = replace(STUDY, algorithm=Algorithm(population=8, generations=3, seed=2), robustness=Robustness(samples=8))
DESIGNS = [(z, h, b, 2, 3, 3) for z in (1, 2, 3) for h in range(0, 11, 3) for b in (0, 4)]


# -- processes of this machine -----------------------------------------------------------------------------------------
def assert_same(found: Evaluation, other: Evaluation) -> None:
    assert (found.violation, found.reason, found.samples) == (other.violation, other.reason, other.samples)
    np.testing.assert_array_equal(found.statistics, other.statistics)
    np.testing.assert_array_equal(found.constraints, other.constraints)
    assert (found.values is None) == (other.values is None)
    if found.values is not None:
        np.testing.assert_array_equal(found.values, other.values)


def where(item: int) -> tuple[int, float]:
    """The process that works, and its memory; slow enough for workers to be started meanwhile."""
    time.sleep(0.02)
    return os.getpid(), memory_limit()


def warm(some: Workers) -> None:
    """Wait until workers do all the work."""
    for _ in range(600):
        if os.getpid() not in {process for _, (process, _) in some.map(where, range(3))}:
            return
        time.sleep(0.1)
    raise AssertionError("no worker became ready")


def test_workers_evaluate_as_this_process_does():
    expected = {design: evaluate(STUDY, design) for design in DESIGNS}
    feasible = [result for result in expected.values() if result.feasible]
    best = [
        r
        for r, kept in zip(feasible, non_dominated(np.array([r.objectives(STUDY) for r in feasible])), strict=True)
        if kept
    ]
    incumbents = Incumbents.of(STUDY, [r.values for r in best if r.values is not None], [r.statistics for r in best])
    with open_workers(threads=2, after=0.0) as some:
        warm(some)
        found, raced = dict(evaluations(some, STUDY, DESIGNS)), dict(evaluations(some, STUDY, DESIGNS, incumbents))
    assert found.keys() == raced.keys() == expected.keys()
    assert {result.samples for result in raced.values()} >= {0, 128, 256}
    for design in DESIGNS:
        assert_same(found[design], expected[design])
        assert_same(raced[design], evaluate(STUDY, design, incumbents))


def test_workers_start_once_this_process_has_worked_for_a_while_and_share_the_memory(monkeypatch):
    monkeypatch.setenv(VARIABLE, "6e8")
    with open_workers(threads=3) as some:
        found = dict(some.map(where, range(5)))
        assert found == dict.fromkeys(range(5), (os.getpid(), 2e8))
    with open_workers(threads=2, after=0.0) as some:
        warm(some)
        processes, memory = zip(*dict(some.map(where, range(20))).values(), strict=True)
        assert len({*processes}) == 2
        assert {*memory} == {3e8}
        huge = replace(STUDY, base=STUDY.base | {"resolution": {"positions": 20_000, "segments": 400}})
        with pytest.raises(MemoryBudgetError, match="300 MB are allowed"):
            dict(evaluations(some, huge, [(2, 3, 4, 2, 3, 3)]))


def deadly(item: tuple[int, str, str]) -> int:
    """Kill the process that works: on item 3 the first time, on item 7 each time if so told."""
    number, folder, how = item
    once = Path(folder) / "killed"
    if (number == 3 and not once.exists()) or (number == 7 and how == "twice"):
        once.write_text("")
        os.kill(os.getpid(), signal.SIGKILL)
    return number


class Mortal(Pool):
    """A pool that breaks as the processes do: all its tasks are lost with one that holds a deadly item."""

    lost, disconnected, ready, count = (BrokenExecutor,), (), True, 2

    def __init__(self, *deadly: int) -> None:
        self.deadly = [*deadly]
        self.asked: list[tuple] = []

    def submit(self, apply, identity, function, share):
        found = Future()
        self.asked = [each for each in self.asked if not each[0].done()] + [(found, function, share)]
        if len(self.asked) == 4 or len(share) == 1:
            killer = next((item for _, _, items in self.asked for item in items if item in self.deadly), None)
            for future, function, items in self.asked:
                if killer is None:
                    future.set_result(apply(identity, function, items))
                else:
                    future.set_exception(BrokenExecutor())
            if killer is not None:
                self.deadly.remove(killer)
        return found

    def close(self):
        pass


def test_items_of_a_lost_worker_are_done_again_and_one_that_loses_two_is_reported():
    assert sorted(Workers(Mortal(3)).map(abs, range(30))) == [(i, i) for i in range(30)]
    with pytest.raises(LostError) as fault:
        dict(Workers(Mortal(7, 7)).map(abs, range(30)))
    assert fault.value.item == 7


@pytest.mark.slow  # starts eight processes
def test_workers_that_are_killed_lose_no_item_and_an_item_that_kills_two_is_reported(tmp_path):
    with open_workers(threads=2, after=0.0) as some:
        warm(some)
        items = [(i, str(tmp_path), "once") for i in range(30)]
        assert sorted(number for _, number in some.map(deadly, items)) == [*range(30)]
        assert (tmp_path / "killed").exists()
        with pytest.raises(LostError) as fault:
            dict(some.map(deadly, [(i, str(tmp_path), "twice") for i in range(30)]))
        assert fault.value.item[0] == 7


def test_a_design_that_ends_its_workers_is_named_by_its_values(monkeypatch):
    def lost(*_: object) -> Iterator[object]:
        raise LostError(DESIGNS[0])
        yield

    monkeypatch.setattr(Workers, "map", lost)
    with (
        open_workers() as some,
        pytest.raises(GearbenchError, match=r"the design teeth = 16, .* ended two"),
    ):
        dict(evaluations(some, STUDY, DESIGNS))


@pytest.mark.parametrize("how", [signal.SIGKILL, pytest.param(signal.SIGINT, marks=pytest.mark.slow)])
def test_workers_end_with_the_process_that_started_them(how):
    code = (
        "import os, time\nfrom gearbench.optimisation.workers import open_workers\n"
        "from tests.optimisation.test_workers import warm, where\n"
        "some = open_workers(threads=2, after=0.0)\nwarm(some)\n"
        "print(*{process for _, (process, _) in some.map(where, range(9))}, flush=True)\ntime.sleep(60)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as parent:
        assert parent.stdout is not None
        children = [int(number) for number in parent.stdout.readline().split()]
        assert children
        parent.send_signal(how)
        parent.wait(20)
    deadline = time.monotonic() + 20
    while any(Path(f"/proc/{child}").exists() for child in children):
        assert time.monotonic() < deadline
        time.sleep(0.1)


# -- the same code -----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("name", "value", "line"),
    [
        ("versions", "numpy 1.26", r"has python 3.* gearbench .*, the search numpy 1\.26: install"),
        ("sources", "0", "has other source files of gearb"),
    ],
)
def test_a_worker_refuses_to_work_for_other_code(name, value, line):
    require_same(identity())
    with pytest.raises(InputError, match=line) as fault:
        require_same(identity() | {name: value})
    assert len(str(fault.value)) < 290


# -- schedulers --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "text", ["inproc://10.0.0.1/3/1", "http://host:8786", "ucx://host:1", "tcp://", "tcp://host", "local:0", "cluster"]
)
def test_what_is_no_address_of_a_scheduler_is_refused(text):
    with pytest.raises(InputError, match=r"^scheduler = .*: must be local:N, or an address such as tcp://host:8786$"):
        check_scheduler(text)


@pytest.mark.parametrize("listens", [False, True])
def test_an_address_where_no_scheduler_answers_is_one_line(run, tmp_path, monkeypatch, listens):
    monkeypatch.setattr(workers, "ANSWERS", 0.5)
    (tmp_path / "study.toml").write_text(SMALL.to_toml(), encoding="utf-8")
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        if listens:
            other.listen()
        address = f"tcp://127.0.0.1:{other.getsockname()[1]}"
        code, out, err = run("optimise", tmp_path / "study.toml", "-o", tmp_path / "out", "--scheduler", address)
    assert (code, out) == (1, "")
    assert err.startswith(f"gearbench: scheduler {address}: cannot be used (")
    assert err.count("\n") == 1


# -- workers of dask ---------------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def expected() -> str:
    return optimise(SMALL, threads=1).attrs["data_sha256"]


def test_a_scheduler_without_workers_is_waited_for_and_told(monkeypatch, caplog):
    monkeypatch.setattr(workers, "WAIT", 0.3)
    with (
        scheduler() as (address, _),
        caplog.at_level(logging.WARNING),
        pytest.raises(GearbenchError, match=rf"^scheduler {address}: cannot be used"),
    ):
        optimise(SMALL, scheduler=address)
    assert caplog.messages == [f"gearbench: the scheduler {address} has no worker; waiting up to 0 min"]


@pytest.mark.slow
def test_workers_of_dask_do_not_change_the_result_and_one_that_is_killed_costs_time_only(expected):
    with scheduler() as (address, _), dask("worker", address, "--nworkers", "2", "--no-dashboard") as nannies:
        assert optimise(SMALL, scheduler=address).attrs["data_sha256"] == expected
        killed: list[object] = []

        def kill(state: object) -> None:
            if not killed:
                started = [c for c in psutil.Process(nannies.pid).children() if "spawn_main" in " ".join(c.cmdline())]
                killed.append(started[0].kill())

        assert optimise(SMALL, scheduler=address, progress=kill).attrs["data_sha256"] == expected
        assert killed
    assert optimise(SMALL, scheduler="local:2").attrs["data_sha256"] == expected


@pytest.mark.slow
def test_a_worker_with_changed_code_of_the_same_version_is_refused(tmp_path):
    for folder in ("gearbench", "fem_reference"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    changed = tmp_path / "gearbench" / "contact" / "batch.py"
    changed.write_text(changed.read_text(encoding="utf-8") + "# changed\n")
    with (
        scheduler() as (address, _),
        dask("worker", address, "--no-nanny", "--no-dashboard", path=tmp_path),
        pytest.raises(InputError, match=r"^worker = on .*: has other source files of gearbench: install"),
    ):
        optimise(SMALL, scheduler=address)


@pytest.mark.slow
def test_a_scheduler_that_is_killed_is_one_line_and_the_search_goes_on(tmp_path, expected):
    with scheduler() as (address, process), dask("worker", address, "--no-nanny", "--no-dashboard"):
        with pytest.raises(GearbenchError, match=r"^the connection to the scheduler is lost: start it again") as fault:
            optimise(
                SMALL, directory=tmp_path, scheduler=address, progress=lambda s: s.generation == 1 and process.kill()
            )
        assert "\n" not in str(fault.value)
    assert optimise(SMALL, directory=tmp_path, resume=True).attrs["data_sha256"] == expected
