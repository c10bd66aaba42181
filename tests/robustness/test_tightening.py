"""Totals beside first-order shares, and which tolerance to tighten first."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

from gearbench.effects.manufacturing_errors import ErrorKind, ManufacturingErrors
from gearbench.library.garambois2017 import gear
from gearbench.loads import Load, WeightedLoad
from gearbench.results.warnings import warnings
from gearbench.robustness.run import robust
from gearbench.robustness.sampling import unit_samples
from gearbench.robustness.sensitivity import sensitivities
from gearbench.robustness.tightening import FINER, gains, tighten_first
from gearbench.scene import Resolution

AMPLITUDES = {"profile_slope": 3.0, "profile_form": 4.0, "helix_slope": 5.0, "inclination": 6.0}


def test_totals_count_products_for_both():
    """y = x_0 x_1 + x_0 on [−1, 1]: variances 1/9 and 1/3, so S = 3/4, 0 and S_T = 1, 1/4."""
    found = [
        sensitivities(x, [x[:, 0] * x[:, 1] + x[:, 0]])[0]
        for s in range(5)
        for x in [2 * unit_samples("random", 1000, 6, s) - 1]
    ]
    total = np.array([f.total[0] for f in found])
    assert_allclose(total, np.broadcast_to([1.0, 0.25, 0, 0, 0, 0], total.shape), atol=0.05)
    assert_allclose(np.mean([f.first_order[0][0] for f in found]), 0.75, atol=0.02)
    stated = np.array([f.total[1][1] for f in found])
    assert np.all((stated > 0.004) & (stated < 0.05))


@pytest.mark.parametrize("sampler", ["random", "sobol"])
def test_the_change_of_the_mean_is_that_of_the_closed_form(sampler):
    """y = Σ a x + b x² + x_0 x_1: scaled by s the mean changes by b (s² − 1)/3, whatever the products."""
    a, b = np.array([1.0, 2.0, 0.5, 0.0]), np.array([0.0, 1.0, 2.0, 0.5])
    change, error = [], []
    for seed in range(40):
        x = 2 * unit_samples(sampler, 512, 4, seed) - 1
        (found,) = sensitivities(x, [x @ a + x**2 @ b + x[:, 0] * x[:, 1]], FINER)
        change.append(found.tightened[0])
        error.append(found.tightened[1])
    off = np.array(change) - b * (FINER**2 - 1) / 3
    # the scatter of 40 numbers is known to 11 %; Sobol points do better than the error states
    z = np.sqrt(np.mean((off / np.maximum(error, 1e-12)) ** 2, axis=0))
    assert np.all(z[:3] < 1.35)
    if sampler == "random":
        assert np.all(z[1:3] > 0.7)
    assert np.abs(off).max() < 0.15


@pytest.fixture(scope="module")
def scene():
    # of one gear each: errors of both would be scaled together
    kinds = {name: ErrorKind(amplitude=a, distribution="normal", gear="pinion") for name, a in AMPLITUDES.items()}
    plain = gear("55").scene(errors=True, resolution=Resolution(gauss_points=4))
    others = [e for e in plain.effects if not isinstance(e, ManufacturingErrors)]
    return replace(plain, effects=(*others, ManufacturingErrors(**kinds)))


def with_errors(scene, **changed):
    errors = scene.effect("manufacturing_errors")
    others = [e for e in scene.effects if e is not errors]
    return replace(scene, effects=(*others, replace(errors, **changed)))


def test_a_finer_class_does_what_was_said(scene):
    """Computed again with that tolerance over √2, on the same samples."""
    dataset = robust(scene, samples=512, threads=1)
    before = float(dataset["transmission_error_rms_mean"])
    names = list(dataset["error_name"].values)
    for kind, name in (("inclination", "inclination"), ("profile_slope", "profile_slope_pinion")):
        changed = replace(getattr(scene.effect("manufacturing_errors"), kind), amplitude=AMPLITUDES[kind] * FINER)
        finer = robust(with_errors(scene, **{kind: changed}), samples=512, threads=1)
        expected = float(finer["transmission_error_rms_mean"]) - before
        at = names.index(name)
        told, error = (
            float(dataset[f"transmission_error_rms_tightened{part}"][at]) for part in ("", "_standard_error")
        )
        # on the same samples most of the error is common to both
        assert told == pytest.approx(expected, abs=2 * error)


def test_the_cost_decides_what_to_tighten(scene):
    dataset = robust(scene, samples=256, threads=1)
    ordered = gains(dataset)
    best = ordered[0]
    assert tighten_first(dataset).startswith(f"tighten {best.name.replace('_', ' ')} first: one class finer changes")
    assert best.change < 0
    kind = best.name.removesuffix("_pinion").removesuffix("_wheel")
    dear = replace(getattr(scene.effect("manufacturing_errors"), kind), cost=1000.0)
    other = robust(with_errors(scene, **{kind: dear}), samples=256, threads=1)
    assert gains(other)[0].name.removesuffix("_pinion").removesuffix("_wheel") != kind
    assert "for each unit of cost" in tighten_first(other)
    few = robust(scene, samples=8, threads=1)
    assert tighten_first(few) == ""


def test_the_gain_over_several_loads_is_their_weighted_mean(scene):
    """Two equal loads are one; the heavier of two counts by its weight."""
    torque = scene.load.torque
    alone = gains(robust(scene, samples=128, threads=1))
    loads = (WeightedLoad(torque=torque, weight=3.0), WeightedLoad(torque=2 * torque, weight=1.0))
    both = replace(scene, load=Load(torque=2 * torque), loads=loads)
    other = {gain.name: gain for gain in gains(robust(replace(scene, load=Load(torque=2 * torque)), samples=128))}
    dataset = robust(both, samples=128, threads=1)
    for gain in gains(dataset):
        (one,) = (each for each in alone if each.name == gain.name)
        assert gain.change == pytest.approx(0.75 * one.change + 0.25 * other[gain.name].change, rel=1e-6)
    assert tighten_first(dataset)


def test_a_single_simulation_says_that_random_errors_are_at_their_means(scene):
    said = [line for line in warnings(scene) if "random errors" in line]
    assert said == ["random errors act with their means, up to 3 µm: gearbench robust draws them"]
    assert not [line for line in warnings(scene.without("manufacturing_errors")) if "random errors" in line]


def test_shares_that_are_not_asked_for_are_not_computed(scene):
    with_shares, without = (robust(scene, samples=64, threads=1, shares=shares) for shares in (True, False))
    left_out = set(with_shares.data_vars) - set(without.data_vars)
    assert {name.removesuffix("_standard_error").rsplit("_rms_")[1] for name in left_out} == {
        "first_order", "total", "tightened",
    }  # fmt: skip
    for name in without.data_vars:
        assert_allclose(without[name], with_shares[name], rtol=0)
    assert gains(without) == []


def test_the_advice_names_the_largest_significant_gain():
    """The largest gain is within two of its standard errors, the second nine of its own from zero."""
    found = {
        "transmission_error_rms_mean": ((), 1.0),
        "transmission_error_rms_tightened": ("error_name", [-0.10, -0.09, -0.01]),
        "transmission_error_rms_tightened_standard_error": ("error_name", [0.06, 0.01, 0.001]),
        "tightening_cost": ("error_name", [1.0, 1.0, 1.0]),
    }
    names = ["helix_slope_pinion", "profile_slope_pinion", "profile_form_wheel"]
    dataset = xr.Dataset(found, coords={"error_name": names})
    said = tighten_first(dataset)
    assert said.startswith("tighten profile slope pinion first")
    assert "not distinguishable from helix slope pinion" in said
    assert "profile form" not in said
    dataset["transmission_error_rms_tightened_standard_error"] = ("error_name", [1.0, 1.0, 1.0])
    assert tighten_first(dataset).startswith("no tolerance lowers the mean STE RMS significantly")
