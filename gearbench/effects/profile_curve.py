"""Profile of each gear as a curve: polynomial or points."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic.dataclasses import dataclass

from gearbench.effects.base import Effects
from gearbench.effects.curves import CurvesOfGears
from gearbench.effects.error_modes import profile_coordinate
from gearbench.effects.relief import MICROMETRE
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.geometry.profile import Modification
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class ProfileCurve(CurvesOfGears):
    """Deviation of the profile of each gear along its roll length, the same all over the face.

    A polynomial runs over the active profile: t = 0 at its start (root side), t = 1 at its end (tip side). Points stand
    at roll lengths √(R² − r_b²).

    Parameters
    ----------
    pinion, wheel
        The curve of each gear.
    """

    name: ClassVar[str] = "profile_curve"
    summary: ClassVar[str] = "gap: any curve along the profile of each gear"
    source: ClassVar[str] = "ISO 21771-1, profile modification; ISO 1328-1, profile trace"
    use: ClassVar[str] = "Where the profile is given as a polynomial or as a trace."
    example: ClassVar[dict[str, Any]] = {"pinion": {"polynomial": [0.0, 2.0, 6.0]}}

    def check(self, pair: Pair, beside: Effects) -> None:
        """Refuse points that miss more than half of the active profile: most likely they are of another gear."""
        for role, curve in self.curves.items():
            low, high = pair.meshing.active_rolls[role]
            if curve.at is not None and min(high, curve.at[-1]) - max(low, curve.at[0]) < (high - low) / 2:
                span = f"{curve.at[0]:g} to {curve.at[-1]:g} mm"
                allowed = f"must cover half of the active profile, roll lengths of {low:.5g} to {high:.5g} mm"
                raise InputError(f"{role.label}.at", span, allowed)

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        total = np.zeros(lines.shape)
        for role, curve in self.curves.items():
            total += MICROMETRE * curve.values(profile_coordinate(lines, role), lines.rolls[role])
        return total

    def modifications(self, pair: Pair) -> tuple[Modification, ...]:
        """The same of each profile, where all are polynomials."""
        found: list[Modification] = []
        for role, curve in self.curves.items():
            if curve.polynomial is None:
                return ()
            low, high = pair.meshing.active_rolls[role]
            for power, c in enumerate(curve.polynomial, start=1):
                missing = c * MICROMETRE / math.cos(pair.meshing.beta_b)
                shape = {"start": low, "length": high - low, "along": "roll", "one_sided": False}
                found.append(Modification(role=role, amount=missing, power=power, **shape))
        return tuple(m for m in found if m.amount != 0)

    def kinks(self, pair: Pair) -> tuple[float, ...]:
        """Positions u [mm] of the points of coarse curves."""
        T = pair.meshing.tangent_length
        return tuple(T - at if role else at for role, curve in self.curves.items() for at in curve.kinks)
