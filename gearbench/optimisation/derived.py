"""Derived design variables: not keys of a scene, but converted to keys once the pair or planetary set is known."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from gearbench.errors import InputError
from gearbench.geometry.pair import Pair
from gearbench.geometry.planetary import expanded

#: Function that gives the value of the keys of a derived variable. Arguments: the scene's tables, a function that makes
#: a pair from its table, and the value of the variable.
Derivation = Callable[[Mapping[str, Any], Callable[[Mapping[str, Any]], Pair], float], float]


def _relief_length(tables: Mapping[str, Any], pair_of: Callable[[Mapping[str, Any]], Pair], value: float) -> float:
    """Length of a relief from a fraction of the smaller tooth height r_a − r_f."""
    return value * min(gear.tooth_height for gear in pair_of(tables["pair"]).gears)


def _addendum(tables: Mapping[str, Any], pair_of: Callable[[Mapping[str, Any]], Pair], value: float) -> float:
    """Addendum of both gears from a fraction: 0 gives ε_α = 1, 1 gives the standard addendum."""
    lowest = unit_contact_addendum(_valid_pair(tables["pair"], pair_of))
    return lowest + value * (1.0 - lowest)


def _valid_pair(table: Mapping[str, Any], pair_of: Callable[[Mapping[str, Any]], Pair]) -> Pair:
    """Pair with the greatest valid addendum; the circles used by ``unit_contact_addendum`` do not depend on it."""
    errors = []
    for tenths in range(10, 0, -1):
        members = {name: {**table.get(name, {}), "addendum": tenths / 10} for name in ("pinion", "wheel")}
        try:
            return pair_of({**table, **members})
        except InputError as error:
            errors.append(error)
    raise errors[0]  # the error at the standard addendum


def unit_contact_addendum(pair: Pair) -> float:
    """Addendum h_a* of both gears at which the tip circles of ``pair`` give a transverse contact ratio of 1.

    Raises
    ------
    InputError
        If no addendum between 0 and 1 gives that.
    """
    from scipy.optimize import brentq

    def excess(addendum: float) -> float:
        tips = [g.pitch_radius + g.normal_module * (addendum + g.profile_shift) for g in pair.gears]
        rolls = [math.sqrt(max(r**2 - g.base_radius**2, 0.0)) for r, g in zip(tips, pair.gears, strict=True)]
        return (sum(rolls) - pair.meshing.tangent_length) / pair.meshing.base_pitch - 1

    if excess(1.0) < 0 or excess(0.0) > 0:
        raise InputError("pair.addendum_fraction", "given", "no addendum up to 1 gives a transverse contact ratio of 1")
    return float(brentq(excess, 0.0, 1.0, xtol=1e-13))  # pyright: ignore[reportArgumentType]


def _ring_teeth(tables: Mapping[str, Any], _pair: Callable[[Mapping[str, Any]], Pair], value: float) -> float:
    """Tooth number of the ring (negative) from the number of teeth to add to the default (negative: to leave out)."""
    planetary = tables["planetary"]
    ring_without_teeth = {key: number for key, number in planetary.get("ring", {}).items() if key != "teeth"}
    default, *_ = expanded({**planetary, "ring": ring_without_teeth})
    return default.teeth[-1] - round(value)


#: Name of the derived variable → keys of the scene that it sets, and the function that gives their value; applied in
#: this order. ``study_file`` refuses keys set twice, and keys of a pair in a study of planetary sets or the reverse.
DERIVED: Mapping[str, tuple[tuple[str, ...], Derivation]] = MappingProxyType(
    {
        "pair.addendum_fraction": (("pair.pinion.addendum", "pair.wheel.addendum"), _addendum),
        "effects.tip_relief.length_fraction": (("effects.tip_relief.length",), _relief_length),
        "effects.root_relief.length_fraction": (("effects.root_relief.length",), _relief_length),
        "planetary.ring.extra_teeth": (("planetary.ring.teeth",), _ring_teeth),
    }
)
