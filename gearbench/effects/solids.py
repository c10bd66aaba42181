"""Solid teeth and gear bodies of a pair, built once: micro-geometry and errors do not change them."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from gearbench.errors import InputError
from gearbench.geometry.gear import Gear
from gearbench.geometry.material import Material
from gearbench.geometry.pair import Pair

if TYPE_CHECKING:
    from gearbench.compliance.gear_body import GearBody
    from gearbench.compliance.solid_tooth import SolidTooth

#: Functions of the solid across the thickness, along height and face width.
SolidOrder = tuple[
    Annotated[int, Field(ge=2, le=40)], Annotated[int, Field(ge=1, le=40)], Annotated[int, Field(ge=1, le=40)]
]
#: … unless a scene says otherwise.
SOLID_ORDER = (4, 5, 5)


@lru_cache(maxsize=256)
def solid_tooth(gear: Gear, material: Material, order: tuple[int, int, int], driven: bool) -> SolidTooth:
    """Solid of a gear's tooth."""
    from gearbench.compliance.solid_tooth import SolidTooth

    return SolidTooth(gear=gear, E=material.E, nu=material.nu, order=order, driven=driven)


@lru_cache(maxsize=256)
def gear_body(pair: Pair, k: int, order: tuple[int, int, int]) -> GearBody:
    """Body of pinion (k = 0) or wheel (k = 1) with its teeth."""
    from gearbench.compliance.gear_body import GearBody

    tooth = solid_tooth(pair.gears[k], pair.material, order, k == 1)
    return GearBody(tooth=tooth, bore_radius=require_bores(pair)[k] / 2)


def require_bores(pair: Pair) -> tuple[float, float]:
    """Bore diameters [mm] of pinion and wheel.

    Raises
    ------
    InputError
        If one is missing.
    """
    found = []
    for name, member in (("pinion", pair.pinion), ("wheel", pair.wheel)):
        if member.bore_diameter is None:
            raise InputError("", f"no pair.{name}.bore_diameter", "needs the bores of both gears")
        found.append(member.bore_diameter)
    return found[0], found[1]
