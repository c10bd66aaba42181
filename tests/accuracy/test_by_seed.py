"""An accuracy asked for is met on pairs drawn by seed that it was not tuned on, in every number it covers."""

from dataclasses import replace

import numpy as np
import pytest

from gearbench import read_scene
from gearbench.accuracy.choose import choose
from gearbench.accuracy.measure import relative_errors
from gearbench.accuracy.settings import SOLID_ORDER, with_order, with_resolution
from gearbench.effects.teeth import clear_tooth_cache
from gearbench.effort.clock import timed, unseen
from gearbench.errors import InputError
from gearbench.scene import Resolution, Scene
from gearbench.solution import solve_scene
from studies.s07_accuracy_cost.promises import BEFORE, REFERENCE, covered_values, covers, random_scenes
from tests.support.campaign import many
from tests.support.paths import ROOT
from tests.support.wide_pairs import wide_scenes

#: Of the few pairs, and of the many.
FEW, MANY = 7203, 8101
#: Part of the scenes on which an accuracy must be met, and how much of it the error bar of the reference may be.
MET, DOUBT = 0.95, 1.0
#: References for an accuracy of 1 %, and how they were before.
ENOUGH = {"segments": 60, "gauss_points": 16}, {"segments": 40, "gauss_points": 12}


def met(scene: Scene, accuracies: tuple[float, ...], references: tuple[dict, dict]) -> list[bool | None]:
    """Whether each accuracy is met; None where the finest reference is not known to it, by what it was before."""
    exact, before = (covered_values(with_resolution(scene, **fine)) for fine in references)
    bar = relative_errors(before, exact)
    found: list[bool | None] = []
    for accuracy in accuracies:
        try:
            choice = choose(replace(scene, resolution=Resolution(accuracy=accuracy)), solve_scene, covers)
        except InputError:  # said to be out of reach
            found.append(False)
            continue
        errors = relative_errors(covers(choice.run), exact)
        doubtful = bool(np.any((errors > accuracy) & (bar > DOUBT * accuracy)))
        found.append(None if doubtful else bool(errors.max() <= accuracy))
    return found


def test_one_percent_is_met_on_each_of_a_few_pairs():
    assert all(met(scene, (0.01,), ENOUGH) == [True] for scene in random_scenes(12, FEW))


@pytest.mark.slow
def test_accuracies_are_met_on_95_percent_of_the_pairs():
    answers = [met(scene, (0.01, 0.001), (REFERENCE, BEFORE)) for scene in random_scenes(many(20), MANY)]
    for index in range(2):
        known = [answer[index] for answer in answers if answer[index] is not None]
        # a doubtful reference counts neither way, and there are few of them
        assert len(known) >= MET * len(answers)
        assert np.mean(known) >= MET


@pytest.mark.slow
def test_one_percent_is_met_on_wide_pairs_on_their_bodies():
    """A third of them off the line of action."""
    for scene in wide_scenes(many(4), 8500):
        fine = with_resolution(with_order(scene, SOLID_ORDER.levels(scene)[-3]), segments=45, gauss_points=9)
        choice = choose(replace(scene, resolution=Resolution(accuracy=0.01)), solve_scene, covers)
        assert relative_errors(covers(choice.run), covered_values(fine)).max() <= 0.01
        clear_tooth_cache()  # teeth of high order that are kept would fill the memory


@pytest.mark.slow
def test_crowned_pairs_off_the_line_of_action_converge_in_the_segments_as_on_it():
    """Measured: 0.5 % at 16 segments, where one polynomial along the whole line left 4.8 %."""
    scene = with_order(wide_scenes(13, 8300)[12], (4, 5, 14))
    assert scene.effect("off_line_contact") is not None
    assert scene.effect("crowning") is not None
    coarse, fine = (covered_values(with_resolution(scene, segments=n, gauss_points=5)) for n in (16, 64))
    assert relative_errors(coarse, fine).max() < 0.01


@pytest.mark.slow
def test_an_electric_axle_on_its_body_takes_a_second():
    """Of processor time, choosing included; three times as much where all tests run at once."""
    scene = read_scene(ROOT / "examples" / "gears" / "e_drive_input.toml").without("off_line_contact")
    asked = [replace(unseen(scene, i), resolution=Resolution(accuracy=0.01)) for i in (1, 2)]
    choose(asked[0], solve_scene, covers)  # kernels are compiled
    choice, cost = timed(lambda: choose(asked[1], solve_scene, covers))
    assert choice.estimated <= 0.01
    assert cost.processor_seconds <= 3.0
