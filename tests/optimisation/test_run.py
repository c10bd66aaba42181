"""Whole runs: the same result whatever computes it and however often it is interrupted."""

import os
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import gearbench
from gearbench import design_scene, optimise, read_study
from gearbench.errors import InputError
from gearbench.optimisation.front import non_dominated
from gearbench.optimisation.problem import Evaluation, evaluate
from gearbench.optimisation.study import Algorithm, Design, OptimisationStudy, Robustness
from gearbench.optimisation.study_file import parse_study
from gearbench.results.netcdf import open_result
from tests.support.paths import EXAMPLES, ROOT

EXAMPLE = EXAMPLES / "optimise_small.toml"
STUDY = replace(
    read_study(EXAMPLE),
    algorithm=Algorithm(population=8, generations=4, seed=2),
    robustness=Robustness(samples=8),
)


@pytest.fixture(scope="module")
def reference() -> xr.Dataset:
    """The result of an uninterrupted run that stores nothing."""
    return optimise(STUDY, threads=1)


@pytest.fixture(scope="module")
def stored(tmp_path_factory) -> tuple[Path, xr.Dataset]:
    """The folder of the same run, and what it returned."""
    folder = tmp_path_factory.mktemp("stored") / "out"
    return folder, optimise(STUDY, directory=folder, threads=1)


@pytest.fixture
def copy(stored, tmp_path) -> Path:
    """A copy of the folder, to be damaged and resumed."""
    return shutil.copytree(stored[0], tmp_path / "copy")


@pytest.fixture
def study_file(tmp_path) -> Path:
    path = tmp_path / "study.toml"
    path.write_text(STUDY.to_toml(), encoding="utf-8")
    return path


def noted(seen: list, study: OptimisationStudy, design: Design, incumbents: object) -> Evaluation:
    seen.append(design)
    return evaluate(study, design)


def seen_designs(monkeypatch) -> list:
    """Designs that are evaluated from here on."""
    seen = []
    monkeypatch.setattr("gearbench.optimisation.workers.evaluate", partial(noted, seen))
    return seen


def assert_same(dataset: xr.Dataset, reference: xr.Dataset) -> None:
    xr.testing.assert_identical(dataset.drop_attrs(), reference.drop_attrs())
    assert dataset.equals(reference)
    assert dataset.attrs["study_sha256"] == reference.attrs["study_sha256"]


# -- what the result holds ---------------------------------------------------------------------------------------------
def test_the_dataset_holds_every_design_and_the_front(reference):
    a = STUDY.algorithm
    assert int(reference["asked"].sum()) == a.population * a.generations
    assert int(reference["evaluated"].sum()) == reference.sizes["design"]
    feasible = reference["feasible"].values == 1
    assert 0 < feasible.sum() < feasible.size
    assert int(reference["feasible_found"][-1]) == feasible.sum()
    F = reference["objective"].values
    np.testing.assert_array_equal(np.isnan(F).any(axis=1), ~feasible)
    expected = np.zeros(feasible.size, dtype=bool)
    expected[feasible] = non_dominated(F[feasible])
    np.testing.assert_array_equal(reference["on_front"].values == 1, expected)
    assert all((str(reason) == "") == ok for reason, ok in zip(reference["reason"].values, feasible, strict=True))
    assert np.all(np.diff(reference["hypervolume"]) >= 0)
    for design, generation in enumerate(reference["first_generation"].values):
        asked = [design in row for row in reference["asked_design"].values]
        assert asked.index(True) + 1 == generation
    assert reference["transmission_error_rms_mean"].attrs["units"] == "µm"
    assert reference["mesh_stiffness_rms_max"].attrs["units"] == "%"
    assert reference["contact_pressure"].attrs["limit_max"] == 1500.0
    assert tomllib.loads(reference.attrs["study"]) == tomllib.loads(STUDY.to_toml())


def test_objectives_follow_from_the_scene_of_a_design(reference):
    best = int(np.nanargmin(reference["objective"].values[:, 0]))
    dataset = gearbench.robust(design_scene(reference, best), samples=8, threads=1)
    for i, name in enumerate(("mesh_stiffness_rms_mean", "transmission_error_rms_mean")):
        assert float(dataset[name]) == float(reference["objective"][best, i]) == float(reference[name][best])
    with pytest.raises(InputError, match="design = 999"):
        design_scene(reference, 999)


def test_no_feasible_design_is_a_result_with_reasons(run, tmp_path):
    tables = tomllib.loads(STUDY.to_toml())
    tables["constraints"] = {"total_contact_ratio": {"min": 9.0}}
    (tmp_path / "study.toml").write_text(OptimisationStudy.to_toml(parse_study(tables)), encoding="utf-8")
    code, out, err = run("optimise", tmp_path / "study.toml", "-o", tmp_path / "out")
    assert (code, err) == (0, "")
    assert "0 on the front" in out
    assert "no feasible design; most often: " in out


# -- workers do not matter ---------------------------------------------------------------------------------------------
def test_worker_processes_do_not_change_the_result_and_leave_nothing_on_the_error_stream(
    reference, study_file, tmp_path
):
    command = [sys.executable, "-m", "gearbench", "optimise", study_file, "-o", tmp_path / "out", "-q"]
    done = subprocess.run([*command, "--threads", "2"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert_same(open_result(tmp_path / "out" / "front.nc"), reference)


def test_equal_designs_are_evaluated_once(monkeypatch):
    tables = tomllib.loads(STUDY.to_toml())
    tables["variables"] = {key: tables["variables"][key] for key in ("teeth", "addendum")}
    tables["algorithm"]["generations"] = 12
    seen = seen_designs(monkeypatch)
    dataset = optimise(parse_study(tables), threads=1)
    assert len(seen) == len(set(seen)) == dataset.sizes["design"] <= 5 * 11
    assert int(dataset["asked"].sum()) > dataset.sizes["design"]
    assert int(dataset["evaluated"].sum()) == dataset.sizes["design"]


# -- the store ---------------------------------------------------------------------------------------------------------
def test_a_stored_run_equals_one_that_is_not_stored(reference, stored):
    folder, dataset = stored
    assert_same(dataset, reference)
    names = sorted(path.name for path in folder.iterdir())
    assert names == [".lock", "front.nc", *(f"generation_{g:04d}.nc" for g in range(1, 5)), "study.toml"]
    with xr.open_dataset(folder / "front.nc", engine="h5netcdf") as front:
        assert front.equals(reference)
        np.testing.assert_array_equal(front["objective"], reference["objective"])
    with xr.open_dataset(folder / "generation_0003.nc", engine="h5netcdf") as generation:
        assert generation.sizes["design"] == 8
        assert generation.attrs["generation"] == 3
        assert generation.attrs["algorithm_seed"] == 2
        assert {"code", "objective", "feasible", "reason", "specific_sliding", "teeth"} <= set(generation.variables)


def test_what_is_stored_is_not_computed_again(reference, copy, monkeypatch):
    before = {path.name: path.read_bytes() for path in copy.glob("generation_*.nc")}
    for generation in (3, 4):
        (copy / f"generation_{generation:04d}.nc").unlink()
    seen = seen_designs(monkeypatch)
    states = []
    assert_same(optimise(STUDY, directory=copy, resume=True, threads=1, progress=states.append), reference)
    assert len(seen) == int(reference["evaluated"][2:].sum()) > 0
    assert states[-1].restored == 2
    assert states[-1].evaluated == reference.sizes["design"]
    assert {path.name: path.read_bytes() for path in copy.glob("generation_*.nc")} == before


def test_a_generation_that_cannot_be_read_is_computed_again(reference, copy):
    whole = (copy / "generation_0003.nc").read_bytes()
    os.truncate(copy / "generation_0004.nc", 3000)
    (copy / "generation_0003.nc").write_bytes(b"")
    (copy / ".generation_0004.nc.abc.part").write_bytes(b"half")
    assert_same(optimise(STUDY, directory=copy, resume=True, threads=1), reference)
    assert (copy / "generation_0003.nc").read_bytes() == whole
    assert [path.name for path in copy.glob(".*")] == [".lock"]


def test_generations_of_another_search_are_refused(tmp_path):
    from gearbench.optimisation.store import Store

    optimise(
        replace(STUDY, algorithm=replace(STUDY.algorithm, seed=9, generations=1)),
        directory=tmp_path / "other",
        threads=1,
    )
    with Store(tmp_path / "mine", STUDY, resume=False):
        pass
    os.replace(tmp_path / "other" / "generation_0001.nc", tmp_path / "mine" / "generation_0001.nc")
    with pytest.raises(InputError, match=r"generation_0001\.nc: was searched with python .* continue with those"):
        optimise(STUDY, directory=tmp_path / "mine", resume=True, threads=1)


def test_a_folder_holds_one_run_at_a_time(tmp_path):
    from gearbench.optimisation.store import Store

    with (
        Store(tmp_path, STUDY, resume=False),
        pytest.raises(InputError, match="another run is writing into the folder"),
    ):
        optimise(STUDY, directory=tmp_path, resume=True)
    with Store(tmp_path, STUDY, resume=True):
        pass


# -- the command line --------------------------------------------------------------------------------------------------
def test_the_command_runs_refuses_and_resumes(run, study_file, tmp_path, reference):
    folder = tmp_path / "out"
    code, out, err = run("optimise", study_file, "-o", folder)
    assert (code, err) == (0, "")
    assert f"{reference.sizes['design']} evaluated" in out
    assert "on the front" in out
    assert "wrote" in out
    code, out, err = run("optimise", study_file, "-o", folder)
    assert code == 2
    assert err == f"gearbench: output = {folder}: the folder is not empty: continue its search with --resume\n"
    code, out, err = run("optimise", study_file, "-o", folder, "--resume", "--json")
    assert (code, err) == (0, "")
    assert f'"on_front": {int(reference["on_front"].sum())}' in out


def test_bad_input_is_one_line(refused, study_file, tmp_path):
    folder = tmp_path / "out"
    (tmp_path / "file").write_text("")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "letter.txt").write_text("")
    optimise(replace(STUDY, algorithm=Algorithm(population=4, generations=1)), directory=folder, threads=1)
    for arguments, message in (
        ((tmp_path / "none.toml", "-o", folder), "none.toml: no such file or directory"),
        ((study_file, "-o", tmp_path / "file"), "must be a folder"),
        ((study_file, "-o", tmp_path / "full"), "the folder is not empty"),
        ((study_file, "-o", tmp_path / "full", "--resume"), "holds no optimisation"),
        ((study_file, "-o", folder, "--resume"), "belongs to another study"),
        ((study_file, "-o", "/proc/none", "--resume"), "must be a folder"),
    ):
        assert message in refused("optimise", *arguments)


@pytest.mark.slow
def test_ctrl_c_keeps_the_generations_and_says_how_to_continue(reference, tmp_path):
    study = replace(STUDY, algorithm=replace(STUDY.algorithm, generations=500))
    path, folder = tmp_path / "study.toml", tmp_path / "out"
    path.write_text(study.to_toml(), encoding="utf-8")
    command = [sys.executable, "-m", "gearbench", "optimise", str(path), "-o", str(folder)]
    # a shell starts what runs in the background with Ctrl-C ignored, and that is handed down
    heard = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, text=True, preexec_fn=heard, **pipes) as process:
        try:
            while not (folder / "generation_0002.nc").exists() and process.poll() is None:
                time.sleep(0.01)
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=60)
        finally:
            process.kill()
    assert process.returncode == 130, err
    kept = len(list(folder.glob("generation_*.nc")))
    again = f"gearbench optimise {path} -o {folder} --resume"
    assert err == f"gearbench: interrupted; {kept} generations are kept. Continue with: {again}\n"
    assert [path.name for path in folder.glob(".*")] == [".lock"]
    with xr.open_dataset(folder / "generation_0001.nc", engine="h5netcdf") as first:
        np.testing.assert_array_equal(first["code"], reference["code"][:8])
