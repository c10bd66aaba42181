"""The explorer without a browser: what is stored, what is changed, what is computed for a picked gear."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from gearbench.errors import InputError
from gearbench.explore.catalogue import ACROSS, UP, catalogue, fronts
from gearbench.explore.model import density, flank_map, shown_results
from gearbench.explore.stored import open_results
from gearbench.keys import value_at
from gearbench.library.garambois2017 import case, gear
from gearbench.optimisation.front import non_dominated
from gearbench.results.netcdf import save
from gearbench.robustness.run import robust
from gearbench.scene_file import read_scene
from gearbench.simulation import simulate
from gearbench.solution import solve_scene
from tests.support.explore_designs import front, stored
from tests.support.paths import EXAMPLES


@pytest.fixture(scope="module")
def robust_scene():
    return read_scene(EXAMPLES / "gear55_robust.toml")


# -- what is stored ---------------------------------------------------------------------------------------------------


def test_results_of_all_commands_open(tmp_path, robust_scene):
    save(front(40), tmp_path / "front.nc")
    save(simulate(case(1)), tmp_path / "simulated.nc")
    dataset = robust(robust_scene, samples=32)
    save(dataset, tmp_path / "robust.nc")
    designs = catalogue(open_results([tmp_path, tmp_path / "simulated.nc", tmp_path / "robust.nc"]))
    assert len(designs) == 39 + 2
    assert designs.scene(39).pair == case(1).pair
    assert designs.scene(40) == robust_scene
    assert_allclose(designs.column(ACROSS).values[40], dataset["mesh_stiffness_rms_mean"], rtol=1e-15)
    assert np.isnan(designs.column("mesh_stiffness_rms_std").values[39])
    assert len({result.label for result in designs.results}) == 3


def test_two_results_of_one_name_are_told_apart(tmp_path):
    for name in "ab":
        save(front(20), tmp_path / f"{name}.nc")
    labels = [result.label for result in open_results([tmp_path / "a.nc", tmp_path / "b.nc"])]
    assert len(set(labels)) == 2


def test_what_is_no_result_is_refused(tmp_path):
    save(front(20).drop_vars("on_front"), tmp_path / "half.nc")
    save(front(20).drop_attrs(), tmp_path / "bare.nc")
    for name in ("half.nc", "bare.nc", "none.nc", ""):
        with pytest.raises(InputError, match=str(tmp_path)):
            open_results([tmp_path / name])


def test_fronts_are_the_designs_that_none_of_their_result_dominates():
    designs = catalogue([stored(300, 1), stored(200, 2)])
    found = fronts(designs)
    F = np.column_stack([designs.column(ACROSS).values, designs.column(UP).values])
    expected = [np.flatnonzero(designs.result == i)[non_dominated(F[designs.result == i])] for i in (0, 1)]
    assert_array_equal(np.sort(found), np.concatenate(expected))
    kept = designs.column("effects.crowning.amount").values <= 3
    rest = fronts(designs, kept)
    assert kept[rest].all()
    first = kept & (designs.result == 0)
    assert_array_equal(np.sort(rest[designs.result[rest] == 0]), np.flatnonzero(first)[non_dominated(F[first])])


def test_scenes_are_those_of_the_designs():
    dataset, designs = front(30), catalogue([stored(30)])
    scene = designs.scene(7)
    assert scene.pair.helix_angle == dataset["pair.helix_angle"].values[7]
    assert value_at(scene, "effects.crowning.amount") == dataset["effects.crowning.amount"].values[7]


# -- what is computed -------------------------------------------------------------------------------------------------


def test_a_picture_agrees_with_simulate_and_robust(robust_scene):
    shown = shown_results(robust_scene)
    dataset = simulate(robust_scene)
    for cycle, name in ((shown.transmission_error, "transmission_error"), (shown.mesh_stiffness, "mesh_stiffness")):
        for quantity in ("mean", "rms", "peak_to_peak"):
            assert_allclose(getattr(cycle, quantity), dataset[f"{name}_{quantity}"], rtol=1e-12)
    samples = robust(robust_scene, samples=256)
    assert_allclose(shown.scatter["mesh_stiffness_rms"], samples["mesh_stiffness_rms"], rtol=1e-12)
    assert_allclose(shown.scatter["transmission_error_rms"], samples["transmission_error_rms"], rtol=1e-12)


@pytest.mark.parametrize("helix", [0.0, 20.0])
def test_the_load_map_carries_the_load(helix):
    """At every phase the line loads add up to F_n: so does the map, integrated over u with the pitch between lines."""
    scene = gear("SC").scene()
    scene = replace(scene, pair=replace(scene.pair, helix_angle=helix, centre_distance=38.0 if helix == 0 else 40.5))
    solved = solve_scene(scene)
    image = flank_map(solved, solved.line_load(), (200, 400))
    pair = scene.pair
    area = (pair.meshing.path_end - pair.meshing.path_start) * pair.face_width
    # mean over a period of Σ q ℓ = ∫∫ q dy/cos β_b du/p_bt
    force = np.nanmean(image) * area / (pair.meshing.base_pitch * np.cos(pair.meshing.beta_b))
    # pixels and ends of lines: 1 %
    assert_allclose(force, scene.F_bn, rtol=1e-2)


def test_density_is_one_in_total_and_a_peak_where_nothing_scatters():
    x, y = density(np.random.default_rng(0).normal(5, 2, 256))
    assert_allclose(np.trapezoid(y, x), 1, atol=5e-3)  # tails beyond three widths: 0.3 %
    assert_allclose(density(np.full(5, 3.0))[0], 3.0)


@pytest.mark.slow
def test_curves_come_before_the_scatter_and_both_are_remembered():
    pytest.importorskip("bokeh")
    from bokeh.document import Document

    from gearbench.explore.live import Session

    session = Session(catalogue([stored(12)]), Document())
    first, second = session.answers(3)
    (whole,) = session.answers(3)
    assert "ste_density" not in first["now"][0]
    assert set(second["now"][0]) == {"ste_density", "stiffness_density", "numbers"}
    assert "…" in first["now"][0]["numbers"]["value"]
    assert "…" not in second["now"][0]["numbers"]["value"]
    for name, table in (first["now"][0] | second["now"][0]).items():
        for key, column in table.items():
            assert_array_equal(column, whole["now"][0][name][key])


def test_questions_that_are_none_are_answered_by_a_message():
    pytest.importorskip("bokeh")
    from bokeh.document import Document

    from gearbench.explore.live import Session

    session = Session(catalogue([stored(12)]), document := Document())
    assert {"question", "answer"} <= {model.name for model in document.models}
    for design in (99, "x", None):
        (answer,) = session.answers(design)
        assert answer["message"][0]
        assert answer["now"] == [None]


# -- the command ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("arguments", [["none.nc"], ["front.nc", "--export", "no/folder/x.html"], ["bad.nc"]])
def test_bad_input_is_one_line_and_exit_code_2(refused, tmp_path, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    save(front(20), tmp_path / "front.nc")
    (tmp_path / "bad.nc").write_text("no netCDF")
    refused("explore", *arguments)


def test_an_interrupted_scatter_is_an_interruption(monkeypatch):
    """No fault of the picture: the program would end with 1, not with the code of its signal."""
    monkeypatch.setattr("gearbench.explore.model.respond", lambda *_: ({}, False))
    with pytest.raises(KeyboardInterrupt):
        shown_results(read_scene(EXAMPLES / "gear55_robust.toml"))
