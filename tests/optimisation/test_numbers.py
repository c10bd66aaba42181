"""Numbers of a design as objectives and limits: mass, cost, pressure, friction; tools of a list, classes of errors."""

import math
import tomllib
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from gearbench.effects.manufacturing_errors import ErrorKind, ManufacturingErrors
from gearbench.errors import InputError
from gearbench.library.garambois2017 import case
from gearbench.optimisation.numbers import largest_pressure, mass
from gearbench.optimisation.problem import evaluate, scene_of
from gearbench.optimisation.study_file import parse_study
from gearbench.results.flank import friction_loss
from gearbench.simulation import simulate
from gearbench.solution import solve_scene
from tests.support.paths import STUDY

SMALL = tomllib.loads(STUDY.read_text(encoding="utf-8"))
KINDS = ("profile_slope", "profile_form", "helix_slope")
NUMBERS = ["friction_loss", "mass", "root_stress", "contact_pressure", "face_load_factor", "cost"]


def tables() -> dict:
    """A study of everything at once: two tools, classes of both gears with what they cost, numbers as objectives."""
    given = deepcopy(SMALL)
    del given["base"]["pair"]["normal_module"]
    given["base"]["effects"]["manufacturing_errors"] = {kind: {} for kind in KINDS}
    given["base"]["operation"] = {"speed": 1500.0, "friction_coefficient": 0.05}
    path = "effects.manufacturing_errors"
    given["variables"] |= {
        "teeth": {"paths": ["pair.pinion.teeth", "pair.wheel.teeth"], "values": [17, 18]},
        "tool": {"sets": {"coarse": {"pair": {"normal_module": 2.0}}, "fine": {"pair": {"normal_module": 1.9}}}},
        "pinion_class": {"paths": [f"{path}.pinion_iso_class"], "values": [4, 6, 8]},
        "wheel_class": {"paths": [f"{path}.wheel_iso_class"], "values": [4, 6, 8]},
    }
    given["costs"] = {name: {"4": 3.0, "6": 1.5, "8": 1.0} for name in ("pinion_class", "wheel_class")}
    given["objectives"] = ["transmission_error_rms_mean", *NUMBERS, "transmission_error_peak_to_peak_max"]
    given["objectives"] += ["mesh_stiffness_amplitude_1_mean"]
    given["constraints"] = {"total_contact_ratio": {"min": 1.0}, "gear_ratio": {"max": 1.2}, "mass": {"max": 0.2}}
    given["robustness"] = {"samples": 16}
    given["algorithm"] = {"population": 8, "generations": 2, "seed": 1}
    return given


def design(study, **codes: int) -> tuple:
    """A gear that keeps the limits, but for the codes given."""
    usual = {"addendum": 10, "pair.helix_angle": 4, "effects.crowning.amount": 2, "effects.tip_relief.amount": 3}
    usual |= {"effects.tip_relief.length_fraction": 3}
    return tuple((usual | codes).get(v.name, 0) for v in study.variables)


def test_the_mass_is_that_of_the_generated_teeth():
    scene = case(1)
    pair = replace(scene.pair, pinion=replace(scene.pair.pinion, bore_diameter=100.0))
    area = 0.0
    for gear, bore in zip(pair.gears, (100.0, 0.0), strict=True):
        # transverse_thickness is the length of the arc: an area in polar coordinates
        teeth = quad(lambda r, g=gear: float(g.transverse_thickness(r)), gear.root_radius, gear.tip_radius, limit=200)[
            0
        ]
        area += math.pi * (gear.root_radius**2 - (bore / 2) ** 2) + gear.teeth * teeth
    assert mass(replace(scene, pair=pair)) == pytest.approx(7.85e-6 * area * pair.face_width, rel=1e-5)
    light = replace(pair, material=replace(pair.material, density=2.7))
    assert mass(replace(scene, pair=light)) == pytest.approx(2.7e-6 * area * pair.face_width, rel=1e-5)


def test_objectives_are_the_numbers_of_the_scene():
    study = parse_study(tables())
    chosen = design(study, pinion_class=0, wheel_class=2)
    result = evaluate(study, chosen)
    assert result.feasible, result.reason
    known = dict(zip(study.statistics, result.statistics, strict=True))
    scene = scene_of(study, chosen)
    dataset = simulate(scene, outputs=("friction_loss", "face_load_factor"))
    for name in ("friction_loss", "face_load_factor"):
        assert known[name] == pytest.approx(float(dataset[name]), rel=1e-12)
    assert known["contact_pressure"] == largest_pressure(solve_scene(scene))
    assert known["cost"] == 3.0 + 1.0
    assert known["mass"] == mass(scene) == result.constraints[2]
    values = result.objectives(study)
    assert values[study.objectives.index(next(o for o in study.objectives if o.label == "mass"))] == mass(scene)


@pytest.mark.parametrize("over_loads", ["mean", "max"])
def test_numbers_of_several_loads_are_their_mean_or_the_greatest(over_loads):
    given = tables()
    del given["base"]["load"]
    torques, weights = (5.0, 10.0), (3.0, 1.0)
    given["base"]["loads"] = [{"torque": t, "weight": w} for t, w in zip(torques, weights, strict=True)]
    given |= {"over_loads": over_loads, "objectives": ["contact_pressure", "friction_loss", "cost"]}
    study = parse_study(given)
    result = evaluate(study, design(study))
    assert result.feasible, result.reason
    scene = scene_of(study, design(study))
    each = [solve_scene(one) for one in scene.each_load]
    assert [one.scene.load.torque for one in each] == list(torques)
    values = np.array([[largest_pressure(one), float(friction_loss(one))] for one in each])
    expected = values.max(axis=0) if over_loads == "max" else np.average(values, axis=0, weights=weights)
    np.testing.assert_allclose(result.objectives(study), [*expected, 6.0], rtol=1e-12)


def test_a_tool_sets_its_keys_and_a_finer_class_scatters_less():
    study = parse_study(tables())
    tools = [study.variables[i] for i, v in enumerate(study.variables) if v.name == "tool"]
    assert tools[0].paths == ("pair.normal_module",)
    scenes = [scene_of(study, design(study, tool=i, teeth=i)) for i in (0, 1)]
    assert [scene.pair.normal_module for scene in scenes] == [2.0, 1.9]
    fine, coarse = (
        dict(
            zip(study.statistics, evaluate(study, design(study, pinion_class=i, wheel_class=i)).statistics, strict=True)
        )
        for i in (0, 2)
    )
    assert fine["transmission_error_rms_std"] < 0.6 * coarse["transmission_error_rms_std"]
    assert fine["cost"] > coarse["cost"]


def test_each_gear_has_the_amplitudes_of_its_own_class():
    pair = case(1).pair
    kinds = {kind: ErrorKind() for kind in KINDS} | {"inclination": ErrorKind()}
    four, seven = ({m.name: m for m in ManufacturingErrors(iso_class=c, **kinds).error_modes(pair)} for c in (4, 7))
    mixed = ManufacturingErrors(iso_class=4, wheel_iso_class=7, **kinds)
    for mode in mixed.error_modes(pair):
        # axes: from the larger tolerance of the two
        of = seven if mode.name.endswith("wheel") or mode.name == "inclination" else four
        assert mode.amplitude == of[mode.name].amplitude
    given = ManufacturingErrors(pinion_iso_class=4, wheel_iso_class=7, **kinds).error_modes(pair)
    assert [m.amplitude for m in given] == [m.amplitude for m in mixed.error_modes(pair)]
    with pytest.raises(ValueError, match=r"profile_slope\.amplitude"):
        ManufacturingErrors(pinion_iso_class=4, **kinds)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t["base"].pop("operation"), r"base\.operation\.speed = missing: is required for friction_loss"),
        (lambda t: t["costs"]["wheel_class"].pop("6"), r"costs\.wheel_class = 6: has no cost"),
        (
            lambda t: t["costs"]["wheel_class"].update({"5": 1.0}),
            r"costs\.wheel_class = 5: is not a value of the variable",
        ),
        (lambda t: t["costs"].update(bore={"1": 1.0}), r"costs = bore: must be the name of a variable"),
        (lambda t: t.pop("costs"), r"costs = missing: is required where cost is an objective or a limit"),
        (
            lambda t: t["variables"]["tool"]["sets"]["fine"].update(load={"torque": 1.0}),
            r"tool\.sets\.fine = .*must set",
        ),
        (lambda t: t["variables"]["tool"]["sets"]["fine"]["pair"].update(normal_module="2"), r"tool = '2': .*must be"),
        (lambda t: t["variables"]["tool"].update(values=[1]), r"tool\.values = .*conflicts with sets"),
        (
            lambda t: t["objectives"].append("weight"),
            r"objectives\.weight = unknown statistic: allowed: transmission_error_mean_mean, ",
        ),
    ],
)
def test_bad_input_names_the_key(change, message):
    given = tables()
    change(given)
    with pytest.raises(InputError, match=message):
        parse_study(given)
