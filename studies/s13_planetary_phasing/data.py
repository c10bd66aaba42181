"""Data of the study: planetary sets, and their responses without errors and over error samples."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.lazy import xr
from gearbench.results.responses import response
from gearbench.robustness.montecarlo import respond
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene
from gearbench.trains.scatter import sampled_train

#: Arrangement of four planets → teeth of sun and planet; the ring has z_s + 2 z_p teeth.
ARRANGEMENTS = {"in phase": (24, 30), "sequential": (25, 31), "counter phase": (26, 32)}
SUNS = ("floating", "held")
#: Number of planets → teeth of sun and planet of the sets for K_γ; all planets are in phase.
LOADED = {3: (24, 30), 4: (24, 30), 5: (25, 30)}
#: Radial stiffness of the sun in the sets for K_γ [N/µm]; 0 for a floating sun.
SUPPORTS = (0.0, 20.0)
CLASSES = (4, 5, 6, 7, 8)
#: Torque on the sun per planet [N·m].
TORQUE = 50.0
#: Errors of class 6 [µm]: limits ± for pins and thickness, and from 0 for run-outs (ISO 1328-2; pins about IT 6).
CLASS_6 = {
    "pin_tangential": 12.0,
    "pin_radial": 12.0,
    "planet_thickness": 6.0,
    "sun_run_out": 20.0,
    "planet_run_out": 16.0,
    "ring_run_out": 30.0,
    "carrier_run_out": 20.0,
}
#: Ratio of the tolerances of neighbouring classes, ISO 1328.
STEP = 2**0.5
HARMONICS = 5
#: Curves of which RMS and harmonics are computed; the next line lists all responses.
CURVES = ("train_transmission_error", "carrier_torque", "sun_force", "sun_motion")
RESPONSES = (
    "mesh_load_factor",
    *(f"{name}_rms" for name in CURVES),
    *(f"{name}_amplitude_{n}" for name in CURVES for n in range(1, HARMONICS + 1)),
)
#: Statistics over the error samples.
STATISTICS = {"mean": np.mean, "q95": lambda x: np.quantile(x, 0.95), "q99": lambda x: np.quantile(x, 0.99)}


def scene(
    teeth: tuple[int, int] = ARRANGEMENTS["in phase"],
    *,
    planets: int = 4,
    sun: Mapping[str, Any] | None = None,
    iso_class: int = 6,
    flanks: bool = True,
    positions: int = 24,
) -> Scene:
    """Make a helical set of module 1.75 on elastic bodies and pins; ``sun`` sets its support (floating by default)."""
    z_s, z_p = teeth
    wider = STEP ** (iso_class - 6)
    own = {
        "normal_module": 1.75,
        "helix_angle": 20.0,
        "face_width": 24.0,
        "planets": planets,
        "pin_stiffness": 400.0,
        "sun": {"teeth": z_s, "bore_diameter": 22.0},
        "planet": {"teeth": z_p, "bore_diameter": 26.0},
        "ring": {"addendum": 0.85, "outer_diameter": 200.0},
        "scatter": {name: wider * f for name, f in CLASS_6.items()},
        **({"floating": ["sun"]} if sun is None else sun),
    }
    effects: dict[str, Any] = {
        "tooth_bending": {"model": "solid"},
        "gear_body": {},
        "hertz": {},
        "off_line_contact": {},
        "tip_relief": {"amount": 8.0, "length": 0.7},
        "crowning": {"amount": 4.0},
    }
    if flanks:
        both = {"distribution": "normal_two_sided"}
        effects["manufacturing_errors"] = {"iso_class": iso_class, "profile_slope": both, "helix_slope": both}
    return parse_scene(
        {
            "name": f"e-axle {z_s}/{z_p}/−{z_s + 2 * z_p}",
            "planetary": own,
            "load": {"torque": TORQUE * planets},
            "effects": effects,
            "resolution": {"positions": positions},
        }
    )


def answers(scene: Scene, names: tuple[str, ...], samples: int) -> NDArray:
    """Compute responses without errors, and their ``STATISTICS`` over the samples, (1 + statistic, response)."""
    train = sampled_train(scene)
    found, _ = respond(train, train.draw(samples, 0, "sobol"), names=names)
    rows = [[float(response(name).reduce(train.solved.cycle)) for name in names]]
    return np.array(rows + [[of(found[name]) for name in names] for of in STATISTICS.values()])


def compute(*, quick: bool = False) -> xr.Dataset:
    """Compute the responses of all arrangements, and K_γ over the tolerance classes."""
    samples, positions = (16, 12) if quick else (1024, 24)
    suns: dict[str, dict[str, Any] | None] = {"floating": None, "held": {}}
    phasing = [
        [answers(scene(teeth, sun=suns[sun], positions=positions), RESPONSES, samples) for sun in SUNS]
        for teeth in ARRANGEMENTS.values()
    ]
    factor = [
        [
            [_factor(planets, support, each, samples, positions) for each in (CLASSES[:1] if quick else CLASSES)]
            for support in SUPPORTS
        ]
        for planets in LOADED
    ]
    variables = {
        "value": (("arrangement", "sun", "statistic", "response"), phasing),
        "mesh_load_factor": (("planets", "support", "iso_class", "statistic"), factor),
    }
    coords = {
        "arrangement": list(ARRANGEMENTS),
        "sun": list(SUNS),
        "statistic": ["nominal", *STATISTICS],
        "response": list(RESPONSES),
        "planets": list(LOADED),
        "support": list(SUPPORTS),
        "iso_class": list(CLASSES[:1] if quick else CLASSES),
    }
    return xr.Dataset(variables, coords=coords).assign_attrs(quick=int(quick), samples=samples)


def _factor(planets: int, support: float, iso_class: int, samples: int, positions: int) -> NDArray:
    """Compute K_γ with errors of pins, thickness and run-outs of a class, (1 + statistic,)."""
    sun = {"sun_support": support} if support else None
    whole = scene(LOADED[planets], planets=planets, sun=sun, iso_class=iso_class, flanks=False, positions=positions)
    return answers(whole, ("mesh_load_factor",), samples)[:, 0]
