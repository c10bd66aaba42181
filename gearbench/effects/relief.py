"""The shape of a relief and on whose flank it is: shared by tip, root and end relief."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import is_dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gearbench.errors import InputError
from gearbench.geometry.role import Role

Shape = Literal["linear", "parabolic", "circular"]
Gears = Literal["both", "pinion", "wheel"]

#: An amount of missing material [µm]; negative: in excess.
Amount = Annotated[float, Field(ge=-1000.0, le=1000.0)]
#: A length on a flank [mm].
Extent = Annotated[float, Field(ge=0.0, le=1000.0)]

MICROMETRE = 1e-3  # mm


def relief(distance: NDArray, length: float, amount: float, shape: Shape) -> NDArray:
    """Gap [mm] of a relief of ``amount`` [µm] over ``length`` [mm] (G11).

    ``distance`` [mm] counts from the relieved edge into the flank; the gap is full at 0 and gone at ``length``.
    """
    if length == 0:
        return np.zeros_like(distance)
    depth = np.clip(length - distance, 0.0, None) / length
    if shape == "linear":
        return amount * MICROMETRE * depth
    return amount * MICROMETRE * arc(depth, bend(shape, amount, length))


def bend(shape: Shape, amount: float, length: float) -> float:
    """κ = length/radius of the arc that leaves a line without kink and is ``amount`` [µm] off it after ``length`` [mm].

    0 for a parabola.
    """
    C = abs(amount) * MICROMETRE
    return 2 * C * length / (length**2 + C**2) if shape == "circular" else 0.0


def arc(t: NDArray, kappa: float) -> NDArray:
    """(1 − √(1 − κ²t²))/(1 − √(1 − κ²)), written so that κ = 0 is the parabola t²."""
    return t**2 * (1 + math.sqrt(1 - kappa**2)) / (1 + np.sqrt(np.maximum(1 - (kappa * t) ** 2, 0.0)))


def one_or_each(
    effect: object, required: Sequence[str], more: Sequence[str] = (), names: Sequence[str] = ("pinion", "wheel")
) -> None:
    """Refuse keys of the whole beside tables ``names`` of its parts, and the lack of both.

    ``required`` keys have to be there where no table is, ``more`` keys may be.

    Raises
    ------
    InputError
        Naming the key.
    """
    own = [name for name in names if getattr(effect, name) is not None]
    for name in (*required, *more):
        value = getattr(effect, name)
        if own and value is not None:
            shown = "given" if is_dataclass(value) else value
            raise InputError(name, shown, f"conflicts with the table {own[0]}: give one of the two")
        if not own and value is None and name in required:
            raise InputError(name, "missing", f"is required, or a table {' or '.join(names)}")


def chosen(gears: Gears) -> tuple[Role, ...]:
    """The gears meant."""
    return {"both": tuple(Role), "pinion": (Role.PINION,), "wheel": (Role.WHEEL,)}[gears]
