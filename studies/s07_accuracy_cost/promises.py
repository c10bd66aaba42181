"""Promises: whether a requested accuracy is met, and at what cost, on random scenes with a search over settings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np
from pydantic import ValidationError

from gearbench.accuracy.choose import choose
from gearbench.accuracy.measure import MEASURED, covered, relative_errors
from gearbench.accuracy.settings import GAUSS_POINTS, SEGMENTS, SOLID_ORDER, with_order, with_resolution
from gearbench.effects.base import Effect
from gearbench.effects.crowning import Crowning
from gearbench.effects.helix_slope import HelixSlope
from gearbench.effects.hertz import Hertz
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.effects.teeth import clear_tooth_cache
from gearbench.effects.tip_relief import TipRelief
from gearbench.effects.tooth_bending import ToothBending
from gearbench.effort.clock import quickest, timed
from gearbench.errors import InputError
from gearbench.results.solved import Solved
from gearbench.robustness.run import robust
from gearbench.scene import Resolution, Scene
from gearbench.solution import solve_scene
from gearbench.threads import default_threads
from studies.s05_tooth_models.pairs import draw, everyday

#: Seeds of scenes on which the accuracy control was not tuned: plates, solid teeth, random errors, and first draw of
#: the random errors. It was tuned on the seeds 9, 60, 61, 62 and 7003, and on the draws from 0 on.
SEED, SOLID_SEED, ROBUST_SEED, FIRST_DRAW = 7103, 7104, 7101, 50_000
#: Resolutions of the reference and of its error bar; the next line limits the search over all settings.
REFERENCE, BEFORE = {"segments": 180, "gauss_points": 24}, {"segments": 120, "gauss_points": 16}
MOST_SEGMENTS, MOST_POINTS = 128, 32
#: Number of best settings that are timed again, and repeats, of which the fastest counts.
FINALISTS, REPEATS = 4, 7
#: Record of an accuracy that the accuracy control reports as out of reach.
REFUSED = dict.fromkeys(("estimated", "true", "seconds", "best_seconds", "search_seconds", "trials"), float("nan"))


def random_scenes(count: int, seed: int = SEED) -> list[Scene]:
    """Random spur and helical pairs with plate teeth; relief, crowning and slope on half of them; none is left out."""
    return list(islice(_scenes(np.random.default_rng(seed), draw(everyday, seed)), count))


def _scenes(rng: np.random.Generator, pairs: Iterator[Scene]) -> Iterator[Scene]:
    for scene in pairs:
        module, u = scene.pair.normal_module, rng.uniform(size=8)
        shape = "linear" if u[5] < 0.5 else "parabolic"
        modifications: tuple[tuple[bool, Effect], ...] = (
            (u[0] < 0.5, TipRelief(amount=4 * module * u[1], length=module * (0.2 + 0.6 * u[2]), shape=shape)),
            (u[3] < 0.5, Crowning(amount=4 * module * u[4])),
            (u[6] < 0.5, HelixSlope(pinion=4 * module * (u[7] - 0.5))),
        )
        gaps = [effect for wanted, effect in modifications if wanted]
        try:
            yield replace(scene, effects=(ToothBending(basis="paper"), Hertz(), *gaps))
        except ValidationError:
            continue


def covered_values(scene: Scene) -> np.ndarray:
    """Compute the numbers that an accuracy covers, (16,); see ``gearbench.accuracy.measure``."""
    return covers(solve_scene(scene))


def covers(solved: Solved) -> np.ndarray:
    """Numbers of a solved scene that an accuracy covers, (16,)."""
    return covered(solved.cycle)


def promises(scene: Scene, accuracies: Sequence[float]) -> list[dict[str, float]]:
    """Choose settings for all accuracies; return estimated and true errors, and times of chosen and best settings.

    ``seconds`` is the whole time, of the search and of the final run.
    """
    reference = covered_values(with_resolution(scene, **REFERENCE))
    bar = float(relative_errors(covered_values(with_resolution(scene, **BEFORE)), reference).max())
    grid = _grid(scene, reference)
    found = []
    for accuracy in accuracies:
        asked = replace(scene, resolution=Resolution(accuracy=accuracy))
        try:
            choice, search = timed(lambda s=asked: choose(s, solve_scene, covers))
        except InputError:  # reported as out of reach: counts as not met
            found.append({"accuracy": accuracy, **REFUSED, "reference_bar": bar})
            continue
        good = [at for _, error, at in grid if error <= accuracy][:FINALISTS]
        whole = [lambda s=asked: choose(s, solve_scene, covers).errors]
        taken = quickest([*whole, *(lambda s=s: covered_values(s) for s in (choice.scene, *good))], REPEATS)
        found.append(
            {
                "accuracy": accuracy,
                "estimated": choice.estimated,
                "true": float(relative_errors(covers(choice.run), reference).max()),
                "reference_bar": bar,
                "seconds": taken[0],
                "best_seconds": min(taken[1:]),
                "search_seconds": search.processor_seconds,
                "trials": float(choice.trials),
            }
        )
    return found


def _grid(scene: Scene, reference: np.ndarray) -> list[tuple[float, float, Scene]]:
    """Processor time [s] and true error of every setting of the grid, fastest first."""
    found = []
    for n in (n for n in SEGMENTS.levels(scene) if int(n) <= MOST_SEGMENTS):
        for g in (g for g in GAUSS_POINTS.levels(scene) if int(g) <= MOST_POINTS):
            at = GAUSS_POINTS.with_level(SEGMENTS.with_level(scene, n), g)
            values, cost = timed(lambda s=at: covered_values(s))
            found.append((cost.processor_seconds, float(relative_errors(values, reference).max()), at))
    return sorted(found, key=lambda each: each[0])


def solid_promise(scene: Scene, accuracy: float) -> dict[str, float]:
    """Promise for solid teeth, whose order is chosen too; the best order is searched with teeth computed anew."""
    effects = tuple(ToothBending(model="solid") if e.name == "tooth_bending" else e for e in scene.effects)
    scene = replace(scene, effects=effects)
    choice = choose(replace(scene, resolution=Resolution(accuracy=accuracy)), solve_scene, covers)
    orders, fine = SOLID_ORDER.levels(scene), {"segments": 96, "gauss_points": 16}
    finest = [covered_values(with_resolution(with_order(scene, order), **fine)) for order in orders[-2:]]
    true = float(relative_errors(covers(choice.run), finest[1]).max())
    clear_tooth_cache()  # cached teeth of high order would fill the memory
    return {
        "accuracy": accuracy,
        "estimated": choice.estimated,
        "true": true,
        "reference_bar": float(relative_errors(finest[0], finest[1]).max()),
    }


def robust_promise(scene: Scene, accuracy: float, seed: int, samples: int = 8192) -> dict[str, float]:
    """Promise for the means over error samples, against many samples at a fine resolution."""
    scene = replace(scene, effects=(*scene.effects, ManufacturingErrors(preset="garambois2017")))
    threads = default_threads()
    found = robust(replace(scene, resolution=Resolution(accuracy=accuracy)), seed=seed, threads=threads)
    exact = robust(
        with_resolution(scene, segments=48, gauss_points=12), samples=samples, seed=seed + 1000, threads=threads
    )
    values, reference = (np.array([float(d[name].mean()) for name in MEASURED]) for d in (found, exact))
    return {
        "accuracy": accuracy,
        "estimated": float(found.attrs["accuracy_estimated"]),
        "true": float(relative_errors(values, reference).max()),
        "samples": float(found.attrs["samples"]),
    }
