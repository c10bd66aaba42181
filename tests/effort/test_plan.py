"""``gearbench plan``: what will run, and nothing that takes long to find out. Its figures: benchmarks/test_plan.py."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import replace

import pytest

from gearbench.contact.size import pairs_of_teeth
from gearbench.effects import tooth_bending
from gearbench.effects.crowning import Crowning
from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.effort.plan import growth, plan
from gearbench.effort.study_plan import study_plan
from gearbench.effort.trials import extrapolated, reduced
from gearbench.errors import GearbenchError
from gearbench.library.garambois2017 import case, gear
from gearbench.loads import WeightedLoad, greatest_load
from gearbench.optimisation.study_file import load_study
from gearbench.scene import Resolution, Scene
from gearbench.scene_file import load_scene, parse_scene
from tests.support.paths import DATA, EXAMPLES, STUDY


@pytest.mark.parametrize("positions", [1, 3, 40])
def test_the_parts_are_those_of_the_scene(positions):
    scene = case(1, Resolution(positions=positions))
    made = plan(replace(scene, effects=(*scene.effects, Crowning(amount=3.0))))
    names = [part.name for part in made.parts]
    assert names == ["contact lines", "tooth_bending", "hertz", "crowning", "contact", "dataset"]
    assert made.seconds == pytest.approx(sum(part.seconds for part in made.parts))
    assert all(part.seconds >= 0 for part in made.parts)
    assert made.megabytes > 0
    assert made.robust_seconds == 0


def test_the_robust_run_is_a_part_of_its_own():
    made = plan(gear("SC").scene(errors=True, resolution=Resolution(positions=4)))
    assert made.parts[-1].name == "robust (1000 samples)"
    assert made.robust_seconds == made.parts[-1].seconds > 0
    assert made.seconds == pytest.approx(sum(part.seconds for part in made.parts[:-1]))


def test_finite_elements_are_estimated_not_run(monkeypatch, tmp_path):
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path))

    def refuse(*_: object) -> None:
        raise AssertionError("finite elements were run")

    monkeypatch.setattr(tooth_bending, "meshed_flank", refuse)
    scene = replace(case(1, Resolution(positions=4)), effects=(ToothBending(model="finite_elements"), Hertz()))
    made = plan(scene)
    part = next(part for part in made.parts if part.name == "finite elements")
    assert part.seconds > 0.1  # the levels that would run, a quarter of a second each
    assert made.seconds > part.seconds


def test_extrapolation_is_linear_in_the_phases_and_never_falls():
    assert extrapolated(3.0, 5.0, 4, 8, 16) == pytest.approx(9.0)
    assert extrapolated(5.0, 3.0, 4, 8, 16) == 3.0
    assert extrapolated(3.0, 5.0, 4, 8, 8) == 5.0


# -- scenes of any size ------------------------------------------------------------------------------------------------
def wide() -> Scene:
    """More than sixty pairs of teeth in contact, each of which moves the others."""
    tables = tomllib.loads((EXAMPLES / "gears" / "e_drive_input.toml").read_text(encoding="utf-8"))
    tables["pair"]["face_width"] *= 25
    del tables["effects"]["off_line_contact"]  # more pairs touch than the path of contact has
    return parse_scene(tables)


def of_high_order() -> Scene:
    scene = load_scene(EXAMPLES / "gears" / "nrel_5mw_stage3.toml")
    tooth = ToothBending(model="solid", order=(12, 20, 40))
    return replace(scene, effects=tuple(tooth if e.name == tooth.name else e for e in scene.effects))


LARGE: dict[str, Callable[[], Scene]] = {
    "as large as there are": lambda: replace(of_high_order(), resolution=Resolution(positions=100_000, segments=2000)),
    "shafts, many segments": lambda: replace(
        load_scene(EXAMPLES / "shafts.toml"), resolution=Resolution(gauss_points=1000, segments=200)
    ),
    "many pairs": wide,
}


@pytest.mark.parametrize("name", LARGE)
def test_trials_are_small_whatever_the_scene(name):
    """That plans take less than two seconds is measured by ``benchmarks/test_plan.py``."""
    small = reduced(LARGE[name]())
    pairs, resolution = pairs_of_teeth(small.scene), small.scene.resolution
    assert pairs <= 12  # one more at either end of a narrower face
    assert pairs * resolution.segments <= 240
    assert small.segments > 1 or small.pairs > 10
    if resolution.positions is None:
        assert resolution.gauss_points is not None
        assert resolution.gauss_points <= 5


def test_a_scene_that_is_small_is_tried_as_it_is():
    scene = case(2, Resolution(gauss_points=3, segments=12))
    small = reduced(scene)
    assert small.scene == scene
    assert (small.segments, small.pairs, small.set_up) == (1, 1, 1)


def test_teeth_of_many_functions_are_tried_with_few():
    small = reduced(of_high_order())
    tooth = small.scene.effect("tooth_bending")
    assert isinstance(tooth, ToothBending)
    assert tooth.order is not None
    across, along, axis = tooth.order
    assert small.set_up == pytest.approx((12 * 20 / (across * along)) ** 2 * 40 / axis)
    assert 40 <= across * along <= 80


def test_a_part_grows_with_the_segments_as_two_numbers_of_them_show():
    assert growth(1.0, 4.0, 10, 20, 80) == pytest.approx(16)  # n²
    assert growth(1.0, 64.0, 10, 20, 80) == pytest.approx(4**2.5)  # no faster
    assert growth(11.0, 12.0, 10, 20, 80) == pytest.approx(18 / 12)  # 10 + n / 10
    assert growth(2.0, 1.0, 10, 20, 80) == 1
    assert growth(0.0, 0.0, 10, 20, 80) == 1


# -- other runs --------------------------------------------------------------------------------------------------------
def test_an_accuracy_is_planned_with_the_settings_that_its_search_begins_with():
    coarse, fine = (plan(case(2, Resolution(accuracy=a))) for a in (0.05, 0.0005))
    assert [part.name for part in coarse.parts][-1] == "choice"
    segments = [int(made.parts[0].size.split()[-2]) for made in (coarse, fine)]
    assert segments == [8, 53]  # 16 for 1 %, 2.5 times as many for a tenth of the error
    assert coarse.seconds < fine.seconds < 300


def test_a_search_costs_its_designs():
    study = load_study(STUDY)
    one, many = study_plan(study, threads=1), study_plan(study, threads=4)
    assert one.designs == study.algorithm.population * study.algorithm.generations
    assert one.seconds == pytest.approx(one.designs * one.design_seconds)
    assert many.seconds == pytest.approx(many.designs * many.design_seconds / 4)
    assert many.megabytes == pytest.approx(4 * one.megabytes, rel=0.2)
    nothing = replace(study, base={**study.base, "pair": {**study.base["pair"], "centre_distance": 3.0}})
    with pytest.raises(GearbenchError, match="none of the first 20 designs is a gear, the last one: pair"):
        study_plan(nothing)


def test_further_loads_add_contact_and_samples_but_no_set_ups():
    scene = gear("55").scene(errors=True, resolution=Resolution(positions=8))
    loads = tuple(WeightedLoad(torque=1.0 + i) for i in range(20))
    one, many = plan(scene), plan(replace(scene, load=greatest_load(loads), loads=loads))
    assert [part.name for part in many.parts] == [part.name for part in one.parts]
    first, last = ({part.name: part for part in made.parts} for made in (one, many))
    assert last["contact"].size == f"{first['contact'].size} × 20 loads"
    # twenty times; a busy machine is given a factor of five
    assert last["contact"].seconds > 4 * first["contact"].seconds
    assert many.robust_seconds > 4 * one.robust_seconds
    assert last["tooth_bending"].seconds < 4 * first["tooth_bending"].seconds
    assert many.megabytes > one.megabytes


def test_a_study_of_several_torques_is_planned():
    study = load_study(STUDY)
    base = {key: value for key, value in study.base.items() if key != "load"}
    made = study_plan(replace(study, base=base | {"loads": [{"torque": 5.0}, {"torque": 10.0}]}), threads=1)
    assert made.seconds == made.designs * made.design_seconds > 0
    assert made.megabytes > 0


def test_the_command_plans_studies_and_stages_too(run):
    code, out, err = run("plan", STUDY)
    assert (code, err) == (0, "")
    assert "200 designs at most" in out
    assert "optimise, predicted: " in out
    stage = DATA / "stage_1.6.rexs"
    code, out, err = run("plan", stage, "--torque", 50)
    assert (code, err) == (0, "")
    assert "simulate, predicted: " in out
