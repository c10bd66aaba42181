"""Comparison with a reference that is known: the scene itself, or twice as soft; several scenes in one Dataset."""

from __future__ import annotations

from dataclasses import replace

import pytest
import xarray as xr
from numpy.testing import assert_allclose

from gearbench.effects.hertz import Hertz
from gearbench.library.garambois2017 import case
from gearbench.results.netcdf import open_result, save
from gearbench.results.quantities import QUANTITIES
from gearbench.results.responses import quantity
from gearbench.scene import Resolution
from gearbench.simulation import simulate
from gearbench.validation.comparison import compare, labels, validate
from gearbench.validation.dataset import of_scene, stack
from tests.support.validation_fakes import plates_for_finite_elements

ERRORS = [
    f"{name}_{part}_error"
    for name in ("transmission_error", "mesh_stiffness")
    for part in ("mean", "peak_to_peak", "amplitude")
]


@pytest.mark.parametrize("number", [1, 2])
def test_a_scene_against_itself_has_no_error(monkeypatch, number):
    plates_for_finite_elements(monkeypatch)
    found = compare(case(number))
    for name in ERRORS:
        assert_allclose(found[name], 0, atol=1e-9, err_msg=name)  # percent; two paths to the same contact problem
    assert_allclose([found["load_share_error_max"], found["load_share_error_rms"]], 0, atol=1e-11)
    for name in ("mac", "mac_worst", "mac_mean", "line_mac_worst", "line_mac_mean", "norm_ratio", "compliance_ratio"):
        assert_allclose(found[name], 1, rtol=1e-12, err_msg=name)


def test_against_a_reference_twice_as_soft(monkeypatch):
    """Teeth half as compliant as the reference's deflect alike; with a linear law half as compliant too, STE halves."""
    plates_for_finite_elements(monkeypatch, softness=2.0)
    found = compare(case(1))
    assert_allclose(found["norm_ratio"], 0.5, rtol=1e-12)
    assert_allclose(found["compliance_ratio"], 0.5, rtol=1e-12)
    assert_allclose(found["mac"], 1, rtol=1e-12)
    # springs in series: the contact law is the same on both sides, so the mean STE loses less than half
    assert -50 < float(found["transmission_error_mean_error"]) < -20
    assert 20 < float(found["mesh_stiffness_mean_error"]) < 100


def test_both_sides_are_what_simulate_gives(monkeypatch):
    plates_for_finite_elements(monkeypatch, softness=1.3)
    scene = case(2)
    found, alone = compare(scene), simulate(scene, outputs=("transmission_error", "mesh_stiffness", "load_share"))
    fast = found.sel(model="fast")
    for name in alone.data_vars:
        if name in found:
            assert_allclose(fast[name], alone[name], rtol=1e-13)
    weight = found["phase_weight"].values
    assert_allclose(found["transmission_error"].values @ weight, found["transmission_error_mean"], rtol=1e-13)
    assert found.attrs["scene"] == scene.to_toml()
    assert 'model = "finite_elements"' in found.attrs["reference_scene"]


def test_every_variable_says_what_it_is(monkeypatch):
    plates_for_finite_elements(monkeypatch)
    found = compare(case(1))
    for name, values in found.data_vars.items():
        assert values.attrs["units"], name
        known = quantity(str(name))
        assert known is not None
        assert values.attrs == known.attrs
        if name.endswith("_error") and name not in QUANTITIES:
            assert values.attrs["units"] == "%"


def test_times_are_measured_or_those_stored_with_the_reference(monkeypatch):
    plates_for_finite_elements(monkeypatch)
    found = compare(case(1))
    assert float(found["compliance_seconds"].sel(model="reference")) == pytest.approx(4.0)  # 2 s for each gear
    assert list(found["reference_cached"].values) == [1, 1]
    for name in ("compliance_seconds", "simulation_seconds"):
        assert 0 < float(found[name].sel(model="fast")) < 5
    assert float(found["first_call_seconds"]) > 0


def test_scenes_of_different_sizes_share_a_dataset_and_come_back(monkeypatch, tmp_path):
    plates_for_finite_elements(monkeypatch)
    scenes = [case(1), replace(case(2), resolution=Resolution(positions=5, segments=4)), replace(case(2), name="")]
    each = [compare(scene) for scene in scenes]
    stored = open_result(save(stack(each, labels(scenes)), tmp_path / "several.nc"))
    assert list(stored["scene"].values) == ["case 1", "case 2", "scene"]
    for i, one in enumerate(each):
        back = of_scene(stored, i)
        # what is read back is the same, but for the name of its scene; netCDF keeps no length of text
        back = back.drop_vars("scene").assign_coords(model=one["model"], gear=one["gear"])
        xr.testing.assert_identical(back.drop_attrs(deep=False), one.drop_attrs(deep=False))
        for key in ("scene", "scene_sha256", "reference_scene", "reference_solver", "reference_versions"):
            assert back.attrs[key] == one.attrs[key]


def test_names_of_scenes_are_told_apart():
    first, second = case(1), case(2)
    assert labels([first, second, first]) == ["case 1 #1", "case 2", "case 1 #3"]


def test_nothing_is_computed_where_one_scene_cannot_be_compared(monkeypatch):
    from gearbench.errors import InputError
    from gearbench.validation import comparison

    monkeypatch.setattr(comparison, "compare", lambda *_: pytest.fail("computed"))
    with pytest.raises(InputError, match=r"no teeth: effects = .*nothing to compare"):
        validate([case(1), replace(case(2), name="no teeth", effects=(Hertz(),))])
