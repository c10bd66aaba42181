"""Fronts on solid teeth and bodies: studies differ in the teeth alone, the page says what is stored."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from gearbench.library.garambois2017 import gear, table_2
from gearbench.optimisation.study import Algorithm
from studies import s10_fronts_on_bodies as bodies
from studies.s06_paper_fronts.findings import coverage, distance, lead
from studies.s06_paper_fronts.search import TOOLS
from studies.s06_paper_fronts.search import study as plate_study
from studies.s10_fronts_on_bodies import data
from studies.s10_fronts_on_bodies.data import MODELS, means, scene
from studies.s10_fronts_on_bodies.findings import measures, points, row_points
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


def on_front(dataset: xr.Dataset, tool: int, model: str) -> NDArray:
    return (dataset["design_tool"].values == tool) & (dataset["design_model"].values == MODELS.index(model))


def test_the_page_says_what_the_stored_fronts_show(kept):
    assert (int(kept.attrs["quick"]), int(kept.attrs["generations"])) == (0, 200)
    found = {tool: measures(kept, tool) for tool in TOOLS}

    def row(name: str, digits: int = 0) -> list[float]:
        return [round(found[tool][name], digits) for tool in TOOLS]

    assert row("gears on the front of the solid") == [28, 57, 54]
    assert row("gears on the front of the plate") == [79, 66, 68]
    assert row("of these, on the front of both together") == [4, 38, 34]
    assert row("hypervolume of the solid's front", 3) == [0.51, 0.412, 0.396]
    assert row("hypervolume of the plate's front, judged by the solid", 3) == [0.493, 0.406, 0.388]
    for name, m_k, m_ste in (("median", [-28, -21, -8], [-4, -12, -11]), ("least", [-61, -31, -29], [-48, -36, -28])):
        comma = ", least" if name == "least" else " from plate to solid, median"
        assert (row(f"m_k{comma} [%]"), row(f"m_ste{comma} [%]")) == (m_k, m_ste)
    assert (row("m_k, greatest [%]"), row("m_ste, greatest [%]")) == ([-18, -17, -1], [110, 40, -3])
    assert row("rank correlation of m_k", 2) == [0.61, 0.99, 0.98]
    assert [round(100 * found[tool]["largest lead of a row of Table 2"], 1) for tool in TOOLS] == [-4.6, -0.2, -1.2]


def test_what_the_fronts_are_made_of(kept):
    crowned = [[int((kept["crowning"].values[on_front(kept, t, m)] > 2).sum()) for t in TOOLS] for m in MODELS]
    assert crowned == [[42, 20, 26], [0, 4, 0]]
    own = on_front(kept, 1, "solid")
    quiet = own & (kept["m_ste_solid"].values < 0.25)
    assert (own.sum(), quiet.sum()) == (28, 24)
    assert set(kept["helix_angle"].values[quiet]) == {25.0}
    assert kept["crowning"].values[quiet].max() == 0
    loud = own & ~quiet
    assert round(kept["m_k_solid"].values[quiet].min() - kept["m_k_solid"].values[loud].min(), 2) == 0.18
    assert 6.5 < kept["m_ste_solid"].values[loud].min() / kept["m_ste_solid"].values[quiet].max() < 7.5


def test_rows_of_the_table_beside_the_fronts(kept):
    covered, farthest, gains, misses = [], [], [], []
    for tool in TOOLS:
        solid, plate = points(kept, tool, "solid", "solid"), points(kept, tool, "plate", "solid")
        plate, theirs = plate[np.isfinite(plate).all(axis=1)], row_points(kept, tool, "solid")
        covered.append((round(coverage(solid, theirs) * len(theirs)), len(theirs)))
        farthest.append(round(100 * max(distance(row, solid) for row in theirs), 1))
        gains.append(round(100 * max(_gain(row, solid) for row in theirs)))
        better = [100 * _gain(point, solid) for point in plate]
        misses.append((round(abs(np.median(better))), round(max(better))))
        assert all(lead(row, solid) < 0 for row in theirs)
    assert covered == [(7, 7), (12, 13), (10, 11)]
    assert farthest[1:] == [0.5, 0.8]
    assert gains == [44, 22, 20]
    assert misses == [(30, 50), (0, 5), (0, 8)]


def _gain(point: NDArray, front: NDArray) -> float:
    """By which share some gear of the front is better than ``point`` in both objectives."""
    return float(np.max(np.min(1 - front / point, axis=1)))


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
