"""A sweep that is killed leaves what was done: no signal handler helps against SIGKILL."""

import subprocess
import sys
import time

import pytest

from gearbench.files import is_part
from gearbench.results.netcdf import open_result
from tests.support.paths import ROOT


@pytest.mark.slow
def test_a_killed_sweep_leaves_what_was_done(tmp_path):
    target = tmp_path / "grid.nc"
    amounts = ",".join(str(0.01 * n) for n in range(1, 81))
    command = [sys.executable, "-m", "gearbench", "sweep", "examples/case2.toml", "--torque", "100:300:10", "--quiet"]
    program = subprocess.Popen([*command, "--set", f"effects.crowning.amount={amounts}", "-o", target], cwd=ROOT)
    end = time.monotonic() + 300
    while not target.exists() and time.monotonic() < end:
        assert program.poll() is None
        time.sleep(0.05)
    time.sleep(0.3)
    program.kill()
    program.wait()
    found = open_result(target)  # whole, with the digest of its bytes
    done = found["transmission_error_mean"].notnull()
    assert found.attrs["complete"] == 0
    assert 0 < int(done.sum()) < done.size
    assert found["transmission_error_mean"].dims == ("torque", "effects.crowning.amount")
    left = [path for path in tmp_path.iterdir() if path != target]
    assert all(is_part(path.name) for path in left)
