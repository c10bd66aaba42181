"""The tutorials do what they say: every file, command and program of each page, in order."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest
import xarray as xr

from tests.support.pages import compare, follow
from tests.support.paths import ROOT

GEARBOX = ROOT / "tests" / "data" / "sew_3_stage_cylindrical_gearbox_1.0.rexs"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder, the current one; output as on a wide terminal without colours."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "80")
    return tmp_path


@pytest.mark.slow
def test_from_a_scene_to_a_robust_front(folder):
    done = list(follow("tutorial_front.md"))
    assert [block.language for block in done].count("sh") == 6
    assert (folder / "front" / "front.nc").exists()
    assert len((folder / "remaining.csv").read_text().splitlines()) > 1


@pytest.mark.slow
def test_validate_your_own_pair(folder, monkeypatch):
    pytest.importorskip("gmsh", exc_type=ImportError)
    monkeypatch.setenv("GEARBENCH_CACHE", str(folder / "cache"))
    done = list(follow("tutorial_validate.md"))
    assert [block.language for block in done].count("python") == 3
    assert "<html" in (folder / "validation" / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_from_a_gearbox_to_its_whine(folder):
    shutil.copy(GEARBOX, folder / "gearbox.rexs")
    for block in follow("tutorial_response.md"):
        if block.language == "text":
            break
    assert (folder / "stage1.wav").stat().st_size == 44 + 2 * 441000
    kinds = ("bearings", "campbell", "force", "orders", "waterfall")
    drawn = {f"{kind}_{mesh}" for kind in kinds for mesh in ("pair", "stage_2", "stage_3")} | {"modes"}
    assert {path.stem for path in (folder / "plots").glob("*.png")} == drawn


@pytest.mark.slow
def test_from_the_data_sheet_of_a_planetary_set_to_its_quietest_arrangement(folder):
    done = list(follow("tutorial_planetary.md"))
    assert [block.language for block in done].count("python") == 4
    assert (folder / "quiet.nc").exists()
    static, over_speed = {"load_shares.png", "train.png"}, {"modes.png", "sharing.png", "ring.png"}
    assert static | over_speed < {path.name for path in (folder / "plots").glob("*.png")}


@pytest.mark.slow
def test_bring_measured_flanks(folder):
    shutil.copy(GEARBOX, folder / "gearbox.rexs")
    assert GEARBOX.relative_to(ROOT).as_posix() in (ROOT / "docs" / "tutorial_measured.md").read_text(encoding="utf-8")
    done = list(follow("tutorial_measured.md"))
    assert [block.language for block in done].count("python") == 1
    measured, ideal = (xr.load_dataset(f"{name}.nc", engine="h5netcdf") for name in ("measured", "ideal"))
    # the flank lacks material, which is negative in a file of excess: the pinion gets ahead
    assert float(measured["transmission_error_mean"]) > float(ideal["transmission_error_mean"])
    assert "pinion_sha256" in measured.attrs["scene"]


# like Slurm it copies the script, which dask deletes after the submission
SBATCH = """#!/bin/sh
cp "$1" "job-$$.sh"
bash "job-$$.sh" > "job-$$.log" 2>&1 &
echo "Submitted batch job $!"
"""
SCANCEL = """#!/bin/sh
kill "$@" 2> /dev/null
true
"""


@pytest.fixture
def slurm(tmp_path_factory, monkeypatch):
    """Commands of Slurm that run a job on this machine."""
    commands = tmp_path_factory.mktemp("bin")
    for name, text in (("sbatch", SBATCH), ("scancel", SCANCEL)):
        (commands / name).write_text(text)
        (commands / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{commands}{os.pathsep}{os.environ['PATH']}")


@pytest.mark.slow
def test_run_on_a_slurm_cluster(folder, slurm):
    pytest.importorskip("dask_jobqueue")
    shutil.copy(ROOT / "examples" / "optimise_small.toml", folder / "study.toml")
    for block in follow("tutorial_cluster.md"):
        if block.language == "console":
            assert block.text == "$ python search.py\n"
            subprocess.run([sys.executable, "search.py"], check=True, timeout=900, capture_output=True)
            logs = [log.read_text() for log in folder.glob("job-*.log")]
            # the second job may be cancelled before its worker is there: the search is small
            assert any("Registered to:" in log for log in logs), logs
    assert (folder / "front" / "front.nc").exists()


@pytest.mark.parametrize(
    ("shown", "printed"),
    [
        ("a 1.00 µm", "a 1.02 µm"),
        ("a\nb", "a\nc\nb"),
        ("a", "a\nb"),
        ("a\nb", "a"),
        ("−0.… %", "0.3 %"),
        ("…\nb", "a\nc"),
    ],
)
def test_what_is_not_printed_is_found(shown, printed):
    with pytest.raises(AssertionError):
        compare(shown, printed, "here")


def test_what_is_printed_is_found():
    compare("a 1.00 µm\n…\nb x…z", "a 1.009 µm\nc\nb xyz", "here")
