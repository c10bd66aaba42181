"""Scenes: a file and an object, the same thing."""

from dataclasses import FrozenInstanceError, replace
from functools import partial

import pytest
from pydantic import ValidationError

from gearbench import hunting_cycle, plan, read_scene, response, robust, simulate, sweep
from gearbench.effects.hertz import Hertz
from gearbench.errors import InputError, one_of
from gearbench.library.garambois2017 import case, gear
from gearbench.scene import Load, Scene
from gearbench.scene_file import parse_scene

SCENES = [case(1), case(2), gear("55").scene(errors=True)]


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_round_trip_through_a_file(scene, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(scene.to_toml(), encoding="utf-8")
    again = read_scene(path)
    assert again == scene
    assert again.digest == scene.digest


def test_scenes_are_frozen_and_changed_by_replace():
    scene = case(1)
    with pytest.raises(FrozenInstanceError):
        scene.load = Load(torque=1.0)
    assert replace(scene, load=Load(torque=1.0)).load.torque == 1.0
    assert hash(replace(scene)) == hash(scene)


def test_an_effect_given_twice_is_refused():
    with pytest.raises(ValidationError, match=r"effects\.hertz = given twice"):
        replace(case(1), effects=(Hertz(), Hertz(law="yang_sun")))


def test_derived_forces():
    scene = case(2)
    pinion = scene.pair.gears[0]
    assert scene.F_bt == pytest.approx(230e3 / pinion.base_radius, rel=1e-14)
    assert scene.F_bn > scene.F_bt
    assert isinstance(scene, Scene)


@pytest.mark.parametrize("run", [simulate, robust, plan, sweep, hunting_cycle, partial(response, speed=900.0)])
def test_a_file_in_place_of_a_scene_is_told_how_it_becomes_one(run):
    with pytest.raises(TypeError, match=r"scene must be a Scene, not str: give read_scene\('case1.toml'\)"):
        run("case1.toml")


def test_a_wrong_centre_distance_blames_neither_gear():
    tables = {"normal_module": 2.0, "face_width": 20.0, "pinion": {"teeth": 25}, "wheel": {"teeth": 40}}
    effects = {"load": {"torque": 10.0}, "effects": {"hertz": {}}}
    with pytest.raises(InputError, match=r"pair.centre_distance = 122: .* profile shifts of 59\.6: .* 65 mm$"):
        parse_scene({"pair": tables | {"centre_distance": 122.0}} | effects)


def test_names_allowed_leave_out_the_one_refused_and_end_with_how_many_more():
    text = one_of("peak", [f"name_{i}" for i in range(100)] + ["peak", "transmission_error_peak"])
    assert text.startswith("did you mean transmission_error_peak? allowed: name_0, ")
    assert text.endswith(" more")
    assert ", peak" not in text
    assert one_of("a", ["b", "c"]) == "allowed: b, c"


def test_keys_that_files_may_not_have_are_not_offered():
    with pytest.raises(InputError) as fault:
        parse_scene({"further": 1})
    assert "further" not in str(fault.value).partition("allowed")[2]
