"""Data of the study: the paper's pairs with every tooth model, and finite elements held at several depths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gearbench.effects.gear_body import GearBody
from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.lazy import xr
from gearbench.library.garambois2017 import case
from gearbench.scene import Scene
from gearbench.simulation import simulate
from gearbench.validation.comparison import validate

ERRORS = {
    "mean STE": "transmission_error_mean_error",
    "p-p STE": "transmission_error_peak_to_peak_error",
    "mean k": "mesh_stiffness_mean_error",
    "p-p k": "mesh_stiffness_peak_to_peak_error",
}
#: Depths below the root circle at which the finite elements are clamped [normal modules].
DEPTHS = (0.0, 0.5, 1.0, 2.0)
PAPER, SOLID, FINE = "plate paper", "solid 4 5 5", "solid 5 8 12"


def cases(*, quick: bool = False) -> dict[str, Scene]:
    """Validation pairs by name.

    The paper does not give the profile shifts of case 2. Two variants are used: equal shifts, which undercut the
    pinion, and no shift on the pinion.
    """
    if quick:
        return {"1": case(1)}
    pair = case(2).pair
    total = sum(gear.profile_shift for gear in pair.gears)
    members = {name: replace(getattr(pair, name), profile_shift=x) for name, x in (("pinion", 0.0), ("wheel", total))}
    return {"1": case(1), "2": case(2), "2, x1 = 0": replace(case(2), pair=replace(pair, **members))}


def models(*, quick: bool = False) -> dict[str, ToothBending]:
    """Fast models by name: the paper's plate, variants of its conventions, and solids."""
    found = {
        PAPER: ToothBending(basis="paper"),
        SOLID: ToothBending(model="solid", order=(4, 5, 5)),
        FINE: ToothBending(model="solid", order=(5, 8, 12)),
    }
    if quick:
        return found
    for basis, order in (("paper", None), ("3 3", (3, 3)), ("5 5", (5, 5))):
        for fillet in (False, True):
            for load in ("full", "component"):
                name = f"plate {basis}{' fillet' * fillet}{' component' * (load == 'component')}"
                plate = ToothBending(basis="paper" if order is None else None, order=order, fillet=fillet, load=load)
                found.setdefault(name, plate)
    return found | {"solid 4 5 10": ToothBending(model="solid", order=(4, 5, 10))}


def scene(number: str = "1", tooth: str = PAPER) -> Scene:
    """Scene of one of the pairs with one of the models."""
    effects = (models()[tooth], Hertz(law="weber_banaschek"))
    return replace(cases()[number], name=f"case {number}, {tooth}", effects=effects)


def on_body(scene: Scene, depth: float) -> Scene:
    """Replace the teeth by finite elements that are held ``depth`` modules below the root circle (0: at the root)."""
    law = Hertz(law="weber_banaschek")
    if depth == 0:
        return replace(scene, effects=(ToothBending(model="finite_elements"), law))
    pair, below = scene.pair, depth * scene.pair.normal_module
    bores = [2 * (gear.root_radius - below) for gear in pair.gears]
    pinion, wheel = replace(pair.pinion, bore_diameter=bores[0]), replace(pair.wheel, bore_diameter=bores[1])
    effects = (ToothBending(model="finite_elements", accuracy=0.02), GearBody(), law)
    return replace(scene, pair=replace(pair, pinion=pinion, wheel=wheel), effects=effects)


def body_errors(scene: Scene, depths: tuple[float, ...]) -> np.ndarray:
    """Errors of the paper's plate against finite elements held at ``depths`` below the root, (depth, error) [%]."""
    names = [name.removesuffix("_error") for name in ERRORS.values()]
    plate = simulate(scene, outputs=names)
    found = [simulate(on_body(scene, depth), outputs=names) for depth in depths]
    return np.array([[100 * float(plate[name] / each[name] - 1) for name in names] for each in found])


def compute(*, quick: bool = False) -> xr.Dataset:
    """Compare every model on every pair (quick: on case 1) with finite elements."""
    wanted = [(number, tooth) for number in cases(quick=quick) for tooth in models(quick=quick)]
    dataset = validate([scene(*each) for each in wanted])
    labels = {"case": [number for number, _ in wanted], "tooth": [tooth for _, tooth in wanted]}
    dataset = dataset.assign_coords({name: ("scene", values) for name, values in labels.items()})
    depths = DEPTHS[:1] if quick else DEPTHS
    pairs = {number: pair for number, pair in cases(quick=quick).items() if number in ("1", "2")}
    of_body = np.array([body_errors(pair, depths) for pair in pairs.values()])
    body = (("pair_name", "depth", "quantity"), of_body, {"units": "%", "long_name": "error of the paper's plate"})
    return dataset.assign(body_error=body).assign_coords(
        pair_name=list(pairs), quantity=list(ERRORS), depth=("depth", list(depths), {"units": "modules"})
    )
