"""REXS on the command line: list, simulate, convert."""

import json
import re
from dataclasses import replace

import pytest

from gearbench.exchange.rexs import read_rexs
from gearbench.exchange.rexs_document import read_document
from gearbench.exchange.rexs_system import system_scene
from gearbench.scene_file import read_scene
from tests.support.paths import DATA

SEW, NEW = DATA / "sew_3_stage_cylindrical_gearbox_1.0.rexs", DATA / "stage_1.6.rexs"


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
