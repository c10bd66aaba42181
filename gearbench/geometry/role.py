"""Which gear of a pair, which flank of a tooth."""

from __future__ import annotations

from enum import IntEnum


class Role(IntEnum):
    """The two gears of a pair; the pinion drives. The value is the index wherever a pair's gears stand in order."""

    PINION = 0
    WHEEL = 1

    @property
    def label(self) -> str:
        """Name in scenes and messages: pinion, wheel."""
        return self.name.lower()

    @property
    def mate(self) -> Role:
        """The other gear."""
        return Role(1 - self)


class Side(IntEnum):
    """The two flanks of a tooth, its tip up; the value is the sign of the angle θ from the tooth's centre line."""

    LEFT = -1
    RIGHT = 1

    @property
    def label(self) -> str:
        """Name of its boundaries: left, right."""
        return self.name.lower()
