"""``gearbench plan``: what will run, sizes and memory, without running it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from gearbench.effects import tooth_bending
from gearbench.effects.crowning import Crowning
from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.effort.plan import plan, study_plan
from gearbench.errors import GearbenchError
from gearbench.library.garambois2017 import case, gear
from gearbench.loads import WeightedLoad, greatest_load
from gearbench.optimisation.study_file import read_study
from gearbench.scene import Resolution
from gearbench.scene_file import read_scene
from gearbench.simulation import simulate

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize("positions", [1, 3, 40])
def test_the_parts_are_those_of_the_scene(positions):
    scene = case(1, Resolution(positions=positions))
    made = plan(replace(scene, effects=(*scene.effects, Crowning(amount=3.0))))
    assert [part.name for part in made.parts] == ["contact lines", "tooth_bending", "hertz", "crowning", "contact"]
    assert made.parts[0].size == f"{positions} positions (uniform) × 2 pairs × 15 segments"
    assert list(made.megabytes) == ["simulate", "validate"]
    assert plan(gear("SC").scene(errors=True)).parts[-1].name == "robust"


def test_finite_elements_are_counted_not_run(monkeypatch, tmp_path):
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path))
    monkeypatch.setattr(tooth_bending, "fe_flank", lambda *_: pytest.fail("finite elements were run"))
    scene = replace(case(1, Resolution(positions=4)), effects=(ToothBending(model="finite_elements"), Hertz()))
    levels = scene.effects[0].missing_levels(scene.pair, {})
    assert len(levels) == 4  # two of each gear
    part = next(part for part in plan(scene).parts if part.name == "tooth_bending")
    assert part.size == f"finite elements of {sum(level.unknowns for level in levels)} unknowns, kept on disk"


def test_other_commands_that_the_scene_is_fit_for():
    assert list(plan(read_scene(EXAMPLES / "shafts.toml")).megabytes) == [
        "simulate",
        "response at 200 speeds",
        "validate",
    ]
    waves = read_scene(Path(__file__).parents[1] / "data" / "waves.toml")
    assert "hunting" in plan(waves).megabytes


def test_an_accuracy_is_planned_with_the_settings_that_its_search_begins_with():
    coarse, fine = (plan(case(2, Resolution(accuracy=a))) for a in (0.05, 0.0005))
    assert coarse.parts[-1].name == "choice"
    segments = [int(made.parts[0].size.split()[-2]) for made in (coarse, fine)]
    assert segments == [8, 53]  # 16 for 1 %, 2.5 times as many for a tenth of the error


def test_several_loads_keep_the_results_of_each():
    scene = gear("55").scene(errors=True, resolution=Resolution(positions=8))
    loads = tuple(WeightedLoad(torque=1.0 + i) for i in range(20))
    one, many = plan(scene), plan(replace(scene, load=greatest_load(loads), loads=loads))
    assert [part.name for part in many.parts] == [part.name for part in one.parts]
    assert many.parts[-2].size == f"{one.parts[-2].size} × 20 loads"
    assert many.megabytes["simulate"] > one.megabytes["simulate"]


@pytest.mark.parametrize("name", ["second_set", "stepped_planets"])
def test_every_mesh_of_a_set_is_planned_at_the_positions_of_its_result(name):
    scene = read_scene(EXAMPLES / f"{name}.toml")
    made, positions = plan(scene), simulate(scene).sizes["position"]
    lines = [part.size for part in made.parts if part.name == "contact lines"]
    assert [size.split()[0] for size in lines] == 2 * [str(positions)]
    assert list(made.megabytes) == ["simulate", "hunting"]


def test_a_search_costs_its_designs():
    study = read_study(EXAMPLES / "optimise_small.toml")
    made = study_plan(study, threads=4)
    assert made.designs == study.algorithm.population * study.algorithm.generations
    assert made.seconds == pytest.approx(made.designs * made.design_seconds / 4)
    assert made.seconds > 0
    nothing = replace(study, base={**study.base, "pair": {**study.base["pair"], "centre_distance": 3.0}})
    with pytest.raises(GearbenchError, match="no valid gear set among the first 20 designs; last error: pair"):
        study_plan(nothing)


def test_the_command_plans_scenes_studies_and_stages(run):
    code, out, err = run("plan", EXAMPLES / "optimise_small.toml")
    assert (code, err) == (0, "")
    assert "200 designs at most, " in out
    assert "one evaluation takes " in out
    stage = Path(__file__).parents[1] / "data" / "stage_1.6.rexs"
    made = json.loads(run("plan", stage, "--torque", 50, "--json")[1])
    assert made["parts"][0]["name"] == "contact lines"
    assert "simulate: " in run("plan", stage, "--torque", 50)[1]
