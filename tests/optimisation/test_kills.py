"""A search that is killed or interrupted at random moments: resumed, it ends as if nothing had happened."""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from gearbench import optimise, read_study
from gearbench.optimisation.study import Algorithm, Robustness
from gearbench.results.netcdf import open_result
from tests.support.campaign import many
from tests.support.paths import STUDY
from tests.support.programs import end, start

SMALL = replace(
    read_study(STUDY), algorithm=Algorithm(population=8, generations=6, seed=2), robustness=Robustness(samples=8)
)


def ended(folder: Path, moment: float = 60.0, how: signal.Signals | None = None) -> bool:
    """Begin or continue the search in ``folder``, and end it at some moment; whether it came to its own end."""
    search = start(
        sys.executable, "-m", "gearbench", "optimise", folder / "study.toml", "-o", folder / "out", "--resume"
    )
    if how:
        time.sleep(moment)
        search.send_signal(how)
    code, err = end(search)
    # a signal that comes before gearbench has begun ends Python
    assert (code, err) == (0, "") or code == -how or (code == 128 + how and err.startswith("gearbench: interrupted"))
    return code == 0


@pytest.mark.slow
def test_many_kills_and_as_many_identical_results(tmp_path):
    """Killed once, or twice in a row."""
    rng, expected = random.Random(2), optimise(SMALL, threads=1)
    (tmp_path / "study.toml").write_text(SMALL.to_toml(), encoding="utf-8")
    begun = time.monotonic()
    assert ended(tmp_path)
    duration, in_time, count = time.monotonic() - begun, 0, many(6)
    for i in range(count):
        folder = tmp_path / str(i)
        folder.mkdir()
        (folder / "study.toml").write_text(SMALL.to_toml(), encoding="utf-8")
        how = (signal.SIGKILL, signal.SIGINT, signal.SIGKILL, signal.SIGTERM)[i % 4]
        for _ in range(1 + i % 2):
            in_time += not ended(folder, rng.uniform(0.3, 1.0) * duration, how)
        assert ended(folder)
        assert open_result(folder / "out" / "front.nc").equals(expected)
        generations = [f"generation_{g:04d}.nc" for g in range(1, 7)]
        assert sorted(os.listdir(folder / "out")) == [".lock", "front.nc", *generations, "study.toml"]
    # machines are uneven: a run may end before its moment comes, but not most of them
    assert in_time >= count // 3
