"""Keys of a scene that are swept, and the scenes at the points of their grid."""

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

#: Name of the axis of several meshes.
MESH = "mesh"
#: Points of a grid at most.
MOST_POINTS = 100_000


@dataclass(frozen=True, kw_only=True)
class SweepAxis:
    """A key that is swept.

    Parameters
    ----------
    name
        As given, and as the dimension of the Dataset is called: a dotted key, or the last part of one of ``[load]``,
        ``[pair]`` or ``[resolution]``.
    path
        The dotted key; items of lists count from 0, as in "effects.waviness.pinion.0.amplitude".
    values
        Its values, ascending, in the unit of the key; names of meshes in their order.
    unit
        Unit of the key, "" where it has none.
    """

    name: str
    path: str
    values: tuple[Any, ...]
    unit: str


def axis(name: str, values: Sequence[float] | NDArray) -> SweepAxis:
    """SweepAxis of the numeric key ``name``; whole numbers where the key takes no others.

    Raises
    ------
    InputError
        If there is no such key, it is no number, or ``values`` are none, not finite, or not all different.
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
    """The axes of a sweep in the order given, and one of the ``meshes`` by their names, where there are several.

    ``coupled`` meshes are no axis: each point has all of them.

    Raises
    ------
    InputError
        As ``axis``; if there is none, a key is given twice, or the grid has more than 100 000 points.
    """
    found = tuple(axis(name, values) for name, values in swept.items())
    if len(meshes) > 1 and not coupled:
        found += (SweepAxis(name=MESH, path=MESH, values=tuple(meshes), unit=""),)
    if not found and not coupled:
        raise InputError("sweep", "no key", "must sweep at least one, e.g. torque=[100, 200]")
    paths = [each.path for each in found]
    for each in found:
        if paths.count(each.path) > 1:
            raise InputError("sweep", each.name, "is swept twice")
    if (points := math.prod(len(each.values) for each in found)) > MOST_POINTS:
        raise InputError("sweep", points, f"points of the grid: at most {MOST_POINTS}")
    return found


def grid(axes: Sequence[SweepAxis]) -> list[dict[str, Any]]:
    """Points of the grid of ``axes``, the last one fastest; each the values by dotted key."""
    return [dict(zip((each.path for each in axes), point, strict=True)) for point in product(*(a.values for a in axes))]
