"""Axes of a sweep: the swept keys of a scene, their values, and the points of their grid."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.scene_file import TABLES, scene_key
from gearbench.schema import keys

#: Name of the axis over several meshes.
MESH = "mesh"
#: Largest number of grid points.
MOST_POINTS = 100_000


@dataclass(frozen=True, kw_only=True)
class SweepAxis:
    """A swept key with its values.

    Parameters
    ----------
    name
        Name of the key as given, which is also the dimension of the Dataset: a dotted key, or the last part of a key of
        ``[load]``, ``[pair]`` or ``[resolution]``.
    path
        The dotted key. List items count from 0, as in "effects.waviness.pinion.0.amplitude".
    values
        Values in the unit of the key, ascending; for meshes their names in the order of the scene.
    unit
        Unit of the key; "" if it has none.
    """

    name: str
    path: str
    values: tuple[Any, ...]
    unit: str


def axis(name: str, values: Sequence[float] | NDArray) -> SweepAxis:
    """Axis of the numeric key ``name``; values are converted to integers if the key requires them.

    Raises
    ------
    InputError
        If the key does not exist or is not numeric, or if ``values`` are empty, not finite, or not all different.
    """
    path = name
    if "." not in name:
        path = next((f"{table}.{name}" for table, kind in TABLES.items() if name in keys(kind)), name)
    key = scene_key(path)
    if key is None or key.number is None:
        raise InputError("sweep", name, 'must be a numeric key of a scene, e.g. "torque" or "effects.crowning.amount"')
    given = [float(value) for value in np.atleast_1d(np.asarray(values, dtype=float))]
    if not given or not all(map(math.isfinite, given)) or len(set(given)) < len(given):
        raise InputError(f"sweep.{name}", list(given), "must be one or more finite values, all different")
    numbers = tuple(int(x) if key.number is int and x.is_integer() else x for x in sorted(given))
    return SweepAxis(name=name, path=path, values=numbers, unit=key.unit)


def axes_of(
    swept: Mapping[str, Sequence[float] | NDArray], meshes: Sequence[str] = (), *, coupled: bool = False
) -> tuple[SweepAxis, ...]:
    """Axes of a sweep in the given order, followed by an axis of the names of the ``meshes`` if there are several.

    ``coupled`` meshes do not form an axis, because they are solved together at every point.

    Raises
    ------
    InputError
        Like ``axis``; also if no key is swept, a key is swept twice, or the grid has more than 100 000 points.
    """
    axes = tuple(axis(name, values) for name, values in swept.items())
    if len(meshes) > 1 and not coupled:
        axes += (SweepAxis(name=MESH, path=MESH, values=tuple(meshes), unit=""),)
    if not axes and not coupled:
        raise InputError("sweep", "no key", "must sweep at least one, e.g. torque=[100, 200]")
    paths = [swept_axis.path for swept_axis in axes]
    for swept_axis in axes:
        if paths.count(swept_axis.path) > 1:
            raise InputError("sweep", swept_axis.name, "is swept twice")
    if (points := math.prod(len(swept_axis.values) for swept_axis in axes)) > MOST_POINTS:
        raise InputError("sweep", points, f"points of the grid: at most {MOST_POINTS}")
    return axes


def grid(axes: Sequence[SweepAxis]) -> list[dict[str, Any]]:
    """Points of the grid of ``axes``, with the last axis varying fastest; a point maps dotted keys to values."""
    return [dict(zip((each.path for each in axes), point, strict=True)) for point in product(*(a.values for a in axes))]
