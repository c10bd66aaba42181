"""Units of REXS attributes. The ``unit`` of every attribute is read, never assumed.

Source: units of the REXS database, versions 1.0 to 1.6 (rexs.info). In version 1.4, "°" was replaced by "deg", and
"none" by an empty text.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Dimension:
    """Kind of quantity: the unit of returned values, and REXS unit → its value in that unit."""

    unit: str
    factors: Mapping[str, float]

    def factor(self, unit: str) -> float | None:
        """Value of one REXS ``unit``, ignoring spaces; None if the dimension has no such unit."""
        return self.factors.get("".join(unit.split()))


def _dimension(unit: str, factors: dict[str, float]) -> Dimension:
    return Dimension(unit, MappingProxyType(factors))


LENGTH = _dimension("mm", {"mm": 1.0, "mum": 1e-3, "µm": 1e-3, "m": 1e3})
ANGLE = _dimension("°", {"°": 1.0, "deg": 1.0, "rad": 180 / math.pi})
TORQUE = _dimension("N·m", {"Nm": 1.0, "Nmm": 1e-3, "kNm": 1e3})
MODULUS = _dimension("GPa", {"N/mm^2": 1e-3, "MPa": 1e-3, "Pa": 1e-9, "GPa": 1.0})
SPEED = _dimension("1/min", {"1/min": 1.0, "1/s": 60.0, "Hz": 60.0, "rad/s": 30 / math.pi})
STIFFNESS = _dimension("N/µm", {"N/m": 1e-6, "N/mm": 1e-3, "N/mum": 1.0, "N/µm": 1.0})
NUMBER = _dimension("none", {"none": 1.0, "": 1.0, "-": 1.0, "%": 0.01})
