"""Workers prove code, packages and a small evaluation; what is no scheduler is told in one line."""

from __future__ import annotations

import logging
import re
import shutil
import socket
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, HTTPServer
from threading import Thread
from types import SimpleNamespace

import pytest

from benchmarks import many_workers
from gearbench import load_study, optimise
from gearbench.errors import GearbenchError, InputError
from gearbench.optimisation import crew
from gearbench.optimisation.crew import Crew
from gearbench.optimisation.engine import Dask
from gearbench.optimisation.proof import difference, prove
from gearbench.optimisation.scheduler import check_scheduler, require_scheduler, silent
from gearbench.optimisation.study import Algorithm, Robustness
from tests.support.dask_processes import dask, scheduler
from tests.support.paths import ROOT

STUDY = replace(
    load_study(ROOT / "examples" / "optimise_small.toml"),
    algorithm=Algorithm(population=8, generations=3, seed=2),
    robustness=Robustness(samples=8),
)


# -- addresses ---------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "text", ["inproc://10.0.0.1/3/1", "http://host:8786", "ucx://host:1", "tcp://", "tcp://host", "local:0", "cluster"]
)
def test_what_is_no_address_of_a_scheduler_is_refused(text):
    with pytest.raises(InputError, match=r"^scheduler = .*: must be local:N, or an address such as tcp://host:8786$"):
        check_scheduler(text)


class Page(BaseHTTPRequestHandler):
    """A program that is no scheduler and says so in its own words."""

    def handle(self) -> None:
        self.connection.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n" + b"x" * 100)

    def log_message(self, *_: object) -> None:
        pass


@contextmanager
def addresses() -> Iterator[dict[str, str]]:
    """Of nobody, of somebody who says nothing, of another program, of a scheduler that asks for a certificate."""
    with socket.socket() as mute, socket.socket() as closed, HTTPServer(("127.0.0.1", 0), Page) as page:
        for each in (mute, closed):
            each.bind(("127.0.0.1", 0))
        mute.listen()
        Thread(target=page.serve_forever, daemon=True).start()
        ports = {"nobody": closed, "silent": mute, "foreign": page.socket}
        found = {name: f"tcp://127.0.0.1:{each.getsockname()[1]}" for name, each in ports.items()}
        yield {**found, "secret": found["silent"].replace("tcp", "tls"), "unknown": "tcp://no.such.host.invalid:8786"}
        page.shutdown()


def fault_at(address: str) -> tuple[str, float]:
    began = time.monotonic()
    with pytest.raises(GearbenchError) as fault:
        require_scheduler(address)
    return str(fault.value), time.monotonic() - began


def test_wrong_silent_and_foreign_addresses_are_one_line_within_ten_seconds(capfd):
    with addresses() as found, ThreadPoolExecutor(len(found)) as pool, silent():
        faults = dict(zip(found, pool.map(fault_at, found.values()), strict=True))
    for name, (line, seconds) in faults.items():
        assert seconds < 10, name
        assert line.startswith(f"scheduler {found[name]}: no "), line
        assert len(line) < 300
        assert "\n" not in line
    assert capfd.readouterr().err == ""


def test_the_command_says_so_in_one_line_before_it_searches(run, tmp_path):
    (tmp_path / "study.toml").write_text(STUDY.to_toml(), encoding="utf-8")
    with addresses() as found:
        words = ("optimise", tmp_path / "study.toml", "-o", tmp_path / "out", "--scheduler", found["foreign"])
        code, out, err = run(*words)
    assert (code, out) == (1, "")
    assert err.startswith(f"gearbench: scheduler {found['foreign']}: no dask scheduler answers there")
    assert err.count("\n") == 1


# -- proofs ------------------------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def ours():
    return prove(STUDY)


def test_a_proof_is_the_same_each_time_and_holds_an_evaluation(ours):
    assert difference(prove(STUDY), ours) == ""
    assert float(ours["answer"]["transmission_error_rms_mean"]) > 0
    assert {"gearbench/contact/_batch_kernels.py", "fem_reference/sector.py"} <= ours["code"].keys()


@pytest.mark.parametrize(
    ("part", "name", "value", "line"),
    [
        ("packages", "numpy", "1.26.0", r"numpy: 1\.26\.0 there, \d.* here"),
        ("packages", "python", "3.9.1", r"python: 3\.9\.1 there, 3\..* here"),
        ("code", "gearbench/contact/solver.py", "0" * 64, r"code differs: gearbench/contact/solver\.py"),
        ("code", "effect wavy", "0" * 64, "code differs: effect wavy"),
        ("loaded", "gearbench/scene.py", "0", r"its code has changed since it was started \(gearbench/scene\.py\)"),
        ("answer", "mesh_stiffness_rms_std", "1.5", r"mesh_stiffness_rms_std = 1\.5 there, 1\.8\d* here"),
    ],
)
def test_a_difference_is_one_line(ours, part, name, value, line):
    theirs = deepcopy(ours)
    theirs[part][name] = value
    found = difference(theirs, ours)
    assert re.search(line, found), found
    assert len(found) < 250


class FakeFuture:
    def __init__(self, result: object) -> None:
        self._result, self.status = result, "error" if isinstance(result, Exception) else "finished"

    def done(self) -> bool:
        return True

    def result(self) -> object:
        return self._result

    def exception(self) -> object:
        return self._result


def scheduler_of(workers: dict[str, object]) -> SimpleNamespace:
    """A client of a scheduler with workers that hand in these proofs."""
    return SimpleNamespace(
        nthreads=lambda: dict.fromkeys(workers, 1),
        submit=lambda work, study, workers_=workers, **how: FakeFuture(workers_[how["workers"][0]]),
    )


def test_a_search_does_not_begin_with_a_worker_that_differs(ours):
    theirs = deepcopy(ours)
    theirs["code"]["gearbench/scene.py"] = "0"
    for bad, why in ((theirs, "code differs"), (ModuleNotFoundError("No module named 'gearbench'"), "cannot evaluate")):
        client = scheduler_of({"tcp://a:1": ours, "tcp://b:2": bad})
        with pytest.raises(InputError, match=rf"^scheduler = tcp://s:1: worker tcp://b:2 is refused: .*{why}"):
            Crew(client, "tcp://s:1").proven(STUDY)


def test_workers_that_join_are_asked_too_and_left_out_if_they_differ(ours, caplog):
    workers: dict[str, object] = {"tcp://a:1": ours}
    known = Crew(scheduler_of(workers), "tcp://s:1")
    assert known.proven(STUDY) == {"tcp://a:1": 1}
    workers |= {"tcp://b:2": ours, "tcp://c:3": {**ours, "packages": {**ours["packages"], "scipy": "1.0"}}}
    assert known.proven(STUDY) == {"tcp://a:1": 1, "tcp://b:2": 1}
    assert "worker tcp://c:3 is refused: scipy: 1.0 there" in caplog.text
    del workers["tcp://a:1"]
    assert known.proven(STUDY) == {"tcp://b:2": 1}


def test_without_workers_it_says_so_and_how_long_it_waits(monkeypatch, caplog):
    monkeypatch.setattr(crew, "WAIT", 0.3)
    monkeypatch.setattr(crew, "SILENCE", 0.1)
    with (
        caplog.at_level(logging.WARNING),
        pytest.raises(GearbenchError, match=r"no worker is connected .* within 0 min"),
    ):
        Crew(scheduler_of({}), "tcp://s:1").proven(STUDY)
    assert caplog.messages == ["gearbench: no worker is connected to the scheduler tcp://s:1; waiting up to 0 min"]


# -- real ones ---------------------------------------------------------------------------------------------------------
@pytest.mark.slow
def test_a_worker_with_changed_code_of_the_same_version_is_refused(tmp_path):
    for folder in ("gearbench", "fem_reference"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    changed = tmp_path / "gearbench" / "contact" / "batch.py"
    changed.write_text(changed.read_text(encoding="utf-8").replace("NEWTON_LIMIT = 25", "NEWTON_LIMIT = 24"))
    fault = r"worker tcp://.* is refused: code differs: gearbench/contact/batch\.py$"
    with (
        scheduler() as (address, _),
        dask("worker", address, "--no-nanny", "--no-dashboard", path=tmp_path),
        pytest.raises(InputError, match=fault),
    ):
        optimise(STUDY, scheduler=address)


@pytest.mark.slow
def test_a_scheduler_that_is_killed_is_one_line_and_the_search_goes_on(tmp_path):
    whole = optimise(STUDY)
    longer = replace(STUDY, algorithm=replace(STUDY.algorithm, generations=40))
    with scheduler() as (address, process), dask("worker", address, "--no-nanny", "--no-dashboard"):
        with pytest.raises(GearbenchError, match=r"^the connection to the scheduler is lost: start it again") as fault:
            optimise(
                longer, directory=tmp_path, scheduler=address, progress=lambda s: s.generation == 2 and process.kill()
            )
        assert "\n" not in str(fault.value)
    with scheduler() as (address, _), dask("worker", address, "--no-nanny", "--no-dashboard"):
        resumed = optimise(longer, directory=tmp_path, scheduler=address, resume=True)
    assert resumed.attrs["data_sha256"] == optimise(longer).attrs["data_sha256"]
    assert (resumed["code"][: whole.sizes["design"]].values == whole["code"].values).all()


@pytest.mark.slow
def test_many_workers_that_are_lost_at_once_do_not_end_a_search():
    """Eight workers in one process are killed with it: each task may meet four of them, dying, in a row."""
    designs = [(i % 5, i // 5, 0, 0, 0, 0) for i in range(50)]
    study = many_workers.the_study(0.5)
    with (
        scheduler() as (address, _),
        many_workers.started("benchmarks.many_workers", address, "8") as lost,
        many_workers.started("benchmarks.many_workers", address, "2"),
        Dask(address) as engine,
    ):
        while len(engine.client.nthreads()) < 10:
            time.sleep(0.2)
        found = {}
        for design, result in engine.evaluate(study, designs):
            if not found:
                lost.kill()
            found[design] = result
    assert found.keys() == {*designs}
    assert all(result == many_workers.asleep(study, designs[0]) for result in found.values())
