"""Support of an internal gear at its outer surface."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.errors import InputError
from gearbench.schema import STRICT

Stiffness = Annotated[float, Field(ge=0.0, le=1e9)]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Support:
    """Support of the outside of a ring: springs all around, or lugs.

    Springs stand for a press fit, a spline or a thin housing, lugs for ears with bolts or feet. With both stiffnesses
    0 the ring is free: only its motion as a rigid body is held.

    Parameters
    ----------
    radial, tangential
        Stiffness per length of the supported circumference [N/mm²]; axially it is the tangential one. Lugs are rigid
        by default.
    lugs
        Angles of the lugs [°], from the middle of tooth 0 towards the teeth that come into mesh next on the drive
        flanks.
    lug_length
        Length of a lug along the circumference [mm]; lugs are as wide as the face.
    tooth
        Tooth that carries tooth pair 0. Lugs make the compliance depend on it; a ``sweep`` over it covers a
        revolution.
    """

    radial: Stiffness | None = None
    tangential: Stiffness | None = None
    lugs: tuple[Annotated[float, Field(ge=-360.0, le=360.0)], ...] = ()
    lug_length: Annotated[float, Field(gt=0.0, le=5000.0)] | None = None
    tooth: Annotated[int, Field(ge=-10000, le=10000)] = 0

    def __post_init__(self) -> None:
        given = [value is not None for value in (self.radial, self.tangential)]
        if any(given) != all(given) or not (self.lugs or all(given)):
            key = "radial" if not given[0] else "tangential"
            without_lugs = "radial and tangential stiffness, or lugs"
            needed = "both stiffnesses, or neither for rigid lugs" if self.lugs else without_lugs
            raise InputError(key, "missing", f"give {needed}")
        if not self.lugs:
            for key, value in (("lug_length", self.lug_length), ("tooth", self.tooth or None)):
                if value is not None:
                    raise InputError(key, value, "needs lugs")
            return
        if self.lug_length is None:
            raise InputError("lug_length", "missing", "is required with lugs")
        if self.radial == 0 or self.tangential == 0:
            key = "radial" if self.radial == 0 else "tangential"
            raise InputError(key, 0, "must be above 0 at lugs: they hold the ring")
        angles = sorted(angle % 360 for angle in self.lugs)
        if any(b - a < 1e-9 for a, b in pairwise(angles)):
            raise InputError("lugs", list(self.lugs), "two lugs at the same angle")

    def check(self, outer_diameter: float) -> None:
        """Refuse lugs that overlap.

        Raises
        ------
        InputError
            With the allowed length.
        """
        if self.lug_length is None:
            return
        angles = sorted(angle % 360 for angle in self.lugs)
        spacing = min(b - a for a, b in pairwise([*angles, angles[0] + 360]))
        if (arc := math.radians(spacing) * outer_diameter / 2) < self.lug_length:
            raise InputError("support.lug_length", self.lug_length, f"lugs overlap: at most {arc:.4g}, their distance")

    def per_area(self, face_width: float) -> tuple[float, float] | None:
        """Radial and tangential stiffness per area [N/mm³]; None for rigid lugs."""
        if self.radial is None or self.tangential is None:
            return None
        return self.radial / face_width, self.tangential / face_width
