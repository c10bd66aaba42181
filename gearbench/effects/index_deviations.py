"""Base class of pitch errors: gaps of teeth ahead of or behind their nominal positions, in any mesh cycle."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gearbench.effects.base import ChangingGap, Effects, GapOverCycles
from gearbench.effects.shape import MICROMETRE, Amount
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.names import GEARS
from gearbench.geometry.pair import Pair

Deviations = tuple[Amount, ...]
Tooth = Annotated[int, Field(ge=0)]


class IndexDeviations(ChangingGap):
    """A gap from the index deviation of each tooth.

    ``pinion_tooth`` and ``wheel_tooth``, the teeth with which the mesh cycle 0 begins, are keys of the effect.
    """

    pinion_tooth: Tooth
    wheel_tooth: Tooth

    @abstractmethod
    def of_teeth(self, pair: Pair) -> Sequence[Deviations | None]:
        """Index deviations of the teeth of pinion and wheel [µm]; None for a gear without deviations."""

    def check(self, pair: Pair, effects: Effects) -> None:
        """Refuse a first tooth that a gear does not have."""
        for name, tooth, gear in zip(GEARS, self._first_teeth, pair.gears, strict=True):
            if tooth >= abs(gear.teeth):
                raise InputError(f"{name}_tooth", tooth, f"must be below {abs(gear.teeth)}, the number of teeth")

    @property
    def _first_teeth(self) -> tuple[int, int]:
        return self.pinion_tooth, self.wheel_tooth

    def turning(self, lines: ContactLines, cycles: NDArray) -> GapOverCycles:
        """Gap f cos α_t cos β_b of a tooth pair by the index deviation f of its tooth; one mode per gear and pair.

        In mesh cycle n, tooth n − k after the first tooth of each gear is in tooth pair k.
        """
        teeth_after_first = cycles[:, None] - lines.index
        if lines.coast:  # coast flanks are solved as a mirrored pair, which turns in the opposite direction
            teeth_after_first = -teeth_after_first
        gear, modes, amounts = lines.pair.gears[0], [], []
        of_pair = MICROMETRE * math.cos(gear.alpha_t) * math.cos(gear.beta_b) * np.eye(len(lines.index))[:, None]
        of_gears = zip(self.of_teeth(lines.pair), self._first_teeth, lines.levers, strict=True)
        for deviations, first, lever in of_gears:
            if deviations is not None:
                modes.append(np.broadcast_to(of_pair, (*lines.shape, len(lines.index))) * np.expand_dims(lever, -1))
                amounts.append(np.array(deviations)[(first + teeth_after_first) % len(deviations)])
        return GapOverCycles(modes=np.concatenate(modes, axis=-1), amounts=np.concatenate(amounts, axis=-1))

    def later(self, pair: Pair, cycles: tuple[int, int]) -> Self:
        """The same deviations with mesh cycles that begin ``cycles`` teeth later."""
        of_gears = zip(GEARS, self._first_teeth, cycles, pair.gears, strict=True)
        return replace(self, **{f"{name}_tooth": (first + n) % abs(gear.teeth) for name, first, n, gear in of_gears})
