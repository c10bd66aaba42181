"""A design's evaluation: the plain scene's answer, or the reason why there is none. Never an exception."""

import math
import random
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from gearbench.optimisation.constraints import constrained, judge
from gearbench.optimisation.numbers import largest_pressure
from gearbench.optimisation.problem import NO_GEAR, evaluate, scene_of
from gearbench.optimisation.study import Limit, Robustness
from gearbench.optimisation.study_file import parse_study
from gearbench.robustness.run import robust
from gearbench.simulation import simulate
from gearbench.solution import solve_scene
from gearbench.strength.rating import root_stress
from tests.support.paths import EXAMPLES

SMALL = tomllib.loads((EXAMPLES / "optimise_small.toml").read_text(encoding="utf-8"))
STUDY = parse_study(SMALL)
#: z = 17, h_a* = 1, β = 20°, with every modification.
GOOD = (2, 10, 4, 2, 3, 3)


def test_the_response_is_that_of_the_scene():
    result = evaluate(STUDY, GOOD)
    scene = scene_of(STUDY, GOOD)
    dataset = robust(scene, samples=64, seed=0, threads=1)
    # the same kernels on the same samples
    assert result.statistics == tuple(float(dataset[name]) for name in STUDY.statistics)
    assert result.feasible
    assert result.reason == ""


def test_without_samples_the_response_is_that_of_simulate():
    tables = {**SMALL, "robustness": {"samples": 0}}
    tables["base"] = {**SMALL["base"], "effects": {"tooth_bending": {"basis": "paper"}, "hertz": {}}}
    study = parse_study(tables)
    known = dict(zip(study.statistics, evaluate(study, GOOD).statistics, strict=True))
    dataset = simulate(scene_of(study, GOOD))
    for name in ("mesh_stiffness_rms", "transmission_error_rms"):
        assert known[f"{name}_mean"] == float(dataset[name])
        assert math.isnan(known[f"{name}_std"])


def test_limited_quantities_are_those_of_the_pair_and_of_strength():
    scene = scene_of(STUDY, GOOD)
    values = constrained(scene, STUDY.constraints)
    assert values == {
        "total_contact_ratio": scene.pair.meshing.total_contact_ratio,
        "specific_sliding": scene.pair.meshing.largest_sliding,
        "contact_pressure": largest_pressure(solve_scene(scene)),
        "root_stress": max(root_stress(scene)),
    }
    assert evaluate(STUDY, GOOD).constraints == tuple(values[name] for name in STUDY.constraints)


def test_a_broken_limit_is_named_and_measured():
    limits = {"total_contact_ratio": Limit(min=2.0), "specific_sliding": Limit(max=100.0)}
    study = replace(STUDY, constraints=limits)
    result = evaluate(study, GOOD)
    ratio = scene_of(study, GOOD).pair.meshing.total_contact_ratio
    assert ratio < 2.0
    assert result.violation == pytest.approx((2.0 - ratio) / 2.0, rel=1e-14)
    assert result.reason == f"total_contact_ratio {ratio:.4g} below 2"
    assert all(map(math.isnan, result.statistics))


def test_violations_add_up():
    limits = {"total_contact_ratio": Limit(min=2.0), "overlap_ratio": Limit(max=0.5)}
    violation, reason = judge({"total_contact_ratio": 1.0, "overlap_ratio": 1.0}, limits)
    assert violation == 0.5 + 1.0
    assert reason.count(";") == 1


def test_a_limited_quantity_that_is_not_a_number_breaks_its_limit():
    limits = {"cost": Limit(max=2.0), "overlap_ratio": Limit(max=0.5)}
    assert judge({"cost": math.nan}, limits) == (1000.0, "cost nan above 2")
    assert judge({"cost": 1.0}, limits) == (0, ""), "a quantity that was not computed breaks no limit"


def test_a_gear_that_does_not_exist_is_an_answer_with_its_reason():
    result = evaluate(STUDY, (0, 10, 0, 0, 0, 0))  # z = 15 at a′ = 38: teeth pointed long before h_a* = 1
    assert result.violation == NO_GEAR
    assert "needs a sum of profile shifts" in result.reason
    assert all(map(math.isnan, (*result.statistics, *result.constraints)))


def wild_study(number: int):
    """Studies over ranges from plausible to absurd; some with limits, some without."""
    near = number % 2 == 0
    tables = {**SMALL, "robustness": {"samples": 4}}
    tables["base"] = {**SMALL["base"], "resolution": {"gauss_points": 2, "segments": 5}}
    tables["variables"] = {
        "z1": {"paths": ["pair.pinion.teeth"], "min": 5 if near else -3, "max": 30 if near else 3000},
        "z2": {"paths": ["pair.wheel.teeth"], "min": 5 if near else 0, "max": 30 if near else 3000},
        "pair.helix_angle": {"min": 0.0 if near else -10.0, "max": 45.0 if near else 95.0},
        "pair.normal_module": {"values": [2.0] if near else [0.0, 1e-3, 0.5, 2.0, 1e6]},
        "pair.pressure_angle": {"values": [14.5, 20.0, 25.0] if near else [0.0, 5.0, 20.0, 90.0]},
        "pair.pinion.addendum": {"min": 0.1 if near else -1.0, "max": 1.6 if near else 4.0},
        "pair.wheel.addendum": {"min": 0.1 if near else -1.0, "max": 1.6 if near else 4.0},
        "pair.centre_distance": {"min": 20.0 if near else -5.0, "max": 60.0 if near else 400.0},
        "pair.face_width": {"values": [0.5, 8.0, 50.0] if near else [0.0, 8.0, 1e9]},
        "load.torque": {"values": [1e-9, 10.0, 1e4, 1e12] if near else [-1.0, 0.0, 10.0]},
        "effects.crowning.amount": {"min": -1000.0, "max": 1000.0},
        "effects.tip_relief.amount": {"min": -10.0, "max": 1000.0},
        "effects.tip_relief.length_fraction": {"min": 0.0 if near else -0.5, "max": 1.1},
    }
    if number % 3 == 0:
        tables["constraints"] = {}
    return parse_study(tables)


def random_design(study, rng):
    return tuple(
        rng.uniform(*variable.bounds) if variable.kind == "real" else rng.randint(*variable.bounds)
        for variable in study.variables
    )


def test_a_thousand_random_designs_raise_nothing():
    studies, rng = [wild_study(number) for number in range(4)], random.Random(5)
    solved = 0
    for i in range(1000):
        study = studies[i % 4]
        result = evaluate(study, random_design(study, rng))
        assert result.feasible == (result.reason == "")
        assert math.isfinite(result.violation)
        assert all(map(math.isfinite, result.statistics)) == result.feasible
        solved += result.feasible
    assert solved > 3  # the limits keep most of them away from the solver


def test_every_design_sees_the_same_samples():
    # results depend on the design alone: not on what was evaluated before it
    first = evaluate(STUDY, GOOD)
    evaluate(STUDY, (1, 8, 5, 0, 0, 0))
    assert evaluate(STUDY, GOOD) == first
    other = replace(STUDY, robustness=Robustness(samples=64, seed=1))
    assert evaluate(other, GOOD).statistics != first.statistics
    assert np.allclose(evaluate(other, GOOD).statistics, first.statistics, rtol=0.3)
