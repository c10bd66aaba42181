"""Random pitch errors of a whole gear, drawn once within its tolerances."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.effects.base import Effects
from gearbench.effects.distributions import DISTRIBUTIONS
from gearbench.effects.index_deviations import Deviations, IndexDeviations, Tooth
from gearbench.errors import InputError
from gearbench.geometry.gear import Gear
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT
from gearbench.tolerances import Edition, gear_tolerances

Tolerance = Annotated[float, Field(gt=0.0, le=1000.0)]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class DrawnPitch:
    """Index deviations of a gear that are drawn within its tolerances.

    Each tooth has its own deviation, normal with 3 σ = f_pt/2 and cut there. A wave of order 1 of random phase is
    added, whose random amplitude keeps the range of all deviations within F_p. Their sum is scaled down if a pitch
    deviates by more than f_pt.

    Parameters
    ----------
    iso_class, edition
        Class of ISO 1328-1, for tolerances that are not given.
    single_pitch, cumulative_pitch
        f_pt and F_p [µm]; without a class and F_p there is no wave.
    seed
        Seed of the draw. Gears of a pair need different seeds; the planets of a set count up from that of the first.
    """

    iso_class: Annotated[int, Field(ge=0, le=12)] | None = None
    edition: Edition = "2013"
    single_pitch: Tolerance | None = None
    cumulative_pitch: Tolerance | None = None
    seed: Annotated[int, Field(ge=0)] = 0

    def __post_init__(self) -> None:
        if self.iso_class is None and self.single_pitch is None:
            raise InputError("single_pitch", "missing", "is required where iso_class is not given")

    @lru_cache(maxsize=64)  # noqa: B019 - a few small objects, asked for at every gap of a scene
    def deviations(self, gear: Gear) -> Deviations:
        """Index deviation of each tooth [µm]."""
        f_pt, F_p = self.single_pitch, self.cumulative_pitch
        if self.iso_class is not None:
            known = gear_tolerances(gear, self.iso_class, self.edition)
            f_pt, F_p = f_pt or known.single_pitch, F_p or known.cumulative_pitch
        assert f_pt is not None
        random, z = np.random.default_rng(self.seed), abs(gear.teeth)
        teeth = f_pt / 2 * DISTRIBUTIONS["normal_two_sided"].quantile(random.random(z))
        share, begin = random.random(2)
        size = share * max((F_p or 0.0) - np.ptp(teeth), 0.0) / 2
        deviations = teeth + size * np.sin(2 * np.pi * (np.arange(z) / z + begin))
        return tuple((deviations * f_pt / max(np.abs(deviations - np.roll(deviations, 1)).max(), f_pt)).tolist())


@dataclass(frozen=True, kw_only=True, config=STRICT)
class RandomPitch(IndexDeviations):
    """Pitch errors of all teeth, drawn within tolerances; the same seed gives the same gear.

    Parameters
    ----------
    pinion, wheel
        Tolerances and seed of either gear.
    pinion_tooth, wheel_tooth
        Teeth with which the mesh cycle begins, as for ``pitch_errors``.
    """

    pinion: DrawnPitch | None = None
    wheel: DrawnPitch | None = None
    pinion_tooth: Tooth = 0
    wheel_tooth: Tooth = 0

    name: ClassVar[str] = "random_pitch"
    summary: ClassVar[str] = "gap: pitch errors of all teeth, drawn within tolerances"
    source: ClassVar[str] = "ISO 1328-1, single pitch and cumulative pitch"
    use: ClassVar[str] = "Side bands of gears of a class, with `gearbench hunting`; one seed is one gear."
    example: ClassVar[dict[str, Any]] = {"pinion": {"iso_class": 6, "seed": 1}}

    def check(self, pair: Pair, effects: Effects) -> None:
        """Refuse a class or a gear outside the scope of the standard, and teeth that a gear does not have."""
        if self.pinion is None and self.wheel is None:
            raise InputError("pinion", "missing", "tolerances are required, here or for the wheel")
        self.of_teeth(pair)
        super().check(pair, effects)

    def of_teeth(self, pair: Pair) -> Sequence[Deviations | None]:
        """The deviations that are drawn."""
        both = zip((self.pinion, self.wheel), pair.gears, strict=True)
        return [None if drawn is None else drawn.deviations(gear) for drawn, gear in both]
