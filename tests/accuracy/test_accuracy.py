"""Requested accuracy: the chosen settings meet it, the result names them, and conflicts are reported in one line."""

from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from gearbench.accuracy.choose import choose
from gearbench.accuracy.measure import COVERED, FLOOR, HARMONIC_FLOOR, HARMONICS, covered, relative_errors, scales
from gearbench.accuracy.settings import SOLID_ORDER, with_resolution
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.crowning import Crowning
from gearbench.effects.helix_slope import HelixSlope
from gearbench.effects.hertz import Hertz
from gearbench.effects.tip_relief import TipRelief
from gearbench.effects.tooth_bending import ToothBending
from gearbench.effort.curves import values_of
from gearbench.errors import InputError
from gearbench.library.garambois2017 import case, gear
from gearbench.robustness.run import robust
from gearbench.scene import Resolution, Scene
from gearbench.scene_file import parse_scene
from gearbench.simulation import simulate
from gearbench.solution import solve_scene


def asking(scene: Scene, accuracy: float) -> Scene:
    return replace(scene, resolution=Resolution(accuracy=accuracy))


def with_effects(scene: Scene, *effects) -> Scene:
    return replace(scene, effects=(*scene.effects, *effects))


#: Spur and helical, with and without gaps; the last ones lose contact on part of the flank.
SCENES = {
    "spur": gear("SC").scene(),
    "helical": case(2),
    "relief": with_effects(case(1), TipRelief(amount=20.0, length=4.0)),
    "slope": with_effects(case(2), HelixSlope(pinion=5.0)),
    "crowned": with_effects(gear("SC").scene(), Crowning(amount=6.0)),
}


@pytest.mark.parametrize(
    ("name", "accuracy"),
    [("relief", 0.01), ("spur", 0.05)]
    + [pytest.param(name, 0.01, marks=pytest.mark.slow) for name in SCENES if name != "relief"],
)
def test_the_true_error_is_within_the_accuracy(name, accuracy):
    scene = SCENES[name]
    found = simulate(asking(scene, accuracy), outputs=COVERED)
    exact = covered(solve_scene(with_resolution(scene, segments=96, gauss_points=16)).cycle)
    true = relative_errors([float(found[output]) for output in COVERED], exact).max()
    assert true <= accuracy
    assert found.attrs["accuracy_requested"] == accuracy
    errors = dict(part.split(" = ") for part in found.attrs["accuracy_errors"].split(", "))
    assert tuple(errors) == COVERED
    assert float(f"{found.attrs['accuracy_estimated']:.2g}") == max(map(float, errors.values())) <= accuracy
    assert 0 < found.attrs["accuracy_seconds"] < found.attrs["wall_time_s"]


def test_the_run_of_the_settings_chosen_is_not_made_again(monkeypatch):
    runs = []
    monkeypatch.setattr("gearbench.simulation.solve_scene", lambda scene: runs.append(scene) or solve_scene(scene))
    found = simulate(asking(case(2), 0.01))
    assert len(runs) == len(set(runs)) == found.attrs["accuracy_trials"] <= 3


OUTPUTS = ("transmission_error_mean", "transmission_error_rms", "mesh_stiffness_mean", "mesh_stiffness_rms")


def test_the_result_is_that_of_the_settings_it_names():
    import tomllib

    found = simulate(asking(case(2), 0.01))
    scene = parse_scene(tomllib.loads(found.attrs["scene"]))
    assert scene.resolution.accuracy is None
    settings = dict(part.split(" = ") for part in found.attrs["accuracy_settings"].split(", "))
    assert int(settings["segments"]) == scene.resolution.segments == found.sizes["segment"]
    assert int(settings["gauss_points"]) == scene.resolution.gauss_points
    assert np.array_equal(simulate(scene)["transmission_error"], found["transmission_error"])


@pytest.mark.parametrize("accuracy", [0.03, 0.01, 0.003])
def test_made_up_errors_are_found_out(accuracy):
    """With an error c/n in segments and d 2^−g in Gauss points, error ≤ estimate ≤ accuracy."""

    def answers(scene: Scene) -> np.ndarray:
        n, g = scene.resolution.segments, scene.resolution.gauss_points
        return np.array([1.0, 1.0, 1.0, 100.0]) * (1 + 0.1 / n + 0.05 * 0.5**g)

    choice = choose(asking(case(1), accuracy), answers, error_over_change=1.5)
    true = relative_errors(answers(choice.scene), [1.0, 1.0, 1.0, 100.0]).max()
    assert true <= 1.02 * choice.estimated <= accuracy  # relative to the answer itself, not to the limit
    assert np.array_equal(choice.run, answers(choice.scene))


@pytest.mark.parametrize("setting", ["segments", "gauss_points"])
def test_only_what_the_estimate_blames_is_raised(setting):
    def answers(scene: Scene) -> np.ndarray:
        return np.array([1.0, 1.0, 1.0, 100.0]) * (1 + 5 / getattr(scene.resolution, setting) ** 2)

    def none(_: Scene) -> np.ndarray:
        return np.ones(4)

    other = {"segments": "gauss_points", "gauss_points": "segments"}[setting]
    first, chosen = (choose(asking(case(1), 0.001), run).scene.resolution for run in (none, answers))
    assert getattr(chosen, setting) > getattr(first, setting)
    assert getattr(chosen, other) == getattr(first, other)


@pytest.mark.slow
def test_the_order_of_solid_teeth_is_chosen_where_the_scene_gives_none():
    solid = replace(case(1), effects=(ToothBending(model="solid"), Hertz()))
    found = choose(asking(solid, 0.03), values_of)
    orders = SOLID_ORDER.levels(solid)
    assert found.scene.effect("tooth_bending").order in orders
    exact = values_of(with_resolution(SOLID_ORDER.with_level(solid, orders[-3]), segments=32, gauss_points=8))
    assert relative_errors(values_of(found.scene), exact).max() <= 0.03
    given = replace(case(1), effects=(ToothBending(model="solid", order=(3, 4, 5)), Hertz()))
    assert choose(asking(given, 0.03), values_of).scene.effect("tooth_bending").order == (3, 4, 5)


def test_finite_elements_take_their_share_and_a_given_accuracy_stays():
    def scene(effect: ToothBending) -> Scene:
        return asking(replace(case(1), effects=(effect, Hertz())), 0.02)

    def alike(_: Scene) -> np.ndarray:
        return np.ones(4)

    choice = choose(scene(ToothBending(model="finite_elements")), alike)
    assert choice.scene.effect("tooth_bending").accuracy == choice.estimated == 0.01
    given = choose(scene(ToothBending(model="finite_elements", accuracy=0.005)), alike)
    assert given.scene.effect("tooth_bending").accuracy == 0.005
    with pytest.raises(InputError, match="finite elements"):
        choose(scene(ToothBending(model="finite_elements", accuracy=0.05)), alike)


def test_robust_chooses_samples_too():
    scene = gear("55").scene(errors=True)
    found = robust(asking(scene, 0.03), seed=1)
    exact = robust(with_resolution(scene, segments=24, gauss_points=8), samples=1024, seed=99)
    values, reference = ([float(d[n].mean()) for n in OUTPUTS] for d in (found, exact))
    assert relative_errors(values, reference).max() <= 0.03
    assert found.attrs["accuracy_estimated"] <= 0.03
    assert f"samples = {found.sizes['sample']}" in found.attrs["accuracy_settings"]


def test_errors_are_relative_to_no_less_than_a_part_of_the_mean():
    # STE 10 µm, fluctuating by 0.01 µm, less than 1 % of it; stiffness 200 N/µm, fluctuating by 5 %
    values = [10.0, 0.01, 200.0, 5.0]
    assert np.array_equal(scales(values), [10.0, FLOOR * 10.0, 200.0, 5.0])
    assert relative_errors([10.0, 0.02, 200.0, 5.0], values).max() == pytest.approx(0.1)


def test_harmonics_count_from_a_fraction_of_peak_to_peak():
    # STE 10 µm and stiffness 200 N/µm, which hardly vary and by 20 N/µm, with harmonics 1 to 5
    values = [10.0, 0.01, 200.0, 5.0, 0.01, 20.0, *[0.005] * HARMONICS, 8.0, 1.0, 1.0, 1.0, 1.0]
    peaks = [FLOOR * 10.0, 20.0]
    least = [HARMONIC_FLOOR * peak for peak in peaks]
    expected = [10.0, 0.1, 200.0, 5.0, *peaks, *[least[0]] * HARMONICS, 8.0, *[least[1]] * (HARMONICS - 1)]
    assert np.allclose(scales(values), expected, rtol=1e-15)


CONFLICTS = {
    "segments": {"segments": 15},
    "gauss_points": {"gauss_points": 8},
    "positions": {"positions": 64},
}


@pytest.mark.parametrize("key", CONFLICTS)
def test_accuracy_conflicts_with_settings_in_one_line(key):
    tables = case(1).to_mapping() | {"resolution": {"accuracy": 0.01, **CONFLICTS[key]}}
    with pytest.raises(InputError, match=f"resolution.{key} = .*: conflicts with accuracy"):
        parse_scene(tables)
    if key != "segments":
        with pytest.raises(ValidationError, match="conflicts with accuracy"):
            Resolution(accuracy=0.01, **CONFLICTS[key])


@pytest.mark.parametrize("accuracy", [0.0, -0.01, 0.6, 1e-9])
def test_an_accuracy_out_of_range_is_refused(accuracy):
    with pytest.raises(InputError, match=r"resolution\.accuracy"):
        parse_scene(case(1).to_mapping() | {"resolution": {"accuracy": accuracy}})


def test_what_solid_teeth_cannot_reach_is_said_at_once():
    """Values that converge like 1/√n with the number n of functions along the height are refused after two orders."""
    runs = []

    def slowly(scene: Scene) -> np.ndarray:
        teeth = scene.effect("tooth_bending")
        assert isinstance(teeth, ToothBending)
        assert isinstance(teeth.order, tuple)
        runs.append(teeth.order)
        return np.full(4, 1.0 + 0.01 / teeth.order[1] ** 0.5)

    solid = ToothBending(model="solid")
    scene = replace(case(2), effects=tuple(solid if e.name == "tooth_bending" else e for e in case(2).effects))
    with pytest.raises(InputError, match=r"because solid teeth of the highest order leave about .* %: ask for less"):
        choose(asking(scene, 0.0001), slowly)
    assert len(set(runs)) == 2


def test_programs_that_choose_nothing_refuse_an_accuracy():
    with pytest.raises(InputError, match=r"resolution\.accuracy"):
        mesh_phases(asking(case(1), 0.01))
