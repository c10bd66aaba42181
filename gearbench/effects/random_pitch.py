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

    Each tooth has a normally distributed deviation with 3 σ = f_pt/2, cut off at ± 3 σ. A wave of order 1 is added. Its
    phase and amplitude are random; the range of all deviations stays within F_p. The sum is scaled down if a pitch
    deviates by more than f_pt.

    Parameters
    ----------
    iso_class, edition
        Class of ISO 1328-1, for tolerances that are not given.
    single_pitch, cumulative_pitch
        f_pt and F_p [µm]. If neither a class nor F_p is given, there is no wave.
    seed
        Seed of the draw. Gears of a pair need different seeds. The planets of a set have the seed of the first planet
        plus 1, 2, …
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
            of_class = gear_tolerances(gear, self.iso_class, self.edition)
            f_pt, F_p = f_pt or of_class.single_pitch, F_p or of_class.cumulative_pitch
        assert f_pt is not None
        random, z = np.random.default_rng(self.seed), abs(gear.teeth)
        of_teeth = f_pt / 2 * DISTRIBUTIONS["normal_two_sided"].quantile(random.random(z))
        share, phase = random.random(2)
        amplitude = share * max((F_p or 0.0) - np.ptp(of_teeth), 0.0) / 2
        deviations = of_teeth + amplitude * np.sin(2 * np.pi * (np.arange(z) / z + phase))
        largest_pitch_deviation = np.abs(deviations - np.roll(deviations, 1)).max()
        return tuple((deviations * f_pt / max(largest_pitch_deviation, f_pt)).tolist())


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
    use: ClassVar[str] = "Sidebands of gears of an accuracy class, with `gearbench hunting`. Each seed gives one gear."
    example: ClassVar[dict[str, Any]] = {"pinion": {"iso_class": 6, "seed": 1}}

    def check(self, pair: Pair, effects: Effects) -> None:
        """Refuse a class or a gear outside the scope of the standard, and teeth that a gear does not have."""
        if self.pinion is None and self.wheel is None:
            raise InputError("pinion", "missing", "tolerances are required, here or for the wheel")
        self.of_teeth(pair)
        super().check(pair, effects)

    def of_teeth(self, pair: Pair) -> Sequence[Deviations | None]:
        """The deviations drawn for pinion and wheel."""
        both = zip((self.pinion, self.wheel), pair.gears, strict=True)
        return [None if table is None else table.deviations(gear) for table, gear in both]
