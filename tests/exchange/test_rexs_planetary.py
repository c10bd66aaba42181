"""REXS: pairs and planetary stages, written and read."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import simulate
from gearbench.errors import InputError
from gearbench.exchange.rexs import find_stage, read_rexs, stage_scene, stages
from gearbench.exchange.rexs_document import read_document
from gearbench.exchange.rexs_results import write_results
from gearbench.exchange.rexs_write import write_rexs
from gearbench.scene_file import parse_scene

EFFECTS = {"tooth_bending": {}, "hertz": {}}


def scene(**keys):
    own = {"normal_module": 2.0, "face_width": 20.0, "centre_distance": 66.2, "pin_stiffness": 250.0}
    gears = {
        "sun": {"teeth": 36, "profile_shift": 0.1, "bore_diameter": 30.0},
        "planet": {"teeth": 30, "addendum": 1.05, "face_width": 22.0, "bore_diameter": 24.0},
        "ring": {"teeth": -96, "addendum": 0.9, "outer_diameter": 240.0, "cutter": {"teeth": 40}},
    }
    given = {**own, **gears, **keys}
    return parse_scene(
        {"planetary": given, "load": {"torque": 200.0}, "effects": EFFECTS, "resolution": {"positions": 6}}
    )


def written(folder, whole, change=None):
    path, _ = write_rexs(whole, folder / "set.rexs")
    if change is not None:
        text = path.read_text(encoding="utf-8")
        path.write_text(change(text), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "keys",
    [
        {"floating": ["sun"], "carrier_support": 300.0, "planets": 4},
        {"held": "carrier", "positions": [0.0, 87.2727, 180.0], "helix_angle": 20.0, "centre_distance": 70.4},
    ],
)
def test_a_set_comes_back_as_it_was(tmp_path, keys):
    whole = scene(**keys)
    back = read_rexs(written(tmp_path, whole))
    for mine, theirs in zip(whole.geometry.meshes, back.geometry.meshes, strict=True):
        for one, two in zip(mine.pair.gears, theirs.pair.gears, strict=True):
            for name in ("teeth", "beta", "profile_shift", "tip_radius", "root_radius", "face_width", "fillet_radius"):
                assert_allclose(getattr(two, name), getattr(one, name), rtol=1e-12, err_msg=name)
    assert back.load.torque == 200.0
    one, two = (each.train.planetary for each in (whole, back))
    for name in ("held", "floating", "pin_stiffness", "carrier_support", "sun_support"):
        assert getattr(two.keys, name) == getattr(one.keys, name)
    assert_allclose(two.angles, one.angles, atol=1e-7)
    tables = back.to_mapping() | {"effects": EFFECTS, "resolution": {"positions": 6}}
    results = [simulate(each, outputs=["transmission_error"]) for each in (whole, parse_scene(tables))]
    for name in ("train_transmission_error", "mesh_load", "load_sharing"):
        assert_allclose(results[1][name], results[0][name], rtol=1e-8)


def test_a_planetary_stage_is_one_stage_of_the_list(tmp_path):
    document = read_document(written(tmp_path, scene()))
    (stage,) = stages(document)
    assert stage.component.kind == "planetary_stage"
    assert [gear.name for gear in stage.gears] == ["sun", "planet 1", "ring"]


def test_without_bearings_a_number_of_planets_is_all_that_is_known(tmp_path):
    def bare(text):
        root = ElementTree.fromstring(text)
        relations = root.find("relations")
        for relation in [each for each in relations if each.get("type") == "side"]:
            relations.remove(relation)
        for component in root.find("components"):
            for attribute in [each for each in component if each.get("id") == "support_vector"]:
                component.remove(attribute)
        return ElementTree.tostring(root, encoding="unicode")

    document = read_document(written(tmp_path, scene(held="carrier", floating=["sun"]), bare))
    found = stage_scene(document, find_stage(document, None))
    table = found.tables["planetary"]
    assert (table["planets"], table["held"]) == (3, "ring")
    assert not {"positions", "floating", "pin_stiffness"} & table.keys()
    assert "no member is coupled to the casing: the ring is taken to be held" in found.notes


@pytest.mark.parametrize(("on", "share"), [("carrier", 36 / 132), ("ring", 36 / 96)])
def test_torque_of_another_member_follows_to_the_sun(tmp_path, on, share):
    def moved(text):
        root = ElementTree.fromstring(text)
        number = {c.get("name"): c.get("id") for c in root.find("components") if c.get("type") == "shaft"}
        for relation in root.find("relations"):
            for ref in relation:
                if ref.get("hint") == "external_load":
                    relation[0].set("id", number[on])
        return ElementTree.tostring(root, encoding="unicode")

    held = "ring" if on == "carrier" else "carrier"
    assert_allclose(read_rexs(written(tmp_path, scene(held=held), moved)).load.torque, 200.0 * share)


def test_unlike_planets_stay_pairs(tmp_path):
    def unlike(text):
        return re.sub(r'(name="planet 2">\s*<attribute id="number_of_teeth" unit="none">)30', r"\g<1>31", text)

    found = stages(read_document(written(tmp_path, scene(), unlike)))
    assert len(found) == 6
    assert all(stage.planetary is None for stage in found)


def test_results_go_into_the_stages_of_the_set(tmp_path):
    whole = scene()
    path = written(tmp_path, whole)
    document = read_document(path)
    result = simulate(whole)
    copy = read_document(write_results(document, find_stage(document, None), result, tmp_path / "results.rexs"))
    for name, part in zip(result["mesh"].values, find_stage(copy, None).planetary.parts, strict=True):
        assert part.name == name
        own = {attribute.get("id"): attribute for attribute in part.element}
        curve = [float(each.text) for each in own["custom_gearbench_meshing_stiffness_characteristic"].iter("c")]
        assert_allclose(curve, 1e3 * result["mesh_stiffness"].sel(mesh=name), rtol=1e-12)
    other = simulate(scene(sun={"teeth": 35}, planet={"teeth": 31}, ring={"teeth": -97}))
    with pytest.raises(InputError, match="must have the teeth of stage 1"):
        write_results(document, find_stage(document, None), other, tmp_path / "other.rexs")


EXTERNAL = {
    "pair": {"normal_module": 2.0, "helix_angle": 12.0, "face_width": 20.0, "centre_distance": 51.5, "backlash": 0.05}
    | {"pinion": {"teeth": 20, "face_width": 24.0, "bore_diameter": 15.0}}
    | {"wheel": {"teeth": 30, "bore_diameter": 20.0}}
}
INTERNAL = {
    "pair": {"normal_module": 2.0, "helix_angle": 15.0, "face_width": 25.0, "centre_distance": 62.1}
    | {"pinion": {"teeth": 39, "bore_diameter": 44.0, "profile_shift": 0.2}}
    | {"wheel": {"teeth": -99, "addendum": 0.85, "outer_diameter": 226.0, "cutter": {"teeth": 50}}}
}


@pytest.mark.parametrize("tables", [EXTERNAL, INTERNAL])
def test_a_pair_comes_back_as_it_was(tmp_path, tables):
    whole = parse_scene({**tables, "load": {"torque": -50.0}, "effects": EFFECTS | {"gear_body": {}}})
    path, notes = write_rexs(whole, tmp_path / "pair.rexs")
    assert notes == ("not written: the sign of load.torque, effects.gear_body, effects.hertz, effects.tooth_bending",)
    back = read_rexs(path)
    for one, two in zip(whole.pair.gears, back.pair.gears, strict=True):
        for name in ("teeth", "beta", "profile_shift", "tip_radius", "root_radius", "face_width", "fillet_radius"):
            assert_allclose(getattr(two, name), getattr(one, name), rtol=1e-12, err_msg=name)
    assert_allclose(back.pair.meshing.transverse_contact_ratio, whole.pair.meshing.transverse_contact_ratio, rtol=1e-12)
    for one, two in zip(whole.pair.members, back.pair.members, strict=True):
        for name in ("bore_diameter", "outer_diameter", "cutter"):
            assert getattr(two, name) == getattr(one, name)
    assert back.effect("gear_body") is not None
    assert back.load.torque == 50.0


def test_outside_of_a_ring_smaller_than_its_root_is_not_taken(tmp_path):
    whole = parse_scene({**INTERNAL, "load": {"torque": 50.0}, "effects": EFFECTS})
    path, _ = write_rexs(whole, tmp_path / "pair.rexs")
    path.write_text(path.read_text(encoding="utf-8").replace("226.0", "205.0"), encoding="utf-8")
    document = read_document(path)
    found = stage_scene(document, find_stage(document, None))
    assert "outer_diameter" not in found.tables["pair"]["wheel"]
    assert any(note.startswith("outside of") and "give outer_diameter" in note for note in found.notes)


def test_other_trains_and_files_are_refused(tmp_path):
    shared = {"normal_module": 2.0, "face_width": 20.0}
    gears = {name: {"teeth": teeth, **shared} for name, teeth in (("a", 20), ("b", 30), ("c", 25))}
    meshes = [
        {"driver": "a", "driven": "b", "centre_distance": 50.5},
        {"driver": "b", "driven": "c", "centre_distance": 55.5},
    ]
    chain = parse_scene({"gears": gears, "meshes": meshes, "load": {"torque": 50.0}, "effects": EFFECTS})
    with pytest.raises(InputError, match="only pairs and planetary sets"):
        write_rexs(chain, tmp_path / "chain.rexs")
    with pytest.raises(InputError, match="must end in"):
        write_rexs(scene(), tmp_path / "set.xml")


def test_at_the_command_line(tmp_path, run):
    (tmp_path / "set.toml").write_text(scene().to_toml(), encoding="utf-8")
    _, said, _ = run("rexs", tmp_path / "set.toml", "--to", tmp_path / "set.rexs")
    assert "not written: effects.hertz, effects.tooth_bending" in said
    _, said, _ = run("rexs", tmp_path / "set.rexs")
    assert "36/30/-96" in said
    run("rexs", tmp_path / "set.rexs", "--scene", "1", tmp_path / "back.toml")
    assert np.isclose(float(re.search(r"torque = (\S+)", (tmp_path / "back.toml").read_text()).group(1)), 200.0)
