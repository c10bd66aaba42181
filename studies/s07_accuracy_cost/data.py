"""Data of the study: work–precision of scenes, Pareto front of all models, requested accuracies, scaling."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from gearbench.accuracy.measure import MEASURED, relative_errors
from gearbench.accuracy.settings import SOLID_ORDER, label, with_resolution
from gearbench.effects.base import Effect
from gearbench.effects.tooth_bending import ToothBending
from gearbench.effort.curves import run
from gearbench.effort.workprecision import cost
from gearbench.lazy import xr
from gearbench.library.garambois2017 import case, gear
from gearbench.scene import Scene
from gearbench.validation.reference import fe_flanks
from studies.report import kept
from studies.s07_accuracy_cost.gears import gear_cost, gears
from studies.s07_accuracy_cost.promises import (
    FIRST_DRAW,
    ROBUST_SEED,
    SEED,
    SOLID_SEED,
    promises,
    random_scenes,
    robust_promise,
    solid_promise,
)
from studies.s07_accuracy_cost.scaling import scaling

SOLID = ToothBending(model="solid")
MESHED_TOOTH = ToothBending(model="finite_elements")
#: Accuracies requested on the random scenes; the next line has seed and number of the scenes by kind.
ACCURACIES, SOLID_ACCURACY, ROBUST_ACCURACY = (0.03, 0.01), 0.03, 0.02
PROMISES = {"promise": (SEED, 60), "solid": (SOLID_SEED, 12), "robust": (ROBUST_SEED, 40)}
#: Accuracies of the finite elements in the front, and of the reference of the fast models.
FE_LEVELS, FE_REFERENCE = (0.1, 0.05, 0.02, 0.01), 0.003
#: Scene of the quick size.
QUICK = "case 2"
PLATES: dict[str, ToothBending] = {
    "plate, paper": ToothBending(basis="paper"),
    "plate (3, 3)": ToothBending(order=(3, 3), fillet=True, load="component"),
    "plate (5, 5)": ToothBending(order=(5, 5), fillet=True, load="component"),
    "plate (10, 10)": ToothBending(order=(10, 10), fillet=True, load="component"),
}
RESOLUTIONS = ((4, 2), (8, 3), (15, 8), (32, 12))


def with_teeth(scene: Scene, teeth: Effect) -> Scene:
    """Return ``scene`` with other teeth instead of its plate."""
    return replace(scene, effects=tuple(teeth if e.name == "tooth_bending" else e for e in scene.effects))


def scenes() -> dict[str, Scene]:
    """Scenes of the diagrams: the paper's, with solid teeth, with random errors, and gears in use."""
    plain = {"SC": gear("SC").scene(), "case 1": case(1), "case 2": case(2)}
    cases = [(name, plain[name]) for name in ("case 1", "case 2")]
    solid = {f"{name}, solid": with_teeth(scene, SOLID) for name, scene in cases}
    return {**plain, **solid, "gear 55, errors": gear("55").scene(errors=True), **gears()}


def scene(name: str = "case 1") -> Scene:
    """Scene of a work–precision diagram, by name."""
    return scenes()[name]


def compute(*, quick: bool = False, folder: Path | None = None) -> xr.Dataset:
    """Compute work–precision of the scenes, front of all models, promises on random scenes, and scaling.

    Finished parts are kept in ``folder``, from which an interrupted run continues; the quick size keeps nothing.
    """
    return join([kept(None if quick or folder is None else folder / f"{n}.nc", part) for n, part in _parts(quick)])


def _parts(quick: bool) -> Iterator[tuple[str, Callable[[], xr.Dataset]]]:
    """Yield the names of the parts, with functions that compute them."""
    repeats = 1 if quick else 7
    for name, scene in scenes().items():
        if not quick or name == QUICK:
            yield f"diagram {name}", partial(_diagram, name, scene, repeats)
    yield "scaling", partial(_scaling, repeats)
    for kind in PROMISES:
        yield kind, partial(_promised, kind, quick)
    if not quick:
        yield "front", _fronts


def join(parts: list[xr.Dataset]) -> xr.Dataset:
    """Join all parts into one Dataset; the diagrams of the scenes follow one another."""
    joined = {}
    for dim in ("setting", "curve"):
        split = [p.drop_dims("curve" if dim == "setting" else "setting") for p in parts if dim in p.dims]
        joined[dim] = xr.concat([s.drop_attrs() for s in split], dim)
    others = [p for p in parts if "setting" not in p.dims]
    return xr.merge([*joined.values(), *others], combine_attrs="drop", compat="override", join="outer")


def _diagram(name: str, scene: Scene, repeats: int) -> xr.Dataset:
    """Compute the work–precision of a scene, with its settings along ``curve``."""
    found = gear_cost(scene) if name in gears() else cost(scene, repeats=repeats, seeds=3 if repeats == 1 else 12)
    found = found.rename_dims(knob="curve").reset_index("knob").rename(knob="curve_knob")
    named = {d: (d, np.full(found.sizes[d], name)) for d in ("setting", "curve")}
    return found.assign_coords({f"{d}_scene": v for d, v in named.items()})


def _front(name: str, scene: Scene) -> xr.Dataset:
    """Measure every tooth model at several resolutions: error against finite elements, and time for a new pair."""
    fine = partial(with_resolution, segments=64, gauss_points=12)
    reference = with_teeth(scene, replace(MESHED_TOOTH, accuracy=FE_REFERENCE))
    exact, _ = run(fine(reference), 1)
    bar = max(flank.error for flank in fe_flanks(reference))
    solid = with_teeth(scene, SOLID)
    teeth: dict[str, tuple[str, Effect]] = {key: ("plate", plate) for key, plate in PLATES.items()}
    for order in SOLID_ORDER.levels(solid):
        teeth[f"solid {label(order)}"] = ("solid", replace(SOLID, order=order))
    for level in FE_LEVELS:
        teeth[f"finite elements {100 * level:g} %"] = ("finite elements", replace(MESHED_TOOTH, accuracy=level))
    rows = []
    for key, (family, effect) in teeth.items():
        for n, g in RESOLUTIONS[-1:] if family == "finite elements" else RESOLUTIONS:
            turned = with_resolution(with_teeth(scene, effect), segments=n, gauss_points=g)
            four, cost = run(turned, 3, prepares=True)
            numbers = (cost.processor_seconds, cost.megabytes, g, bar)
            rows.append((relative_errors(four, exact), *numbers, key, family, name))
    error, *columns = zip(*rows, strict=True)
    names = ("seconds", "megabytes", "points", "bar", "label", "family", "scene")
    flat = {f"model_{key}": ("model", np.array(values)) for key, values in zip(names, columns, strict=True)}
    found = xr.Dataset({"model_error": (("model", "quantity"), np.array(error)), **flat}, {"quantity": list(MEASURED)})
    return found.set_coords(["model_label", "model_family", "model_scene"])


def _scaling(repeats: int) -> xr.Dataset:
    """Measure the scaling, with the names of its variables in the Dataset of the study."""
    names = {"seconds": "run_seconds", "processor_seconds": "run_processor", "size": "run_size"}
    return scaling(repeats, quick=repeats == 1).rename(names)


def _fronts() -> xr.Dataset:
    """Compute the fronts of both cases, one after the other."""
    return xr.concat([_front(f"case {k}", case(k)) for k in (1, 2)], "model")


def _promised(kind: str, quick: bool) -> xr.Dataset:
    """Choose settings for requested accuracies on random scenes; the dimension is named after the ``kind``."""
    seed, count = PROMISES[kind]
    drawn = random_scenes(1 if quick else count, seed=seed)
    if kind == "promise":
        return as_table(kind, [row for scene in drawn for row in promises(scene, ACCURACIES)])
    if kind == "solid":
        return as_table(kind, [solid_promise(scene, SOLID_ACCURACY) for scene in drawn])
    samples = 512 if quick else 8192
    rows = [robust_promise(scene, ROBUST_ACCURACY, FIRST_DRAW + i, samples) for i, scene in enumerate(drawn)]
    return as_table(kind, rows)


def as_table(kind: str, rows: list[dict[str, float]]) -> xr.Dataset:
    """Make a Dataset of rows of numbers along the dimension ``kind``."""
    return xr.Dataset({f"{kind}_{name}": (kind, np.array([row[name] for row in rows])) for name in rows[0]})
