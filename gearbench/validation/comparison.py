"""Comparison of scenes with their finite element references: curves, errors and times in one Dataset."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from typing import Any, TypeVar

import numpy as np

from gearbench.compliance.flank import FlankCompliance
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.transitions import mesh_phases
from gearbench.effort.clock import timed, times, unseen
from gearbench.errors import GearbenchError, InputError, naming
from gearbench.lazy import xr
from gearbench.results.provenance import provenance, run_provenance
from gearbench.results.responses import described
from gearbench.scene import Scene
from gearbench.simulation import simulate
from gearbench.validation.dataset import CYCLE, stack
from gearbench.validation.judge import judge, require_reference
from gearbench.validation.mac import LOADS, flank_grid
from gearbench.validation.reference import fe_flanks, reference_scene, smooth_effects
from gearbench.validation.sets import distinct, members, meshes_of, set_cycle
from gearbench.validation.ste_error import CURVES, HARMONICS, OUTPUTS, shared_load

T = TypeVar("T")

#: Number of timed runs; the median counts.
REPEATS = 5
MODELS = ("fast", "reference")


def compare(scene: Scene, accuracy: float | None = None) -> xr.Dataset:
    """Compare a scene with its finite element reference.

    Parameters
    ----------
    accuracy
        Relative error of the reference's compliance. By default, the reference is refined until its error is at most a
        fifth of the differences that it must judge (``gearbench.validation.judge``).

    Returns
    -------
    Dataset with the dimensions ``model`` (fast, reference), ``position``, ``pair``, ``harmonic``, ``gear``,
    ``load_height``, ``load_face``; both scenes as TOML in the attributes. For a planetary set or parallel paths, curves
    are those of the set, on the base circle of the first gear, and ``mesh`` replaces ``pair``.

    Raises
    ------
    InputError
        If the scene has no reference, see ``reference_scene``.
    AccuracyError
        If no reference can be computed; says which accuracy is possible.
    """
    start = time.perf_counter()
    reference_scene(scene)  # raises before anything is computed
    fast_run, first_call = timed(lambda: set_cycle(scene) if scene.coupled else simulate(scene, outputs=OUTPUTS))
    judged = judge(scene, fast_run, accuracy)
    reference = judged.reference
    variables: dict[str, tuple] = {
        name: (("model", *fast_run[name].dims), np.array([fast_run[name].values, judged.cycle[name].values]))
        for name in (*CURVES, shared_load(fast_run))
    }
    meshes = meshes_of(scene)
    grids = [flank_grid(meshes[mesh].pair, index, LOADS) for _, mesh, index in members(meshes)]
    coords: dict[str, tuple] = {
        "model": ("model", list(MODELS)),
        "gear": ("gear", [name for name, _, _ in members(meshes)]),
        "harmonic": ("harmonic", np.arange(1, HARMONICS + 1)),
        **{name: (fast_run[name].dims, fast_run[name].values) for name in (*CYCLE, "mesh") if name in fast_run.coords},
    }
    variables |= judged.found | _reference(reference)
    variables |= _times(scene, reference) | {
        "load_radius": (("gear", "load_height"), np.array([grid.radius for grid in grids])),
        "load_position": (("load_face",), grids[0].y),
        "first_call_seconds": ((), first_call.seconds),
        "reference_settled": ((), int(judged.settled)),
    }
    attrs = provenance(scene, wall_time=time.perf_counter() - start) | _reference_attrs(reference)
    return xr.Dataset(described(variables), described(coords), attrs | {"reference_reason": judged.reason})


def _reference(reference: Scene) -> dict[str, tuple]:
    """Variables on the finite elements of the gears."""
    flanks = _flanks(reference)
    of_gear: dict[str, list[Any]] = {
        "reference_error": [flank.error for flank in flanks],
        "reference_unknowns": [flank.attrs["unknowns"] for flank in flanks],
        "reference_meshes": [flank.attrs["meshes"] for flank in flanks],
        "reference_seconds": [flank.attrs["seconds"] for flank in flanks],
        "reference_cached": [int(flank.attrs.get("cached", False)) for flank in flanks],
    }
    return {name: (("gear",), np.array(values)) for name, values in of_gear.items()}


def _flanks(reference: Scene) -> list[FlankCompliance]:
    """Flanks of the ``members`` on finite elements."""
    meshes = meshes_of(reference)
    return [fe_flanks(meshes[mesh])[index] for _, mesh, index in members(meshes)]


def _times(scene: Scene, reference: Scene) -> dict[str, tuple]:
    """Wall times of both models; those of the finite elements were measured when they were solved."""
    solved = {id(flank.attrs): flank.attrs["seconds"] for flank in _flanks(reference)}  # both flanks of a planet once
    compliance = [sum(map(compliance_seconds, distinct(meshes_of(scene)).values())), sum(solved.values())]
    simulation = [times(lambda s=s: simulate(s), REPEATS).seconds for s in (scene, reference)]
    return {
        "compliance_seconds": (("model",), np.array(compliance)),
        "simulation_seconds": (("model",), np.array(simulation)),
    }


def compliance_seconds(scene: Scene, repeats: int = REPEATS) -> float:
    """Wall time of the smooth compliance on the lines of all positions, for a pair that no cache knows [s]."""
    fresh = iter([unseen(scene, i + 1) for i in range(repeats)])
    return times(lambda: smooth_compliance(next(fresh)), repeats).seconds


def smooth_compliance(scene: Scene) -> None:
    """Compute the smooth compliances of ``scene`` on all its contact lines."""
    lines = scene_lines(scene, mesh_phases(scene)[0])
    for effect in smooth_effects(scene):
        effect.compliance(lines, scene.effects_by_name)


def _reference_attrs(reference: Scene) -> dict[str, str]:
    attrs = _flanks(reference)[0].attrs
    return {
        "reference_scene": reference.to_toml(),
        "reference_solver": str(attrs["solver"]),
        "reference_element": str(attrs["element"]),
        "reference_versions": ", ".join(_installed("scipy", "pypardiso")),
    }


def _installed(*packages: str) -> list[str]:
    """Names and versions of the packages that are installed."""
    found = []
    for package in packages:
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            continue
    return found


def validate(
    scenes: Sequence[Scene], accuracy: float | None = None, progress: Callable[[str], object] = lambda _: None
) -> xr.Dataset:
    """Compare several scenes with their references; the Dataset has the dimension ``scene``.

    Before every scene, ``progress`` is called with its name and the number of unknowns of its finite elements.

    Raises
    ------
    InputError
        As ``compare``, before anything is computed; also for a set beside other scenes.
    GearbenchError
        If the reference of a scene cannot be computed; names the scene, and says what to do.
    """
    start = time.perf_counter()
    named = list(zip(labels(scenes), scenes, strict=True))
    for name, scene in named:
        check(scene, name)
        if scene.coupled and len(named) > 1:
            raise InputError(
                "scenes", f"{len(named)} scenes", "a planetary set is compared alone: give one scene", name
            )
    sizes = [_of(name, partial(require_reference, scene, accuracy)) for name, scene in named]
    comparisons = []
    for (name, scene), size in zip(named, sizes, strict=True):
        progress(f"{name}: finite elements of {size} unknowns" if size else name)
        comparisons.append(_of(name, partial(compare, scene, accuracy)))
    return stack(comparisons, labels(scenes)).assign_attrs(run_provenance(wall_time=time.perf_counter() - start))


def _of(name: str, work: Callable[[], T]) -> T:
    """Do ``work``; add the name of the scene to its errors."""
    try:
        with naming(name):
            return work()
    except GearbenchError as error:
        raise GearbenchError(f"{name}: {error}") from None


def check(scene: Scene, file: str) -> None:
    """Refuse a scene that has no reference; the error names its file."""
    with naming(file):
        reference_scene(scene)


def labels(scenes: Sequence[Scene]) -> list[str]:
    """Names of the scenes; missing and repeated names are numbered."""
    names = [scene.name or "scene" for scene in scenes]
    return [name if names.count(name) == 1 else f"{name} #{i + 1}" for i, name in enumerate(names)]
