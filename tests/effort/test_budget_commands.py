"""Memory of hunting cycles, responses and comparisons: known before it is spent, as it is measured."""

from __future__ import annotations

import re
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from gearbench import budget, read_study
from gearbench.budget import MemoryBudgetError, memory_limit, nonlinear_memory, sample_memory, speed_memory
from gearbench.contact.transitions import mesh_phases
from gearbench.dynamics import force_curve
from gearbench.dynamics.analysis import response
from gearbench.dynamics.model import Model
from gearbench.dynamics.nonlinear import PER_ORDER, STEPS, nonlinear_response
from gearbench.dynamics.revolution import revolution_response
from gearbench.dynamics.scatter import BLOCK, robust_response
from gearbench.dynamics.size import bearings, in_blocks
from gearbench.effects.waviness import Wave, Waviness
from gearbench.effort.clock import apart, most_megabytes
from gearbench.errors import InputError
from gearbench.hunting.cycles import hunting_memory
from gearbench.hunting.run import hunting_cycle
from gearbench.optimisation import verify as verifying
from gearbench.optimisation.select import open_designs
from gearbench.scene import Resolution, Scene
from gearbench.scene_file import read_scene
from gearbench.validation import comparison
from gearbench.validation.comparison import validate
from gearbench.validation.reference import reference_memory, reference_scene
from tests.support.paths import ROOT
from tests.support.systems import shafts, spur_scene

COARSE = {"segments": 6, "gauss_points": 3}
HERTZ = {"hertz": {"law": "yang_sun"}}
WAVY = {**HERTZ, "waviness": {"pinion": [{"order": 1, "amplitude": 5.0}], "wheel": [{"order": 2, "amplitude": 3.0}]}}
SPEEDS = partial(np.linspace, 500.0, 6000.0)


def peak(work: Callable[[], object]) -> float:
    """Bytes of arrays and objects at the same time, at most."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def grows(work: Callable[[int], object], few: int, many: int) -> float:
    """Bytes that each of what there are few and many takes."""
    work(2)
    return (peak(lambda: work(many)) - peak(lambda: work(few))) / (many - few)


# -- predictions -------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("orders", "waves"), [(1.0, 1), (3.0, 20), (60.0, 1)])
def test_memory_of_mesh_cycles(orders, waves):
    resolution = {"segments": 4, "positions": 12}
    scene = spur_scene(effects=WAVY, **resolution)
    own = tuple(Wave(order=order, amplitude=1.0) for order in range(1, waves + 1))
    effects = (Waviness(pinion=own) if e.name == "waviness" else e for e in scene.effects)
    pair = replace(scene.pair, wheel=replace(scene.pair.wheel, teeth=41), centre_distance=99.3)
    scene = replace(scene, pair=pair, effects=tuple(effects))
    hunting_cycle(spur_scene(effects=WAVY, **resolution))  # compiled code is loaded
    found: dict[str, int] = {}
    measured = peak(lambda: found.update(hunting_cycle(scene, orders=orders).sizes))
    predicted = hunting_memory(scene, found["position"], found["cycle"], orders, 2 * waves)
    assert found["cycle"] == 25 * 41
    assert 0.95 * measured < predicted < 2 * measured


def on_shafts(**more: object) -> Scene:
    return spur_scene(shafts(damping_ratio=0.03), **{**COARSE, **more})


@pytest.mark.parametrize("scene", [spur_scene({}, **COARSE), on_shafts()], ids=["wheels", "shafts"])
@pytest.mark.parametrize("harmonics", [2, pytest.param(20, marks=pytest.mark.slow)])
def test_memory_of_a_response(scene, harmonics):
    each = grows(lambda n: response(scene, speed=SPEEDS(n), harmonics=harmonics), 1000, 3000)
    assert bearings(scene) == len(Model(scene=scene).mechanics.bearing_names)
    assert each < speed_memory(harmonics, 1, bearings(scene)) < 2 * each


@pytest.mark.parametrize("system", [{}, shafts(damping_ratio=0.03)], ids=["wheels", "shafts"])
def test_memory_of_a_revolution(system):
    scene = spur_scene(system, effects=WAVY, **COARSE)
    each = grows(lambda n: revolution_response(scene, speed=SPEEDS(n), harmonics=4), 20, 60)  # of 200 mesh cycles
    assert each < speed_memory(4 * 200, 1, bearings(scene)) < 2 * each


def test_memory_of_a_response_with_loss_of_contact(monkeypatch):
    monkeypatch.setattr(force_curve, "POINTS", 40)  # the table of forces would take more than all speeds
    scene = spur_scene({"damping_ratio": 0.1}, **COARSE)
    each = grows(lambda n: nonlinear_response(scene, speed=SPEEDS(n), harmonics=3), 20, 60)
    assert each < nonlinear_memory(max(STEPS, PER_ORDER * 3), 3, 0, 1) < 2 * each


@pytest.mark.parametrize(
    ("harmonics", "few", "many"), [(2, 2000, 5000), pytest.param(12, 1000, 2000, marks=pytest.mark.slow)]
)
def test_memory_of_scattered_samples(harmonics, few, many):
    scene = on_shafts(effects={**HERTZ, "manufacturing_errors": {"preset": "garambois2017"}})
    speed = SPEEDS(BLOCK)
    each = grows(lambda n: robust_response(scene, speed=speed, samples=n, harmonics=harmonics, threads=1), few, many)
    assert each < sample_memory(harmonics, BLOCK, 3) < 2 * each


def test_matrices_of_a_response_do_not_take_more_at_more_speeds():
    """In one piece, those of 500 speeds would take 500 · 201² · 8 bytes."""
    scene = spur_scene({}, **COARSE)
    response(scene, speed=1000.0)
    assert peak(lambda: response(scene, speed=SPEEDS(500), harmonics=100)) < 0.2 * 500 * 201**2 * 8
    assert [*in_blocks(5, 10**9)] == [slice(i, i + 1) for i in range(5)]
    assert [range(7)[here] for here in in_blocks(7, 10**5)] == [range(2), range(2, 4), range(4, 6), range(6, 7)]


def largest_with_a_reference(scene: Scene) -> tuple[float, float]:
    """Memory [MB] predicted for the finite elements of a comparison, and what this process has taken after it."""
    predicted = reference_memory(reference_scene(scene), len(mesh_phases(scene)[0]))
    comparison.compare(scene, 0.01)
    return predicted / 1e6, most_megabytes()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["nrel_5mw_stage3", "fzg_c"])
def test_memory_of_a_comparison_is_that_of_its_process(name):
    predicted, measured = apart(largest_with_a_reference, read_scene(ROOT / "examples" / "gears" / f"{name}.toml"))
    assert 0.5 * measured < predicted < 2 * measured


@pytest.mark.parametrize("name", [pytest.param("large_wheel", marks=pytest.mark.slow), "nrel_5mw_stage3"])
def test_memory_of_mesh_cycles_of_gears_in_use(name):
    """A wheel far larger than its pinion, and an undercut one: with waves, at few of their mesh cycles' positions."""
    scene = read_scene(ROOT / "examples" / "gears" / f"{name}.toml")
    waves = Waviness(pinion=(Wave(order=1, amplitude=2.0),))
    scene = replace(scene, effects=(*scene.effects, waves), resolution=Resolution(positions=4, segments=8))
    hunting_cycle(scene, orders=0.1)
    found: dict[str, int] = {}
    measured = peak(lambda: found.update(hunting_cycle(scene, orders=200.0).sizes))
    assert 0.95 * measured < hunting_memory(scene, 4, found["cycle"], 200.0, 2) < 2 * measured


# -- refusals ----------------------------------------------------------------------------------------------------------
def refused(work: Callable[[], object], key: str) -> str:
    """The line by which a run is refused, one of its key, with what would fit."""
    with pytest.raises(MemoryBudgetError) as fault:
        work()
    line = str(fault.value)
    assert line.startswith(f"{key} = ")
    assert "of memory, " in line
    assert line.endswith(" would fit")
    assert len(line) < 300
    assert "\n" not in line
    return line


def test_mesh_cycles_beyond_the_memory_are_refused_with_what_fits(monkeypatch):
    scene = spur_scene(effects=WAVY, segments=4, gauss_points=40)
    pair = replace(scene.pair, wheel=replace(scene.pair.wheel, teeth=1999), normal_module=0.1, centre_distance=101.22)
    scene = replace(scene, pair=pair)
    monkeypatch.setenv(budget.VARIABLE, "3e8")
    line = refused(lambda: hunting_cycle(scene, orders=40.0), "hunting")
    assert line.startswith("hunting = 49975 mesh cycles × ")
    positions, fewer = (int(re.search(rf"(\d+) positions{end}", line)[1]) for end in (", 40 orders", " or"))
    lower = float(re.search(r"or ([\d.]+) orders would fit", line)[1])
    assert hunting_memory(scene, fewer, 49975, 40.0, 4) <= memory_limit()
    assert hunting_memory(scene, positions, 49975, lower, 4) <= memory_limit()


@pytest.mark.parametrize("kind", ["linear", "nonlinear", "samples", "revolution"])
def test_responses_beyond_the_memory_are_refused_with_what_fits(monkeypatch, kind):
    errors = {**HERTZ, "manufacturing_errors": {"preset": "garambois2017"}}
    scene = spur_scene({}, effects={"revolution": WAVY, "samples": errors}.get(kind, HERTZ), **COARSE)
    many = SPEEDS(200_000)
    work = {
        "linear": lambda: response(scene, speed=many, harmonics=50),
        "nonlinear": lambda: nonlinear_response(scene, speed=many),
        "samples": lambda: robust_response(scene, speed=many[:100], samples=10**6),
        "revolution": lambda: revolution_response(scene, speed=many),
    }[kind]
    monkeypatch.setenv(budget.VARIABLE, "3e8")
    line = refused(work, "sample" if kind == "samples" else "speed")
    assert 0 < int(re.search(r"; (\d+) (?:speeds|samples) would fit", line)[1]) < 10**6


def test_a_comparison_beyond_the_memory_is_refused_before_any_of_it(monkeypatch, tmp_path):
    """That of the second scene before the first is computed."""
    scenes = [read_scene(ROOT / "examples" / "gears" / f"{name}.toml") for name in ("fzg_c", "nrel_5mw_stage3")]
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path))
    monkeypatch.setenv(budget.VARIABLE, "6e8")
    monkeypatch.setattr(comparison, "compare", lambda *_: pytest.fail("something was computed"))
    with pytest.raises(InputError, match=r"^nrel.*tooth_bending.accuracy = 0.01: needs about .* no accuracy"):
        validate(scenes)


@pytest.fixture(scope="module")
def front(tmp_path_factory):
    from gearbench import optimise

    folder = tmp_path_factory.mktemp("front")
    study = read_study(ROOT / "examples" / "optimise_small.toml")
    small = replace(study.algorithm, population=8, generations=3)
    optimise(replace(study, algorithm=small, robustness=replace(study.robustness, samples=4)), directory=folder)
    return open_designs(folder)


def test_a_verification_beyond_the_memory_is_refused_before_any_of_it(monkeypatch, tmp_path, front):
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path))
    monkeypatch.setenv(budget.VARIABLE, "3e8")
    monkeypatch.setattr(verifying.ToothBending, "flank", lambda *_: pytest.fail("something was computed"))
    with pytest.raises(MemoryBudgetError, match=r"effects.tooth_bending.accuracy = 0.001: needs about .* fit"):
        verifying.verify(front, accuracy=0.001)
