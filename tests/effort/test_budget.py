"""Memory is known before it is spent; what needs more than there may be is refused in one line that says what fits."""

from __future__ import annotations

import os
import re
import resource
import tomllib
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from gearbench import budget, robust, simulate, sweep
from gearbench.accuracy import choose
from gearbench.budget import MemoryBudgetError, memory_limit, parse_memory, require, shown
from gearbench.contact.size import contact_memory, kept_memory
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.tooth_bending import ToothBending
from gearbench.errors import InputError
from gearbench.library.garambois2017 import case, gear
from gearbench.optimisation.study_file import read_study
from gearbench.optimisation.workers import evaluations
from gearbench.scene import Resolution, Scene
from gearbench.scene_file import parse_scene
from tests.support.paths import ROOT
from tests.support.texts import HELICAL

BODY = (
    HELICAL.replace("teeth = 25", "teeth = 25\nbore_diameter = 15.0").replace(
        "teeth = 40", "teeth = 40\nbore_diameter = 25.0"
    )
    + '[effects.tooth_bending]\nmodel = "solid"\n[effects.gear_body]\n'
)


def on_bodies(**resolution: int) -> Scene:
    return replace(parse_scene(tomllib.loads(BODY)), resolution=Resolution(**resolution))


# -- the budget --------------------------------------------------------------------------------------------------------
def test_sizes_are_read_and_shown():
    assert [parse_memory(text) for text in ("4GB", "500 MB", "1.5TB", "7B")] == [4e9, 5e8, 1.5e12, 7.0]
    assert [shown(size) for size in (4.25e9, 5e8, 1.5e12, 7.0)] == ["4.2 GB", "500 MB", "1.5 TB", "7 B"]
    for text in ("4", "GB", "-1GB", "0GB", "1e400GB", "4 GiB", "9" * 400 + "GB"):
        with pytest.raises(InputError, match="must be a number with a unit, such as 4GB or 500MB"):
            parse_memory(text)


def test_the_budget_is_the_least_of_all_limits(monkeypatch):
    whole = memory_limit()
    assert 0 < whole <= 0.7 * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    monkeypatch.setenv(budget.VARIABLE, "1e9")
    assert memory_limit() == min(whole, 1e9)
    monkeypatch.setattr(resource, "getrlimit", lambda _: (5e8, 5e8))
    assert memory_limit() < 5e8


def test_a_need_beyond_it_is_one_line(monkeypatch):
    monkeypatch.setenv(budget.VARIABLE, "3e8")
    require(2.9e8, "key", "value")
    with pytest.raises(
        MemoryBudgetError, match=r"^key = v: needs about 4.1 GB of memory, 300 MB are allowed; try less$"
    ):
        require(4.1e9, "key", "v", "try less")


# -- predictions -------------------------------------------------------------------------------------------------------
PREDICTED = {
    "plate": case(2, Resolution(positions=400, segments=100)),
    "Hertz alone": replace(case(2, Resolution(positions=500, segments=60)), effects=case(2).effects[1:]),
    "solid": replace(
        case(2, Resolution(positions=100, segments=60)), effects=(ToothBending(model="solid"), *case(2).effects[1:])
    ),
    "on bodies": on_bodies(positions=40, segments=40),
}


@pytest.mark.parametrize("name", PREDICTED)
def test_memory_is_predicted_within_a_factor_of_two_and_never_exceeded(name):
    scene = PREDICTED[name]
    simulate(replace(scene, resolution=Resolution(positions=2, segments=3)))  # kernels and teeth
    tracemalloc.start()
    simulate(scene)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak <= contact_memory(scene, len(mesh_phases(scene)[0])) <= 2.2 * peak


@pytest.mark.parametrize("positions", [100_000, 2000])
def test_a_resolution_beyond_the_memory_is_refused_with_one_that_fits(monkeypatch, positions):
    monkeypatch.setenv(budget.VARIABLE, "3e9")
    scene = on_bodies(positions=positions, segments=2000)
    with pytest.raises(MemoryBudgetError, match=r"would fit$") as fault:
        simulate(scene)
    line = str(fault.value)
    assert line.startswith(f"resolution = {positions} positions × 4 pairs × 2000 segments: needs about ")
    assert len(line) < 300
    found = re.search(r"; (?:segments = (\d+))?(?: or )?(?:(\d+) positions)? would fit", line)
    assert found is not None
    segments, fewer = (int(number or 1) for number in found.groups())
    fitting = Resolution(positions=positions, segments=segments)
    assert contact_memory(replace(scene, resolution=fitting), positions) <= 3e9
    assert contact_memory(scene, fewer) <= 3e9 or not found[2]


def test_error_samples_and_orders_beyond_the_memory_are_refused(monkeypatch):
    monkeypatch.setenv(budget.VARIABLE, "3e8")
    scene = gear("SC").scene(errors=True, resolution=Resolution(positions=80_000, segments=15))
    assert robust(replace(scene, resolution=Resolution(positions=50)), samples=8).sizes["sample"] == 8
    with pytest.raises(MemoryBudgetError, match=r"^resolution = .* needs about .* would fit$"):
        robust(scene, samples=8)
    teeth = (ToothBending(model="solid", order=(40, 40, 40)), *case(1).effects[1:])
    with pytest.raises(MemoryBudgetError, match=r"effects.tooth_bending.order = \[40, 40, 40\]: needs about .* GB"):
        simulate(replace(case(1, Resolution(positions=2)), effects=teeth))


def test_a_machine_that_is_too_small_says_nothing_about_a_gear(monkeypatch):
    study = read_study(ROOT / "examples" / "optimise_small.toml")
    study = replace(study, base={**study.base, "resolution": {"positions": 20_000, "segments": 400}})
    monkeypatch.setenv(budget.VARIABLE, "3e8")
    designs = [(z, 5, 4, 1, 0, 3) for z in range(4)]
    with pytest.raises(MemoryBudgetError, match="would fit"):
        list(evaluations(None, study, designs))


# -- accuracy ----------------------------------------------------------------------------------------------------------
def never_agrees(scene: Scene) -> np.ndarray:
    r = scene.resolution
    return np.array([1.0, 0.1, 1.0, 10.0]) * (1 + 0.5 * (-1) ** r.segments.bit_length() + 0.1 / (r.gauss_points or 1))


def test_the_search_for_an_accuracy_begins_no_run_after_its_time_and_says_what_it_reached(monkeypatch):
    now, begun = [0.0], []

    def dear(scene: Scene) -> np.ndarray:
        r = scene.resolution
        begun.append(now[0])
        now[0] += 1e-2 * (60 + (r.gauss_points or 1) * (4 + r.segments)) ** 1.5
        return never_agrees(scene)

    monkeypatch.setattr("gearbench.accuracy.choose.time.perf_counter", lambda: now[0])
    with pytest.raises(
        InputError, match=r"^accuracy = 0.01: the search ended at an error of about .* with segments = \d+"
    ):
        choose.choose(case(1, Resolution(accuracy=0.01)), dear)
    assert begun[-1] <= choose.SEARCH_TIME < now[0]


def test_the_search_for_an_accuracy_ends_at_its_memory_and_says_what_it_reached(monkeypatch):
    def large(scene: Scene) -> np.ndarray:
        require(1e6 * scene.resolution.segments**2, "resolution", "large")
        return never_agrees(scene)

    monkeypatch.setenv(budget.VARIABLE, "1e9")
    fault = r"with segments = \d+, gauss_points = \d+, because needs about .* of memory, 1 GB are allowed"
    with pytest.raises(InputError, match=fault) as found:
        choose.choose(case(1, Resolution(accuracy=0.01)), large)
    assert len(str(found.value)) < 300


# -- sweeps ------------------------------------------------------------------------------------------------------------
@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "least"),
    [("effects.crowning.amount", 0.4), ("load.torque", 0.2)],  # torques share their contact lines
)
def test_memory_of_the_points_of_a_sweep_is_predicted(key, least):
    scene, peaks = on_bodies(positions=16, segments=30), []
    sweep(scene, {key: [100.0]})  # what all points share
    for count in (200, 300):  # more than the problem itself takes
        tracemalloc.start()
        sweep(scene, {key: np.linspace(1.0, 150.0, count)})
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    predicted = kept_memory(scene, 16)
    assert least * predicted < (peaks[1] - peaks[0]) / 100 < predicted


def test_more_points_than_the_memory_holds_are_refused_with_what_fits(monkeypatch):
    monkeypatch.setenv(budget.VARIABLE, "5e8")
    scene, torques = on_bodies(positions=64, segments=15), np.linspace(50.0, 150.0, 100_000)
    with pytest.raises(
        MemoryBudgetError, match=r"sweep = 100000 points: needs about .* (\d+) points would fit"
    ) as found:
        sweep(scene, torque=torques)
    fits = int(re.search(r"(\d+) points would fit", str(found.value))[1])
    assert 0.9 * 5e8 < fits * kept_memory(scene, 64) <= 5e8


# -- the command -------------------------------------------------------------------------------------------------------
def test_the_command_takes_a_budget_and_plan_tells_what_simulate_refuses(run, refused, tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(BODY + "[resolution]\npositions = 2000\nsegments = 400\n", encoding="utf-8")
    err = refused("simulate", scene, "--memory", "1GB", "-o", tmp_path / "out.nc")
    assert "1 GB are allowed" in err
    assert budget.VARIABLE not in os.environ
    code, out, _ = run("plan", scene, "--memory", "1GB")
    assert code == 0
    assert "2000 positions" in out
    assert "more than the 1 GB of memory that are allowed: simulate refuses it" in out
    assert run("simulate", scene, "--memory", "many")[0] == 2
    assert os.listdir(tmp_path) == ["scene.toml"]
