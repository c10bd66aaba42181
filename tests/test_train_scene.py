"""Scenes of gears and meshes: a pair is a train of two gears, an idler carries on both flanks."""

import copy
import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

from gearbench import open_result, relieve, response, revolution_response, robust, save, simulate, sweep
from gearbench.errors import InputError
from gearbench.explore.model import without_scatter
from gearbench.results.origin import scene_of, single_mesh
from gearbench.scene_file import parse_scene, scene_at
from gearbench.schema import read
from gearbench.sweeps import figures
from gearbench.sweeps.figures import draw_sweep
from gearbench.system.schema import System
from gearbench.validation.reference import reference_scene

GEAR = {"normal_module": 2.0, "helix_angle": 17.0, "face_width": 20.0}
IDLER = {
    "name": "idler",
    "gears": {
        "motor": {**GEAR, "teeth": 19, "tip_relief": {"amount": 5.0, "length": 0.5}},
        "idler": {**GEAR, "teeth": 31, "profile_slope": 2.0, "coast": {"profile_slope": 4.0}},
        "load": {**GEAR, "teeth": 26, "face_width": 16.0, "axial_offset": 1.0},
    },
    "meshes": [
        {"driver": "motor", "driven": "idler", "centre_distance": 52.7},
        {"name": "out", "driver": "idler", "driven": "load", "centre_distance": 60.0, "direction": 70.0},
    ],
    "load": {"torque": 50.0},
    "operation": {"speed": 1500.0, "friction_coefficient": 0.06},
    "resolution": {"positions": 4, "segments": 9},
    "effects": {"tooth_bending": {}, "hertz": {}},
}


def idler(**gears):
    """The tables, other keys below gears."""
    tables = copy.deepcopy(IDLER)
    for name, keys in gears.items():
        tables["gears"][name] |= keys
    return tables


def alone(**more):
    """Tables of motor and idler alone."""
    tables = idler()
    del tables["gears"]["load"], tables["meshes"][1]
    return tables | more


def test_a_pair_is_a_train_of_two_gears():
    scene = parse_scene(alone())
    short = {key: IDLER[key] for key in ("name", "load", "operation", "resolution")}
    pair = {**GEAR, "centre_distance": 52.7, "pinion": {"teeth": 19}, "wheel": {"teeth": 31}}
    effects = {"tip_relief": {"pinion": {"amount": 5.0, "length": 0.5}}, "profile_slope": {"wheel": 2.0}}
    coast = {"profile_slope": {"wheel": 4.0}}
    same = parse_scene({**short, "pair": pair, "effects": {**IDLER["effects"], **effects}, "coast": coast})
    assert scene.pair == same.pair
    assert set(scene.effects) == set(same.effects)
    assert scene.coast == same.coast
    outputs = ["transmission_error", "mesh_stiffness", "line_load", "root_stress"]
    for torque in (50.0, -50.0):
        one, two = (simulate(scene_at(each, {"load.torque": torque}), outputs=outputs) for each in (scene, same))
        for name in outputs:
            assert_allclose(one[name].values, two[name].values, rtol=1e-12, atol=1e-12)
    assert one["gear"].values.tolist() == ["motor", "idler"]
    assert parse_scene(tomllib.loads(scene.to_toml())) == scene
    at = scene_at(scene, {"gears.motor.tip_relief.amount": 7.0, "gears.idler.teeth": 30})
    assert (at.effect("tip_relief").pinion.amount, at.pair.wheel.teeth) == (7.0, 30)


def test_an_idler_drives_with_its_other_flank_under_the_torque_that_passes_through():
    scene = parse_scene(IDLER)
    first, second = scene.meshes.values()
    assert second.load.torque == pytest.approx(50.0 * 31 / 19)
    assert second.operation.speed == pytest.approx(1500.0 * 19 / 31)
    assert [mesh.effect("profile_slope") for mesh in (first, second)] == [
        type(first.effect("profile_slope"))(wheel=2.0),
        type(first.effect("profile_slope"))(pinion=4.0),
    ]
    # the idler is the same gear in both meshes: its shift follows from the first
    assert second.pair.gears[0] == first.pair.gears[1]
    assert second.effect("tip_relief") is None


def test_every_mesh_is_simulated_as_the_pair_that_it_is(tmp_path):
    scene = parse_scene(IDLER)
    whole = simulate(scene, outputs=["transmission_error", "line_load", "root_stress", "sliding_speed"])
    assert whole["mesh"].values.tolist() == ["motor to idler", "out"]
    assert whole["root_stress"].dims == ("mesh", "gear")
    save(whole, tmp_path / "train.nc")
    for name, one in scene.meshes.items():
        own = single_mesh(open_result(tmp_path / "train.nc"), name)
        exact = simulate(one, outputs=["transmission_error", "line_load", "root_stress", "sliding_speed"])
        for variable in exact.data_vars:
            np.testing.assert_array_equal(own[variable].values, exact[variable].values)
        assert own["gear"].values.tolist() == exact["gear"].values.tolist()
        assert scene_of(own) == one
    xr.testing.assert_equal(whole, open_result(tmp_path / "train.nc"))


def test_a_train_is_written_read_and_swept_by_the_names_of_its_gears():
    scene = parse_scene(IDLER)
    again = parse_scene(tomllib.loads(scene.to_toml()))
    assert again == scene
    assert again.digest == scene.digest
    swept = sweep(scene, {"gears.idler.coast.profile_slope": [0.0, 4.0], "torque": [20.0, 50.0]})
    assert swept["transmission_error_mean"].dims == ("gears.idler.coast.profile_slope", "torque", "mesh")
    change = swept["transmission_error_mean"].diff("gears.idler.coast.profile_slope").isel(torque=1)
    assert float(change.sel(mesh="motor to idler").item()) == 0.0
    assert abs(float(change.sel(mesh="out").item())) > 0.1
    point = scene_of(swept.isel({"gears.idler.coast.profile_slope": 0, "torque": 0}))
    assert point.load.torque == 20.0
    assert point.meshes["out"].effect("profile_slope").pinion == 0.0


def test_a_negative_torque_loads_the_other_flanks_of_all_gears():
    scene = parse_scene(idler() | {"load": {"torque": -50.0}})
    slopes = [
        next(each for each in mesh.flank_effects if each.name == "profile_slope") for mesh in scene.meshes.values()
    ]
    assert [slopes[0].wheel, slopes[1].pinion] == [4.0, 2.0]
    assert all(mesh.load.coast for mesh in scene.meshes.values())


@pytest.mark.parametrize(
    ("change", "key", "words"),
    [
        ({"motor": {"teeth": -9}}, "gears.motor.teeth", "internal"),
        ({"motor": {"face_width": None}}, "gears.motor.face_width", "number"),
        ({"motor": {"tooth": 19}}, "gears.motor.tooth", "allowed"),
        ({"idler": {"normal_module": 2.1}}, "gears.idler.normal_module", "must be that of its mate motor, 2"),
        ({"motor": {"tip_relief": {"amount": 5.0, "length": 90.0}}}, "gears.motor.tip_relief.length", "at most"),
        ({"load": {"bore_diameter": -1.0}}, "gears.load.bore_diameter", "greater than 0"),
        ({"motor": {"coast": {"profile_slope": 2.0}}}, "gears.motor.coast.profile_slope", "drive flank too"),
        ({"motor": {"addendum": 2.0}}, "gears.motor.addendum", "pointed|root of its mate"),
    ],
)
def test_faults_name_the_gear(change, key, words):
    with pytest.raises(InputError, match=words) as caught:
        parse_scene(idler(**change))
    assert caught.value.key == key


@pytest.mark.parametrize(
    ("change", "key", "words"),
    [
        ({"meshes": []}, "meshes", "one or more"),
        ({"pair": {}}, "pair", "conflicts with gears"),
        ({"effects": {**IDLER["effects"], "tip_relief": {"amount": 1.0}}}, "gears.motor.tip_relief", "both"),
        ({"meshes": [IDLER["meshes"][0]]}, "gears.load", "driver or the driven"),
        ({"meshes": [IDLER["meshes"][0], IDLER["meshes"][1] | {"driver": "rotor"}]}, "meshes.1.driver", "motor"),
        ({"meshes": [IDLER["meshes"][0], IDLER["meshes"][1] | {"flank": "drive"}]}, "meshes.1.flank", "must be coast"),
        ({"meshes": [IDLER["meshes"][0], {**IDLER["meshes"][1], "centre_distance": 50.0}]}, "meshes.1.centre_distance",
         "base radii"),
    ],
)  # fmt: skip
def test_faults_of_the_meshes_are_one_line(change, key, words):
    with pytest.raises(InputError, match=words) as caught:
        parse_scene(idler() | change)
    assert caught.value.key == key


def test_gears_out_of_mesh_are_apart():
    # motor and load both beside the idler, at 17° from each other
    meshes = [IDLER["meshes"][0], IDLER["meshes"][1] | {"direction": 163.0}]
    parts = parse_scene(idler()).meshes.values()
    r_1, r_2 = (pair.gears[index].tip_radius for index, pair in enumerate(scene.pair for scene in parts))
    distance = abs(52.7 + 60.0 * np.exp(1j * math.radians(163.0)))
    with pytest.raises(InputError, match=rf"overlap those of motor by {r_1 + r_2 - distance:.4g} mm") as caught:
        parse_scene(idler() | {"meshes": meshes})
    assert caught.value.key == "gears.load"
    side = {"idler": {"face_width": 64.0}, "load": {"face_width": 20.0, "axial_offset": 22.0}}
    assert parse_scene(idler(**side) | {"meshes": meshes}).geometry.gears == ("motor", "idler", "load")


def test_a_ring_surrounds_gears_out_of_mesh():
    own = {"normal_module": 2.0, "face_width": 20.0}
    teeth = {"wheel": {"teeth": 20}, "pinion": {"teeth": 24}, "ring": {"teeth": -84, "addendum": 0.8}}
    meshes = [
        {"driver": "wheel", "driven": "pinion", "centre_distance": 44.0},
        {"driver": "pinion", "driven": "ring", "centre_distance": 60.0},
    ]
    tables = {"gears": {name: own | keys for name, keys in teeth.items()}, "meshes": meshes}
    tables |= {key: IDLER[key] for key in ("load", "effects")}
    assert_allclose(parse_scene(tables).geometry.places["ring"], [44.0 - 60.0, 0.0])
    meshes[0]["direction"] = 180.0  # to a pinion on the other side, so that the wheel is outside of the ring
    with pytest.raises(InputError, match=r"ring = tips overlap those of wheel by 43\.6 mm"):
        parse_scene(tables)


def test_faults_of_effects_name_the_gear():
    with pytest.raises(InputError, match=r"needs gears\.motor\.bore_diameter"):
        parse_scene(idler() | {"effects": {**IDLER["effects"], "gear_body": {}}})


def test_what_is_of_one_mesh_says_so():
    scattered = {**IDLER["effects"], "manufacturing_errors": {"preset": "garambois2017"}}
    with pytest.raises(InputError, match="2 meshes: in a row are for simulate without --report, sweep and, with"):
        robust(parse_scene(idler() | {"effects": scattered}))


@pytest.mark.parametrize("answer", [relieve, without_scatter, reference_scene])
def test_answers_for_a_pair_refuse_trains_on_shafts_too(answer):
    with pytest.raises(InputError, match="2 meshes: in a row are for"):
        answer(parse_scene(gearbox()))


def test_several_loads_of_a_train_survive_the_file():
    tables = {key: table for key, table in idler().items() if key != "load"}
    scene = parse_scene(tables | {"loads": [{"torque": 20.0}, {"torque": 50.0, "weight": 2.0}]})
    assert parse_scene(tomllib.loads(scene.to_toml())) == scene


def test_figures_of_a_load_range_of_a_train_name_the_mesh(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(figures, "write_figure", lambda figure, path: drawn.append(figure) or path)
    draw_sweep(sweep(parse_scene(idler()), torque=[20.0, 50.0]), tmp_path)
    assert "mesh = motor to idler" in drawn[0].get_suptitle()


def test_gears_on_one_shaft_turn_together():
    first, second = ({"normal_module": m, "face_width": 10 * m} for m in (2.0, 3.0))
    tables = {
        "gears": {
            "in": {**first, "teeth": 20},
            "large": {**first, "teeth": 50, "shaft": "counter"},
            "small": {**second, "teeth": 18, "shaft": "counter"},
            "out": {**second, "teeth": 54},
        },
        "meshes": [
            {"driver": "in", "driven": "large", "centre_distance": 70.0},
            {"driver": "small", "driven": "out", "centre_distance": 108.0},
        ],
        "load": {"torque": 40.0},
        "operation": {"speed": 3000.0},
        "effects": {"hertz": {"law": "yang_sun"}},
    }
    second = parse_scene(tables).meshes["small to out"]
    assert (second.load.torque, second.operation.speed) == (pytest.approx(100.0), pytest.approx(1200.0))
    del tables["gears"]["small"]["shaft"]
    with pytest.raises(InputError, match="no shaft connects"):
        parse_scene(tables)


def gearbox():
    """The idler train on three shafts."""
    ends = [{"position": at, "radial_stiffness": 200.0, "axial_stiffness": 100.0} for at in (0.0, 100.0)]
    shafts = [
        {
            "name": f"{name} shaft",
            "sections": [{"length": 100.0, "diameter": 25.0}],
            "gears": [{"gear": name, "position": 50.0}],
            "bearings": ends,
        }
        for name in ("motor", "idler", "load")
    ]
    for shaft in (shafts[0], shafts[2]):
        shaft["coupling"] = {"position": 0.0, "inertia": 0.01}
    return idler() | {"system": {"shafts": shafts}, "resolution": {"segments": 9}}


def test_a_train_on_its_shafts_is_the_gearbox_whose_meshes_are_files():
    tables = gearbox()
    scene = parse_scene(tables)
    assert parse_scene(tomllib.loads(scene.to_toml())) == scene
    first, second = parse_scene({key: table for key, table in tables.items() if key != "system"}).meshes.values()
    a, b = (mesh.pair.centre_distance for mesh in (first, second))
    axes = [[0.0, 0.0], [a, 0.0], [a + b * math.cos(math.radians(70)), b * math.sin(math.radians(70))]]
    seats = [[("pinion", "pair")], [("wheel", "pair"), ("pinion", "second")], [("wheel", "second")]]
    shafts = [
        {**shaft, "axis": axis, "gears": [{"gear": gear, "mesh": mesh, "position": 50.0} for gear, mesh in own]}
        for shaft, axis, own in zip(tables["system"]["shafts"], axes, seats, strict=True)
    ]
    meshes = [{"name": "second", "scene": "", "hand": "left"}]
    system = read(System, {"shafts": shafts, "meshes": meshes})
    files = replace(first, system=system, further=(replace(second, gear_names=("pinion", "wheel")),))
    assert scene.mesh_names == ("motor to idler", "out")
    whole = simulate(scene, outputs=["transmission_error", "line_load"])
    for name, own in zip(scene.mesh_names, ("pair", "second"), strict=True):
        exact = simulate(files.seen_from(own), outputs=["transmission_error", "line_load"])
        for variable in ("transmission_error", "line_load"):
            assert_allclose(single_mesh(whole, name)[variable], exact[variable], rtol=1e-9, atol=1e-9)
    dynamic, before = (response(each, speed=[1000.0, 2000.0]) for each in (scene, files))
    assert dynamic["mesh"].values.tolist() == ["motor to idler", "out"]
    assert dynamic["gear"].values.tolist()[:2] == ["motor to idler pinion", "motor to idler wheel"]
    for name in ("dynamic_transmission_error_rms", "bearing_load"):
        assert_allclose(dynamic[name].values, before[name].values, rtol=1e-9)


def test_sidebands_of_a_train_on_its_shafts_are_those_of_its_first_pair():
    tables = gearbox()
    tables["gears"]["motor"]["pitch_errors"] = np.random.default_rng(1).normal(0.0, 3.0, 19).tolist()
    scene = parse_scene(tables)
    own, of_pair = (revolution_response(each, speed=[1000.0], harmonics=1) for each in (scene, scene.seen_from("pair")))
    assert own["mesh"].values.tolist() == ["motor to idler"]
    assert_allclose(own["mesh_force_amplitude"], of_pair["mesh_force_amplitude"], rtol=1e-9)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"meshes": [{"name": "x", "scene": "x.toml"}]}, "conflicts with the meshes of the scene"),
        ({"shafts": gearbox()["system"]["shafts"][:2]}, "wheel of mesh 'out' on 0 shafts"),
        ({"shafts": [{**gearbox()["system"]["shafts"][0], "gears": [{"gear": "rotor", "position": 5.0}]}]}, "motor"),
    ],
)
def test_faults_of_its_shafts_are_one_line(change, words):
    tables = gearbox()
    with pytest.raises(InputError, match=words):
        parse_scene(tables | {"system": tables["system"] | change})
