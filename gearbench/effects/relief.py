"""The shape of a relief and on whose flank it is: shared by tip, root and end relief."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gearbench.geometry.role import Role

Shape = Literal["linear", "parabolic"]
Gears = Literal["both", "pinion", "wheel"]

#: An amount of missing material [µm]; negative: in excess.
Amount = Annotated[float, Field(ge=-1000.0, le=1000.0)]

MICROMETRE = 1e-3  # mm


def relief(distance: NDArray, length: float, amount: float, shape: Shape) -> NDArray:
    """Gap [mm] of a relief of ``amount`` [µm] over ``length`` [mm].

    ``distance`` [mm] counts from the relieved edge into the flank; the gap is full at 0 and gone at ``length``.
    """
    if length == 0:
        return np.zeros_like(distance)
    depth = np.clip(length - distance, 0.0, None) / length
    return amount * MICROMETRE * (depth if shape == "linear" else depth**2)


def chosen(gears: Gears) -> tuple[Role, ...]:
    """The gears meant."""
    return {"both": tuple(Role), "pinion": (Role.PINION,), "wheel": (Role.WHEEL,)}[gears]
