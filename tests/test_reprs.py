"""What a notebook shows of scenes and pairs, plots that return their axes, and results in pandas and MATLAB."""

import h5py
import matplotlib as mpl
import pytest

from gearbench.html import notebook_table
from gearbench.library.garambois2017 import case, gear
from gearbench.results.netcdf import save
from gearbench.robustness.run import robust
from gearbench.scene_file import parse_scene
from gearbench.simulation import simulate
from tests.support.html import Page

mpl.use("agg")


@pytest.fixture(scope="module")
def result():
    return simulate(case(2))


def test_a_pair_shows_its_sizes():
    rows = {row[0]: row[1:] for row in Page(case(2).pair._repr_html_()).rows}
    assert rows[""] == ["pinion", "wheel"]
    assert rows["teeth z"] == ["17", "71"]
    tip = [f"{g.tip_radius:.5g}" for g in case(2).pair.gears]
    assert rows["tip radius r_a [mm]"] == tip
    assert rows["E [GPa], ν"] == ["210, 0.3"]


def test_a_scene_shows_its_effects_and_nothing_else():
    scene = gear("55").scene(errors=True)
    rows = {row[0]: row[1:] for row in Page(scene._repr_html_()).rows}
    assert rows["load"] == ["10 N·m on the pinion"]
    assert rows["tip_relief"] == ["amount = 5.0, length = 0.44"]
    assert "crowning" not in rows


def test_names_are_escaped():
    tables = case(1).to_mapping() | {"name": "<script>alert(1)</script> & more"}
    text = parse_scene(tables)._repr_html_()
    assert "<script>" not in text
    assert "&lt;script&gt;" in text
    table = notebook_table("a & b", ("<i>",), {"<b>": ("<u>",)})
    assert [mark for mark in ("<i>", "<b>", "<u>", "a & b") if mark in table] == []


def test_files_hold_only_types_that_every_netcdf_reader_knows(result, tmp_path):
    # MATLAB reads netCDF-4 of numbers and text; not enumerations (booleans), compounds or opaque types
    sampled = robust(gear("55").scene(errors=True), samples=64, threads=1)
    for name, dataset in (("simulate", result), ("robust", sampled)):
        with h5py.File(save(dataset, tmp_path / f"{name}.nc")) as file:
            for key, variable in file.items():
                assert isinstance(variable, h5py.Dataset), f"{key} is a group"
                text = h5py.check_string_dtype(variable.dtype) is not None
                assert text or variable.dtype.kind in "fi", key
                assert text == (key == "error_name"), key
            for key in file.attrs:
                kind = file.attrs.get_id(key).dtype
                assert h5py.check_string_dtype(kind) is not None or kind.kind in "fiS", key
                assert h5py.check_enum_dtype(kind) is None, key
