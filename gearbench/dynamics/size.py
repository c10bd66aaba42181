"""Sizes of a response over speed: number of bearings, and blocks that limit the size of matrices."""

from __future__ import annotations

from collections.abc import Iterator

from gearbench.scene import Scene

#: Maximum number of elements of an array that is computed in one go.
BLOCK = 200_000


def in_blocks(count: int, elements: int) -> Iterator[slice]:
    """Slices of ``range(count)`` with at most ``BLOCK`` array elements, or one item; an item has ``elements``."""
    step = max(1, BLOCK // max(elements, 1))
    return (slice(first, first + step) for first in range(0, count, step))


def bearings(scene: Scene) -> int:
    """Number of bearings of the system of ``scene``.

    For a coupled train, an upper bound of the number of bodies, which take the place of bearings.
    """
    if scene.coupled:
        return len(scene.geometry.gears) + 1
    return 0 if scene.system is None else sum(len(shaft.bearings) for shaft in scene.system.shafts)
