"""Accuracy on wide helical pairs with relief on their bodies: whether it is met, and its time over that of the best."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import count, islice

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from gearbench.accuracy.choose import choose
from gearbench.accuracy.knobs import SOLID_ORDER, with_order, with_resolution
from gearbench.accuracy.measure import relative_errors
from gearbench.effects.base import Effect
from gearbench.effects.crowning import Crowning
from gearbench.effects.gear_body import GearBody
from gearbench.effects.helix_slope import HelixSlope
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.teeth import forget_fast_teeth
from gearbench.effects.tip_relief import TipRelief
from gearbench.effort.clock import timed, unseen
from gearbench.errors import InputError
from gearbench.scene import Resolution, Scene
from gearbench.solution import solve_scene
from studies.s05_tooth_models.pairs import draw, in_use
from studies.s07_accuracy_cost.promises import covered_values, covers

#: Face width that counts as wide [modules].
WIDE = 10.0
#: Rung of the order of solid teeth, counted from the highest, segments and Gauss points of the reference, and of the
#: one that its error bar is taken from.
REFERENCE, BEFORE = (3, 45, 9), (4, 36, 8)
#: Segments and Gauss points among which the quickest settings are looked for.
GRID = (*((n, g) for n in (8, 12, 16, 24, 36) for g in (3, 4, 5)), *((n, 8) for n in (16, 24, 36)))
#: How many of them are timed, on pairs that nothing is kept for.
FINALISTS = 2

_new = count(1)


def wide_scenes(number: int, seed: int) -> list[Scene]:
    """Helical pairs on bodies, b/m above ``WIDE``, all relieved, half crowned or sloping, a third off the line."""
    return list(islice(_wide(seed), number))


def _wide(seed: int) -> Iterator[Scene]:
    rng = np.random.default_rng(seed)
    for scene in draw(in_use, seed):
        pair = scene.pair
        if not pair.helix_angle or pair.face_width < WIDE * pair.normal_module:
            continue
        m, u = pair.normal_module, rng.uniform(size=8).tolist()
        shape = "linear" if u[0] < 0.5 else "parabolic"
        relief = TipRelief(amount=4 * m * (0.2 + 0.8 * u[1]), length=m * (0.2 + 0.6 * u[2]), shape=shape)
        more: tuple[tuple[bool, Effect], ...] = (
            (u[3] < 0.5, Crowning(amount=4 * m * u[4])),
            (u[5] < 0.5, HelixSlope(pinion=4 * m * (u[6] - 0.5))),
            (u[7] < 1 / 3, OffLineContact()),
        )
        try:
            yield replace(
                scene, effects=(*scene.effects, GearBody(), relief, *(each for wanted, each in more if wanted))
            )
        except (ValidationError, ValueError):
            continue


def body_promise(scene: Scene, accuracy: float) -> dict[str, float | str]:
    """Settings chosen for an accuracy: estimated and true error, and its processor time against that of the best."""
    rows: dict[str, float | str] = {"accuracy": accuracy, "estimated": np.nan, "true": np.nan, "seconds": np.nan}
    exact, before = (covered_values(_at(scene, len(SOLID_ORDER.levels(scene)) - up, n, g)) for up, n, g in _FINEST)
    rows["reference_bar"] = float(relative_errors(before, exact).max())
    asked = replace(unseen(scene, next(_new)), resolution=Resolution(accuracy=accuracy))
    try:
        choice, cost = timed(lambda: choose(asked, solve_scene, covers))
    except InputError as refused:  # said to be out of reach
        return rows | {"settings": str(refused).replace("\n", " ")}
    rows |= {
        "estimated": choice.estimated,
        "true": float(relative_errors(covers(choice.run), exact).max()),
        "seconds": cost.processor_seconds,
        "trials": choice.trials,
        "settings": ", ".join(choice.settings.values()),
    }
    forget_fast_teeth()  # those of the references are kept: their order would seem cheap
    best, settings = _best(scene, accuracy, exact)
    forget_fast_teeth()  # teeth of high order that are kept would fill the memory
    return rows | {"best_seconds": best, "best_settings": settings}


_FINEST = REFERENCE, BEFORE


def _at(scene: Scene, rung: int, n: int, g: int) -> Scene:
    order = SOLID_ORDER.levels(scene)[rung]
    return with_order(with_resolution(scene, segments=n, gauss_points=g), order)


def _best(scene: Scene, accuracy: float, exact: NDArray) -> tuple[float, str]:
    """Processor time [s] of the quickest settings of that accuracy, the first time for a pair, and these."""
    good: list[tuple[float, int, int, int]] = []
    for rung in range(len(SOLID_ORDER.levels(scene)) - REFERENCE[0]):
        _, first = timed(partial(covered_values, _at(scene, rung, *GRID[0])))
        for n, g in GRID:
            values, again = timed(partial(covered_values, _at(scene, rung, n, g)))
            if relative_errors(values, exact).max() <= accuracy:
                good.append((first.processor_seconds + again.processor_seconds, rung, n, g))
        if good and first.processor_seconds > 1.5 * min(good)[0]:
            break
    found = []
    for _, rung, n, g in sorted(good)[:FINALISTS]:
        found.append((_first_time(scene, rung, n, g), f"rung {rung}, {n}, {g}"))
    return min(found, default=(float("nan"), "none"))


def _first_time(scene: Scene, rung: int, n: int, g: int) -> float:
    start = time.process_time()
    covered_values(_at(unseen(scene, next(_new)), rung, n, g))
    return time.process_time() - start
