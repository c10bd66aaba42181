"""Gaps of teeth before or behind their nominal positions, in any mesh cycle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gearbench.effects.base import GapOverCycles
from gearbench.effects.shape import MICROMETRE, Amount
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair

Deviations = tuple[Amount, ...]
Tooth = Annotated[int, Field(ge=0)]


def turning(
    lines: ContactLines, cycles: NDArray, deviations: Sequence[Deviations | None], first: Sequence[int]
) -> GapOverCycles:
    """Gap f cos α_t cos β_b of both teeth of a pair, with one gap shape per tooth pair.

    ``deviations`` are those of the teeth of both gears [µm], ``first`` their teeth with which the mesh cycle 0 begins.
    In mesh cycle n, pair k is made by the teeth with the numbers first + n − k.
    """
    later = cycles[:, None] - lines.index
    if lines.coast:  # the mirror image of the coast flanks turns in the opposite direction
        later = -later
    amounts = np.zeros(later.shape)
    for own, tooth in zip(deviations, first, strict=True):
        if own is not None:
            amounts += np.array(own)[(tooth + later) % len(own)]
    gear, pairs = lines.pair.gears[0], len(lines.index)
    normal = MICROMETRE * math.cos(gear.alpha_t) * math.cos(gear.beta_b)
    return GapOverCycles(modes=np.broadcast_to(normal * np.eye(pairs)[:, None], (*lines.shape, pairs)), amounts=amounts)


def later_teeth(pair: Pair, first: tuple[int, int], cycles: tuple[int, int]) -> dict[str, int]:
    """Keys of the teeth of both gears with which mesh cycles begin that are ``cycles`` teeth later."""
    own = zip(("pinion_tooth", "wheel_tooth"), first, cycles, pair.gears, strict=True)
    return {key: (tooth + cycle) % abs(gear.teeth) for key, tooth, cycle, gear in own}


def check_teeth(pair: Pair, first: tuple[int, int]) -> None:
    """Refuse a first tooth that a gear does not have."""
    for name, tooth, gear in zip(("pinion", "wheel"), first, pair.gears, strict=True):
        if tooth >= abs(gear.teeth):
            raise InputError(f"{name}_tooth", tooth, f"must be below {abs(gear.teeth)}, the number of teeth")
