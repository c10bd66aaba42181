"""Scenes with phases of their own side by side in one Dataset."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.results.provenance import provenance
from gearbench.results.responses import described
from gearbench.scene import Scene
from gearbench.solution import Columns

if TYPE_CHECKING:
    import xarray as xr

#: Dimension whose length differs.
_POSITION = "position"


def ragged(
    parts: Sequence[tuple[Columns, Columns, int]], dim: str, axis: tuple[NDArray, dict[str, str]], scene: Scene
) -> xr.Dataset:
    """Dataset of ``parts``, their coordinates, variables and polished positions, along ``dim`` of the values ``axis``.

    Positions that others have are NaN, of weight 0. ``scene``: of the provenance.
    """
    import xarray as xr

    coords = {name: _beside([part[0][name] for part in parts], dim) for name in parts[0][0]}
    dims, weight = coords["phase_weight"]
    coords["phase_weight"] = dims, np.nan_to_num(weight)
    variables = {name: _beside([part[1][name] for part in parts], dim, alike=False) for name in parts[0][1]}
    attrs = provenance(scene, wall_time=0.0) | {"polished_positions": sum(polished for *_, polished in parts)}
    return xr.Dataset(described(variables), coords=described(coords) | {dim: (dim, *axis)}, attrs=attrs)


def _beside(
    parts: Sequence[tuple[tuple[str, ...], NDArray]], dim: str, *, alike: bool = True
) -> tuple[tuple[str, ...], NDArray]:
    """Arrays along a new first dimension, filled up with NaN; as they are, where they are ``alike`` and may stay so."""
    dims, first = parts[0]
    if alike and all(np.array_equal(values, first) for _, values in parts):
        return dims, first
    most = max((np.shape(values)[0] for _, values in parts if dims[:1] == (_POSITION,)), default=None)
    if most is None or all(len(values) == most for _, values in parts):
        return (dim, *dims), np.stack([values for _, values in parts])
    found = np.full((len(parts), most, *first.shape[1:]), np.nan)
    for row, (_, values) in zip(found, parts, strict=True):
        row[: len(values)] = values
    return (dim, *dims), found
