"""Data of the study: random gear pairs, and errors of every tooth model against finite elements on them."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import islice

import numpy as np
from pydantic import ValidationError

from fem_reference.refinement import AccuracyError
from gearbench.effects.base import Effect
from gearbench.effects.gear_body import GearBody
from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.lazy import xr
from gearbench.scene import Scene
from gearbench.simulation import simulate
from gearbench.validation.comparison import compliance_seconds
from gearbench.validation.mac import compare_shapes
from gearbench.validation.reference import fe_flanks, reference_scene
from gearbench.validation.ste_error import OUTPUTS, cycle_errors
from studies.s05_tooth_models.pairs import draw, everyday

SEED, PAIRS = 2017, 48
#: Accuracy of the finite elements, for a clamped tooth and for a sector of teeth on its body.
ACCURACY = {"clamped": 0.005, "rim": 0.01}
COARSE, FINE = (4, 5, 5), (8, 12, 12)
#: Support of the finite elements → tooth models compared with them; "solid" has its default order.
MODELS: dict[str, dict[str, tuple[Effect, ...]]] = {
    "clamped": {
        "plate, paper": (ToothBending(basis="paper"),),
        "plate (5, 5), fillet": (ToothBending(order=(5, 5), fillet=True, load="component"),),
        "solid (4, 5, 5)": (ToothBending(model="solid", order=COARSE),),
        "solid": (ToothBending(model="solid"),),
        "solid (8, 12, 12)": (ToothBending(model="solid", order=FINE),),
    },
    "rim": {
        "plate, paper": (ToothBending(basis="paper"),),
        "plate + Sainsot–Velex": (ToothBending(basis="paper"), GearBody(model="sainsot_velex")),
        "solid + Sainsot–Velex": (ToothBending(model="solid"), GearBody(model="sainsot_velex")),
        "solid + ring, uncoupled": (ToothBending(model="solid"), GearBody(coupled=False)),
        "solid + ring (4, 5, 5)": (ToothBending(model="solid", order=COARSE), GearBody()),
        "solid + ring": (ToothBending(model="solid"), GearBody()),
        "solid + ring (8, 12, 12)": (ToothBending(model="solid", order=FINE), GearBody()),
    },
}
ERRORS = tuple(
    f"{name}_{part}_error" for name in ("transmission_error", "mesh_stiffness") for part in ("mean", "peak_to_peak")
)


def scene(i: int = 0) -> Scene:
    """Scene of the random pair number ``i``."""
    return next(islice(draw(everyday, SEED), i, None))


def compute(*, quick: bool = False) -> xr.Dataset:
    """Compute errors [%], worst MAC and times of every model on every pair; NaN if a model refuses a pair."""
    scenes = list(islice(draw(everyday, SEED), 2 if quick else PAIRS))
    data: dict[str, tuple] = {"scene": (("design",), [scene.to_toml() for scene in scenes])}
    for support, models in MODELS.items():
        found = [_pair_errors(scene, support, models, ACCURACY[support] * (4 if quick else 1)) for scene in scenes]
        for name in found[0]:
            dims = ("design",) if found[0][name].ndim == 0 else ("design", f"{support}_model")
            data[f"{support}_{name}"] = (dims, np.array([each[name] for each in found]))
    return xr.Dataset(data, coords={f"{support}_model": list(models) for support, models in MODELS.items()})


def _pair_errors(
    scene: Scene, support: str, models: dict[str, tuple[Effect, ...]], accuracy: float
) -> dict[str, np.ndarray]:
    on_body = (GearBody(),) if support == "rim" else ()
    solid = replace(scene, effects=(ToothBending(model="solid"), *on_body, Hertz()))
    try:
        reference = reference_scene(solid, accuracy)
        exact = simulate(reference, outputs=OUTPUTS)
    except AccuracyError:  # for very wide gears, the finest mesh that fits into 1.5 GB is slightly too coarse
        reference = reference_scene(solid, 1.5 * accuracy)
        exact = simulate(reference, outputs=OUTPUTS)
    found: dict[str, list[float]] = {name: [] for name in (*ERRORS, "mac", "seconds")}
    for effects in models.values():
        try:
            fast = replace(scene, effects=(*effects, Hertz()))
        except ValidationError:  # the pair is outside the range of Sainsot–Velex
            for column in found.values():
                column.append(math.nan)
            continue
        errors = cycle_errors(simulate(fast, outputs=OUTPUTS), exact)
        for name in ERRORS:
            found[name].append(float(errors[name][1]))
        found["mac"].append(min(float(compare_shapes(fast, reference, index).mac.min()) for index in (0, 1)))
        found["seconds"].append(compliance_seconds(fast, 3))
    flanks = fe_flanks(reference)
    return {name: np.array(column) for name, column in found.items()} | {
        "reference_seconds": np.array(sum(flank.attrs["seconds"] for flank in flanks)),
        "reference_error": np.array(max(flank.error for flank in flanks)),
    }
