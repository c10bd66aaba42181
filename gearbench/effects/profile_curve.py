"""Profile of each gear as a curve: polynomial or points."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic.dataclasses import dataclass

from gearbench.effects.base import Effects
from gearbench.effects.curves import CurvesOfGears
from gearbench.effects.shape import Polyline, Ramp, slope
from gearbench.errors import InputError
from gearbench.geometry.names import GEARS
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class ProfileCurve(CurvesOfGears):
    """Deviation of the profile of each gear along its roll length, the same all over the face.

    A polynomial runs over the active profile, from t = 0 (root side) to t = 1 (tip side). Points are at roll lengths
    √(R² − r_b²). On a ring these increase towards the root, and all of them may be negative, as in ISO 21771.

    Parameters
    ----------
    pinion, wheel
        The curve of each gear.
    """

    name: ClassVar[str] = "profile_curve"
    summary: ClassVar[str] = "gap: any curve along the profile of each gear"
    source: ClassVar[str] = "ISO 21771-1, profile modification; ISO 1328-1, profile trace"
    use: ClassVar[str] = "A profile given as a polynomial or as a trace."
    example: ClassVar[dict[str, Any]] = {"pinion": {"polynomial": [0.0, 2.0, 6.0]}}

    def check(self, pair: Pair, effects: Effects) -> None:
        """Refuse points that cover less than half of the active profile: they probably belong to another gear."""
        for shape in self.shapes(pair):
            (curve,) = shape.factors
            if shape.gear is None or not isinstance(curve, Polyline):
                continue
            sign = pair.gears[shape.gear].sign
            low, high = sorted(sign * roll for roll in pair.meshing.active_rolls[shape.gear])
            first, last = sorted((sign * curve.at[0], sign * curve.at[-1]))
            if min(high, last) - max(low, first) < (high - low) / 2:
                allowed = f"must cover at least half of the active profile, roll lengths of {low:.5g} to {high:.5g} mm"
                raise InputError(f"{GEARS[shape.gear]}.at", f"{first:g} to {last:g} mm", allowed)

    def extent(self, pair: Pair, index: int) -> Ramp:
        """Ramp t from 0 to 1 over the roll lengths of the active profile."""
        return slope(pair, index)
