"""Profile slope: a flank that leans, linear in the roll length of each gear."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from numpy.typing import NDArray
from pydantic.dataclasses import dataclass

from gearbench.effects.base import GapEffect
from gearbench.effects.error_modes import profile_coordinate
from gearbench.effects.relief import MICROMETRE, Amount
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.geometry.profile import Modification
from gearbench.geometry.role import Role
from gearbench.schema import STRICT


@dataclass(frozen=True, kw_only=True, config=STRICT)
class ProfileSlope(GapEffect):
    """Profile slope f_Hα of each gear: zero at the start of its active profile, full amount at its end (tip side).

    Linear along the path of contact, i.e. in roll length, as a profile is measured. Positive: material missing at
    the tip.

    Parameters
    ----------
    pinion, wheel
        Amounts [µm].
    """

    pinion: Amount = 0.0
    wheel: Amount = 0.0

    name: ClassVar[str] = "profile_slope"
    summary: ClassVar[str] = "gap: linear along the profile of each gear"
    source: ClassVar[str] = "ISO 1328-1 f_Hα"
    use: ClassVar[str] = "A known deviation of the pressure angle, or a deliberate one."
    example: ClassVar[dict[str, Any]] = {"pinion": 2.0, "wheel": -3.0}

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        return MICROMETRE * (
            self.pinion * profile_coordinate(lines, Role.PINION) + self.wheel * profile_coordinate(lines, Role.WHEEL)
        )

    def modifications(self, pair: Pair) -> tuple[Modification, ...]:
        """The same of each profile."""
        found = []
        for role, amount in zip(Role, (self.pinion, self.wheel), strict=True):
            low, high = pair.meshing.active_rolls[role]
            missing = amount * MICROMETRE / math.cos(pair.meshing.beta_b)
            shape = {"start": low, "length": high - low, "along": "roll", "one_sided": False}
            found.append(Modification(role=role, amount=missing, **shape))
        return tuple(m for m in found if m.amount != 0)
