"""The scene that a Dataset is of, and what it keeps of the files that the scene refers to."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING

import numpy as np

from gearbench.errors import InputError
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene, scene_at

if TYPE_CHECKING:
    import xarray as xr


#: Tables of effects whose grids a Dataset keeps → what their names begin with.
_KEPT = {"effects": "", "coast": "coast_"}


def keeping(dataset: xr.Dataset, scene: Scene) -> xr.Dataset:
    """``dataset`` with the measured grids of ``scene``, so that ``scene_of`` does not need their files."""
    for table, prefix in _KEPT.items():
        for effect in getattr(scene, table):
            for name, array in effect.kept().items():
                own = array.rename({dim: f"{prefix}{dim}" for dim in array.dims})
                dataset = dataset.assign({f"{prefix}{name}": own})
    return dataset


def _recall(dataset: xr.Dataset) -> None:
    """Let the scene have the grids that the Dataset keeps."""
    for gear in ("pinion", "wheel"):
        for prefix in _KEPT.values():
            name = f"{prefix}topography_{gear}"
            if name in dataset.data_vars:
                from gearbench.effects.topography import remember

                remember(dataset[name])


def scene_of(dataset: xr.Dataset) -> Scene:
    """The scene of a result; of one point of a sweep, e.g. ``swept.sel(torque=100)``, that at this point.

    Raises
    ------
    InputError
        If the Dataset holds no scene, or one that cannot be read.
    """
    if "scene" not in dataset.attrs:
        raise InputError("dataset", "no scene", "must be a result of gearbench, with its attributes")
    try:
        _recall(dataset)
        scene = parse_scene(tomllib.loads(str(dataset.attrs["scene"])))
    except RecursionError as error:
        raise InputError("dataset", "scene", f"cannot be read: {error}") from None
    except ValueError as error:  # an InputError is one, too
        raise InputError("dataset", "scene", f"cannot be read: {error}") from None
    point = {}
    for path in map(str, np.atleast_1d(dataset.attrs.get("swept", []))):
        name = path if path in dataset.coords else path.rpartition(".")[2]
        if name in dataset.coords and dataset[name].ndim == 0:
            point[path] = dataset[name].item()
    return scene_at(scene, point)
