"""Derived design variables: not keys of a scene, but converted to keys once the pair or planetary set is known."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from gearbench.errors import InputError
from gearbench.geometry.pair import Pair
from gearbench.geometry.planetary import expanded

#: Function of the scene's tables, of a function that makes a pair from its table, and of the variable's value;
#: it returns the keys that the value sets.
Derivation = Callable[[Mapping[str, Any], Callable[[Mapping[str, Any]], Pair], float], dict[str, Any]]


def _relief_length(effect: str) -> Derivation:
    def derive(tables: Mapping[str, Any], pair_of: Callable[[Mapping[str, Any]], Pair], value: float) -> dict[str, Any]:
        pair = pair_of(tables["pair"])
        return {f"effects.{effect}.length": value * min(gear.tooth_height for gear in pair.gears)}

    return derive


def _addendum(tables: Mapping[str, Any], pair_of: Callable[[Mapping[str, Any]], Pair], value: float) -> dict[str, Any]:
    lowest = unit_contact_addendum(_any_pair(tables["pair"], pair_of))
    addendum = lowest + value * (1.0 - lowest)
    return {"pair.pinion.addendum": addendum, "pair.wheel.addendum": addendum}


def _any_pair(table: Mapping[str, Any], pair_of: Callable[[Mapping[str, Any]], Pair]) -> Pair:
    """Pair with the greatest valid addendum; pitch and base circles, which alone are needed, do not depend on it."""
    errors = []
    for tenths in range(10, 0, -1):
        members = {name: {**table.get(name, {}), "addendum": tenths / 10} for name in ("pinion", "wheel")}
        try:
            return pair_of({**table, **members})
        except InputError as error:
            errors.append(error)
    raise errors[0]


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


def _ring_teeth(tables: Mapping[str, Any], _build: Callable[[Mapping[str, Any]], Pair], value: float) -> dict[str, Any]:
    planetary = tables["planetary"]
    ring = {key: number for key, number in planetary.get("ring", {}).items() if key != "teeth"}
    known = expanded({**planetary, "ring": ring})[0]
    return {"planetary.ring.teeth": known.teeth[-1] - round(value)}


#: Name → function that sets keys of the scene; applied in this order. Lengths are fractions of the tooth depth h_e
#: (of the smaller one if the gears differ). The addendum fraction runs from 0 (ε_α = 1) to 1 (standard h_a* = 1).
#: Extra teeth are added to the default number of the ring.
DERIVED: Mapping[str, Derivation] = MappingProxyType(
    {
        "pair.addendum_fraction": _addendum,
        "effects.tip_relief.length_fraction": _relief_length("tip_relief"),
        "effects.root_relief.length_fraction": _relief_length("root_relief"),
        "planetary.ring.extra_teeth": _ring_teeth,
    }
)

#: Keys of the scene that a derived variable sets, for checks.
KEYS_SET: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "pair.addendum_fraction": ("pair.pinion.addendum", "pair.wheel.addendum"),
        "effects.tip_relief.length_fraction": ("effects.tip_relief.length",),
        "effects.root_relief.length_fraction": ("effects.root_relief.length",),
        "planetary.ring.extra_teeth": ("planetary.ring.teeth",),
    }
)
