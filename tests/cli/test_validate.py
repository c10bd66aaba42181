"""``gearbench validate`` from the command line, on real finite elements; also in a worker and twice in a process."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from gearbench.errors import install_extra
from gearbench.results.netcdf import open_result

#: A narrow pair, cheap to solve.
SCENE = """
name = "narrow"
[pair]
normal_module = 2.0
face_width = 4.0
centre_distance = 60.0
[pair.pinion]
teeth = 24
bore_diameter = 20.0
[pair.wheel]
teeth = 36
bore_diameter = 30.0
[load]
torque = 20.0
[effects.tooth_bending]
model = "solid"
order = [4, 5, 4]
[effects.hertz]
[resolution]
gauss_points = 4
segments = 7
"""


@pytest.fixture
def scene(tmp_path, monkeypatch):
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path / "cache"))
    path = tmp_path / "narrow.toml"
    path.write_text(SCENE, encoding="utf-8")
    return path


@pytest.mark.slow
def test_a_report_and_a_dataset_are_written(run, scene, tmp_path):
    code, out, err = run("validate", scene, "-o", tmp_path / "out", "--accuracy", 0.05)
    assert (code, err) == (0, "")
    assert "narrow. Against finite elements: mean STE" in out
    assert "warning: narrow: teeth are clamped at their roots" in out
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["report.html", "validation.nc"]
    first = open_result(tmp_path / "out" / "validation.nc")
    # the solid is the better of our teeth: near finite elements, of which the accuracy asked for is a part
    assert abs(float(first["transmission_error_mean_error"][0])) < 5
    assert abs(float(first["mesh_stiffness_mean_error"][0])) < 5
    assert float(first["line_mac_mean"].min()) > 0.99
    assert list(first["reference_cached"].values.ravel()) == [0, 0]

    # once more in the same process, as JSON; the meshes of the pictures are made again
    code, out, err = run("validate", scene, "-o", tmp_path / "again", "--accuracy", 0.05, "--json")
    summary = json.loads(out)
    assert (code, err) == (0, "")
    (again,) = summary["scenes"]
    expected = float(first["transmission_error_mean_error"][0])
    assert again["transmission_error_mean_error"] == pytest.approx(expected, rel=1e-9)


@pytest.mark.slow
def test_a_pair_on_its_body_is_compared_with_teeth_on_a_body(run, scene, tmp_path):
    scene.write_text(SCENE + "[effects.gear_body]\n", encoding="utf-8")
    code, _, err = run("validate", scene, "-o", tmp_path / "out", "--accuracy", 0.1, "-q")
    assert (code, err) == (0, "")
    found = open_result(tmp_path / "out" / "validation.nc")
    assert "[effects.gear_body]" in str(found["reference_scene_toml"].values[0])
    assert abs(float(found["transmission_error_mean_error"][0])) < 10


@pytest.mark.parametrize("command", ["validate", "simulate"])
def test_without_the_extra_it_says_how_to_install_it(tmp_path, command):
    module = "platformdirs"  # where finite elements are kept; gmsh and scikit-fem are for the plain meshes only
    path = tmp_path / "scene.toml"
    meshed = SCENE.replace('"solid"\norder = [4, 5, 4]', '"finite_elements"')
    path.write_text(meshed if command == "simulate" else SCENE, encoding="utf-8")
    start = f"import sys; sys.modules['{module}'] = None; from gearbench.cli import main; main()"
    arguments = [command, str(path), "-o", str(tmp_path / ("out.nc" if command == "simulate" else "out"))]
    env = {**os.environ, "GEARBENCH_CACHE": ""}
    done = subprocess.run([sys.executable, "-c", start, *arguments], capture_output=True, text=True, env=env)
    assert done.returncode == 1
    assert done.stderr == f"gearbench: {module} is not installed: {install_extra('fem')}\n"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[effects.tooth_bending]", "[effects.tooth_bendin]", "unknown effect"),
        ('[effects.tooth_bending]\nmodel = "solid"\norder = [4, 5, 4]', "", "nothing to compare: add tooth_bending"),
        (
            '[effects.tooth_bending]\nmodel = "solid"\norder = [4, 5, 4]',
            '[effects.tooth_bending]\nmodel = "finite_elements"',
            "effects.tooth_bending.model = finite_elements: is the reference",
        ),
    ],
)
def test_bad_scenes_are_one_line_before_anything_is_made(refused, scene, tmp_path, old, new, message):
    assert old in SCENE
    scene.write_text(SCENE.replace(old, new), encoding="utf-8")
    err = refused("validate", scene, "-o", tmp_path / "out")
    assert f"{scene}: " in err
    assert message in err
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_written_is_one_line_before_anything_is_computed(run, scene, tmp_path, monkeypatch):
    from gearbench.validation import comparison

    monkeypatch.setattr(comparison, "validate", lambda *_: pytest.fail("computed"))
    monkeypatch.chdir(tmp_path)  # a long path is shortened in the message
    code, out, err = run("validate", scene.name, "-o", scene.name)
    assert (code, out) == (2, "")
    assert err == f"gearbench: output = {scene.name}: must be a folder (File exists)\n"
