"""The Dataset of a sweep: those of its points side by side, and what several loads have in common."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gearbench.loads import WeightedLoad, load_weights
from gearbench.results.responses import OVER_LOADS, described, is_response
from gearbench.robustness.statistics import summarise
from gearbench.solution import Columns
from gearbench.sweeps.axes import Axis

if TYPE_CHECKING:
    import xarray as xr

#: What a Dataset says of its missing values.
MISSING = "positions, pairs and segments that a point does not have are NaN; such positions have the phase_weight 0"
#: Dimensions that are aligned by labels, and the coordinates that hold these; all others count from 0 at every point.
_LABELS = {"pair": "pair_index", "error_name": "error_name", "gear": "gear"}


#: Dimensions and values of an array.
Column: TypeAlias = tuple[tuple[str, ...], NDArray]


@dataclass(frozen=True)
class Point:
    """Coordinates and variables of the Dataset of one point, or of several."""

    coords: Columns
    variables: Columns

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Length of each dimension."""
        both = (*self.coords.values(), *self.variables.values())
        return {d: n for dims, values in both for d, n in zip(dims, np.shape(values), strict=True)}


def of_each_load(coords: Columns, variables: Columns, loads: tuple[int, ...]) -> Iterator[Point]:
    """Points of arrays that have the ``loads`` before their dimensions; those that lack them are the same for all."""
    if not loads:
        yield Point(coords, variables)
        return
    for i in range(*loads):
        own = {name: (dims, x[i] if np.ndim(x) > len(dims) else x) for name, (dims, x) in variables.items()}
        yield Point(coords, own)


def combined(points: Mapping[tuple[float, ...], Point], axes: Sequence[Axis]) -> xr.Dataset:
    """The Datasets of ``points``, by their values of the ``axes``, as one whose first dimensions are the axes.

    Points that are not there are NaN, as are positions, pairs and segments that a point does not have; these have the
    weight 0. The attribute ``missing`` says so. Coordinates follow those axes alone along which they change.
    """
    import xarray as xr

    found: dict[tuple[float, ...], Point] = dict(points)
    for i in reversed(range(len(axes))):
        grouped: dict[tuple[float, ...], dict[float, Point]] = {}
        for at, point in found.items():
            grouped.setdefault(at[:i], {})[at[i]] = point
        found = {at: beside([own.get(x) for x in axes[i].values], axes[i].name) for at, own in grouped.items()}
    (whole,) = found.values()
    coords, attrs = dict(whole.coords), {}
    if "phase_weight" in coords:
        dims, weight = coords["phase_weight"]
        coords["phase_weight"] = dims, np.nan_to_num(weight)
    if any(point.sizes.get(d, n) < n for point in points.values() for d, n in whole.sizes.items()):
        attrs = {"missing": MISSING}
    swept = {each.name: (each.name, np.array(each.values), {"units": each.unit or "1"}) for each in axes}
    names = [each.name for each in axes]
    return xr.Dataset(described(whole.variables), coords=described(coords) | swept, attrs=attrs).transpose(*names, ...)


def beside(parts: Sequence[Point | None], dim: str) -> Point:
    """The ``parts`` along a new first dimension, NaN where one is not there or is shorter than others.

    Coordinates that are the same in all parts stay as they are.
    """
    known = [part for part in parts if part is not None]
    labels = {d: _union([part.coords[name][1] for part in known if name in part.coords]) for d, name in _LABELS.items()}
    sizes: dict[str, int] = {}
    for part in known:
        sizes |= {d: max(n, sizes.get(d, 0)) for d, n in part.sizes.items()}
    sizes |= {d: len(found) for d, found in labels.items() if found.size}
    places = [_places(part, labels) if part else {} for part in parts]

    def joined(own: Sequence[Column | None]) -> Column:
        """Dimensions and values of one variable over all points; NaN where a point does not have it."""
        arrays = sorted((each for each in own if each is not None), key=lambda each: -len(each[0]))
        dims = list(dict.fromkeys(d for each in arrays for d in each[0]))
        full = tuple(sizes[d] for d in dims)
        whole = len(arrays) == len(parts) and all((d, np.shape(x)) == (tuple(dims), full) for d, x in arrays)
        if whole and "error_name" not in dims:  # nothing to align
            return (dim, *dims), np.stack([each[1] for each in own if each is not None])
        found = np.full((len(parts), *full), np.nan)
        for i, (place, each) in enumerate(zip(places, own, strict=True)):
            if each is not None:
                there: dict[str, Any] = {d: place[d] if d in each[0] else np.arange(sizes[d]) for d in dims}
                shape = [len(there[d]) if d in each[0] else 1 for d in dims]
                order = [each[0].index(d) for d in dims if d in each[0]]
                found[np.ix_([i], *there.values())] = np.transpose(each[1], order).reshape(1, *shape)
        kind = np.result_type(*(values for _, values in arrays))
        return (dim, *dims), found.astype(kind) if kind.kind in "iub" and np.isfinite(found).all() else found

    def columns(table: str) -> dict[str, list[Column | None]]:
        names = dict.fromkeys(name for part in known for name in getattr(part, table))
        return {name: [getattr(part, table).get(name) if part else None for part in parts] for name in names}

    coords: Columns = {name: ((d,), labels[d]) for d, name in _LABELS.items() if labels[d].size}
    for name, own in columns("coords").items():
        if name not in coords:
            first, *others = (each for each in own if each is not None)
            coords[name] = first if all(_same(each, first) for each in others) else joined(own)
    return Point(coords, {name: joined(own) for name, own in columns("variables").items()})


def _union(labels: Sequence[NDArray]) -> NDArray:
    """Labels of all points: numbers ascending, names as they come."""
    every = list(dict.fromkeys(label for own in labels for label in own.tolist()))
    return np.array(every if every and isinstance(every[0], str) else sorted(every))


def _places(part: Point, labels: Mapping[str, NDArray]) -> dict[str, NDArray]:
    """Where the items of each dimension of a point stand among those of all points."""
    found = {d: np.arange(n) for d, n in part.sizes.items()}
    for d, name in _LABELS.items():
        if name in part.coords:
            at = {label: i for i, label in enumerate(labels[d].tolist())}
            found[d] = np.array([at[label] for label in part.coords[name][1].tolist()], dtype=int)
    return found


def _same(one: Column, other: Column) -> bool:
    """Whether two coordinates are the same."""
    return one[0] == other[0] and (one[1] is other[1] or np.array_equal(one[1], other[1], equal_nan=True))


def over_loads(dataset: xr.Dataset, loads: Sequence[WeightedLoad]) -> xr.Dataset:
    """With the weighted mean and the greatest value over several ``loads`` of each response, and their weights."""
    if not loads:
        return dataset
    weight = dataset["torque"].copy(data=load_weights(loads))
    dataset = dataset.assign_coords(described({"load_weight": ("torque", weight.values)}))
    found: dict[str, xr.DataArray] = {}
    for name, values in dataset.data_vars.items():
        if "torque" in values.dims and is_response(str(name)):
            found[f"{name}_load_mean"] = (values * weight).sum("torque", skipna=False)
            found[f"{name}_load_max"] = values.max("torque", skipna=False)
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
