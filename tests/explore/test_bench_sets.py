"""The design bench of planetary sets: controls, answers that agree with simulate and robust, gears in mesh."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

pytest.importorskip("bokeh", reason="the explorer needs the extra gearbench[explore]")

from gearbench.errors import InputError
from gearbench.explore.bench.answers import COARSE, Answers, changed
from gearbench.explore.bench.form import flat, form
from gearbench.explore.bench.session import bench, bench_html, example
from gearbench.explore.gear_data import tables
from gearbench.explore.model import without_scatter
from gearbench.keys import with_values
from gearbench.robustness.run import robust
from gearbench.scene_file import parse_scene, read_scene
from gearbench.simulation import simulate
from tests.support.paths import EXAMPLES

SET = {
    "name": "set",
    "planetary": {
        "normal_module": 2.0,
        "face_width": 20.0,
        "planets": 4,
        "pin_tangential": [10.0, 0.0, 0.0, -5.0],
        "floating": ["sun"],
        "sun": {"teeth": 36, "bore_diameter": 20.0, "tip_relief": {"amount": 8.0, "length": 0.8}},
        "planet": {"teeth": 30, "bore_diameter": 15.0},
        "ring": {"teeth": -96, "outer_diameter": 230.0},
    },
    "load": {"torque": 200.0},
    "effects": {"hertz": {"law": "yang_sun"}},
    "resolution": {"positions": 8},
}
GEAR = {"normal_module": 2.0, "face_width": 42.0}
#: A motor drives a coaxial output through two idlers beside each other.
SPLIT = {
    "gears": {
        "motor": {**GEAR, "face_width": 20.0, "teeth": 21, "profile_shift": 0.2, "axial_offset": -11.0},
        "left": {**GEAR, "teeth": 43},
        "right": {**GEAR, "teeth": 43},
        "output": {**GEAR, "face_width": 20.0, "teeth": 21, "profile_shift": 0.2, "axial_offset": 11.0},
    },
    "meshes": [
        {"driver": "motor", "driven": "left", "centre_distance": 64.4},
        {"driver": "motor", "driven": "right", "centre_distance": 64.4, "direction": 180.0},
        {"driver": "left", "driven": "output", "centre_distance": 64.4, "direction": 180.0},
        {"driver": "right", "driven": "output", "centre_distance": 64.4},
    ],
    "load": {"torque": 60.0},
    "effects": {"hertz": {"law": "yang_sun"}},
    "resolution": {"positions": 8},
}


def moved(tables, **values):
    """Tables with values at dotted keys."""
    return with_values(tables, {path.replace("__", "."): value for path, value in values.items()})


def answered(tables, **values):
    """Answers of the page of ``tables`` after values were set."""
    return Answers(parse_scene(tables))({"scene": [json.dumps(moved(tables, **values))]})


def numbers(answer):
    found = answer["now"][0]["numbers"]
    return dict(zip(found["label"], found["value"], strict=True))


# -- controls ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("given", [SET, SPLIT], ids=["set", "train"])
def test_every_number_of_a_train_has_its_control(given):
    scene = parse_scene(given)
    controls = {control.path: control for group in flat(form(scene)) for control in group.controls}

    def check(table, path):
        for name, value in table.items() if isinstance(table, dict) else enumerate(table):
            own = f"{path}.{name}".strip(".")
            if isinstance(value, dict) or (isinstance(value, list) and isinstance(value[0], dict)):
                check(value, own)
            elif own not in ("name", "meshes"):
                known = own in controls or not isinstance(value, int | float | list)
                assert known, own
                assert own not in controls or controls[own].value == value

    check(scene.to_mapping(), "")
    for control in controls.values():
        if control.high is not None and control.kind != "list":
            assert control.low <= control.value <= control.high, control.path
    assert changed(scene, scene.to_mapping()) == scene


def test_a_list_over_the_planets_has_a_slider_for_each():
    controls = {control.path: control for group in flat(form(parse_scene(SET))) for control in group.controls}
    for name in ("pin_tangential", "pin_radial", "planet_thickness"):
        slider = controls[f"planetary.{name}"]
        assert (slider.items, slider.low, slider.high) == (4, -20.0, 20.0)
    assert controls["planetary.floating"].choices == ("sun", "ring", "carrier")
    teeth = controls["planetary.ring.teeth"]
    assert (teeth.low, teeth.high) == (-116.0, -76.0)
    assert "planetary.sun.normal_module" not in controls


def test_tables_that_a_set_may_have_are_offered_with_examples():
    groups = {group.path: group for group in flat(form(parse_scene(SET)))}
    assert groups["planetary.sun.tip_relief"].present
    for path in ("planetary.scatter", "planetary.run_out", "planetary.planet.coast.crowning", "effects.crowning"):
        assert groups[path].optional
        assert not groups[path].present
        drive = {"planetary.planet.crowning.amount": 0.0} if "coast" in path else {}  # a coast flank needs it
        parse_scene(moved(SET, **drive, **{path: dict(groups[path].example)}))


# -- answers ----------------------------------------------------------------------------------------------------------


def test_answers_are_coarse_then_those_of_simulate_and_robust():
    change = {"planetary__pin_tangential": [3.0, 0.0, 0.0, 6.0], "planetary__scatter": {"pin_tangential": 8.0}}
    coarse, fine, warned, scattered, swept = answered(SET, **change)
    scene = parse_scene(moved(SET, **change))
    for answer, expected in ((coarse, replace(scene, resolution=COARSE)), (fine, scene)):
        dataset, found, shown = simulate(expected), numbers(answer), answer["now"][0]
        assert found["peak-to-peak Δ [µm]"] == f"{float(dataset['train_transmission_error_peak_to_peak']):.3f}"
        assert found["RMS Δ [µm]"] == f"{float(dataset['train_transmission_error_rms']):.3f}"
        assert found["mesh load factor K_γ"] == f"{float(dataset['mesh_load_factor']):.3f}"
        shares = dataset["load_sharing"].transpose("mesh", "position").values
        assert len(shown["sharing"]["ys"]) == 4
        for i, drawn in enumerate(shown["sharing"]["ys"]):
            assert_allclose(drawn, np.tile(shares[i], 2), rtol=1e-6)
            assert_allclose(shares[i + 4], shares[i], rtol=1e-9)  # one share of a planet: its torques balance
        known = dataset["train_transmission_error_amplitude"].sel(harmonic=shown["ste_orders"]["order"].astype(int))
        assert_allclose(shown["ste_orders"]["amplitude"], known, rtol=1e-5, atol=1e-7)
    lines = warned["now"][0]["warnings"]["text"]
    assert len([line for line in lines if "rigid" in line]) == 1
    samples, found = robust(scene, samples=256), numbers(scattered)
    for name, text in (
        ("mesh_load_factor", "K_γ, mean ± σ of the error samples"),
        ("train_transmission_error_rms", "RMS Δ, mean ± σ of the error samples [µm]"),
    ):
        values = samples[name].values
        assert values.std() > 1e-4 * values.mean()
        assert found[text] == f"{values.mean():.3f} ± {values.std(ddof=1):.3f}"
    table = swept["now"][0]["torque"]
    alone = parse_scene(moved(SET, **change, load__torque=table["torque"][2], resolution={"positions": 32}))
    alone = replace(alone, resolution=replace(alone.resolution, segments=10))
    assert_allclose(table["peak_to_peak"][2], simulate(alone)["train_transmission_error_peak_to_peak"], rtol=1e-6)


def test_run_out_is_shown_over_a_revolution():
    change = {"planetary__run_out": {"sun": 30.0}, "planetary__floating": []}
    shown = next(iter(answered(SET, **change)))
    dataset = simulate(replace(parse_scene(moved(SET, **change)), resolution=COARSE))
    over = dataset["load_sharing_over_revolution"].values
    for i, drawn in enumerate(shown["now"][0]["revolution"]["ys"]):
        assert_allclose(drawn, over[i], rtol=1e-6)
    assert numbers(shown)["mesh load factor K_γ"] == f"{float(dataset['mesh_load_factor']):.3f}"


def test_stepped_planets_are_shown_over_their_whole_cycle():
    tables = read_scene(EXAMPLES / "stepped_planets.toml").to_mapping()
    tables = {**tables, "effects": {"hertz": {"law": "yang_sun"}}, "resolution": {"positions": 24}}
    del tables["planetary"]["scatter"]
    _, fine, *_ = answered(tables)
    dataset, shown = simulate(parse_scene(tables)), fine["now"][0]
    assert shown["extent"]["cycle"] == [3, 3]
    assert_allclose(shown["ste"]["phase"], dataset["mesh_phase"], rtol=1e-6)
    known = dataset["train_transmission_error_amplitude"].dropna("harmonic")
    assert_allclose(shown["ste_orders"]["order"], known["harmonic"], rtol=1e-6)
    assert_allclose(shown["ste_orders"]["amplitude"], known, rtol=1e-5, atol=1e-7)
    assert numbers(fine)["order 1 of Δ [µm]"] == f"{float(known.sel(harmonic=1)):.3f}"
    assert shown["gears"]["name"].count("") == 4  # one name for both gears of a planet


def test_a_train_with_parallel_paths_is_shown_mesh_by_mesh():
    answers = list(answered(SPLIT, gears__left__tip_relief={"amount": 10.0, "length": 0.5}))
    assert {answer["message"][0] for answer in answers} == {""}
    assert len(answers[0]["now"][0]["sharing"]["ys"]) == 4
    assert numbers(answers[1])["teeth z of motor, left, right, output"] == "21/43/43/21"


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"planetary__face_width": -1.0}, "planetary.face_width = -1.0: must be greater than 0"),
        ({"planetary__planets": 3}, "planetary.pin_tangential = 4 numbers: must be one for each of the 3 planets"),
        ({"planetary__planets": 7, "planetary__pin_tangential": []}, "planetary.planets = 7: planets collide"),
        ({"planetary__floating": ["moon"]}, "planetary.floating.0 = 'moon': must be 'sun', 'ring' or 'carrier'"),
        ({"planetary__positions": [0.0, 91.0, 180.0, 270.0]}, "planetary.positions = "),
        ({"planetary__sun__topography": {"pinion": "x.csv"}}, "planetary.sun.topography = given: refers to files"),
        ({"planetary__sun": 3}, "planetary.sun = 3: must be a table"),
    ],
)
def test_faults_are_one_line_with_key_and_value(change, line):
    (found,) = answered(SET, **change)
    assert found["message"][0].startswith(line)
    assert "\n" not in found["message"][0]


# -- pages ------------------------------------------------------------------------------------------------------------


def test_pairs_and_sets_have_pages_of_their_own():
    for one, other in ((example(), parse_scene(SET)), (parse_scene(SET), example())):
        with pytest.raises(InputError, match="separate pages"):
            bench(one, other)


def test_meshes_that_are_not_one_contact_problem_are_refused(refused):
    assert "2 meshes" in refused("explore", EXAMPLES / "idler.toml")


@pytest.mark.slow
def test_the_file_of_a_set_has_its_drawing_and_no_form():
    text = bench_html(parse_scene(SET), parse_scene(moved(SET, name="wide", planetary__face_width=24.0)))
    assert 'data-figure="gears"' in text
    assert 'data-figure="pressure"' not in text
    assert "<form" not in text
    assert "wide" in text


# -- drawing ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("torque", [200.0, -200.0])
def test_gears_turn_by_a_tooth_in_a_mesh_period_and_never_overlap(torque):
    from matplotlib.path import Path

    now, _ = without_scatter(parse_scene(moved(SET, load__torque=torque)))
    shown = tables(now)
    gears = {key: list(column) for key, column in shown["gears"].items()}
    at = {name: i for i, name in enumerate(gears["name"])}

    def turned(i, phase):
        points = np.column_stack([gears["xs"][i], gears["ys"][i]]).astype(float)
        axis, angle = np.array([gears["x"][i], gears["y"][i]]), phase * gears["rate"][i]
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        return axis + (points - axis) @ turn.T

    for name, teeth in (("sun", 36), ("planet 2", 30), ("ring", 96)):
        assert_allclose(abs(gears["rate"][at[name]]), 2 * np.pi / teeth, rtol=1e-12)
    for phase in (0.0, 0.3, 0.7):
        sun, ring = (turned(at[name], phase) for name in ("sun", "ring"))
        for name in ("planet 1", "planet 2", "planet 3", "planet 4"):
            planet = turned(at[name], phase)
            beyond = [planet[Path(sun).contains_points(planet)], planet[~Path(ring).contains_points(planet)]]
            for points, mate in zip(beyond, (sun, ring), strict=True):
                edge = np.concatenate([mate + t * (np.roll(mate, -1, axis=0) - mate) for t in np.linspace(0, 1, 21)])
                deep = [np.linalg.norm(edge - point, axis=1).min() for point in points]
                # chords of 0.6 mm lie off fillets of 1.5 mm radius; a wrong sense of rotation overlaps by 1 mm
                assert max(deep, default=0.0) < 0.03
