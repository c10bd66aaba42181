"""Plots: what they say, which way their axes run, and the points of a sweep."""

from __future__ import annotations

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

from gearbench import fourier, simulate, sweep
from gearbench.errors import InputError
from gearbench.library.garambois2017 import gear
from gearbench.plot import (
    density,
    draw_robust,
    draw_simulation,
    load_distribution,
    load_map,
    order_spectrum,
    over_two_periods,
)
from gearbench.results.origin import scene_of
from gearbench.scene import Load

SCENE = gear("SC").scene()
TORQUES = [5.0, 10.0, 20.0]
CENTRES = [38.0, 38.04]


@pytest.fixture(scope="module")
def loads():
    return sweep(SCENE, torque=TORQUES)


@pytest.fixture(scope="module")
def distances():
    """Swept over the geometry: points with mesh phases of their own."""
    bare = replace(SCENE, pair=replace(SCENE.pair, **shifts(None)))
    return sweep(bare, {"pair.centre_distance": CENTRES, "torque": [5.0, 10.0]})


def shifts(value):
    pair = SCENE.pair
    return {gear: replace(getattr(pair, gear), profile_shift=value) for gear in ("pinion", "wheel")}


@pytest.fixture
def axes():
    figure, drawn = plt.subplots()
    yield drawn
    plt.close(figure)


# -- sweeps -----------------------------------------------------------------------------------------------------------


def test_orders_of_every_point_are_those_of_its_scene(loads, distances):
    found = fourier(loads, "transmission_error")
    assert found.shape == (3, 10)
    assert_allclose(found, loads["transmission_error_amplitude"].values, rtol=1e-9)
    single = simulate(replace(SCENE, load=Load(torque=10.0)))
    assert_allclose(found[1], fourier(single, "transmission_error"), rtol=0.02, atol=1e-3)  # phases of their own
    found = fourier(distances, "mesh_stiffness", 4)
    assert found.shape == (2, 2, 4)
    stored = distances["mesh_stiffness_amplitude"].transpose("pair.centre_distance", "torque", "harmonic").values
    assert_allclose(found, stored[..., :4], rtol=1e-9)


@pytest.mark.parametrize("which", ["loads", "distances"])
def test_every_point_of_a_sweep_is_a_curve(request, axes, which):
    data = request.getfixturevalue(which)
    over_two_periods(data, "transmission_error", axes)
    labels = [line.get_label() for line in axes.get_lines() if not line.get_label().startswith("_")]
    if which == "loads":
        assert labels == ["torque 5 N·m", "torque 10 N·m", "torque 20 N·m"]
    else:
        assert labels[0] == "centre distance 38 mm, torque 5 N·m"
        assert len(labels) == 4
    assert [text.get_text() for text in axes.get_legend().get_texts()] == labels
    for line, values in zip(axes.get_lines(), data["transmission_error"].values.reshape(len(labels), -1), strict=False):
        drawn = line.get_ydata()
        assert np.isfinite(drawn).all()
        # curves run between the Gauss points and a little beyond them
        assert_allclose([drawn.min(), drawn.max()], [np.nanmin(values), np.nanmax(values)], atol=0.2 * np.ptp(drawn))


def test_spectra_and_densities_of_a_sweep_have_a_line_a_point(loads, axes):
    order_spectrum(loads, "mesh_stiffness", axes)
    assert axes.get_legend().get_texts()[0].get_text() == "torque 5 N·m"
    assert_allclose(axes.get_lines()[2].get_ydata(), loads["mesh_stiffness_amplitude"].values[2], rtol=1e-9)
    axes.clear()
    rng = np.random.default_rng(0)
    name, attrs = "transmission_error_rms", {"symbol": "x", "units": "µm"}
    scatter = xr.Dataset({name: (("torque", "sample"), rng.normal([[1], [3]], 0.1, (2, 50)), attrs)})
    density(scatter.assign_coords(torque=("torque", [5.0, 10.0], {"units": "N·m"})), name, axes)
    peaks = [line.get_xdata()[np.argmax(line.get_ydata())] for line in axes.get_lines()]
    assert_allclose(peaks, [1.0, 3.0], atol=0.1)


def test_the_axis_of_an_order_spectrum_shows_the_noise_floor_it_names(axes):
    data = simulate(SCENE)
    name = "transmission_error_amplitude_noise_floor"
    floor = np.full(data.sizes["harmonic"], 1e-3 * float(data["transmission_error_amplitude"].min()))
    order_spectrum(data.assign({name: ("harmonic", floor)}), axes=axes)
    assert axes.get_legend_handles_labels()[1] == ["numerical noise floor"]
    assert axes.get_ylim()[0] < floor[0]


def test_many_points_are_thinned_and_both_ends_kept(axes):
    phase = np.linspace(0, 1, 16, endpoint=False)
    weight, none = np.full(16, 1 / 16), np.full(16, np.nan)
    values = np.arange(30.0)[:, None] + np.sin(2 * np.pi * phase)
    coords = {"mesh_phase": phase, "phase_weight": weight, "panel_start": none, "panel_end": none}
    data = xr.Dataset(
        {"transmission_error": (("torque", "position"), values, {"symbol": "δ", "units": "µm"})},
        {name: ("position", v) for name, v in coords.items()} | {"torque": ("torque", np.arange(1.0, 31.0))},
    )
    over_two_periods(data, "transmission_error", axes)
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert (len(labels), labels[0], labels[-1]) == (8, "torque 1", "torque 30")


def test_figures_of_one_scene_ask_for_a_point_and_show_it(loads, distances, axes, tmp_path):
    for draw in (
        load_distribution,
        lambda data: load_map(data, 0),
        lambda data: draw_simulation(data, tmp_path),
    ):
        with pytest.raises(InputError, match=r"dataset = swept over torque: must be one point, e\.g\. dataset\.isel"):
            draw(loads)
    one = distances.sel({"pair.centre_distance": CENTRES[1], "torque": 10.0})
    scene = scene_of(one)
    assert (scene.pair.centre_distance, scene.load.torque) == (CENTRES[1], 10.0)
    load_distribution(one, axes)
    load_map(one, 1)
    plt.close("all")
    assert scene_of(loads.sel(torque=20.0)) == replace(SCENE, load=Load(torque=20.0))
    assert scene_of(loads) == SCENE  # of all points, what they share


# -- axes and titles --------------------------------------------------------------------------------------------------


def test_the_face_width_runs_across_on_every_picture_of_a_flank(axes, monkeypatch, tmp_path):
    from studies.s03_error_modes import compute, figures, findings

    data = simulate(SCENE)
    load_distribution(data, axes)
    shown = [axes, load_map(data, 0)]
    monkeypatch.setattr(findings, "write_figure", lambda figure, path: shown.append(figure.axes[0]))
    figures(compute(quick=True), tmp_path)
    assert len(shown) > 5
    for axis in shown:
        assert axis.get_xlabel() == "position along the face width y [mm]"
    # and not only by their labels: the load spans the face
    across = axes.collections[0].get_datalim(axes.transData).width
    assert_allclose(across, SCENE.pair.face_width, rtol=0.15)
    plt.close("all")


def robust_data(shares, errors, total=None):
    names = ["profile_form", "helix_slope", "deviation"]
    rng = np.random.default_rng(3)
    data = {}
    for name, units in (("transmission_error_rms", "µm"), ("mesh_stiffness_rms", "%")):
        values = rng.normal(5.0, 0.5, 40)
        data[name] = ("sample", values, {"symbol": name, "units": units})
        data |= {f"{name}_mean": values.mean(), f"{name}_std": values.std()}
        data[f"{name}_first_order"] = ("error_name", shares)
        data[f"{name}_first_order_standard_error"] = ("error_name", errors)
        data[f"{name}_total"] = ("error_name", shares if total is None else total)
    attrs = {"scene": SCENE.to_toml(), "support": "clamped"}
    return xr.Dataset(data, {"error_name": names}, attrs)


@pytest.mark.parametrize(
    ("shares", "errors", "says"),
    [
        ([0.6, 0.3, 0.05], [0.02, 0.02, 0.02], "profile form alone causes 60 % of the variance of RMS STE"),
        (
            [0.42, 0.4, 0.1],
            [0.05, 0.05, 0.05],
            "causes 42 % of the variance of RMS STE\nhelix slope: equal within twice the standard error",
        ),
        ([0.42, 0.4, 0.39], [0.3, 0.3, 0.3], "\nhelix slope, deviation: equal within twice the standard error"),
        ([np.nan] * 3, [np.nan] * 3, "too few error samples"),
    ],
)
def test_a_title_names_no_winner_within_error_bars(monkeypatch, tmp_path, shares, errors, says):
    import gearbench.plotting

    titles = []
    write = gearbench.plotting.write_figure
    monkeypatch.setattr(
        gearbench.plotting, "write_figure", lambda f, path: titles.append(f.axes[0].get_title()) or write(f, path)
    )
    draw_robust(robust_data(shares, errors), tmp_path)
    assert says in titles[-1]


def test_a_title_names_who_leads_with_others_too(tmp_path, monkeypatch):
    import gearbench.plotting

    titles = []
    monkeypatch.setattr(gearbench.plotting, "write_figure", lambda f, path: titles.append(f.axes[0].get_title()))
    draw_robust(robust_data([0.4, 0.2, 0.1], [0.02] * 3, [0.45, 0.6, 0.1]), tmp_path)
    assert titles[-1].endswith(
        "profile form alone causes 40 % of the variance of RMS STE\nhelix slope together with other errors 60 %"
    )


def test_no_density_is_drawn_below_zero_where_no_sample_is(axes):
    """A kernel density reflected at zero: its integral over the positive axis is 1."""
    values = np.random.default_rng(1).exponential(size=400)
    data = xr.Dataset({"transmission_error_rms": ("sample", values, {"symbol": "δ", "units": "µm"})})
    x, y = density(data, "transmission_error_rms", axes).lines[-1].get_data()
    assert x.min() == 0.0
    assert np.trapezoid(y, x) == pytest.approx(1.0, abs=0.02)  # the grid ends a tenth of the range above the largest
