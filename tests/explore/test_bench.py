"""The design bench: controls from the input classes, scenes from controls, answers that agree with simulate."""

import json
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

pytest.importorskip("bokeh", reason="the explorer needs the extra gearbench[explore]")

from gearbench.effects.crowning import Crowning
from gearbench.effects.registry import EFFECTS
from gearbench.errors import InputError
from gearbench.explore.bench.answers import COARSE, QUICK_ORDER, TORQUES, Answers, changed
from gearbench.explore.bench.form import flat, form
from gearbench.explore.bench.session import example
from gearbench.scene import Load, Resolution
from gearbench.scene_file import parse_scene, read_scene
from gearbench.simulation import simulate
from tests.support.paths import EXAMPLES


@pytest.fixture(scope="module")
def scene():
    return example()


@pytest.fixture(scope="module")
def controls(scene):
    return {control.path: control for group in flat(form(scene)) for control in group.controls}


def asked(scene, **changes):
    """The question that a page asks after values were set at dotted keys."""
    tables = scene.to_mapping()
    for path, value in changes.items():
        *parents, last = path.split("__")
        table = tables
        for part in parents:
            table = table.setdefault(part, {})
        table[last] = value
    return {"scene": [json.dumps(tables)]}


# -- controls ---------------------------------------------------------------------------------------------------------


def test_every_table_of_a_scene_has_its_controls(scene, controls):
    groups = {group.path: group for group in flat(form(scene))}
    files = {"effects.topography"}
    assert {f"effects.{name}" for name in EFFECTS} - files <= set(groups)
    for name, table in scene.to_mapping()["effects"].items():
        assert groups[f"effects.{name}"].present
        for key, value in table.items():
            assert controls[f"effects.{name}.{key}"].value == value
    for key in ("pair.normal_module", "pair.pinion.teeth", "pair.wheel.bore_diameter", "load.torque"):
        *parents, last = key.split(".")
        table = scene.to_mapping()
        for part in parents:
            table = table[part]
        assert controls[key].value == table[last]


def test_controls_know_units_and_limits(controls):
    assert controls["pair.helix_angle"].unit == "°"
    assert controls["load.torque"].unit == "N·m"
    assert controls["effects.crowning.amount"].label == "crowning C_β"
    assert (controls["pair.pinion.teeth"].kind, controls["pair.pinion.face_width"].least) == ("integer", 0.0)
    assert controls["effects.tooth_bending.model"].choices == ("plate", "solid", "finite_elements")


def test_sliders_stay_within_the_limits_and_hold_the_value_in_round_steps(controls):
    sliders = [control for control in controls.values() if control.high is not None]
    assert len(sliders) > 20
    for control in sliders:
        assert control.low < control.high
        assert control.low <= control.value <= control.high
        assert control.least is None or control.low >= control.least
        assert control.most is None or control.high <= control.most
        assert re.fullmatch(r"[125](\.0)?(e-?\d+)?|0\.0*[125]|[125]0*(\.0)?", f"{control.step}"), control
        assert 20 <= (control.high - control.low) / control.step <= 1000 or control.kind == "integer"


def test_tables_within_an_effect_are_named_after_it_and_shown_with_it(scene):
    inner = {each.title: group.path for group in form(scene) for each in group.below}
    assert inner["Profile curve: pinion"] == "effects.profile_curve"
    assert inner["Helix curve: pinion"] == "effects.helix_curve"


# -- scenes -----------------------------------------------------------------------------------------------------------


def test_untouched_controls_give_the_scene_back(scene):
    assert changed(scene, scene.to_mapping()) == scene


def test_a_change_is_that_of_the_scene_file(scene):
    tables = scene.to_mapping()
    tables["effects"]["crowning"]["amount"] = 6.0
    tables["pair"]["helix_angle"] = 19.0
    assert changed(scene, tables) == parse_scene(tables)


def test_a_page_names_no_files(scene, tmp_path):
    (tmp_path / "secret.csv").write_text("1,2\n3,4\n")
    tables = scene.to_mapping()
    tables["effects"]["topography"] = {"pinion": str(tmp_path / "secret.csv")}
    with pytest.raises(InputError, match="refers to files"):
        changed(scene, tables)


def test_faults_are_one_line_with_key_and_value(scene):
    (found,) = Answers(scene)(asked(scene, pair__face_width=-1.0))
    assert found["message"] == ["pair.face_width = -1.0: must be greater than 0 mm"]
    (found,) = Answers(scene)(asked(scene, effects__crowning__amont=1.0))
    assert "amont" in found["message"][0]
    (found,) = Answers(scene)(asked(scene, effects__tip_relief__length=50.0))
    assert "length" in found["message"][0]
    for junk in ({}, {"scene": ["no json"]}, {"scene": ["[1]"]}, {"scene": ['{"effects": 3}']}):
        (found,) = Answers(scene)(junk)
        assert found["message"][0]


# -- answers ----------------------------------------------------------------------------------------------------------


def test_answers_are_coarse_then_those_of_simulate(scene):
    found = [answer["now"][0] for answer in Answers(scene)(asked(scene, effects__crowning__amount=6.0))]
    moved = replace(scene, effects=tuple(Crowning(amount=6.0) if e.name == "crowning" else e for e in scene.effects))
    for tables, expected in ((found[0], replace(moved, resolution=COARSE)), (found[1], moved)):
        dataset = simulate(expected)
        numbers = dict(zip(tables["numbers"]["label"], tables["numbers"]["value"], strict=True))
        assert numbers["peak-to-peak STE [µm]"] == f"{float(dataset['transmission_error_peak_to_peak']):.3f}"
        assert numbers["mean stiffness k [N/µm]"] == f"{float(dataset['mesh_stiffness_mean']):.1f}"
        orders, amplitude = tables["ste_orders"], dataset["transmission_error_amplitude"]
        known = amplitude.sel(harmonic=orders["order"].astype(int))
        assert_allclose(orders["amplitude"], known, rtol=1e-5, atol=1e-7)
        assert parse_scene(tomllib.loads(tables["scene"]["text"][0])) == moved
    assert [list(t) for t in found[2:]] == [["warnings"], ["harris", "torque"]]


def test_gears_have_controls_of_their_own_keys_only():
    paths = {control.path for group in flat(form(read_scene(EXAMPLES / "ring.toml"))) for control in group.controls}
    own = {"pair.pinion.bore_diameter", "pair.wheel.outer_diameter"}
    assert own <= paths
    assert not {"pair.wheel.bore_diameter", "pair.wheel.protuberance", "pair.pinion.outer_diameter"} & paths


def test_a_ring_is_answered_like_a_wheel():
    ring = read_scene(EXAMPLES / "ring.toml")
    found = [answer["now"][0] for answer in Answers(ring)(asked(ring, load__torque=50.0))]
    numbers = dict(zip(found[1]["numbers"]["label"], found[1]["numbers"]["value"], strict=True))
    dataset = simulate(replace(ring, load=Load(torque=50.0)))
    assert numbers["peak-to-peak STE [µm]"] == f"{float(dataset['transmission_error_peak_to_peak']):.3f}"
    assert {"pinion", "wheel", "path", "motion"} <= set(found[1])
    (fault,) = Answers(ring)(asked(ring, pair__wheel__teeth=-2))
    assert "pair.wheel.teeth" in fault["message"][0]


def test_teeth_that_are_new_are_sketched_with_few_functions_until_they_are_known(scene):
    ask = Answers(scene)
    assert ask.sketch(scene) == replace(scene, resolution=COARSE)
    wider = replace(scene, pair=replace(scene.pair, face_width=1.04 * scene.pair.face_width))
    sketch = ask.sketch(wider)
    assert sketch.effect("tooth_bending").order == QUICK_ORDER
    assert (sketch.pair, sketch.load, sketch.effect("hertz")) == (wider.pair, wider.load, scene.effect("hertz"))
    answers = ask(asked(wider))
    next(answers)
    assert ask.sketch(wider) == sketch
    next(answers)  # as fine as the scene: now these teeth are known, and the former ones are not
    assert ask.sketch(wider) == replace(wider, resolution=COARSE)
    assert ask.sketch(scene).effect("tooth_bending").order == QUICK_ORDER
    own = replace(scene.effect("tooth_bending"), order=(3, 3, 4))
    few = replace(wider, effects=tuple(own if each.name == own.name else each for each in wider.effects))
    assert ask.sketch(few).effect("tooth_bending").order == (3, 3, 4)


def test_few_functions_are_good_enough_for_a_sketch():
    base = replace(read_scene("examples/gears/e_drive_input.toml"), resolution=COARSE)
    few = replace(base.effect("tooth_bending"), order=QUICK_ORDER)
    quick = replace(base, effects=tuple(few if each.name == few.name else each for each in base.effects))
    expected, found = (simulate(each) for each in (base, quick))
    assert_allclose(found["transmission_error_mean"], expected["transmission_error_mean"], rtol=0.03)
    assert_allclose(
        found["transmission_error_peak_to_peak"], expected["transmission_error_peak_to_peak"], rtol=0.04
    )  # the page shows three digits until the slider rests


def test_a_newer_question_ends_the_torques(scene):
    found = [list(answer["now"][0]) for answer in Answers(scene)(asked(scene), lambda: True)]
    assert found
    assert ["harris", "torque"] not in found
    assert len(found) == sum(1 for _ in Answers(scene)(asked(scene))) - 1


def test_torques_are_those_of_single_scenes(scene):
    *_, last = Answers(scene)(asked(scene))
    table = last["now"][0]["torque"]
    assert_allclose(table["torque"], np.array(TORQUES) * scene.load.torque, rtol=1e-3)
    alone = replace(scene, load=Load(torque=table["torque"][2]), resolution=Resolution(positions=32, segments=10))
    assert_allclose(table["peak_to_peak"][2], simulate(alone)["transmission_error_peak_to_peak"], rtol=1e-4)
    harris = last["now"][0]["harris"]
    for x, y in zip(harris["xs"], harris["ys"], strict=True):
        assert_allclose(y[-1], y[0])
        assert_allclose(x[-1] - x[0], 2.0)


def test_coast_flanks_are_swept_and_slid_under_their_own_torque(scene):
    coast = replace(scene, load=Load(torque=-scene.load.torque))
    (slider,) = (c for g in form(coast) for c in g.controls if c.path == "load.torque")
    assert slider.low < slider.value < slider.high < 0
    *_, last = Answers(coast)(asked(coast))
    table = last["now"][0]["torque"]
    assert sorted(table["torque"]) == table["torque"]
    assert max(table["torque"]) < 0
    alone = replace(coast, load=Load(torque=table["torque"][2]), resolution=Resolution(positions=32, segments=10))
    assert_allclose(table["peak_to_peak"][2], simulate(alone)["transmission_error_peak_to_peak"], rtol=1e-4)


def test_clamped_teeth_are_warned_of(scene):
    clamped = replace(scene, effects=tuple(e for e in scene.effects if e.name != "gear_body"))
    lines = [answer["now"][0] for answer in Answers(clamped)(asked(clamped))][2]["warnings"]["text"]
    assert any("gear_body" in line for line in lines)
