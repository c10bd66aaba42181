"""Earlier name of the gears of a pair, kept for one version with a warning."""

from enum import IntEnum
from typing import Any
from warnings import warn


def __getattr__(name: str) -> Any:
    if name != "Role":
        raise AttributeError(name)
    warn("geometry.role.Role is now an index: 0 the pinion, 1 the wheel", DeprecationWarning, stacklevel=2)
    return IntEnum("Role", {"PINION": 0, "WHEEL": 1})
