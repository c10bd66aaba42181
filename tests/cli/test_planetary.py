"""A planetary set at the command line: its gears by their names, figures of its scatter."""

import pytest

SET = """
name = "set"
[planetary]
normal_module = 2.0
face_width = 20.0
centre_distance = 66.0
[planetary.sun]
teeth = 36
[planetary.planet]
teeth = 30
[planetary.ring]
teeth = -96
[planetary.scatter]
pin_tangential = 10.0
sun_run_out = 10.0
[load]
torque = 300.0
[effects.hertz]
law = "yang_sun"
[resolution]
positions = 4
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "set.toml"
    path.write_text(SET)
    return path


def test_tables_and_warnings_call_gears_by_their_names(run, scene):
    _, said, _ = run("simulate", scene)
    assert "pinion" not in said
    assert "wheel" not in said
    assert said.count("the tip of the ring reaches below the form circle of the planet 1") == said.count("interference")
    assert "sun (z 36), planet 1 (z 30), planet 2 (z 30), planet 3 (z 30), ring (z -96), 300 N·m on sun" in said


def test_figures_of_the_scatter_are_drawn(run, scene, tmp_path):
    code, said, _ = run("robust", scene, "--samples", "32", "--plots", tmp_path / "plots")
    assert code == 0
    assert "contributions.png" in said
    assert {path.name for path in (tmp_path / "plots").iterdir()} == {"density.png", "contributions.png"}


def test_a_page_is_refused_of_several_meshes(run, scene, tmp_path):
    code, _, said = run("simulate", scene, "--report", tmp_path / "page.html")
    assert code == 2
    assert "without --report" in said


@pytest.mark.slow
def test_forces_on_bearings_that_cancel_are_not_printed(run, scene):
    scene.write_text(SET.replace("positions = 4", "positions = 8"))
    code, said, _ = run("response", scene, "--speed", "1000:2000:2", "--harmonics", "1")
    assert code == 0
    assert "force on the bearing of planet" in said
    assert "force on the bearing of sun" not in said


def test_a_place_to_listen_at_needs_a_sound(refused, scene):
    assert "--sound-at = sun: needs --sound" in refused("response", scene, "--speed", "1000:2000", "--sound-at", "sun")


def test_uneven_spacing_and_planets_without_load_are_reported(run, scene):
    scene.write_text(SET.replace("planetary]", "planetary]\nplanets = 4\npin_tangential = [900.0, 0.0, 0.0, 0.0]", 1))
    _, said, _ = run("simulate", scene)
    assert "warning: sun to planet 1 carries no load" in said
    assert "sun to planet 2 carries no load" not in said
    assert "even spacing" not in said
    scene.write_text(SET.replace("= 36", "= 37").replace("= -96", "= -97").replace("centre_distance = 66.0\n", ""))
    _, said, _ = run("simulate", scene)
    assert "planets are up to 0.896° away from even spacing: teeth fit at 134 angles, not a multiple of 3" in said


@pytest.mark.slow
def test_loss_of_contact_is_printed_and_drawn(run, scene, tmp_path):
    scene.write_text(SET.replace("positions = 4", "positions = 8"))
    options = ("--speed", "1000:2000:2", "--harmonics", "1", "--nonlinear", "--plots", tmp_path / "plots")
    code, said, _ = run("response", scene, *options)
    assert code == 0
    assert said.count("RMS of the transmission error of the train") == 1
    names = {path.stem for path in (tmp_path / "plots").iterdir()}
    assert {name.split("_")[0] for name in names} == {"force", "modes"}
