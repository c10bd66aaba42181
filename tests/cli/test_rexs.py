"""REXS on the command line: list, simulate, convert, write back."""

import json
import re
import zipfile
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from gearbench.exchange.rexs import read_rexs
from gearbench.exchange.rexs_document import children, read_document
from gearbench.exchange.rexs_system import system_scene
from gearbench.scene_file import read_scene
from tests.support.paths import DATA

SEW, NEW = DATA / "sew_3_stage_cylindrical_gearbox_1.0.rexs", DATA / "stage_1.6.rexs"


@pytest.fixture
def result(run, tmp_path):
    """Result of stage 1 of the new model."""
    target = tmp_path / "result.nc"
    assert run("simulate", NEW, "-q", "-o", target) == (0, "", "")
    return target


def test_a_stage_chosen_by_its_id_is_named(run):
    found = {stage: json.loads(run("simulate", SEW, "--stage", stage, "--json")[1]) for stage in ("1", "6")}
    assert found["1"]["mesh_stiffness_mean"] == found["6"]["mesh_stiffness_mean"] > 0
    (added,) = set(found["6"]["notes"]) - set(found["1"]["notes"])
    assert added == "6 is the id of stage 1"


def test_the_list_shows_all_stages(run):
    code, out, _ = run("rexs", SEW)
    assert code == 0
    for words in ("23/67", "13/76", "14/87", "4.725", "13.76", "80.46"):
        assert words in out
    stages = json.loads(run("rexs", SEW, "--json")[1])["stages"]
    assert [row["id"] for row in stages] == [6, 37, 55]
    assert stages[1]["ε_α"] == pytest.approx(read_rexs(SEW, 2).pair.meshing.transverse_contact_ratio, rel=1e-12)


def test_the_list_says_what_a_stage_lacks(run, tmp_path):
    path = tmp_path / "broken.rexs"
    path.write_text(re.sub(r'<attribute id="center_distance".*', "", NEW.read_text()))
    code, out, _ = run("rexs", path)
    assert code == 0
    assert "component 10.center_distance = missing" in out


@pytest.mark.parametrize(("name", "value"), [("tip_diameter", 1.0), ("root_diameter", 900.0)])
def test_a_circle_on_the_wrong_side_is_named_as_in_the_file(run, tmp_path, name, value):
    text = NEW.read_text()
    path = tmp_path / "circle.rexs"
    path.write_text(re.sub(rf'(<attribute id="{name}"[^>]*>)[^<]*', rf"\g<1>{value}", text))
    code, _, err = run("simulate", path)
    assert code == 2
    assert re.fullmatch(rf"gearbench: {re.escape(str(path))}: component \d+\.{name} = {value:g}: must be [^\n]+\n", err)


def test_a_stage_becomes_a_scene_file(run, tmp_path):
    target = tmp_path / "stage2.toml"
    assert run("rexs", SEW, "--scene", 2, target)[0] == 0
    scene = read_scene(target)
    document = read_document(SEW)
    whole, notes = system_scene(document, 2)
    assert replace(scene, system=None, further=()) == read_rexs(SEW, 2)
    assert scene.system.shafts == whole.system.shafts
    assert scene.further == whole.further
    assert all(f"# {note}\n" in target.read_text() for note in notes)


def test_options_of_rexs_need_a_rexs_file(run, refused, tmp_path):
    target = tmp_path / "s.toml"
    run("rexs", NEW, "--scene", 1, target, "-q")
    assert "--stage" in refused("simulate", target, "--stage", 1)
    refused("simulate", SEW)
    refused("simulate", SEW, "--stage", 4)


def attributes(path, component):
    """Attribute → (unit, values) of a component."""
    element = read_document(path).components[component].element
    found = {}
    for attribute in children(element, "attribute"):
        cells = [cell.text for array in children(attribute, "array") for cell in children(array, "c")]
        found[attribute.get("id")] = attribute.get("unit"), cells or attribute.text
    return found


def test_results_are_written_where_the_standard_has_attributes(run, tmp_path, result):
    target = tmp_path / "with.rexs"
    code, out, _ = run("rexs", NEW, "--stage", 1, "--write", result, target)
    assert (code, out) == (0, f"wrote {target}\n")
    found = attributes(target, 10)
    with xr.open_dataset(result, engine="h5netcdf") as dataset:
        for name, unit, expected in (
            ("meshing_stiffness_characteristic", "N / mm", 1000 * dataset["mesh_stiffness"]),
            ("rotational_meshing_position", "deg", dataset["mesh_phase"] * 360 / 20),
            ("custom_gearbench_static_transmission_error", "mum", dataset["transmission_error"]),
        ):
            assert found[name][0] == unit
            # text holds every digit; the angle is multiplied in another order
            np.testing.assert_allclose(np.array(found[name][1], dtype=float), expected, rtol=1e-15)
        assert found["custom_gearbench_scene_sha256"] == ("none", dataset.attrs["scene_sha256"])


def test_a_file_with_results_is_the_same_model(run, tmp_path, result):
    once, twice, packed = tmp_path / "once.rexs", tmp_path / "twice.rexs", tmp_path / "packed.rexsz"
    run("rexs", NEW, "--stage", 1, "--write", result, once)
    run("rexs", once, "--stage", 1, "--write", result, twice)
    run("rexs", once, "--stage", 1, "--write", result, packed)
    assert read_rexs(twice).pair == read_rexs(packed).pair == read_rexs(NEW).pair
    assert read_rexs(twice).load == read_rexs(NEW).load
    # written again, results are replaced
    assert once.read_bytes() == twice.read_bytes()
    with zipfile.ZipFile(packed) as archive:
        assert archive.namelist() == ["packed.rexs"]
    for number in set(read_document(NEW).components) - {10}:
        assert attributes(twice, number) == attributes(NEW, number)
    assert attributes(NEW, 10).items() <= attributes(twice, 10).items()


def test_older_versions_get_custom_attributes_and_keep_comments(run, tmp_path):
    result, target = tmp_path / "result.nc", tmp_path / "with.rexs"
    run("simulate", SEW, "--stage", 3, "-q", "-o", result)
    run("rexs", SEW, "--stage", 3, "--write", result, target, "-q")
    found = attributes(target, 55)
    assert found["custom_gearbench_rotational_meshing_position"][0] == "°"
    assert "meshing_stiffness_characteristic" not in found
    assert len(found["custom_gearbench_meshing_stiffness_characteristic"][1]) > 10
    comment = "<!--Stage relation between Stirnradstufe and Stirnrad pos=1 [23] and Stirnrad pos=2 [34]-->"
    assert comment in SEW.read_text()
    assert comment in target.read_text()


def test_results_of_another_stage_are_refused(run, tmp_path, result):
    target = tmp_path / "with.rexs"
    code, _, err = run("rexs", SEW, "--stage", 1, "--write", result, target)
    assert code == 2
    assert "20/44" in err
    assert not target.exists()
