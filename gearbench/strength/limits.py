"""Limits of the strength numbers, and by how much a design misses them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.geometry.material import STRICT
from gearbench.strength.rating import Strength

#: Largest violation reported: sliding at an interference point is infinite, and an optimiser adds violations up.
LARGEST_VIOLATION = 1e6


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Limits:
    """Limits of a design; a limit that is absent is not checked.

    Parameters
    ----------
    total_contact_ratio_min
        Least total contact ratio ε_γ [–].
    specific_sliding_max
        Largest specific sliding [–].
    contact_pressure_max, root_stress_max
        Largest Hertz pressure and nominal root stress of the material [MPa].
    """

    total_contact_ratio_min: Annotated[float, Field(ge=1.0)] | None = 1.1
    specific_sliding_max: Annotated[float, Field(gt=0.0)] | None = 2.5
    contact_pressure_max: Annotated[float, Field(gt=0.0)] | None = None
    root_stress_max: Annotated[float, Field(gt=0.0)] | None = None


def violations(strength: Strength, limits: Limits) -> dict[str, float]:
    """Relative excess over each limit that is given, (value − limit)/limit; the limit holds where it is ≤ 0.

    For the contact ratio the excess is (limit − value)/limit. Values are at most 1e6, so that they stay finite.
    """
    s = strength
    highest = {
        "specific_sliding": (s.specific_sliding, limits.specific_sliding_max),
        "contact_pressure": (s.contact_pressure, limits.contact_pressure_max),
        "root_stress": (max(s.root_stress), limits.root_stress_max),
    }
    least = limits.total_contact_ratio_min
    excess = {} if least is None else {"total_contact_ratio": (least - s.total_contact_ratio) / least}
    excess |= {name: value / limit - 1 for name, (value, limit) in highest.items() if limit is not None}
    return {name: min(value, LARGEST_VIOLATION) for name, value in excess.items()}
