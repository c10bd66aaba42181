"""Memory of a response over speed: matrices are made in blocks, the size of the results is known before they are."""

from __future__ import annotations

from collections.abc import Iterator

from gearbench.budget import SMALL, memory_limit, require
from gearbench.scene import Scene

#: Numbers of an array that is made in one go.
BLOCK = 200_000
#: Numbers that are kept at the same time, at most, for each mesh, speed and order: curves over time; or the variables,
#: and those of each bearing. Measured, with a tenth in reserve.
OF_CURVES, OF_VARIABLES, OF_BEARING = 48.0, 42.0, 7.0
#: The same for each speed and step of the period with loss of contact, its two sweeps together.
OF_STEP = 108.0
#: And of scattered samples, for each order and for each speed of a block.
OF_SAMPLE, OF_SPEED = 6.5, 0.2
_NUMBER = 8


def in_blocks(count: int, each: int) -> Iterator[slice]:
    """The numbers below ``count`` in blocks of about ``BLOCK`` numbers, ``each`` of them for one."""
    step = max(1, BLOCK // max(each, 1))
    return (slice(first, first + step) for first in range(0, count, step))


def bearings(scene: Scene) -> int:
    """Bearings of the system of ``scene``."""
    return 0 if scene.system is None else sum(len(shaft.bearings) for shaft in scene.system.shafts)


def speed_memory(orders: int, meshes: int, bearings: int) -> float:
    """Memory [bytes] that a speed takes in a linear response of so many orders."""
    return _NUMBER * meshes * (orders + 1) * max(OF_CURVES, OF_VARIABLES + OF_BEARING * bearings)


def nonlinear_memory(steps: int, harmonics: int, bearings: int) -> float:
    """Memory [bytes] that a speed takes where flanks part, with so many steps of the period and orders."""
    return _NUMBER * (OF_STEP * steps + 2 * OF_BEARING * harmonics * (1 + bearings))


def sample_memory(harmonics: int, block: int) -> float:
    """Memory [bytes] that a sample takes among others, at a block of speeds."""
    return _NUMBER * (OF_SAMPLE * (harmonics + 1) + OF_SPEED * block)


def require_each(each: float, count: int, key: str, of: str) -> None:
    """Refuse more than the memory holds of what takes ``each`` bytes.

    Parameters
    ----------
    key
        In the singular, as it is given: "speed".
    of
        What each of them has, in words.

    Raises
    ------
    MemoryBudgetError
        Naming the number that would fit.
    """
    fits = int(max(memory_limit(), SMALL) / each)
    require(each * count, key, f"{count} {key}s × {of}", f"{fits} {key}s would fit" if fits else f"less than {of} fit")
