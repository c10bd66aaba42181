"""The command line as a user meets it: results, files, and one clear line for every fault."""

import json
import re
import sys
import tomllib

import numpy as np
import pytest
import xarray as xr

from gearbench import __version__
from gearbench.doctor import Finding
from gearbench.library.garambois2017 import case, gear
from gearbench.results.netcdf import open_result
from gearbench.scene_file import read_scene
from tests.support.paths import EXAMPLES

GOOD = """
[pair]
normal_module = 1.0
face_width = 8.0
centre_distance = 38.0
[pair.pinion]
teeth = 38
[pair.wheel]
teeth = 38
[load]
torque = 10.0
[effects.hertz]
[resolution]
positions = 4
"""


def test_simulate_prints_a_table_and_writes_the_dataset(run, tmp_path):
    target = tmp_path / "case1.nc"
    code, out, err = run("simulate", EXAMPLES / "case1.toml", "-o", target)
    assert (code, err) == (0, "")
    assert "mean static transmission error" in out
    with xr.open_dataset(target, engine="h5netcdf") as dataset:
        assert dataset["transmission_error"].attrs["units"] == "µm"
        assert dataset["mesh_stiffness"].attrs["units"] == "N/µm"
        assert dataset["line_load"].dims == ("position", "pair", "segment")
        np.testing.assert_allclose(dataset["phase_weight"].sum(), 1, rtol=1e-14)
        assert tomllib.loads(dataset.attrs["scene"]) == tomllib.loads((EXAMPLES / "case1.toml").read_text())
        for name in ("scene_sha256", "versions", "git_revision", "wall_time_s", "host"):
            assert name in dataset.attrs
    assert [path.name for path in tmp_path.iterdir()] == ["case1.nc"]


def test_the_torque_of_the_command_line_takes_the_place_of_the_files(run, tmp_path):
    scene, other, target = tmp_path / "a.toml", tmp_path / "b.toml", tmp_path / "o.nc"
    scene.write_text(GOOD, encoding="utf-8")
    other.write_text(GOOD.replace("torque = 10.0", "torque = 200.0"), encoding="utf-8")
    assert run("simulate", scene, "--torque", 200, "-q", "-o", target) == (0, "", "")
    assert open_result(target).attrs["scene_sha256"] == read_scene(other).digest
    code, _, err = run("simulate", scene, "--torque", 0)
    assert (code, err.count("\n")) == (2, 1)
    assert "--torque = 0: must not be 0" in err


def test_json_is_one_object_with_every_scalar(run):
    code, out, _ = run("simulate", EXAMPLES / "sc.toml", "--json")
    summary = json.loads(out)
    assert code == 0
    assert summary["mesh_stiffness_rms"] == pytest.approx(18.3, abs=0.5)
    assert summary["transmission_error_rms"] == pytest.approx(0.495, abs=0.015)
    assert summary["units"]["transmission_error_rms"] == "µm"
    assert set(summary["units"]) <= set(summary)
    assert 0 <= summary["equilibrium_residual_max"] < 1e-9
    assert 0 <= summary["complementarity_residual_max"] < 1e-9


def test_names_are_no_formulas_in_plots():
    from matplotlib.cbook import is_math_text

    from gearbench.plotting import as_label

    for name in ("$\\frac{$", "$a$ and $b", "\\$x$", "𝔘 \u202e \x1b[31m", "a\nb"):
        assert not is_math_text(as_label(name))


def test_names_are_text_in_plots_and_on_the_terminal(run, tmp_path):
    import tomli_w

    scene = tmp_path / "scene.toml"
    scene.write_text(tomli_w.dumps({"name": "$𝔘 \u202e \x1b[31m\nb"}) + GOOD, encoding="utf-8")
    code, out, err = run("simulate", scene, "--plots", tmp_path / "plots")
    assert (code, err) == (0, "")
    assert all(line.isprintable() for line in out.splitlines())
    assert list((tmp_path / "plots").glob("*.png"))


def test_robust_writes_samples_and_statistics(run, tmp_path):
    target = tmp_path / "robust.nc"
    code, out, _ = run("robust", EXAMPLES / "gear55_robust.toml", "--samples", 64, "--seed", 3, "-o", target)
    assert code == 0
    assert "64 samples" in out
    with xr.open_dataset(target, engine="h5netcdf") as dataset:
        assert dataset.sizes["sample"] == 64
        assert dataset.attrs["seed"] == 3
        for name in ("mean", "std", "max"):
            assert f"transmission_error_rms_{name}" in dataset
            assert f"mesh_stiffness_rms_{name}_standard_error" in dataset


@pytest.mark.slow
def test_plots_are_drawn_where_asked(run, tmp_path):
    run("simulate", EXAMPLES / "case2.toml", "--plots", tmp_path / "a", "-q")
    run("robust", EXAMPLES / "gear55_robust.toml", "--samples", 64, "--plots", tmp_path / "b", "-q")
    drawn = sorted(path.name for path in tmp_path.rglob("*.png"))
    assert drawn == [
        "contributions.png", "density.png", "load_distribution.png", "load_maps.png", "order_spectrum.png",
        "ste_and_stiffness.png",
    ]  # fmt: skip
    assert all(path.stat().st_size > 10_000 for path in tmp_path.rglob("*.png"))


def test_doctor_is_content_where_the_tests_run(run):
    code, out, _ = run("doctor")
    assert code == 0, out
    assert "numba" in out


def test_doctor_names_the_extra_that_brings_a_missing_package(run, monkeypatch):
    remedy = "pip install 'gearbench[fem]'"
    missing = Finding("gmsh", "not installed", False, needed=False, remedy=remedy)
    monkeypatch.setattr("gearbench.doctor.examine", lambda: [missing])
    code, out, _ = run("doctor")
    assert (code, out) == (0, f"none gmsh: not installed\n       {remedy}\n")


def test_version(run):
    assert run("--version") == (0, f"gearbench {__version__}\n", "")


#: What is replaced by what in the good scene, the key that must be named, and what else must be said.
PINION = "teeth = 38\n[pair.wheel]"
BAD = {
    "unknown key": ("face_width = 8.0", "face_widht = 8.0", "pair.face_widht", "did you mean face_width?"),
    "unknown effect": ("[effects.hertz]", "[effects.herz]", "effects.herz", "did you mean hertz?"),
    "module in metres": ("normal_module = 1.0", "normal_module = 0.001", "pair.normal_module", "0.001"),
    "modulus in MPa": ("[load]", "[pair.material]\nyoungs_modulus = 210000.0\n[load]", "youngs_modulus", "210000"),
    "internal gear": (PINION, "teeth = -38\n[pair.wheel]", "pair.pinion.teeth = -38:", "internal gear"),
    "teeth of text": ("teeth = 38\n[pair.wheel]", 'teeth = "38"\n[pair.wheel]', "pair.pinion.teeth", "38"),
    "pointed tip": (PINION, "teeth = 38\naddendum = 2.4\n[pair.wheel]", "pair.pinion.addendum", "2.4"),
    "tip twice": ("teeth = 38", "teeth = 38\naddendum = 0.9\ntip_diameter = 40.0", "pair.pinion.tip_diameter", "40"),
    "no contact": ("teeth = 38", "teeth = 38\naddendum = 0.02", "pair.centre_distance", "38"),
    "backlash twice": ("[pair.pinion]\nteeth = 38\n[pair.wheel]\n",
                       "backlash = 0.1\n[pair.pinion]\nteeth = 38\nprofile_shift = 0.0\n"
                       "[pair.wheel]\nprofile_shift = 0.0\n",
                       "pair.backlash", "0.1"),
    "no torque": ("torque = 10.0", "torque = 0.0", "load.torque", "0"),
    "not a number": ("torque = 10.0", "torque = nan", "load.torque", None),
    "missing key": ("torque = 10.0", "", "load.torque", "missing"),
    "no effects": ("[effects.hertz]", "", "effects", "none"),
    "gap only": ("[effects.hertz]", "[effects.crowning]\namount = 5.0", "effects", "crowning"),
    "law": ("[effects.hertz]", '[effects.hertz]\nlaw = "sun_yang"', "effects.hertz.law", "sun_yang"),
    "no TOML": ("[pair]", "[pair", "not TOML", None),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "key", "says"), BAD.values(), ids=BAD.keys())
def test_bad_input_is_one_line_and_exit_code_2(run, tmp_path, old, new, key, says):
    scene, target = tmp_path / "scene.toml", tmp_path / "out.nc"
    assert old in GOOD
    scene.write_text(GOOD.replace(old, new), encoding="utf-8")
    code, out, err = run("simulate", scene, "-o", target)
    assert code == 2
    assert out == ""
    assert re.fullmatch(r"gearbench: [^\n]+\n", err)
    assert str(scene) in err
    assert key in err
    assert says is None or says in err
    assert not target.exists()
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]


@pytest.mark.parametrize("kind", ["missing", "folder", "binary"])
def test_unreadable_files(refused, tmp_path, kind):
    scene = tmp_path / "scene.toml"
    if kind == "folder":
        scene.mkdir()
    if kind == "binary":
        scene.write_bytes(b"\xff\xfe\x00")
    err = refused("simulate", scene)
    assert str(scene) in err


@pytest.mark.parametrize("command", ["simulate", "robust"])
@pytest.mark.parametrize("where", ["no/such/folder/out.nc", "."])
def test_outputs_that_cannot_be_written_are_refused_before_computing(refused, tmp_path, command, where, monkeypatch):
    import gearbench.contact.solver

    monkeypatch.setattr(gearbench.contact.solver, "solve", lambda *_: pytest.fail("computed"))
    refused(command, EXAMPLES / "gear55_robust.toml", "-o", tmp_path / where)


def test_results_are_not_written_under_the_name_of_another_format(run, tmp_path):
    target = tmp_path / "x.csv"
    code, _, err = run("simulate", EXAMPLES / "sc.toml", "-o", target)
    assert (code, err) == (2, f"gearbench: output = {target}: must end in .nc: results are written as netCDF\n")
    assert not target.exists()


def test_robust_without_random_errors_says_what_is_missing(run):
    code, _, err = run("robust", EXAMPLES / "sc.toml")
    assert code == 2
    assert err.startswith(f"gearbench: {EXAMPLES / 'sc.toml'}: effects")
    assert "manufacturing_errors" in err


def test_usage_errors_exit_with_2(run):
    assert run("simulate")[0] == 2
    assert run("robust", EXAMPLES / "sc.toml", "--samples", 0)[0] == 2
    assert run("robust", EXAMPLES / "gear55_robust.toml", "--samples", 1)[0] == 2  # has no scatter
    assert run("no-such-command")[0] == 2


def test_examples_are_the_published_pairs():
    texts = {
        "case1": case(1).to_toml(),
        "case2": case(2).to_toml(),
        "sc": gear("SC").scene().to_toml(),
        "gear55_robust": gear("55").scene(errors=True).to_toml(),
    }
    for name, text in texts.items():
        assert tomllib.loads((EXAMPLES / f"{name}.toml").read_text()) == tomllib.loads(text)


def test_the_first_run_says_why_it_takes_longer(run, tmp_path, monkeypatch):
    line = "first run: the solver is compiled, once after an installation; about a minute"
    monkeypatch.setattr(type(sys.stderr), "isatty", lambda self: True, raising=False)
    command = ("simulate", EXAMPLES / "sc.toml")
    assert line not in run(*command)[2]
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))  # empty: nothing was compiled
    assert run(*command)[2].splitlines()[0] == line
    assert line not in run(*command, "-q")[2]


@pytest.mark.parametrize("command", ["hunting", "robust", "cost", "plan", "simulate"])
def test_a_refusal_names_the_file_that_was_read(run, tmp_path, command):
    path = tmp_path / "scene.toml"
    text = (EXAMPLES / "sc.toml").read_text(encoding="utf-8").replace("[load]", "[[loads]]")
    path.write_text(text if command == "cost" else text.replace("teeth", "tooth", 1), encoding="utf-8")
    code, _, err = run(command, path)
    assert code == 2
    assert err.startswith(f"gearbench: {path}: ")
    assert run("robust", path, "-o", tmp_path / "none" / "o.nc")[2].startswith("gearbench: ")
