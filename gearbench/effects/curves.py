"""Curves as a drawing or a measuring machine gives them: a polynomial, or points with straight lines between them."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.effects.base import GapEffect
from gearbench.effects.relief import Amount
from gearbench.errors import InputError
from gearbench.geometry.role import Role
from gearbench.schema import STRICT

#: Curves with more points than this cannot have a panel of the mesh cycle for each.
MOST_KINKS = 12

Coordinates = Annotated[tuple[Annotated[float, Field(ge=-20000.0, le=20000.0)], ...], Field(max_length=10000)]
Deviations = Annotated[tuple[Amount, ...], Field(max_length=10000)]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class FlankCurve:
    """A polynomial, or points.

    Parameters
    ----------
    polynomial
        Coefficients c_1, c_2, … of c_1 t + c_2 t² + … [µm], t from 0 to 1; at most 12.
    at
        Positions of the points [mm], two or more, increasing; held beyond the first and the last.
    deviation
        Deviation at each of them [µm].
    """

    polynomial: Annotated[Deviations, Field(max_length=12)] | None = None
    at: Coordinates | None = None
    deviation: Deviations | None = None

    def __post_init__(self) -> None:
        if (self.polynomial is None) == (self.at is None):
            given = "missing" if self.at is None else "given"
            raise InputError("polynomial", given, "give either polynomial, or at and deviation")
        if self.polynomial is not None:
            if not self.polynomial:
                raise InputError("polynomial", "[]", "must have at least one coefficient")
            if self.deviation is not None:
                raise InputError("deviation", "given", "conflicts with polynomial: give one of the two")
            return
        count = 0 if self.deviation is None else len(self.deviation)
        at = self.at or ()
        if len(at) < 2 or count != len(at):
            allowed = f"must be one for each of the {len(at)} positions at, two or more"
            raise InputError("deviation", f"{count} values", allowed)
        if not np.all(np.diff(at) > 0):
            raise InputError("at", list(at), "must increase")

    def values(self, t: NDArray, position: NDArray) -> NDArray:
        """Deviation [µm] where the polynomial's variable is ``t`` and the points' position is ``position``."""
        if self.polynomial is not None:
            return np.polynomial.polynomial.polyval(t, (0.0, *self.polynomial))
        return np.interp(position, np.array(self.at), np.array(self.deviation))

    @property
    def kinks(self) -> tuple[float, ...]:
        """Positions of the points of a coarse curve; the kinks of a fine one are too many to integrate between."""
        return self.at if self.at is not None and len(self.at) <= MOST_KINKS else ()


@dataclass(frozen=True, kw_only=True, config=STRICT)
class CurvesOfGears(GapEffect):
    """A curve of one gear or of both.

    Parameters
    ----------
    pinion, wheel
        The curve of each gear.
    """

    pinion: FlankCurve | None = None
    wheel: FlankCurve | None = None

    def __post_init__(self) -> None:
        if self.pinion is None and self.wheel is None:
            raise InputError("pinion", "missing", "a curve is required, here or for the wheel")

    @property
    def curves(self) -> dict[Role, FlankCurve]:
        """The curve of each gear that has one."""
        return {role: curve for role in Role if (curve := getattr(self, role.label)) is not None}
