"""Profile crowning (barrelling): parabolic in the roll length of each gear."""

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
class ProfileCrowning(GapEffect):
    """Profile crowning C_α of each gear: e = C_α (2t − 1)², t from 0 to 1 over the roll length of its active profile.

    Nothing is missing in the middle of the active profile, the whole amount at both its ends. Positive: convex.

    Parameters
    ----------
    pinion, wheel
        C_α, material missing at either end of the active profile [µm].
    """

    pinion: Amount = 0.0
    wheel: Amount = 0.0

    name: ClassVar[str] = "profile_crowning"
    summary: ClassVar[str] = "gap: parabola along the profile of each gear"
    source: ClassVar[str] = "ISO 21771-1 C_α"
    use: ClassVar[str] = "Where tip and root are to be relieved without a kink."
    example: ClassVar[dict[str, Any]] = {"pinion": 4.0, "wheel": 4.0}

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap [mm], (position, pair, segment)."""
        t1, t2 = (profile_coordinate(lines, role) for role in Role)
        return MICROMETRE * (self.pinion * (2 * t1 - 1) ** 2 + self.wheel * (2 * t2 - 1) ** 2)

    def modifications(self, pair: Pair) -> tuple[Modification, ...]:
        """The same of each profile."""
        found = []
        for role, amount in zip(Role, (self.pinion, self.wheel), strict=True):
            low, high = pair.meshing.active_rolls[role]
            missing = amount * MICROMETRE / math.cos(pair.meshing.beta_b)
            shape = {"start": (low + high) / 2, "length": (high - low) / 2, "along": "roll", "one_sided": False}
            found.append(Modification(role=role, amount=missing, power=2, **shape))
        return tuple(m for m in found if m.amount != 0)
