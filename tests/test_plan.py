"""``gearbench plan``: what will run, and nothing that takes long to find out. Its figures: benchmarks/test_plan.py."""

from __future__ import annotations

from dataclasses import replace

import pytest

from gearbench.effects import tooth_bending
from gearbench.effects.crowning import Crowning
from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.effort.plan import extrapolated, plan
from gearbench.library.garambois2017 import case, gear
from gearbench.scene import Resolution


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
