"""Scene of a Dataset, and the measured grids that the Dataset keeps from the scene's files."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Any

import numpy as np

from gearbench.effects.registry import effect_class, effect_names
from gearbench.errors import InputError
from gearbench.lazy import xr
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene, scene_at

#: Table of effects whose grids a Dataset keeps → prefix of their names.
_GRID_TABLES = {"effects": "", "coast": "coast_"}


def with_grids(dataset: xr.Dataset, scene: Scene) -> xr.Dataset:
    """Add the measured grids of ``scene`` to ``dataset``, so that ``scene_of`` does not need their files."""
    for table, prefix in _GRID_TABLES.items():
        for effect in getattr(scene, table):
            for name, array in effect.kept().items():
                renamed = array.rename({dim: f"{prefix}{dim}" for dim in array.dims})
                dataset = dataset.assign({f"{prefix}{name}": renamed})
    return dataset


def _recall(dataset: xr.Dataset, tables: Mapping[str, Any]) -> None:
    """Hand the grids of the Dataset to the effects, for the scene of ``tables``."""
    for table, prefix in _GRID_TABLES.items():
        asked = tables.get(table)
        for effect in set(asked) & set(effect_names()) if isinstance(asked, dict) else ():
            grids = [name for name in map(str, dataset) if name.startswith(f"{prefix}{effect}_")]
            effect_class(effect).recall({name.removeprefix(prefix): dataset[name] for name in grids})


def single_mesh(dataset: xr.Dataset, mesh: str) -> xr.Dataset:
    """Select one mesh of a result with several, without foreign positions and gears; return others unchanged."""
    if "mesh" not in dataset.dims:
        return dataset
    of_mesh = dataset.sel(mesh=mesh)
    if "gear" in of_mesh.dims:
        of_mesh = of_mesh.sel(gear=list(scene_of(of_mesh).gear_names))
    if "phase_weight" in of_mesh and of_mesh["phase_weight"].dims == ("position",):
        of_mesh = of_mesh.isel(position=np.flatnonzero(of_mesh["phase_weight"].values > 0))
        if "segment_length" in of_mesh:
            loaded = (of_mesh["segment_length"] > 0).any(("position", "segment"))
            of_mesh = of_mesh.isel(pair=np.flatnonzero(loaded.values))
    return of_mesh


def scene_of(dataset: xr.Dataset) -> Scene:
    """Read the scene of a result; for a point of a sweep, e.g. ``swept.sel(torque=100)``, the scene at this point.

    Raises
    ------
    InputError
        If the Dataset holds no scene, or one that cannot be read.
    """
    if "scene" not in dataset.attrs:
        raise InputError("dataset", "no scene", "must be a result of gearbench, with its attributes")
    try:
        tables = tomllib.loads(str(dataset.attrs["scene"]))
        _recall(dataset, tables)
        scene = parse_scene(tables)
    except (ValueError, RecursionError) as error:  # an InputError is a ValueError too
        raise InputError("dataset", "scene", f"cannot be read: {error}") from None
    point = {}
    for path in map(str, np.atleast_1d(dataset.attrs.get("swept", []))):
        name = path if path in dataset.coords else path.rpartition(".")[2]
        if name in dataset.coords and dataset[name].ndim == 0:
            point[path] = dataset[name].item()
    mesh = point.pop("mesh", None)
    scene = scene_at(scene, point)
    return scene if mesh is None else scene.meshes[mesh]
