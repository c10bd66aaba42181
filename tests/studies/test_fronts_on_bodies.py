"""Fronts on solid teeth and bodies: studies differ in the teeth alone, the page says what is stored."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from gearbench.library.garambois2017 import gear, table_2
from gearbench.optimisation.study import Algorithm
from studies import s10_fronts_on_bodies as bodies
from studies.s06_paper_fronts.search import study as plate_study
from studies.s10_fronts_on_bodies import data
from studies.s10_fronts_on_bodies.data import means, scene
from studies.s10_fronts_on_bodies.findings import measures
from tests.support.stored import stored


@pytest.fixture
def kept() -> xr.Dataset:
    return stored("s10_fronts_on_bodies")


def test_rows_are_as_they_were_stored(kept):
    """Two of them, as the solid is today: a short path, two pairs and more."""
    for name in ("1", "7"):
        number = list(kept["row"].values).index(name)
        assert table_2()[number].gear == name
        found = means(scene(number), plate_study(1).robustness)
        stored = [kept[f"row_{each}_solid"].values[number] for each in ("m_k", "m_ste")]
        np.testing.assert_allclose(found, stored, rtol=1e-3)


def test_the_studies_differ_in_teeth_and_bodies_alone():
    plate, solid = (data.study(2, model).to_mapping() for model in data.MODELS)
    assert plate["robustness"]["racing"]
    assert plate["base"]["effects"].pop("tooth_bending") == {"basis": "paper"}
    assert solid["base"]["effects"].pop("tooth_bending") == {"model": "solid"}
    assert solid["base"]["effects"].pop("gear_body") == {"model": "ring"}
    for member in ("pinion", "wheel"):
        assert solid["base"]["pair"][member].pop("bore_diameter") == data.BORE
    assert plate | {"name": ""} == solid | {"name": ""}


def test_a_row_on_its_body_is_the_scene_of_the_study():
    """Of the effects that a design of the study has, and no others."""
    scene = data.on_body(gear("55").scene(errors=True))
    assert scene.effect("tooth_bending").model == "solid"
    assert scene.effect("gear_body") is not None
    assert scene.pair.pinion.bore_diameter == data.BORE
    assert scene.effect("manufacturing_errors") == gear("55").scene(errors=True).effect("manufacturing_errors")


@pytest.mark.slow
def test_from_end_to_end(monkeypatch, tmp_path):
    quick = (Algorithm(population=10, generations=3, seed=1), replace(data.QUICK[1], samples=16))
    monkeypatch.setattr(data, "QUICK", quick)
    dataset = bodies.compute(quick=True, folder=tmp_path / "searches")
    again = bodies.compute(quick=True, folder=tmp_path / "searches")
    np.testing.assert_array_equal(dataset["m_k_solid"], again["m_k_solid"])
    assert bodies.checks(dataset)
    bodies.figures(dataset, tmp_path)
    found = measures(dataset, 3)
    assert found["gears on the front of the solid"] >= 1
    # the paper prints m_ste to two decimals; the plate is its model
    near = dataset["row_m_ste_plate"].values / dataset["row_m_ste_paper"].values
    assert 0.8 < np.median(near) < 1.3
