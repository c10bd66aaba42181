"""Searches that are killed or interrupted at random moments: resumed, they end as if nothing had happened.

The processes that are killed are forks of one that has everything imported and compiled, so that many can be.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gearbench import optimise, read_study
from gearbench.optimisation.study import Algorithm, OptimisationStudy, Robustness
from gearbench.results.netcdf import open_result
from tests.support.campaign import many
from tests.support.paths import ROOT

STUDY = replace(
    read_study(ROOT / "examples" / "optimise_small.toml"),
    algorithm=Algorithm(population=8, generations=6, seed=2),
    robustness=Robustness(samples=8),
)


NURSERY = """
import os, signal, sys
from gearbench import read_study, optimise
from gearbench.cli import main

study = read_study(sys.argv[1])
optimise(study, threads=1)
# a search that does not listen yet dies silently, as a program does that Python has not begun
signal.signal(signal.SIGINT, signal.SIG_DFL)

print("ready", flush=True)
for line in iter(sys.stdin.readline, ""):
    folder, *more = line.split()
    said = os.open(folder + ".err", os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    child = os.fork()
    if child == 0:
        os.dup2(said, 2)
        os.dup2(said, 1)
        sys.argv = ["gearbench", "optimise", sys.argv[1], "-o", folder, "--resume", "-q", *more]
        main()
    os.close(said)
    print(child, flush=True)
    sys.stdin.readline()  # until then its number is not given to another process
    _, status = os.waitpid(child, 0)
    print(os.waitstatus_to_exitcode(status), flush=True)
"""


@dataclass(frozen=True)
class Nursery:
    """A process whose children are searches."""

    process: subprocess.Popen[str]
    folder: Path

    def _answer(self, line: str) -> int:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        return int(self.process.stdout.readline())

    def start(self, folder: Path, *more: str) -> int:
        """Begin or resume a search in ``folder``; its process."""
        return self._answer(" ".join([str(folder), *more]))

    def end(self) -> int:
        """Exit code of the search, the number of the signal that killed it less than zero."""
        return self._answer("")


@contextmanager
def nursery(study: OptimisationStudy, folder: Path) -> Iterator[Nursery]:
    (folder / "study.toml").write_text(study.to_toml(), encoding="utf-8")
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", NURSERY, str(folder / "study.toml")]
    # a shell starts what runs in the background with Ctrl-C ignored, and that is handed down
    heard = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)  # noqa: E731
    with subprocess.Popen(command, env=environment, preexec_fn=heard, **pipes) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        yield Nursery(process, folder)
        process.kill()


def end_at(nest: Nursery, folder: Path, moment: float, how: signal.Signals, *more: str) -> bool:
    """Send a signal to a new search at some moment; whether it was still running."""
    child = nest.start(folder, *more)
    time.sleep(moment)
    os.kill(child, how)  # one that has ended is waited for only after this
    code = nest.end()
    lines = Path(f"{folder}.err").read_text(encoding="utf-8")
    if code == 0:
        assert lines == ""
        return False
    if how == signal.SIGKILL:
        assert code == -signal.SIGKILL, lines
    else:
        assert code in (128 + how, -how), lines
        assert lines.count("\n") == (code > 0), lines
        assert lines.startswith("gearbench: interrupted" * (code > 0))
    return True


def assert_as_if_nothing_had_happened(folder: Path, expected: xr.Dataset) -> None:
    front = open_result(folder / "front.nc")
    assert front.equals(expected)
    np.testing.assert_array_equal(front["objective"].values, expected["objective"].values)
    generations = [f"generation_{g:04d}.nc" for g in range(1, expected.sizes["generation"] + 1)]
    assert sorted(os.listdir(folder)) == [".lock", "front.nc", *generations, "study.toml"]


def kill_and_resume(count: int, study: OptimisationStudy, tmp_path: Path, seed: int, *more: str) -> None:
    """Kill and interrupt searches, twice in a row at times; each is resumed to its end."""
    rng, expected = random.Random(seed), optimise(study, threads=1)
    with nursery(study, tmp_path) as nest:
        began = time.monotonic()
        nest.start(tmp_path / "whole", *more)
        assert nest.end() == 0, (tmp_path / "whole.err").read_text(encoding="utf-8")
        duration = time.monotonic() - began
        assert_as_if_nothing_had_happened(tmp_path / "whole", expected)
        in_time = 0
        for i in range(count):
            folder = tmp_path / str(i)
            how = (signal.SIGKILL, signal.SIGINT, signal.SIGKILL, signal.SIGTERM)[i % 4]
            ended = end_at(nest, folder, rng.uniform(0.0, duration), how, *more)
            if ended and i % 5 == 0:
                end_at(nest, folder, rng.uniform(0.0, duration / 2), how, *more)
            in_time += ended
            nest.start(folder, *more)
            assert nest.end() == 0, Path(f"{folder}.err").read_text(encoding="utf-8")
            assert_as_if_nothing_had_happened(folder, expected)
    # machines are uneven: a run may end before its moment comes, but not most of them
    assert in_time >= count // 3


@pytest.mark.slow
def test_many_kills_and_as_many_identical_results(tmp_path):
    kill_and_resume(many(8), STUDY, tmp_path, 2, "--threads", "2")
