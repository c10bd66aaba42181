"""What the design bench answers: the scene that its controls describe, solved coarsely, finely, then over torque."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gearbench.contact.off_line import advice
from gearbench.errors import GearbenchError, InputError
from gearbench.explore.bench.form import takes_files
from gearbench.explore.gear_data import ORDERS, Tables, densities, tables
from gearbench.explore.model import Picture, outline, scattered
from gearbench.explore.page import answer_data
from gearbench.results.solved import Solved
from gearbench.results.warnings import warnings as scene_warnings
from gearbench.scene import Resolution, Scene
from gearbench.scene_file import TABLES, table_class
from gearbench.schema import as_table, make, read
from gearbench.sweeps.run import sweep

#: Quick look while a slider moves.
COARSE = Resolution(positions=16, segments=10)
#: Torques of the Harris map over that of the scene.
TORQUES = tuple(np.round(np.linspace(0.2, 1.6, 8), 3))
#: Resolution of the Harris map.
_MAP = Resolution(positions=32, segments=10)


def changed(base: Scene, given: Mapping[str, Any]) -> Scene:
    """The scene of the tables of a page. Coast flanks, system and tables that name files stay those of ``base``.

    Raises
    ------
    InputError
        Naming key, value and the values allowed.
    """
    found = {name: read(kind, given[name], name) for name, kind in TABLES.items() if name in given}
    effects = []
    for name, table in as_table("effects", given.get("effects", {})).items():
        kind = table_class(f"effects.{name}")
        own = base.effect(name)
        if takes_files(kind) and own is None:
            raise InputError(f"effects.{name}", "given", "names files: write it into the scene file")
        effects.append(own if takes_files(kind) else read(kind, table, f"effects.{name}"))
    name = str(given.get("name", base.name))
    fixed = {key: getattr(base, key) for key in ("coast", "system", "further")}
    return make(Scene, name=name, **found, effects=tuple(effects), **fixed)


def answers(base: Scene, asked: Any) -> Iterator[dict[str, Any]]:
    """Answers to the tables of a scene: coarse, as fine as the scene, scatter, over torque; or the fault in them."""
    try:
        scene = changed(base, json.loads(asked["scene"][0]))
        yield from _solved(scene)
    except (InputError, GearbenchError, ArithmeticError) as error:
        yield answer_data(message=str(error))
    except (AttributeError, IndexError, KeyError, TypeError, ValueError):
        yield answer_data(message="this is no question of the page")


def _solved(scene: Scene) -> Iterator[dict[str, Any]]:
    quick, _ = outline(replace(scene, resolution=COARSE))
    yield answer_data(tables(replace(quick, scene=scene), teeth=False))
    now, solved = outline(scene)
    yield answer_data(tables(now))
    yield answer_data({"warnings": {"text": warnings(now, solved)}})
    if now.unfinished:
        now = scattered(now, solved)
        yield answer_data(densities(now))
    yield answer_data(over_torque(scene))


def warnings(now: Picture, solved: Solved) -> list[str]:
    """What a reader of the curves should know, a line each."""
    import xarray as xr

    cycle = now.transmission_error
    known = {"transmission_error_mean": cycle.mean, "transmission_error_rms": cycle.rms}
    known |= {"transmission_error_peak_to_peak": cycle.peak_to_peak, "flank_pressure_max": np.nanmax(now.pressure)}
    dataset = xr.Dataset(known)
    found = list(scene_warnings(now.scene, dataset))
    if (missed := advice(now.scene, dataset)) is not None:
        found.append(missed)
    parted = int((~(solved.solution.force > 0).any(axis=(-2, -1))).sum())
    if parted:
        found.append(f"Contact is lost at {parted} mesh phases.")
    return found


#: Tables over torque of a scene that is not swept yet.
NOT_SWEPT: Tables = {
    "harris": {"xs": [], "ys": [], "torque": []},
    "torque": {"torque": [], "peak_to_peak": [], **{f"order {n}": [] for n in ORDERS}},
}


def over_torque(scene: Scene) -> Tables:
    """Harris map, and orders and peak-to-peak STE over torque; of the scene's own load case."""
    names = ("transmission_error", "transmission_error_amplitude", "transmission_error_peak_to_peak")
    asked = [float(f"{ratio * scene.load.torque:.4g}") for ratio in TORQUES]
    found = sweep(replace(scene, resolution=_MAP), {"torque": asked}, outputs=names)
    torque = found["torque"].values.tolist()  # ascending, also below 0
    phase, values = found["mesh_phase"].values, found["transmission_error"].transpose("torque", ...).values
    phase = phase if phase.ndim == 2 else np.broadcast_to(phase, values.shape)
    lines = [_two_periods(x, y - y.mean()) for x, y in zip(phase, values, strict=True)]
    amplitude = found["transmission_error_amplitude"].transpose("harmonic", "torque").values
    over = {f"order {n}": amplitude[n - 1] for n in ORDERS}
    return {
        "harris": {
            "xs": [x for x, _ in lines],
            "ys": [y for _, y in lines],
            "torque": torque,
        },
        "torque": {
            "torque": torque,
            "peak_to_peak": found["transmission_error_peak_to_peak"].values.astype("float32"),
            **{name: values.astype("float32") for name, values in over.items()},
        },
    }


def _two_periods(phase: np.ndarray, values: np.ndarray) -> tuple[list[float], list[float]]:
    order = np.argsort(phase)
    x, y = phase[order], values[order]
    return [*x, *(x + 1), x[0] + 2], [*y, *y, y[0]]
