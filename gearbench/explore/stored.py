"""Stored results as the pages of ``explore`` show them: feasible designs with their quantities and scenes."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.explore.columns import Column, known_column, variable_column
from gearbench.lazy import xr
from gearbench.optimisation.designs import Designs
from gearbench.optimisation.select import chosen_scene, open_designs
from gearbench.optimisation.study import RESPONSES
from gearbench.results.netcdf import open_result
from gearbench.results.origin import scene_of
from gearbench.results.provenance import support
from gearbench.results.responses import is_response, statistics_of
from gearbench.scene import Scene

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class Stored:
    """Feasible designs of one result.

    Parameters
    ----------
    label
        Display name.
    columns
        Quantities of the designs, with values (design,).
    numbers
        Numbers of the designs in their file, (design,).
    scene
        Function from a design's number to its scene.
    teeth
        Tooth model and model of the gear bodies with which the values were computed.
    """

    label: str
    columns: tuple[Column, ...]
    numbers: NDArray
    scene: Callable[[int], Scene]
    teeth: str


def open_results(paths: Sequence[str | Path]) -> tuple[Stored, ...]:
    """Open results of ``optimise`` (folder or front.nc), ``robust`` and ``simulate``.

    Raises
    ------
    InputError
        If one of them cannot be read, or is another kind of file.
    """
    results = [_open(Path(path)) for path in paths]
    labels = [result.label for result in results]
    for path, result in zip(paths, results, strict=True):
        _LOG.debug("read %s: %d designs", path, len(result.numbers))
    return tuple(
        replace(result, label=f"{result.label} ({path})") if labels.count(result.label) > 1 else result
        for result, path in zip(results, paths, strict=True)
    )


def _open(path: Path) -> Stored:
    """Open one result; raises as ``open_results``."""
    if path.is_dir():
        return of_designs(open_designs(path), str(path))
    dataset = open_result(path)
    if "study" in dataset.attrs:
        return of_designs(Designs(dataset, str(path)), str(path))
    if "scene" in dataset.attrs and any(name in dataset for name in RESPONSES):
        return of_run(dataset, str(path))
    raise InputError("", str(path), "must be a result of gearbench optimise, robust or simulate")


def scene_of_run(path: Path) -> Scene | None:
    """Scene of the result of a single scene; None if the file is the result of an optimisation.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    dataset = open_result(path)
    single = "study" not in dataset.attrs and "scene" in dataset.attrs
    return scene_of(dataset) if single else None


def of_designs(designs: Designs, file: str) -> Stored:
    """Take the feasible designs of an optimisation.

    Raises
    ------
    InputError
        If there is no feasible design, or the designs are planetary sets.
    """
    dataset, study = designs.dataset, designs.study
    if study.of_set:
        raise InputError("", file, "holds planetary sets: the page shows fronts of pairs; use gearbench select")
    numbers = designs.require_feasible()
    columns = [variable_column(v.name, v.paths, dataset[v.name].values[numbers]) for v in study.variables]
    columns += [known_column(name, "limit", dataset[name].values[numbers]) for name in study.constraints]
    columns += [known_column(name, "statistic", dataset[name].values[numbers]) for name in study.statistics]
    label = study.name or file
    teeth = _teeth(designs, numbers)
    return Stored(
        label=label, columns=tuple(columns), numbers=numbers, scene=lambda n: chosen_scene(designs, n), teeth=teeth
    )


def _teeth(designs: Designs, numbers: NDArray) -> str:
    """Text ``teeth_of`` the first of ten designs whose scene can be read; a file that it names may be missing."""
    for number in numbers[:10]:
        try:
            return teeth_of(chosen_scene(designs, int(number)))
        except InputError:
            continue
    return "teeth not known"


def _scene(dataset: xr.Dataset, file: str) -> Scene:
    """Scene stored with the result of a single scene; an error names the file."""
    try:
        return scene_of(dataset)
    except InputError as error:
        raise InputError("", file, f"its scene {error.allowed}") from None


def of_run(dataset: xr.Dataset, file: str) -> Stored:
    """Take the scene of a simulation or a robustness run as a single design."""
    scene = _scene(dataset, file)
    columns = []
    for response in dict.fromkeys((*RESPONSES, *filter(is_response, map(str, dataset.data_vars)))):
        for name in statistics_of([response]):
            variable = dataset.get(name)
            if variable is None and name == f"{response}_mean":
                variable = dataset[response].mean()
            columns.append(known_column(name, "statistic", np.array([np.nan if variable is None else float(variable)])))
    label = scene.name or file
    return Stored(
        label=label, columns=tuple(columns), numbers=np.array([0]), scene=lambda _: scene, teeth=teeth_of(scene)
    )


def teeth_of(scene: Scene) -> str:
    """Tooth model and model of the gear bodies of a scene as text, e.g. "solid teeth, ring"."""
    bending = scene.effect("tooth_bending")
    if bending is None:
        return "rigid teeth"
    return f"{getattr(bending, 'model', '')} teeth, {support(scene)}".replace("_", " ")
