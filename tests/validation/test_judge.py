"""The error of the reference: a known one, how far it is lowered, and what is said where it cannot be."""

from __future__ import annotations

from dataclasses import replace

import pytest
from numpy.testing import assert_allclose

from fem_reference import refinement
from gearbench import budget
from gearbench.effects.gear_body import GearBody
from gearbench.effects.tip_relief import TipRelief
from gearbench.errors import InputError
from gearbench.library.garambois2017 import case
from gearbench.simulation import simulate
from gearbench.validation import judge as module
from gearbench.validation.comparison import compare, validate
from gearbench.validation.judge import ACCURACIES, JUDGED, NEGLIGIBLE, TIMES
from gearbench.validation.reference import reference_scene
from gearbench.validation.ste_error import OUTPUTS
from tests.support.validation_fakes import plates_for_finite_elements


def test_error_bars_are_what_the_finest_level_alone_would_change(monkeypatch):
    plates_for_finite_elements(monkeypatch, softness=2.0, correction=10.0)
    found = compare(case(1), 0.05)
    # the reference is twice as soft, its finest level 1.5 times
    assert_allclose(found["compliance_ratio_bar"], 1 / 1.5 - 1 / 2, rtol=1e-12)
    assert_allclose(found["norm_ratio_bar"], 1 / 1.5 - 1 / 2, rtol=1e-12)
    assert_allclose(found["mac_worst_bar"], 0, atol=1e-12)
    plates_for_finite_elements(monkeypatch, softness=1.5)
    bare = compare(case(1), 0.05)
    for name in JUDGED:
        assert_allclose(found[f"{name}_bar"], abs(found[name] - bare[name]), rtol=1e-9, err_msg=name)
    assert_allclose(found["transmission_error_mean_bar"][0], 0, atol=1e-12)  # the fast model is not in doubt
    moved = found["transmission_error_mean"][1] - bare["transmission_error_mean"][1]
    assert_allclose(found["transmission_error_mean_bar"][1], abs(moved), rtol=1e-9)


@pytest.mark.parametrize(("correction", "tried"), [(0.01, 1), (1.6, 2), (6.0, 3), (90.0, 3)])
def test_the_accuracy_is_raised_until_the_reference_can_judge(monkeypatch, correction, tried):
    """Fast and reference agree: each bar must be below a fifth of what is negligible."""
    plates_for_finite_elements(monkeypatch, correction=correction)
    scene, asked = case(1), []
    monkeypatch.setattr(module, "reference_scene", lambda *a: asked.append(a[1]) or reference_scene(*a))
    found = module.judge(scene, simulate(scene, outputs=OUTPUTS))
    assert asked == list(ACCURACIES[:tried])
    bars = [float(found.found[f"{name}_bar"][1]) for name in JUDGED]
    assert found.settled == (max(bars) <= NEGLIGIBLE / TIMES) == (correction < 50)
    assert found.reason == ("" if found.settled else "accuracy = 0.00025 is the finest that is tried")


def test_a_better_reference_that_takes_too_long_is_not_begun(monkeypatch):
    plates_for_finite_elements(monkeypatch, correction=2.0)
    monkeypatch.setattr(module, "unknowns", lambda _: 10**6)
    scene = case(1)
    found = module.judge(scene, simulate(scene, outputs=OUTPUTS))
    assert not found.settled
    assert found.reason == "accuracy = 0.001 would take finite elements of 1000000 unknowns"


def test_a_reference_that_cannot_be_had_says_what_to_do(monkeypatch, tmp_path):
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path))
    monkeypatch.setattr(refinement, "memory_limit", lambda: 1e8)
    monkeypatch.setattr(budget, "memory_limit", lambda: 1e8)
    monkeypatch.setattr(budget, "SMALL", 0.0)
    scene = case(1)
    bores = {"pinion": 200.0, "wheel": 500.0}
    members = {name: replace(getattr(scene.pair, name), bore_diameter=bore) for name, bore in bores.items()}
    scene = replace(scene, pair=replace(scene.pair, **members), effects=(*scene.effects, GearBody()))
    with pytest.raises(InputError, match=r"case 1: .*needs about .* no accuracy would fit: compare without"):
        validate([scene])


def test_the_reference_is_solved_at_the_phases_of_the_scene(monkeypatch):
    """Its own would lie elsewhere where lines part: relief that only the stiffer teeth do not press away."""
    relieved = replace(case(2), effects=(*case(2).effects, TipRelief(amount=30.0, length=1.0)))
    plates_for_finite_elements(monkeypatch, softness=3.0)
    fast = simulate(relieved, outputs=OUTPUTS)
    reference = reference_scene(relieved, 0.01)
    own, found = simulate(reference, outputs=OUTPUTS), module.judge(relieved, fast, 0.01).cycle
    assert own.sizes["position"] != fast.sizes["position"]
    for name in ("mesh_phase", "phase_weight", "panel_start", "panel_end"):
        assert_allclose(found[name], fast[name], rtol=0, atol=1e-14, err_msg=name)
    # the same reference: its mean is known by either, its curve is not that of the fast teeth
    assert_allclose(found["mesh_stiffness_mean"], own["mesh_stiffness_mean"], rtol=1e-3)
    assert float(found["mesh_stiffness_mean"]) < 0.9 * float(fast["mesh_stiffness_mean"])
