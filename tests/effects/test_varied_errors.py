"""Random errors of any number of a gap effect, of run-out and wobble, of centre distance and tooth thickness."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.contact.coarse_solution import scene_lines
from gearbench.effects.manufacturing_errors import DISTANCES, ManufacturingErrors
from gearbench.effects.registry import effect_class
from gearbench.effects.waviness import Wave, Waviness
from gearbench.errors import InputError
from gearbench.geometry.pair import Member, Pair
from gearbench.geometry.thickness import Thickness
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.robustness.run import robust
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene
from gearbench.schema import read

TABLES: dict[str, dict[str, Any]] = {
    "tooth_bending": {"basis": "paper"},
    "hertz": {},
    "crowning": {"amount": 4.0},
    "tip_relief": {"pinion": {"amount": 6.0, "length": 0.9}},
    "profile_curve": {"pinion": {"polynomial": [0.0, 2.0, 6.0]}},
    "waviness": {"pinion": [{"order": 7, "amplitude": 2.0, "phase": 20.0}]},
}
NAMES = ("transmission_error_rms", "mesh_stiffness_rms")


def scene(errors: dict[str, Any], **changes: dict[str, Any]) -> Scene:
    return parse_scene(
        {
            "pair": {
                "normal_module": 3.0,
                "helix_angle": 12.0,
                "face_width": 24.0,
                "centre_distance": 92.2,
                "pinion": {"teeth": 24},
                "wheel": {"teeth": 36},
            },
            "load": {"torque": 150.0},
            "effects": {**TABLES, **changes, "manufacturing_errors": errors},
            "resolution": {"positions": 6, "segments": 60},
        }
    )


def varied(key: str, amplitude: float, **more: Any) -> dict[str, Any]:
    return {"varied": [{"key": key, "amplitude": amplitude, **more}]}


#: Another value of each key, and a table of the effect that has it.
KEYS: dict[str, tuple[float, dict[str, Any]]] = {
    "crowning.amount": (5.5, {"amount": 5.5}),
    "tip_relief.pinion.amount": (4.5, {"pinion": {"amount": 4.5, "length": 0.9}}),
    "profile_curve.pinion.polynomial.1": (1.2, {"pinion": {"polynomial": [0.0, 1.2, 6.0]}}),
    "waviness.pinion.0.amplitude": (3.1, {"pinion": [{"order": 7, "amplitude": 3.1, "phase": 20.0}]}),
    "tip_relief.pinion.length": (0.75, {"pinion": {"amount": 6.0, "length": 0.75}}),
    "waviness.pinion.0.phase": (55.0, {"pinion": [{"order": 7, "amplitude": 2.0, "phase": 55.0}]}),
}
NOMINAL = {"crowning.amount": 4.0, "tip_relief.pinion.amount": 6.0, "profile_curve.pinion.polynomial.1": 2.0}
NOMINAL |= {"waviness.pinion.0.amplitude": 2.0, "tip_relief.pinion.length": 0.9, "waviness.pinion.0.phase": 20.0}
LINEAR = ("amount", "polynomial.1", "amplitude")


@pytest.mark.parametrize("key", KEYS)
def test_a_sample_is_the_scene_with_that_value(key):
    """The average over a cell remains that of the scene; this error is of second order, 2 % at 12 segments."""
    value, table = KEYS[key]
    amplitude = 1.6 * abs(value - NOMINAL[key])
    errors = np.array([[value - NOMINAL[key]]])
    found, _ = respond(prepare_scene(scene(varied(key, amplitude))), errors, names=NAMES)
    moved = scene(varied("crowning.amount", 1e-9), **{key.split(".")[0]: table})
    expected, _ = respond(prepare_scene(moved), np.zeros((1, 1)), names=NAMES)
    straight = key.endswith(LINEAR)
    for name in NAMES:
        assert found[name] == pytest.approx(expected[name], rel=2e-3 if straight else 0.02)
    at = prepare_scene(scene(varied(key, amplitude)))
    changed = at.expansion.modes @ at.expansion.amounts(errors)[0]
    lines = scene_lines(at.scene, at.phases.phase)
    name = key.split(".")[0]
    gaps = [other.effects_by_name[name].gap(lines) for other in (moved, at.scene)]
    assert_allclose(changed, gaps[0] - gaps[1], atol=1e-14 if straight else 3e-4)
    unmoved, _ = respond(prepare_scene(scene(varied(key, amplitude))), np.zeros((1, 1)), names=NAMES)
    assert found[NAMES[0]] != pytest.approx(unmoved[NAMES[0]], rel=5e-4)


def test_a_key_that_is_not_linear_has_a_mode_at_each_node_and_a_linear_one_a_single_mode():
    at = scene(
        {
            "varied": [
                {"key": "tip_relief.pinion.length", "amplitude": 0.2},
                {"key": "crowning.amount", "amplitude": 2.0},
            ]
        }
    )
    expansion = prepare_scene(at).expansion
    assert [part.modes.shape[-1] for part in expansion.parts] == [8, 1]
    # at a node the gap is the gap
    at_node = expansion.amounts(np.array([[-0.1, 0.0]]))[0]
    assert_allclose(at_node, [0, 0, 1, 0, 0, 0, 0, 0, 0], atol=1e-12)


@pytest.mark.parametrize(("name", "over_face"), [("run_out", "even"), ("wobble", "tilting")])
def test_run_out_is_a_wave_of_order_one_of_any_phase(name, over_face):
    at = scene({name: {"amplitude": 30.0, "gear": "wheel"}})
    problem = prepare_scene(at)
    assert problem.names == (f"{name}_wheel", f"{name}_wheel_phase")
    lines = scene_lines(at, np.array([0.1, 0.7]))
    errors = at.effect("manufacturing_errors")
    assert isinstance(errors, ManufacturingErrors)
    expansion = errors.expansion(lines, at.effects_by_name)
    gap = errors.gap(lines) + expansion.modes @ expansion.amounts(np.array([[22.0, 130.0]]))[0]
    wave = Waviness(wheel=(Wave(order=1, amplitude=11.0, phase=130.0, over_face=over_face),))
    assert_allclose(gap, wave.gap(lines), atol=1e-15)
    # simulate has the mean
    mean = Waviness(wheel=(Wave(order=1, amplitude=7.5, over_face=over_face),))
    assert_allclose(errors.gap(lines), mean.gap(lines), atol=1e-15)


def test_errors_of_all_kinds_beside_each_other():
    errors = {
        "iso_class": 6,
        "profile_slope": {"distribution": "uniform_two_sided"},
        "run_out": {"amplitude": 20.0},
        "varied": [{"key": "crowning.amount", "amplitude": 2.0}],
        "tooth_thickness": {"amplitude": 20.0},
    }
    at = scene(errors)
    dataset = robust(at, samples=64, seed=1, threads=1)
    assert dataset.error_name.values.tolist() == [
        "profile_slope_pinion", "profile_slope_wheel",
        "run_out_pinion", "run_out_pinion_phase", "run_out_wheel", "run_out_wheel_phase",
        "crowning.amount", "tooth_thickness_pinion", "tooth_thickness_wheel",
    ]  # fmt: skip
    assert np.all(np.isfinite(dataset.transmission_error_rms))
    assert np.ptp(dataset.error.sel(error_name="run_out_wheel_phase").values) > 300
    assert parse_scene(at.to_mapping()) == at


# -- sizes ------------------------------------------------------------------------------------------------------------
PAIR = Pair(
    normal_module=3.0,
    face_width=24.0,
    centre_distance=92.4,
    centre_distance_upper=60.0,
    centre_distance_lower=-20.0,
    pinion=Member(teeth=24, thickness=Thickness(upper=-60.0, lower=-100.0)),
    wheel=Member(teeth=37, thickness=Thickness(upper=-40.0, lower=-80.0)),
)


def sized(errors: dict[str, Any]) -> Scene:
    effects = [read(effect_class(name), TABLES[name]) for name in ("tooth_bending", "hertz")]
    errors_of = read(ManufacturingErrors, errors)
    return replace(scene(varied("crowning.amount", 1.0)), pair=PAIR, effects=(*effects, errors_of))


def test_samples_are_solved_at_their_centre_distance():
    at = sized({"centre_distance": {"distribution": "uniform_two_sided"}, "run_out": {"amplitude": 1e-9}})
    problem = prepare_scene(at)
    errors = problem.draw(200, 0, "sobol")
    column = problem.names.index("centre_distance")
    assert len(np.unique(errors[:, column])) == DISTANCES
    assert np.abs(errors[:, column]).max() == pytest.approx(40.0 * (1 - 1 / DISTANCES))
    answer, complete = respond(problem, errors[:20], names=NAMES)
    assert complete
    for i in (3, 11):
        distance = 20.0 + errors[i, column]
        fixed = replace(
            at,
            pair=replace(PAIR, centre_distance_upper=distance, centre_distance_lower=distance),
            effects=(*at.effects[:2], read(ManufacturingErrors, {"run_out": {"amplitude": 1e-9}})),
        )
        alone = prepare_scene(fixed)
        assert alone.scene.pair.meshing.centre_distance == pytest.approx(92.4 + 1e-3 * distance, abs=1e-12)
        expected, _ = respond(alone, alone.mean[None], names=NAMES)
        for name in NAMES:
            assert answer[name][i] == pytest.approx(expected[name][0], rel=1e-6)
    assert np.ptp(answer[NAMES[1]]) > 0.001 * answer[NAMES[1]].mean()


def test_backlash_of_each_sample_is_that_of_its_sizes():
    dataset = robust(sized({"centre_distance": {}, "tooth_thickness": {}}), samples=48, seed=2, threads=1)
    low, high = PAIR.backlash_limits
    assert low < float(dataset.backlash.min()) < float(dataset.backlash.max()) < high
    assert float(dataset.backlash.mean()) == pytest.approx(PAIR.actual_backlash, rel=0.02)
    s1, s2, a = (dataset.error.values[5, i] for i in (1, 2, 0))
    sample = replace(
        PAIR,
        centre_distance_upper=20.0 + a,
        centre_distance_lower=20.0 + a,
        pinion=replace(PAIR.pinion, thickness=Thickness(upper=-80.0 + s1, lower=-80.0 + s1)),
        wheel=replace(PAIR.wheel, thickness=Thickness(upper=-60.0 + s2, lower=-60.0 + s2)),
    )
    assert float(dataset.backlash[5]) == pytest.approx(sample.actual_backlash, abs=1e-12)


# -- faults -----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("errors", "line"),
    [
        (varied("crowning.height", 1.0), "varied.0.key = crowning.height: must be a number that is given"),
        (varied("hertz.law", 1.0), "must be a number of a gap effect of the scene: crowning, tip_relief"),
        (varied("waviness.pinion.0.order", 1.0), "must be a number that is given in effects.waviness"),
        (varied("waviness.pinion.3.phase", 1.0), "must be a number that is given"),
        (varied("tip_relief.pinion.length", 1.0), "tip_relief.pinion.length − 1: pinion.length must be"),
        (varied("crowning.amount", -1.0), "varied.0.amplitude"),
        (varied("crowning.amount", 1.0, distribution="normal"), "varied.0.distribution"),
        ({"varied": [{"key": "crowning.amount", "amplitude": 1.0}] * 2}, "given twice"),
        ({"run_out": {}}, "run_out.amplitude = missing"),
        ({"centre_distance": {}}, "centre_distance.amplitude = missing"),
        ({"preset": "garambois2017", "wobble": {"amplitude": 1.0}}, "wobble = given: conflicts with preset"),
    ],
)
def test_faults_are_one_line(errors, line):
    with pytest.raises(InputError) as caught:
        scene(errors)
    assert line in str(caught.value)
    assert str(caught.value).startswith("effects.manufacturing_errors.")
