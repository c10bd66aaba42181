"""Gaps of teeth before or behind their nominal positions, in any mesh cycle."""

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
        """Index deviations of the teeth of both gears [µm]; None: all teeth are in their places."""

    def check(self, pair: Pair, effects: Effects) -> None:
        """Refuse a first tooth that a gear does not have."""
        for name, tooth, gear in zip(GEARS, self._first, pair.gears, strict=True):
            if tooth >= abs(gear.teeth):
                raise InputError(f"{name}_tooth", tooth, f"must be below {abs(gear.teeth)}, the number of teeth")

    @property
    def _first(self) -> tuple[int, int]:
        return self.pinion_tooth, self.wheel_tooth

    def turning(self, lines: ContactLines, cycles: NDArray) -> GapOverCycles:
        """Gap f cos α_t cos β_b of both teeth of a pair, with one gap shape per tooth pair.

        In mesh cycle n, pair k is made by the teeth with the numbers first + n − k.
        """
        later = cycles[:, None] - lines.index
        if lines.coast:  # the mirror image of the coast flanks turns in the opposite direction
            later = -later
        amounts = np.zeros(later.shape)
        for deviations, tooth in zip(self.of_teeth(lines.pair), self._first, strict=True):
            if deviations is not None:
                amounts += np.array(deviations)[(tooth + later) % len(deviations)]
        gear, pairs = lines.pair.gears[0], len(lines.index)
        normal = MICROMETRE * math.cos(gear.alpha_t) * math.cos(gear.beta_b)
        modes = np.broadcast_to(normal * np.eye(pairs)[:, None], (*lines.shape, pairs))
        return GapOverCycles(modes=modes, amounts=amounts)

    def later(self, pair: Pair, cycles: tuple[int, int]) -> Self:
        """The same deviations with mesh cycles that begin ``cycles`` teeth later."""
        of_gears = zip(GEARS, self._first, cycles, pair.gears, strict=True)
        return replace(self, **{f"{name}_tooth": (tooth + n) % abs(gear.teeth) for name, tooth, n, gear in of_gears})
