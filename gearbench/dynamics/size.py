"""Sizes of a response over speed: matrices are made in blocks."""

from __future__ import annotations

from collections.abc import Iterator

from gearbench.scene import Scene

#: Numbers of an array that is made in one go.
BLOCK = 200_000


def in_blocks(count: int, each: int) -> Iterator[slice]:
    """The numbers below ``count`` in blocks of about ``BLOCK`` numbers, ``each`` of them for one."""
    step = max(1, BLOCK // max(each, 1))
    return (slice(first, first + step) for first in range(0, count, step))


def bearings(scene: Scene) -> int:
    """Bearings of the system of ``scene``; of a planetary set its members."""
    if scene.coupled:
        return len(scene.geometry.gears) + 1
    return 0 if scene.system is None else sum(len(shaft.bearings) for shaft in scene.system.shafts)
