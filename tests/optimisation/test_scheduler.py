"""Searches on the workers of a dask scheduler: the same results, and one line where the scheduler is of no use."""

from __future__ import annotations

import shutil
import socket
import subprocess
import sys
from dataclasses import replace

import psutil
import pytest
import xarray as xr

from gearbench import optimise, read_study
from gearbench.errors import GearbenchError, InputError
from gearbench.optimisation import scheduler as schedulers
from gearbench.optimisation.run import Progress
from gearbench.optimisation.scheduler import dask_workers
from gearbench.optimisation.study import Algorithm, Robustness
from tests.support.dask_processes import dask, scheduler
from tests.support.paths import ROOT, STUDY

SMALL = replace(
    read_study(STUDY), algorithm=Algorithm(population=8, generations=3, seed=2), robustness=Robustness(samples=8)
)


@pytest.fixture(scope="module")
def expected() -> xr.Dataset:
    return optimise(SMALL, threads=1)


@pytest.mark.parametrize(
    "text", ["inproc://10.0.0.1/3/1", "http://host:8786", "ucx://host:1", "tcp://", "tcp://host", "local:0", "cluster"]
)
def test_what_is_no_address_of_a_scheduler_is_refused(refused, tmp_path, text):
    line = refused("optimise", STUDY, "-o", tmp_path / "out", "--scheduler", text)
    assert f"scheduler = {text}: must be local:N, or an address such as tcp://host:8786" in line


def test_dask_that_is_not_installed_is_one_line(refused, tmp_path, monkeypatch):
    monkeypatch.setattr(schedulers, "find_spec", lambda _: None)
    line = refused("optimise", STUDY, "-o", tmp_path / "out", "--scheduler", "local:2")
    assert "scheduler = local:2: needs dask.distributed: pip install 'gearbench[optimise]" in line


@pytest.mark.parametrize("listens", [False, True])
def test_an_address_where_no_scheduler_answers_is_one_line(refused, tmp_path, monkeypatch, listens):
    monkeypatch.setattr(schedulers, "ANSWER_LIMIT", 0.5)
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        if listens:
            other.listen()
        address = f"tcp://127.0.0.1:{other.getsockname()[1]}"
        line = refused("optimise", STUDY, "-o", tmp_path / "out", "--scheduler", address)
    assert f"scheduler = {address}: cannot be used (" in line


def test_a_scheduler_without_workers_is_one_line(monkeypatch):
    monkeypatch.setattr(schedulers, "WORKER_LIMIT", 0.3)
    with (
        scheduler() as (address, _),
        pytest.raises(InputError, match=rf"^scheduler = {address}: cannot be used \(Only 0/1 workers"),
        dask_workers(address),
    ):
        pass


@pytest.mark.slow
def test_workers_of_dask_do_not_change_the_result_and_one_that_is_killed_costs_time_only(expected):
    with scheduler() as (address, _), dask("worker", address, "--nworkers", "2", "--no-dashboard") as nannies:
        killed: list[object] = []

        def kill(state: object) -> None:
            if not killed:
                started = [c for c in psutil.Process(nannies.pid).children() if "spawn_main" in " ".join(c.cmdline())]
                killed.append(started[0].kill())

        with dask_workers(address) as workers:
            assert optimise(SMALL, executor=workers).equals(expected)
            assert optimise(SMALL, executor=workers, progress=kill).equals(expected)
        assert killed


@pytest.mark.slow
def test_the_command_line_on_dask_workers_of_this_machine(tmp_path, expected):
    (tmp_path / "study.toml").write_text(SMALL.to_toml(), encoding="utf-8")
    command = [sys.executable, "-m", "gearbench", "optimise", tmp_path / "study.toml", "-o", tmp_path / "out", "-q"]
    done = subprocess.run([*command, "--scheduler", "local:2"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    with xr.open_dataset(tmp_path / "out" / "front.nc", engine="h5netcdf") as front:
        assert front.equals(expected)


@pytest.mark.slow
def test_a_worker_with_changed_code_of_the_same_version_is_refused(tmp_path):
    for folder in ("gearbench", "fem_reference"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    changed = tmp_path / "gearbench" / "contact" / "batch.py"
    changed.write_text(changed.read_text(encoding="utf-8") + "# changed\n")
    with (
        scheduler() as (address, _),
        dask("worker", address, "--no-nanny", "--no-dashboard", path=tmp_path),
        dask_workers(address) as workers,
        pytest.raises(InputError, match=r"^worker = .*: has other source files of gearbench: install"),
    ):
        optimise(SMALL, executor=workers)


@pytest.mark.slow
def test_a_scheduler_that_is_killed_is_one_line_and_the_search_goes_on(tmp_path, expected):
    with scheduler() as (address, process), dask("worker", address, "--no-nanny", "--no-dashboard"):

        def kill(state: Progress) -> None:
            if state.generation == 1:
                process.kill()

        with (
            pytest.raises(GearbenchError, match=r"^the connection to the scheduler is lost: start it again") as fault,
            dask_workers(address) as workers,
        ):
            optimise(SMALL, directory=tmp_path, executor=workers, progress=kill)
        assert "\n" not in str(fault.value)
    assert optimise(SMALL, directory=tmp_path, resume=True).equals(expected)
