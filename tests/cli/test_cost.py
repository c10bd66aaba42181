"""``gearbench cost``, ``--accuracy``, and docs/performance.md."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gearbench import read_scene, simulate
from gearbench.accuracy.measure import MEASURED
from gearbench.accuracy.settings import GAUSS_POINTS, PLATE_ORDER, SEGMENTS, with_resolution
from gearbench.effects.helix_slope import HelixSlope
from gearbench.effort import workprecision
from gearbench.effort.curves import WorkPrecision, observed_order, setting_curve
from gearbench.effort.workprecision import sample_curves
from gearbench.library.garambois2017 import case, gear
from gearbench.results.netcdf import open_result
from tests.support.paths import EXAMPLES, ROOT

DOCS = ROOT / "docs"
SMALL = """
[pair]
normal_module = 2.676
helix_angle = 25.648
face_width = 20.0
centre_distance = 128.0
pinion = { teeth = 17, addendum = 1.15, dedendum = 1.65 }
wheel = { teeth = 71, addendum = 1.13, dedendum = 1.62 }
[load]
torque = 230.0
[effects.hertz]
[resolution]
gauss_points = 2
segments = 4
"""


def test_cost_as_json_and_in_silence(run, tmp_path, monkeypatch):
    few = replace(SEGMENTS, levels=lambda _: (1, 2, 4, 8))
    monkeypatch.setattr(workprecision, "SETTINGS", {few.name: few})
    scene = tmp_path / "small.toml"
    scene.write_text(SMALL, encoding="utf-8")
    code, out, _ = run("cost", scene, "-o", tmp_path / "cost", "--repeats", 1, "--json")
    summary = json.loads(out)
    assert code == 0
    assert {row["knob"] for row in summary["settings"]} == set(summary["observed_order"])
    assert all(set(row["error"]) == set(MEASURED) and "seconds" in row for row in summary["settings"])
    assert all(Path(file).exists() for file in summary["files"])
    assert run("cost", scene, "--repeats", 1, "--quiet") == (0, "", "")


def test_accuracy_on_the_command_line(run, tmp_path):
    code, out, _ = run("simulate", EXAMPLES / "sc.toml", "--accuracy", "1%", "-o", tmp_path / "a.nc")
    assert code == 0
    assert "accuracy 1 %: segments = " in out
    assert open_result(tmp_path / "a.nc").attrs["accuracy_requested"] == 0.01


@pytest.mark.parametrize(
    ("text", "what"),
    [("x", "must be a number"), ("0", "at least"), ("70%", "at most"), ("1%%", "must be a number")],
)
def test_accuracies_that_are_none_are_one_line(refused, text, what):
    err = refused("simulate", EXAMPLES / "sc.toml", "--accuracy", text)
    assert "accuracy" in err
    assert what in err


def test_accuracy_beside_a_resolution_is_one_line(run, tmp_path):
    scene = tmp_path / "small.toml"
    scene.write_text(SMALL, encoding="utf-8")
    code, _, err = run("simulate", scene, "--accuracy", "0.01")
    assert (code, err.count("\n")) == (2, 1)
    assert "conflicts with the scene's [resolution]" in err
    code, _, err = run("robust", EXAMPLES / "gear55_robust.toml", "--accuracy", "0.1", "--samples", 8)
    assert (code, err.count("\n")) == (2, 1)
    assert "samples = 8: conflicts with accuracy" in err


def test_cost_refuses_a_scene_that_leaves_its_resolution_open(run, tmp_path):
    scene = tmp_path / "open.toml"
    scene.write_text(SMALL.replace("gauss_points = 2\nsegments = 4", "accuracy = 0.01"), encoding="utf-8")
    code, _, err = run("cost", scene)
    assert (code, err.count("\n")) == (2, 1)
    assert "resolution.accuracy" in err


PLANETARY = """
[planetary]
normal_module = 2.0
face_width = 20.0
planets = 3
sun = { teeth = 37 }
planet = { teeth = 32 }
ring = { teeth = -101, addendum = 0.9 }
[load]
torque = 200.0
[effects.tooth_bending]
basis = "paper"
[effects.hertz]
[resolution]
gauss_points = 2
segments = 8
"""


def test_cost_of_a_planetary_set_is_that_of_its_transmission_error(run, tmp_path, monkeypatch):
    few = replace(GAUSS_POINTS, levels=lambda _: (1, 2, 3, 96))  # a train ends at 24
    plate = replace(PLATE_ORDER, levels=lambda _: ("paper", (2, 2), (3, 3)))  # teeth that are computed anew
    monkeypatch.setattr(workprecision, "SETTINGS", {each.name: each for each in (few, plate)})
    scene = tmp_path / "set.toml"
    scene.write_text(PLANETARY, encoding="utf-8")
    code, out, _ = run("cost", scene, "-o", tmp_path / "cost", "--repeats", 1, "--json")
    summary = json.loads(out)
    rows = [row for row in summary["settings"] if row["knob"] == "gauss_points"]
    assert (code, len(rows), len(summary["settings"])) == (0, 1, 2)
    assert all(row["seconds"] > 0 and row["megabytes"] > 0 for row in summary["settings"])
    loaded = read_scene(scene)
    coarse, exact = (simulate(with_resolution(loaded, gauss_points=n)) for n in (1, 3))
    names = ("train_transmission_error_mean", "train_transmission_error_rms")
    expected = [abs(float(coarse[name]) / float(exact[name]) - 1) for name in names]
    assert expected[0] > 1e-4
    # relative differences of the two numbers; their rounding is 1e-12
    np.testing.assert_allclose([rows[0]["error"][name] for name in MEASURED[:2]], expected, rtol=1e-6)


def slanted(slope: float) -> WorkPrecision:
    """Segments of case 2 with a gap that varies along the lines."""
    scene = with_resolution(case(2), gauss_points=6)
    scene = replace(scene, effects=(*scene.effects, HelixSlope(pinion=slope)))
    return setting_curve(scene, replace(SEGMENTS, levels=lambda scene: SEGMENTS.levels(scene)[:-4]), repeats=1)


def test_segments_gain_digits_at_every_one_where_the_gap_varies_but_flanks_touch_all_along():
    assert np.all(slanted(5.0).order > 4.0)


def test_segments_are_of_second_order_at_least_where_flanks_part():
    """The mean of the STE and its RMS; the stiffness, whose slope jumps where they do, loses up to one order.

    Points on patches grow in number with the segments, which adds about one order.
    """
    order = slanted(40.0).order
    assert np.all(order[:2] > 2.0)
    assert np.all(order[2:] > 1.0)


def test_orders_of_plates_converge_and_the_paper_is_one_of_them():
    found = setting_curve(with_resolution(case(1), segments=4, gauss_points=2), PLATE_ORDER, repeats=1)
    assert found.labels[1] == "paper"
    mean = found.errors[:, 0]
    assert np.all(np.diff(mean) < 0)
    assert np.all(found.bar[0] < mean)


def test_samplers_are_of_their_orders():
    scene = with_resolution(gear("SC").scene(errors=True), segments=4, gauss_points=2)
    curves = {c.setting: c for c in sample_curves(scene, repeats=1, seeds=6, reference=2**12)}
    sobol, random = (curves[f"samples, {name}"] for name in ("sobol", "random"))
    # pseudo-random samples: ½, from six draws of each number
    np.testing.assert_allclose(np.median(random.order), 0.5, atol=0.25)
    assert np.nanmedian(sobol.order) > 0.6
    assert np.all(sobol.errors[-1] < random.errors[-1])


def test_the_order_observed_leaves_out_what_is_not_clear():
    sizes = np.array([2.0, 4.0, 8.0, 16.0, 32.0])
    errors = 3 * sizes**-2.0
    assert observed_order(sizes, errors, 0.0) == pytest.approx(2.0)
    errors[-1] = errors[-2]  # as large as the error bar
    assert observed_order(sizes, errors, errors[-1]) == pytest.approx(2.0)
    assert np.isnan(observed_order(sizes, errors, 1.0))


def test_tables_of_the_page_on_run_time_are_those_of_its_dataset(tmp_path):
    from docs.performance import DATA, FIGURES, TABLES, write_tables

    for made in write_tables(open_result(DATA), tmp_path):
        assert made.read_text(encoding="utf-8") == (TABLES / made.name).read_text(encoding="utf-8")
    for name in FIGURES:
        assert (DOCS / "figures" / f"performance_{name}.png").exists()
