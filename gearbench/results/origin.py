"""The scene that a Dataset is of."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING

import numpy as np

from gearbench.errors import InputError
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene, scene_at

if TYPE_CHECKING:
    import xarray as xr


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
