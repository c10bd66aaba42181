"""Data of the study: errors of solid teeth on pinion and ring against finite elements on random internal pairs."""

from __future__ import annotations

from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np

from gearbench.effects.teeth import require_bores
from gearbench.lazy import xr
from gearbench.scene import Scene
from gearbench.simulation import simulate
from gearbench.validation.judge import cycle_beside
from gearbench.validation.reference import fe_flanks, finest_level, reference_scene, solved_reference
from gearbench.validation.ste_error import OUTPUTS, cycle_errors, error_bars
from studies.report import kept
from studies.s05_tooth_models.data import ERRORS
from studies.s05_tooth_models.pairs import draw
from studies.s14_internal_pairs.pairs import internal, support_of

SEED, PAIRS = 31, 60
#: Accuracy of the finite elements.
ACCURACY = 0.01


def scene(i: int = 0) -> Scene:
    """Scene of pair number ``i``."""
    return next(islice(draw(internal, SEED), i, None))


def compute(*, quick: bool = False, folder: Path | None = None) -> xr.Dataset:
    """Compute errors [%] with error bars on every pair; finished pairs are kept in ``folder``."""
    scenes = list(islice(draw(internal, SEED), 1 if quick else PAIRS))
    found = [kept(folder and folder / f"{i:02d}.nc", partial(pair_errors, each)) for i, each in enumerate(scenes)]
    return xr.concat(found, "design").assign(number=("design", np.arange(len(found))))


def pair_errors(scene: Scene) -> xr.Dataset:
    """Compute errors [%] of the cycle of a pair against finite elements, their error bars, and data of the pair."""
    own, reference = simulate(scene, outputs=OUTPUTS), reference_scene(scene, ACCURACY)
    exact, again = (cycle_beside(own, kind(reference), reference) for kind in (solved_reference, finest_level))
    errors = cycle_errors(own, exact)
    errors |= error_bars(errors, cycle_errors(own, again))
    pair = scene.pair
    rim = (pair.gears[1].root_radius - require_bores(pair)[1] / 2) / pair.normal_module
    numbers = {
        "rim": rim,
        "reference_error": max(flank.error for flank in fe_flanks(reference)),
        **{name: float(np.asarray(errors[name][1])) for error in ERRORS for name in (error, f"{error}_bar")},
    }
    return xr.Dataset({"scene": scene.to_toml(), "support": support_of(scene), **numbers})
