"""The Dataset of a sweep: those of its groups side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.loads import WeightedLoad, load_weights
from gearbench.results.responses import OVER_LOADS, described, is_response
from gearbench.robustness.statistics import summarise
from gearbench.scene import Scene
from gearbench.sweeps.axes import TORQUE, Axis
from gearbench.sweeps.groups import LOAD

if TYPE_CHECKING:
    import xarray as xr

#: What a Dataset says of its missing values.
MISSING = "positions that a point does not have are NaN, of phase_weight 0: each has mesh phases of its own"


def combined(
    parts: Sequence[xr.Dataset], points: Sequence[Sequence[Sequence[Scene]]], axes: Sequence[Axis]
) -> xr.Dataset:
    """The Datasets of the groups of all ``points`` (point, group, load), in order, along ``axes``.

    Where positions, pairs or segments differ in number, those missing are NaN, and their weight is zero; the attribute
    ``missing`` says so. Groups and loads that are not there are NaN.
    """
    torque = next((each for each in axes if each.path == TORQUE), None)
    outer = [each for each in axes if each is not torque]
    if not outer and len(points[0]) == 1 and torque is not None and torque.name == LOAD:
        (found,) = parts
        if LOAD in found.coords and found.sizes[LOAD] == len(torque.values):
            return _with_note(found)  # one group, whole, with its loads for its first dimension
    parts = [part.drop_vars(LOAD, errors="ignore") for part in parts]
    whole, rest = [], list(parts)
    for groups in points:
        own, rest = rest[: len(groups)], rest[len(groups) :]
        if not own:
            whole.append(whole[-1].where(False))
            continue
        found = beside(own, LOAD) if len(own) > 1 else own[0]
        missing = sum(map(len, groups)) - found.sizes[LOAD]
        found = found.pad({LOAD: (0, missing)}) if missing else found
        whole.append(found.isel({LOAD: 0}, drop=True) if torque is None else found)
    for each in reversed(outer):
        n = len(each.values)
        whole = [beside(whole[i : i + n], each.name) for i in range(0, len(whole), n)]
    (found,) = whole
    found = found.drop_vars(["position", "pair", "segment"], errors="ignore")
    if "phase_weight" in found:
        found["phase_weight"] = found["phase_weight"].fillna(0.0)
    if torque is not None and torque.name != LOAD:
        found = found.rename({LOAD: torque.name})
    coords = {each.name: (each.name, np.array(each.values), {"units": each.unit or "1"}) for each in axes}
    return _with_note(found.assign_coords(coords).transpose(*coords, ...))


def _with_note(dataset: xr.Dataset) -> xr.Dataset:
    """With the attribute ``missing``, where a point has fewer positions than another."""
    if "phase_weight" not in dataset or (dataset["phase_weight"].values > 0).all():
        return dataset
    return dataset.assign_attrs(missing=MISSING)


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


#: Dimensions whose length differs from point to point.
_RAGGED = ("position", "pair", "segment")


def beside(parts: Sequence[xr.Dataset], dim: str) -> xr.Dataset:
    """The ``parts`` side by side along ``dim``, NaN where one has no such position, pair or segment.

    As ``xarray.concat`` of them would do, which aligns each variable by itself and takes longer than solving.
    """
    import xarray as xr

    labels = {
        d: np.unique(np.concatenate([_labels(part, d) for part in parts if d in part.sizes]))
        for d in _RAGGED
        if any(d in part.sizes for part in parts)
    }
    places = [{d: np.searchsorted(all_of, _labels(part, d)) for d, all_of in labels.items()} for part in parts]
    found: dict[str, Any] = {}
    for name in dict.fromkeys(str(name) for part in parts for name in part.variables if name not in labels):
        own = [part.variables.get(name) for part in parts]
        first = next(each for each in own if each is not None)
        same = all(each is not None and each.identical(first) for each in own)
        if same and name not in parts[0].data_vars and dim not in first.dims:
            found[name] = first
            continue
        # a coordinate may follow the torque at one point and not at another
        both = {str(d): n for each in own if each is not None for d, n in each.sizes.items() if d != dim}
        sizes = {d: len(labels[d]) if d in labels else n for d, n in both.items()}
        rest = list(sizes)
        lengths = [part.sizes.get(dim, 1) for part in parts]
        values = np.full((sum(lengths), *(sizes[d] for d in rest)), np.nan)
        begin = 0
        for each, place, length in zip(own, places, lengths, strict=True):
            if each is not None:
                cells = [place.get(d, np.arange(sizes[d])) for d in rest]
                missing = {d: sizes[d] for d in rest if d not in each.dims} | ({} if dim in each.dims else {dim: 1})
                values[np.ix_(np.arange(begin, begin + length), *cells)] = each.set_dims(
                    missing | dict(each.sizes)
                ).transpose(dim, *rest)
            begin += length
        kind = np.result_type(*(each.dtype for each in own if each is not None))
        whole = values.astype(kind) if kind.kind in "iub" and np.isfinite(values).all() else values
        found[name] = xr.Variable((dim, *rest), whole, first.attrs)
    coords = {name for part in parts for name in map(str, part.coords)} & found.keys()
    return xr.Dataset(
        {name: each for name, each in found.items() if name not in coords},
        coords={name: found[name] for name in found if name in coords} | {d: (d, x) for d, x in labels.items()},
        attrs=parts[0].attrs,
    )


def _labels(part: xr.Dataset, dim: str) -> NDArray:
    """Numbers of the positions, tooth pairs or segments of a Dataset."""
    if dim in part.coords:
        return part.variables[dim].values
    return part.variables["pair_index"].values if dim == "pair" else np.arange(part.sizes[dim])
