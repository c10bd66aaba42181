"""Answers of the design bench: solve the scene of its controls coarsely, then at its resolution, then over torque."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from gearbench.effects.base import ComplianceEffect
from gearbench.effects.registry import effect_class, effect_names
from gearbench.effects.tooth_bending import ToothBending
from gearbench.errors import InputError
from gearbench.explore.bench.form import takes_files
from gearbench.explore.gear_data import ORDERS, Tables, densities, tables
from gearbench.explore.model import with_scatter, without_scatter
from gearbench.explore.page import answer_data, explained
from gearbench.keys import value_at
from gearbench.lazy import xr
from gearbench.results import flank
from gearbench.results.solved import Solved
from gearbench.results.warnings import warnings as scene_warnings
from gearbench.scene import Resolution, Scene
from gearbench.scene_file import TABLES, parse_scene, scene_at, table_class
from gearbench.schema import as_table, make, read
from gearbench.sweeps.run import sweep
from gearbench.trains.solve import SolvedTrain

#: Resolution of the first, quick answer while a slider moves.
COARSE = Resolution(positions=16, segments=8)
#: ``order`` of solid teeth in the quick answer if their compliance is not known yet: it takes a fifth of the time of
#: the default order, and changes the mean STE by at most 3 %.
QUICK_ORDER = (4, 5, 6)
#: Message for an effect whose table names files.
NAMES_FILES = "refers to files, so it can be given in the scene file only"
#: Torques of the Harris map relative to the torque of the scene.
TORQUES = tuple(np.round(np.linspace(0.2, 1.6, 8), 3))
#: Resolution of the curves over torque.
_OVER_TORQUE = Resolution(positions=32, segments=10)


def changed(base: Scene, given: Mapping[str, Any]) -> Scene:
    """Read a scene from the tables of a page; coast flanks, system and effects with files stay those of ``base``.

    For a pair, the given tables of effects with files are ignored. For a train, they must equal the tables of ``base``.

    Raises
    ------
    InputError
        If the tables are not valid; the error names key, value and the allowed values.
    """
    if base.train is not None:
        base_tables = base.to_mapping()
        _refuse_files(base_tables, given, "")
        return parse_scene({**given, **{key: base_tables[key] for key in ("coast", "system") if key in base_tables}})
    scene_tables = {name: _read(name, json.dumps(given[name])) for name in TABLES if name in given}
    effects = []
    for name, table in as_table("effects", given.get("effects", {})).items():
        kind = table_class(f"effects.{name}")
        effect_of_base = base.effect(name)
        if takes_files(kind) and effect_of_base is None:
            raise InputError(f"effects.{name}", "given", NAMES_FILES)
        effects.append(effect_of_base if takes_files(kind) else read(kind, table, f"effects.{name}"))
    name = str(given.get("name", base.name))
    fixed = {key: getattr(base, key) for key in ("coast", "system", "further")}
    return make(Scene, name=name, **scene_tables, effects=tuple(effects), **fixed)


def _refuse_files(known: Mapping[str, Any], given: Mapping[str, Any], path: str) -> None:
    """Refuse tables of effects that refer to files, unless they are those of the tables ``known``."""
    for name, table in given.items():
        dotted = f"{path}.{name}".strip(".")
        if name in effect_names() and takes_files(effect_class(name)) and table != value_at(known, dotted):
            raise InputError(dotted, "given", NAMES_FILES)
        if isinstance(table, Mapping):
            _refuse_files(known, table, dotted)


@lru_cache(maxsize=16)
def _read(name: str, text: str) -> Any:
    """Read a table other than an effect; cached, so that tables that a slider does not change keep computed values."""
    return read(TABLES[name], json.loads(text), name)


class Overtaken(Exception):
    """Signal that a newer question waits."""


class Answers:
    """Answers to the questions of an open page.

    The object keeps the inputs of the last tooth compliance that was computed with the scene's own order. If a question
    has the same inputs, its quick answer needs no lower order.

    Parameters
    ----------
    base
        The first scene, already solved.
    """

    def __init__(self, base: Scene) -> None:
        self._base, self._known = base, _compliance_inputs(base)

    def __call__(self, asked: Any, overtaken: Callable[[], bool] = lambda: False) -> Iterator[dict[str, Any]]:
        """Yield answers for a scene: coarse, at its resolution, warnings, scatter, over torque; or an error message.

        ``asked`` holds the columns of the source ``question``: ``scene`` is a list with one scene as JSON text.

        Scatter and torques take longest; they are abandoned once ``overtaken`` says that a newer question waits.
        """

        def progress(_done: int, _of: int) -> None:
            if overtaken():
                raise Overtaken

        with suppress(Overtaken):
            yield from explained(self._solved(asked, progress))

    def _solved(self, asked: Any, progress: Callable[[int, int], None]) -> Iterator[dict[str, Any]]:
        """Yield the answers to ``asked``; ``progress`` raises to abandon one."""
        scene = changed(self._base, json.loads(asked["scene"][0]))
        quick_results, _ = without_scatter(self.sketch(scene))
        # the page shows the scene asked for, not the coarse one
        yield answer_data(tables(replace(quick_results, scene=scene), teeth=False))
        results, solved = without_scatter(scene)
        self._known = _compliance_inputs(scene)
        yield answer_data(tables(results))
        yield answer_data({"warnings": {"text": warnings(solved)}})
        if results.unfinished:
            yield answer_data(densities(with_scatter(results, solved, progress=progress)))
        yield answer_data(over_torque(scene, progress))

    def sketch(self, scene: Scene) -> Scene:
        """Reduce ``scene`` for the quick answer: few phases and segments, and a low order in new solid teeth."""
        bending = scene.effect("tooth_bending")
        quick = replace(scene, resolution=COARSE)
        if not isinstance(bending, ToothBending) or bending.model != "solid":
            return quick
        if _compliance_inputs(scene) == self._known:
            return quick
        if bending.order is not None and math.prod(bending.order) < math.prod(QUICK_ORDER):
            return quick
        return scene_at(quick, {"effects.tooth_bending.order": QUICK_ORDER})


def _compliance_inputs(scene: Scene) -> tuple[Any, ...]:
    """Inputs that determine the compliance of teeth and bodies, for comparison."""
    pairs = (scene.pair, *(mesh.pair for mesh in scene.further))
    effects = (effect for effect in scene.effects if isinstance(effect, ComplianceEffect))
    return pairs, scene.load.coast, *effects


def warnings(solved: Solved | SolvedTrain) -> list[str]:
    """Warnings to show with the curves, one line per warning."""
    meshes, lines = solved.meshes if isinstance(solved, SolvedTrain) else {"": solved}, []
    for name, mesh in meshes.items():
        loaded = (mesh.solution.force > 0).any(axis=(-2, -1))
        if separated := int((~loaded).sum()):
            lines.append(f"Contact is lost at {separated} of {loaded.size} mesh phases{f' of {name}' if name else ''}.")
    # Meshes of equal pairs would have the same warnings: show those of the most loaded one. It comes last, and a
    # dictionary keeps the last value of a key.
    by_load = sorted(meshes.values(), key=lambda mesh: mesh.solution.force.max())
    for mesh in {mesh.scene.pair: mesh for mesh in by_load}.values():
        greatest = xr.Dataset({"flank_pressure_max": np.nanmax(flank.pressure(mesh))})
        lines += scene_warnings(mesh.scene, greatest)
    return list(dict.fromkeys(lines))


#: Outputs of a pair that the curves over torque need; those of a train are in every Dataset.
_SWEPT = ("transmission_error", "transmission_error_amplitude", "transmission_error_peak_to_peak")
#: Empty tables over torque, for a scene that is not swept yet.
NOT_SWEPT: Tables = {
    "harris": {"xs": [], "ys": [], "torque": []},
    "torque": {"torque": [], "peak_to_peak": [], **{f"order {n}": [] for n in ORDERS}},
}


def over_torque(scene: Scene, progress: Callable[[int, int], None] = lambda _done, _of: None) -> Tables:
    """Tables of the Harris map, and of orders and peak-to-peak STE, over ``TORQUES`` times the torque of the scene.

    After every torque, ``progress`` is called with the numbers of torques done and in total. It may raise to abort.
    """
    curve, outputs = ("train_transmission_error", ()) if scene.coupled else ("transmission_error", _SWEPT)
    torques = [float(f"{ratio * scene.load.torque:.4g}") for ratio in TORQUES]
    swept = sweep(replace(scene, resolution=_OVER_TORQUE), {"torque": torques}, outputs=outputs, progress=progress)
    torque = swept["torque"].values.tolist()  # ``sweep`` sorts them: negative torques come in reverse
    phase, values = swept["mesh_phase"].values, swept[curve].transpose("torque", ...).values
    phase = phase if phase.ndim == 2 else np.broadcast_to(phase, values.shape)
    lines = [_two_periods(x, y - y.mean()) for x, y in zip(phase, values, strict=True)]
    amplitude = swept[f"{curve}_amplitude"].transpose("torque", ...)
    amplitudes = {f"order {n}": amplitude.sel(harmonic=n).values for n in ORDERS}
    return {
        "harris": {
            "xs": [x for x, _ in lines],
            "ys": [y for _, y in lines],
            "torque": torque,
        },
        "torque": {
            "torque": torque,
            "peak_to_peak": swept[f"{curve}_peak_to_peak"].values.astype("float32"),
            **{name: values.astype("float32") for name, values in amplitudes.items()},
        },
    }


def _two_periods(phase: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sort a cycle by phase, and show it twice if it is one mesh period long: phases and values, (point,) each."""
    order = np.argsort(phase)
    x, y = phase[order], values[order]
    if x[-1] >= 1:  # a cycle of several mesh periods, shown once
        return x, y
    return np.concatenate([x, x + 1, [x[0] + 2]]), np.concatenate([y, y, y[:1]])
