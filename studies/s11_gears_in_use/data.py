"""Data of the study: errors of teeth on bodies against finite elements on random pairs from all gears in use."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from gearbench.effects.base import Effect
from gearbench.effects.gear_body import GearBody
from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.lazy import xr
from gearbench.scene import Scene
from gearbench.simulation import simulate
from gearbench.solution import dataset, solve_scene
from gearbench.validation.comparison import compliance_seconds
from gearbench.validation.mac import compare_shapes
from gearbench.validation.reference import fe_flanks, finest_level, reference_scene
from gearbench.validation.ste_error import OUTPUTS, cycle_errors, error_bars
from studies.report import kept
from studies.s05_tooth_models.data import ERRORS
from studies.s05_tooth_models.data import MODELS as MODELS_OF_S05
from studies.s05_tooth_models.pairs import draw, in_use

#: Seed → number of pairs. The thresholds of the default order of solid teeth (``gearbench.effects.teeth``) were tuned
#: on the first set; the second set was drawn afterwards.
DRAWN = {2017: 200, 2018: 30}
#: Accuracy of the finite elements.
ACCURACY = 0.01
#: Tooth models compared with finite elements of the whole gear: all of s05 but the finest.
MODELS = {name: MODELS_OF_S05["rim"][name] for name in list(MODELS_OF_S05["rim"])[:-1]}


def scene(i: int = 0) -> Scene:
    """Scene of pair number ``i`` of the first set."""
    return next(islice(draw(in_use, min(DRAWN)), i, None))


def compute(*, quick: bool = False, folder: Path | None = None) -> xr.Dataset:
    """Compute errors [%] with error bars, worst MAC and times of every model on every pair; NaN if a pair is refused.

    Finished pairs are kept in ``folder`` and not computed again.
    """
    drawn = [(seed, each) for seed, pairs in DRAWN.items() for each in islice(draw(in_use, seed), pairs)]
    seeds, scenes = zip(*drawn[: 1 if quick else None], strict=True)
    found = [kept(folder and folder / f"{i:03d}.nc", partial(pair_errors, each)) for i, each in enumerate(scenes)]
    return xr.concat(found, "design").assign(seed=("design", list(seeds)))


def pair_errors(scene: Scene) -> xr.Dataset:
    """Compute errors, error bars, MAC and times of the models on a pair, (tooth_model,), and data of the reference."""
    solid = replace(scene, effects=(ToothBending(model="solid"), GearBody(), Hertz()))
    reference = reference_scene(solid, ACCURACY)
    exact, again = simulate(reference, outputs=OUTPUTS), _finest_cycle(reference)
    bare, flanks = finest_level(reference), fe_flanks(reference)
    rows = [_model_errors(scene, effects, (reference, exact), (bare, again)) for effects in MODELS.values()]
    of_models = {name: ("tooth_model", np.array([row[name] for row in rows])) for name in rows[0]}
    of_reference = {
        "reference_seconds": float(sum(flank.attrs["seconds"] for flank in flanks)),
        "reference_error": float(max(flank.error for flank in flanks)),
        "reference_level": float(max(flank.attrs["level"] for flank in flanks)),
    }
    return xr.Dataset({"scene": scene.to_toml(), **of_models, **of_reference}, coords={"tooth_model": list(MODELS)})


def _finest_cycle(reference: Scene) -> xr.Dataset:
    """Simulate the reference with its finest level alone."""
    start = time.perf_counter()
    return dataset(replace(solve_scene(finest_level(reference)), scene=reference), OUTPUTS, start)


def _model_errors(
    scene: Scene, effects: tuple[Effect, ...], exact: tuple[Scene, xr.Dataset], again: tuple[Scene, xr.Dataset]
) -> dict[str, float]:
    """Compare a model with the reference and with its finest level, both given as scene and cycle."""
    names = (*ERRORS, *(f"{name}_bar" for name in ERRORS), "mac", "mac_bar", "seconds")
    try:
        fast = replace(scene, effects=(*effects, Hertz()))
    except ValidationError:  # the pair is outside the range of Sainsot–Velex
        return dict.fromkeys(names, math.nan)
    cycle = simulate(fast, outputs=OUTPUTS)
    errors = cycle_errors(cycle, exact[1])
    errors |= error_bars(errors, cycle_errors(cycle, again[1]))
    worst, bare = (
        min(float(compare_shapes(fast, each, index).mac.min()) for index in (0, 1)) for each, _ in (exact, again)
    )
    more = {"mac": worst, "mac_bar": abs(worst - bare), "seconds": compliance_seconds(fast, 1)}
    return {name: more[name] if name in more else float(errors[name][1]) for name in names}
