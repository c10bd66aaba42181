"""Results joined along a new dimension: points of a sweep, or meshes of a train."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

#: Dimensions and values of an array.
Column: TypeAlias = tuple[tuple[str, ...], NDArray]
#: Dimensions and values by name.
Columns: TypeAlias = dict[str, Column]
#: Dimension that is aligned by labels → coordinate with the labels. All other dimensions count from 0 at every point.
_LABELS = {"pair": "pair_index", "error_name": "error_name", "gear": "gear"}


@dataclass(frozen=True)
class Point:
    """Coordinates and variables of a Dataset, for one point or for several joined ones."""

    coords: Columns
    variables: Columns

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Dimension → its length."""
        both = (*self.coords.values(), *self.variables.values())
        return {d: n for dims, values in both for d, n in zip(dims, np.shape(values), strict=True)}


def of_each_load(coords: Columns, variables: Columns, loads: tuple[int, ...]) -> Iterator[Point]:
    """Yield one point per load from arrays with the leading dimensions ``loads``; other arrays are in every point."""
    if not loads:
        yield Point(coords, variables)
        return
    for i in range(*loads):
        of_load = {name: (dims, x[i] if np.ndim(x) > len(dims) else x) for name, (dims, x) in variables.items()}
        yield Point(coords, of_load)


def join_points(parts: Sequence[Point | None], dim: str) -> Point:
    """Join ``parts`` along a new first dimension; missing parts, and the missing ends of shorter ones, are NaN.

    Coordinates that are the same in all parts do not get the new dimension.
    """
    known = [part for part in parts if part is not None]
    labels = {d: _union([part.coords[name][1] for part in known if name in part.coords]) for d, name in _LABELS.items()}
    sizes: dict[str, int] = {}
    for part in known:
        sizes |= {d: max(n, sizes.get(d, 0)) for d, n in part.sizes.items()}
    sizes |= {d: len(found) for d, found in labels.items() if found.size}
    places = [_places(part, labels) if part else {} for part in parts]

    def joined(own: Sequence[Column | None]) -> Column:
        """Join a variable over all points; NaN where a point does not have it."""
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
    """Labels of all points: numbers in ascending order, names in order of appearance."""
    every = list(dict.fromkeys(label for own in labels for label in own.tolist()))
    return np.array(every if every and isinstance(every[0], str) else sorted(every))


def _places(part: Point, labels: Mapping[str, NDArray]) -> dict[str, NDArray]:
    """Indices of a point's items among those of all points, by dimension."""
    places = {d: np.arange(n) for d, n in part.sizes.items()}
    for d, name in _LABELS.items():
        if name in part.coords:
            index_of = {label: i for i, label in enumerate(labels[d].tolist())}
            places[d] = np.array([index_of[label] for label in part.coords[name][1].tolist()], dtype=int)
    return places


def _same(one: Column, other: Column) -> bool:
    """Whether two coordinates are equal."""
    numbers = one[1].dtype.kind == "f"
    return one[0] == other[0] and (one[1] is other[1] or np.array_equal(one[1], other[1], equal_nan=numbers))
