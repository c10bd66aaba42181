"""The Dataset of a sweep: those of its groups side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.loads import WeightedLoad, load_weights
from gearbench.results.responses import OVER_LOADS, described, is_response
from gearbench.robustness.statistics import summarise
from gearbench.scene import Scene
from gearbench.sweeps.axes import TORQUE, Axis
from gearbench.sweeps.groups import LOAD

if TYPE_CHECKING:
    import xarray as xr


def combined(
    parts: Sequence[xr.Dataset], points: Sequence[Sequence[Sequence[Scene]]], axes: Sequence[Axis]
) -> xr.Dataset:
    """The Datasets of the groups of all ``points`` (point, group, load), in order, along ``axes``.

    Where positions, pairs or segments differ in number, those missing are NaN, and their weight is zero. Groups and
    loads that are not there are NaN.
    """
    torque = next((each for each in axes if each.path == TORQUE), None)
    outer = [each for each in axes if each is not torque]
    if not outer and len(points[0]) == 1 and torque is not None and torque.name == LOAD:
        (found,) = parts
        if LOAD in found.coords and found.sizes[LOAD] == len(torque.values):
            return found  # one group, whole, with its loads for its first dimension
    parts = [part.drop_vars(LOAD, errors="ignore") for part in parts]
    if outer or len(points[0]) > 1:
        parts = [_labelled(part) for part in parts]
    whole, rest = [], list(parts)
    for groups in points:
        own, rest = rest[: len(groups)], rest[len(groups) :]
        if not own:
            whole.append(whole[-1].where(False))
            continue
        found = _concat(own, LOAD) if len(own) > 1 else own[0]
        missing = sum(map(len, groups)) - found.sizes[LOAD]
        found = found.pad({LOAD: (0, missing)}) if missing else found
        whole.append(found.isel({LOAD: 0}, drop=True) if torque is None else found)
    for each in reversed(outer):
        n = len(each.values)
        whole = [_concat(whole[i : i + n], each.name) for i in range(0, len(whole), n)]
    (found,) = whole
    found = found.drop_vars(["position", "pair", "segment"], errors="ignore")
    if "phase_weight" in found:
        found["phase_weight"] = found["phase_weight"].fillna(0.0)
    if torque is not None and torque.name != LOAD:
        found = found.rename({LOAD: torque.name})
    coords = {each.name: (each.name, np.array(each.values), {"units": each.unit or "1"}) for each in axes}
    return found.assign_coords(coords).transpose(*coords, ...)


def over_loads(dataset: xr.Dataset, loads: Sequence[WeightedLoad]) -> xr.Dataset:
    """With the weighted mean and the greatest value over several ``loads`` of each response, and their weights."""
    if not loads:
        return dataset
    weight = dataset[LOAD].copy(data=load_weights(loads))
    dataset = dataset.assign_coords(described({"load_weight": (LOAD, weight.values)}))
    found: dict[str, xr.DataArray] = {}
    for name, values in dataset.data_vars.items():
        if LOAD in values.dims and is_response(str(name)):
            found[f"{name}_load_mean"] = (values * weight).sum(LOAD, skipna=False)
            found[f"{name}_load_max"] = values.max(LOAD, skipna=False)
            if f"{name}_std" in dataset:
                for kind in OVER_LOADS:
                    found |= _statistics(f"{name}{kind}", found[f"{name}{kind}"], dataset.attrs["sampler"])
    return dataset.assign(described({name: (values.dims, values.values) for name, values in found.items()}))


def _statistics(name: str, values: xr.DataArray, sampler: Any) -> dict[str, xr.DataArray]:
    """Statistics over the samples, with their standard errors."""
    first = values.isel(sample=0, drop=True)
    rows = [
        summarise(row, sampler) for row in values.transpose(..., "sample").values.reshape(-1, values.sizes["sample"])
    ]
    found = {}
    for statistic in rows[0]:
        both = np.array([row[statistic] for row in rows]).reshape(*first.shape, 2)
        found[f"{name}_{statistic}"] = first.copy(data=both[..., 0])
        found[f"{name}_{statistic}_standard_error"] = first.copy(data=both[..., 1])
    return found


def _concat(parts: Sequence[xr.Dataset], dim: str) -> xr.Dataset:
    import xarray as xr

    return xr.concat(
        parts, dim, data_vars="all", coords="different", compat="equals", join="outer", combine_attrs="override"
    )


def _labelled(part: xr.Dataset) -> xr.Dataset:
    """With the numbers of positions, tooth pairs and segments as labels, which concatenation goes by."""
    labels = {dim: np.arange(part.sizes[dim]) for dim in ("position", "segment") if dim in part.dims}
    return part.assign_coords(labels | ({"pair": part["pair_index"].values} if "pair" in part.dims else {}))
