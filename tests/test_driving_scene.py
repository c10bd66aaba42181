"""Scenes in a row: a scene takes its loads from a member of the scene that drives it."""

import pytest
import tomli_w
from numpy.testing import assert_allclose

from gearbench import parse_scene, read_scene, simulate
from gearbench.errors import InputError
from tests.support.paths import EXAMPLES
from tests.test_planetary import tables

GEAR = {"normal_module": 2.0, "face_width": 20.0}
PAIR = {**GEAR, "centre_distance": 60.0, "pinion": {"teeth": 20}, "wheel": {"teeth": 40}}


@pytest.fixture
def second(tmp_path):
    """Write the driving scene, and read the pair that it drives."""

    def read(driving, load):
        (tmp_path / "first.toml").write_text(tomli_w.dumps(driving), encoding="utf-8")
        given = {"pair": PAIR, "load": load, "effects": {"hertz": {}}}
        (tmp_path / "second.toml").write_text(tomli_w.dumps(given), encoding="utf-8")
        return read_scene(tmp_path / "second.toml")

    return read


def train(*more):
    """Tables of a gear of 20 teeth that drives a counter-shaft with 50 and 18 teeth, and a wheel of 54."""
    teeth = {"in": 20, "large": 50, "small": 18, "out": 54}
    gears = {name: {**GEAR, "teeth": z} for name, z in teeth.items()}
    for name in ("large", "small"):
        gears[name]["shaft"] = "counter"
    meshes = [("in", "large", 70.0), ("small", "out", 72.0), *more]
    meshes = [{"driver": one, "driven": two, "centre_distance": a} for one, two, a in meshes]
    return {"gears": gears, "meshes": meshes, "load": {"torque": 40.0}, "effects": {"hertz": {}}}


@pytest.mark.parametrize(
    ("driving", "member", "torque"),
    [
        ({"pair": PAIR, "load": {"torque": -30.0}, "effects": {"hertz": {}}}, "wheel", -60.0),
        (train(), "out", 40.0 * 50 / 20 * 54 / 18),
        (tables(torque=200.0), "carrier", 200.0 * (1 + 96 / 36)),
        (tables(torque=-200.0, held="carrier"), "ring", -200.0 * 96 / 36),
        (tables((24, 36, 84), planet_at_ring={"teeth": 24}), "carrier", 200.0 * (1 + 36 * 84 / (24 * 24))),
    ],
    ids=["pair", "train", "carrier", "ring", "stepped"],
)
def test_the_torque_is_that_on_the_member(second, driving, member, torque):
    # even shares of parallel paths are rounded to 1e-12
    assert second(driving, {"scene": "first.toml", "member": member}).load.torque == pytest.approx(torque, rel=1e-12)


def test_planets_that_share_unevenly_pass_on_the_same_torque(second):
    keys = {"planets": 4, "pin_tangential": [20.0, 0.0, 0.0, 0.0], "pin_stiffness": 200.0, "floating": ["sun"]}
    driving = tables(phases=4, **keys)
    found = simulate(parse_scene(driving), outputs=["transmission_error"])
    assert float(found["mesh_load_factor"]) > 1.02
    load = second(driving, {"scene": "first.toml", "member": "carrier"}).load
    assert_allclose(found["member_torque"].sel(member="carrier"), load.torque, rtol=1e-9)


def test_all_loads_are_passed_on(second):
    loads = [{"torque": 10.0, "weight": 3.0}, {"torque": -25.0}]
    driving = {"pair": PAIR, "loads": loads, "effects": {"hertz": {}}}
    scene = second(driving, {"scene": "first.toml", "member": "wheel"})
    assert [(load.torque, load.weight) for load in scene.loads] == [(20.0, 3.0), (-50.0, 1.0)]


def test_the_example_is_two_sets_in_a_row():
    first, second = (read_scene(EXAMPLES / f"{name}.toml") for name in ("planetary", "second_set"))
    assert second.load.torque == pytest.approx(first.load.torque * (1 + 96 / 36))
    # the file that a result holds needs no other one
    assert parse_scene(second.to_mapping()) == second


@pytest.mark.parametrize(
    ("load", "key", "words"),
    [
        ({"scene": "third.toml", "member": "carrier"}, "load.scene", "readable file"),
        ({"scene": 3, "member": "carrier"}, "load.scene", "must be text"),
        ({"scene": "first.toml"}, "load.member", "is required"),
        ({"scene": "first.toml", "member": "carrier", "torque": 3.0}, "load.torque", "unknown key|allowed"),
        ({"scene": "first.toml", "member": "ring"}, "load.member", "allowed: carrier"),
        ({"scene": "first.toml", "member": "planet 1"}, "load.member", "allowed: carrier"),
        ({"scene": "second.toml", "member": "wheel"}, "load.scene", "own file: second.toml → second.toml"),
    ],
)
def test_faults_are_one_line(second, load, key, words):
    with pytest.raises(InputError, match=words) as caught:
        second(tables(), load)
    assert caught.value.key == key
    assert "\n" not in str(caught.value)


def test_a_circle_of_files_is_shown(second, tmp_path):
    driven = tables() | {"load": {"scene": "second.toml", "member": "carrier"}}
    (tmp_path / "middle.toml").write_text(tomli_w.dumps(driven))
    with pytest.raises(InputError, match=r"second\.toml → middle\.toml → second\.toml") as caught:
        second(tables(), {"scene": "middle.toml", "member": "carrier"})
    assert caught.value.key == "load.scene"


def test_one_kind_of_load():
    given = {"pair": PAIR, "load": {"scene": "first.toml", "member": "carrier"}, "loads": [{"torque": 3.0}]}
    with pytest.raises(InputError, match="conflicts with load"):
        parse_scene({**given, "effects": {"hertz": {}}})
