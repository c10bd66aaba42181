"""Pitch errors: teeth ahead of or behind their nominal positions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from pydantic.dataclasses import dataclass

from gearbench.effects.base import Effects
from gearbench.effects.index_deviations import Deviations, IndexDeviations, Tooth
from gearbench.errors import InputError
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class PitchErrors(IndexDeviations):
    """Index deviations of the teeth, in one of the many mesh cycles of a revolution.

    Teeth are numbered from 0 in the order in which they come into mesh. The mesh cycle begins when ``pinion_tooth`` and
    ``wheel_tooth`` reach the start of the path of contact at y = 0. A single cycle is not periodic; ``gearbench
    hunting`` computes all cycles.

    Parameters
    ----------
    pinion, wheel
        Index deviation of the loaded flank of each tooth [µm], an arc of the pitch circle in the transverse plane;
        positive: material missing. With Σ, the sum of the single pitch deviations f_pi up to the tooth (ISO 1328-1,
        positive for a long pitch), it is +Σ on drive flanks of the pinion and coast flanks of the wheel, and −Σ on the
        other two.
    pinion_tooth, wheel_tooth
        Teeth with which the mesh cycle begins.
    """

    pinion: Deviations | None = None
    wheel: Deviations | None = None
    pinion_tooth: Tooth = 0
    wheel_tooth: Tooth = 0

    name: ClassVar[str] = "pitch_errors"
    summary: ClassVar[str] = "gap: one amount for each tooth, over one mesh cycle"
    source: ClassVar[str] = "ISO 1328-1 index deviation F_pi"
    use: ClassVar[str] = "Teeth that differ from one another: pitch deviations, run-out."
    example: ClassVar[dict[str, Any]] = {"pinion": [0.0, 2.0, -1.0, 1.0, 0.0]}

    def check(self, pair: Pair, effects: Effects) -> None:
        """Refuse lists that do not have one deviation for each tooth."""
        if self.pinion is None and self.wheel is None:
            raise InputError("pinion", "missing", "deviations are required, here or for the wheel")
        for name, gear in zip(("pinion", "wheel"), pair.gears, strict=True):
            deviations, count = getattr(self, name), abs(gear.teeth)
            if deviations is not None and len(deviations) != count:
                raise InputError(name, f"{len(deviations)} deviations", f"must be one for each of the {count} teeth")
        super().check(pair, effects)

    def of_teeth(self, pair: Pair) -> Sequence[Deviations | None]:
        """The given deviations."""
        return self.pinion, self.wheel
