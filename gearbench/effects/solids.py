"""Solid teeth and gear bodies of a pair, built once: micro-geometry and errors do not change them."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from gearbench.errors import InputError
from gearbench.geometry.gear import Gear
from gearbench.geometry.pair import Pair

if TYPE_CHECKING:
    from gearbench.compliance.gear_body import GearBody
    from gearbench.compliance.solid_tooth import SolidTooth

#: Functions of the solid across the thickness, along height and face width.
SolidOrder = tuple[
    Annotated[int, Field(ge=2, le=40)], Annotated[int, Field(ge=1, le=40)], Annotated[int, Field(ge=1, le=40)]
]

#: Bore over root circle.
_LARGEST_BORE = 0.999


def solid_order(gear: Gear) -> tuple[int, int, int]:
    """Order of a solid tooth unless a scene gives one: across the face as many functions as the flank can feel."""
    from gearbench.compliance.local import waves_across

    return 6, 7, waves_across(gear) + 1


@lru_cache(maxsize=256)
def solid_tooth(pair: Pair, k: int, order: tuple[int, int, int] | None) -> SolidTooth:
    """Solid tooth of pinion (k = 0) or wheel (k = 1)."""
    from gearbench.compliance.solid_tooth import SolidTooth

    gear, material = pair.gears[k], pair.material
    return SolidTooth(gear=gear, E=material.E, nu=material.nu, order=order or solid_order(gear), driven=k == 1)


@lru_cache(maxsize=256)
def gear_body(pair: Pair, k: int, order: tuple[int, int, int] | None) -> GearBody:
    """Body of pinion (k = 0) or wheel (k = 1) with its teeth."""
    from gearbench.compliance.gear_body import GearBody

    return GearBody(tooth=solid_tooth(pair, k, order), bore_radius=require_bores(pair)[k] / 2)


def require_bores(pair: Pair) -> tuple[float, float]:
    """Bore diameters [mm] of pinion and wheel.

    Raises
    ------
    InputError
        If one is missing, or leaves no body below the teeth.
    """
    found = []
    for name, member, gear in zip(("pinion", "wheel"), (pair.pinion, pair.wheel), pair.gears, strict=True):
        bore, most = member.bore_diameter, _LARGEST_BORE * 2 * gear.root_radius
        if bore is None:
            raise InputError("", f"no pair.{name}.bore_diameter", "needs the bores of both gears")
        if bore > most:
            raise InputError("", f"pair.{name}.bore_diameter = {bore:.6g}", f"must be at most {most:.6g} (root circle)")
        found.append(bore)
    return found[0], found[1]
