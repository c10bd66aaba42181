"""Comparison of planetary sets with references that are known: the set itself, or one twice as soft."""

import numpy as np
import pytest
import tomli_w
from numpy.testing import assert_allclose

from gearbench import simulate
from gearbench.errors import InputError
from gearbench.library.garambois2017 import case
from gearbench.results.responses import quantity
from gearbench.scene_file import parse_scene
from gearbench.validation import contact
from gearbench.validation.comparison import compare, validate
from gearbench.validation.dataset import of_scene
from gearbench.validation.judge import JUDGED
from gearbench.validation.reference import reference_scene
from gearbench.validation.report import finding, render
from tests.support.validation_fakes import plates_for_finite_elements
from tests.test_planetary import tables

#: A sequential set whose pins share unevenly.
SET = {"planets": 4, "pin_stiffness": 200.0, "pin_tangential": [20.0, 0.0, -10.0, 0.0]}


#: Gears of stepped planets, and of planets that are not.
GEARS = {
    "simple": (["sun", "planet 1 at sun", "planet 1 at ring", "ring"], {}),
    "stepped": (["sun", "planet 1", "planet 1 at ring", "ring"], {"planet_at_ring": {"teeth": 24}}),
}


def scene(law="weber_banaschek"):
    return parse_scene(tables((37, 31, 99), effects={"tooth_bending": {}, "hertz": {"law": law}}, **SET))


def test_the_command_compares_sets(run, tmp_path, monkeypatch):
    plates_for_finite_elements(monkeypatch)
    coarse = {"positions": 4, "segments": 5}
    path = tmp_path / "set.toml"
    path.write_text(tomli_w.dumps(tables(effects={"tooth_bending": {}, "hertz": {}}) | {"resolution": coarse}))
    code, out, err = run("validate", path, "-o", tmp_path / "out")
    assert (code, err) == (0, "")
    assert out.startswith("scene. Against finite elements: mean STE +0.000")
    assert "warning: scene: " in out


@pytest.mark.parametrize("kind", GEARS)
def test_a_set_against_itself_has_no_error(monkeypatch, kind):
    plates_for_finite_elements(monkeypatch)
    gears, stepped = GEARS[kind]
    effects = {"tooth_bending": {}, "hertz": {}}
    whole = parse_scene(tables((24, 36, 84), effects=effects, **SET, **stepped)) if stepped else scene()
    found, alone = compare(whole), simulate(whole)
    for name in (*JUDGED, "mesh_load_factor_error", "load_share_error_max"):
        assert_allclose(found[name], 0, atol=1e-8, err_msg=name)
    assert_allclose(found["transmission_error"], np.tile(alone["train_transmission_error"], (2, 1)), rtol=1e-10)
    assert_allclose(found["load_sharing"].sel(model="fast").T, alone["load_sharing"], rtol=1e-10)
    assert_allclose(found["mesh_load_factor"], float(alone["mesh_load_factor"]), rtol=1e-10)
    assert list(found["gear"].values) == gears
    assert_allclose(found["mac_worst"], 1, rtol=1e-12)
    assert all(quantity(str(name)) is not None for name in found.data_vars)


@pytest.mark.slow
def test_stepped_planets_agree_with_finite_elements():
    """All four kinds of gears on finite elements, one pin off its place."""
    given = tables((24, 36, 84), planet_at_ring={"teeth": 24, "bore_diameter": 22.0}, pin_stiffness=300.0)
    given["planetary"] |= {"face_width": 16.0, "pin_tangential": [8.0, 0.0, -5.0]}
    given["planetary"]["sun"]["bore_diameter"] = 22.0
    given["planetary"]["planet"] |= {"bore_diameter": 22.0, "tip_relief": {"amount": 10.0, "length": 0.8}}
    given["planetary"]["ring"] |= {"addendum": 0.9, "outer_diameter": 205.0}
    given["effects"] = {"tooth_bending": {"model": "solid"}, "gear_body": {}, "hertz": {}, "off_line_contact": {}}
    found = compare(parse_scene(given), accuracy=0.05)
    # at 1 %: −0.11, −0.13, +0.12 and +0.02 %; the finite elements of the test are coarser
    assert abs(float(found["transmission_error_mean_error"])) < 1.0
    assert abs(float(found["transmission_error_peak_to_peak_error"])) < 3.0
    assert abs(float(found["mesh_stiffness_mean_error"])) < 1.0
    assert abs(float(found["mesh_load_factor_error"])) < 0.2
    assert float(found["mesh_load_factor"].min()) > 1.02


def test_a_set_of_teeth_twice_as_soft_yields_more_and_shares_better(monkeypatch):
    plates_for_finite_elements(monkeypatch, softness=2.0)
    found = compare(scene("yang_sun"))
    assert_allclose(found["norm_ratio"], 0.5, rtol=1e-12)
    # the contact law and the pins are alike on both sides, so the mean loses less than half
    assert -50 < float(found["transmission_error_mean_error"]) < -5
    assert float(found["mesh_load_factor_error"]) > 1.0
    fast, reference = found["load_sharing"].values
    assert_allclose(found["load_share_error_max"], np.abs(fast - reference).max(), rtol=1e-12)


def test_the_report_is_of_the_set(monkeypatch):
    plates_for_finite_elements(monkeypatch, softness=1.2)
    found = validate([scene()])
    said = finding(of_scene(found, 0))
    assert "K_γ +" in said
    assert "of an even share" in said
    text = render(found)
    assert text.count("<img") == 6
    assert "planet 1 at ring" in text


def test_the_reference_of_a_set_can_be_written_and_is_its_own_scene():
    given = tables(
        effects={"tooth_bending": {}, "hertz": {}, "gear_body": {}}, sun={"teeth": 36, "bore_diameter": 30.0}
    )
    given["planetary"]["planet"]["bore_diameter"], given["planetary"]["ring"]["outer_diameter"] = 30.0, 215.0
    given["planetary"]["planet"]["tip_relief"] = {"amount": 5.0, "length": 0.5}
    reference = reference_scene(parse_scene(given), 0.02)
    again = reference.to_mapping()
    assert again["planetary"]["planet"]["tip_relief"] == {"amount": 5.0, "length": 0.5}
    assert again["effects"] == {
        "tooth_bending": {"model": "finite_elements", "accuracy": 0.02},
        "gear_body": {},
        "hertz": {},
    }
    with pytest.raises(InputError, match="is the reference"):
        reference_scene(reference)


def test_sets_are_compared_alone_and_not_by_contact_elements():
    with pytest.raises(InputError, match="compared alone"):
        validate([scene(), case(1)])
    with pytest.raises(InputError, match="meshes"):
        contact.check(scene())
