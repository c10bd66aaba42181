"""Panels of the mesh cycle between changes of the contact, short beside births and growing with the distance from them.

Where a pair of teeth takes its load the compliance of what has just begun to touch falls like a logarithm or a power of
that load: beside a birth STE and stiffness have a steep side, on which polynomials over one long panel converge slowly.
On panels whose ends lie in geometric progression from it they converge exponentially again (Gui and Babuška, The h, p
and h-p versions of the finite element method in one dimension, Numer. Math. 49, 1986).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

#: Changes closer than this are one, by rank 0, 1 and −1 [mesh cycles].
CLOSE = (1e-3, 5e-3, 2e-4)
#: The longest panel beside a birth, how many times as far from it as it begins a panel may end, and the longest of
#: helical pairs [mesh cycles].
BESIDE, GROWTH, LONGEST = 0.04, 8.0, 0.25


class Change(NamedTuple):
    """A change of the contact at a mesh phase.

    ``rank`` is 0 where a pair takes or leaves its load or an end of its line, −1 at both ends of a ramp on which it
    does, 1 otherwise; ``side`` where curves are steep beside it: 1 after it, −1 before it, 0 neither.
    """

    phase: float
    rank: int
    side: int = 0


def panel_ends(
    changes: Iterable[Change], longest: float = 1.0, close: tuple[float, float, float] = CLOSE
) -> list[float]:
    """Beginnings of panels in [0, 1), ascending, 0 among them; of ``close`` changes that of the lowest rank counts."""
    changes = list(changes)
    kept = [0.0]
    for phase, rank, _ in sorted(changes, key=lambda change: (change.rank, change.phase)):
        start, *others = (abs(_behind(phase, other, 0.5)) for other in kept)
        # 0 begins a panel whether or not anything changes there: what does beside it is not that
        if start > close[rank if rank > 0 else -1] and min(others, default=1.0) > close[rank]:
            kept.append(phase)
    after, before = ([change.phase for change in changes if change.side == side] for side in (1, -1))
    found: list[float] = []
    for a, b in pairwise([*sorted(kept), 1.0]):
        # phases from the nearest birth before the panel to its beginning, and from its end to the nearest one after it
        left = min((max(_behind(a, s), 0.0) for s in after), default=1.0)
        right = min((max(_behind(s, b), 0.0) for s in before), default=1.0)
        found += _split(a, b, left, right, longest)[:-1]
    return found


def _behind(phase: float, other: float, least: float = CLOSE[1]) -> float:
    """``phase`` less ``other``, in [−least, 1 − least): of those close together either may come first."""
    return (phase - other + least) % 1.0 - least


def _split(a: float, b: float, left: float, right: float, longest: float) -> list[float]:
    """Ends of the panels that [a, b] is split into, with births ``left`` before a and ``right`` after b."""
    middle = (a + b) / 2
    inside = [*_grown(left, middle - a, a, 1), *_grown(right, b - middle, b, -1)[::-1]]
    ends = [a, *inside, b]
    if not _fits(ends, left, right):
        ends = sorted([*ends, middle])
    pieces = [math.ceil((high - low) / longest - 1e-9) for low, high in pairwise(ends)]
    each = zip(pairwise(ends), pieces, strict=True)
    return [low + i * (high - low) / n for (low, high), n in each for i in range(n)] + [b]


def _grown(distance: float, length: float, start: float, sign: int) -> list[float]:
    """Ends within a piece of this ``length``, in geometric progression from a birth ``distance`` before its start."""
    first = max(distance, BESIDE / GROWTH)
    count = math.ceil(math.log((distance + length) / first) / math.log(GROWTH) - 1e-9)
    ratio = ((distance + length) / first) ** (1 / max(count, 1))
    return [start + sign * (first * ratio**i - distance) for i in range(1, count)]


def _fits(ends: Sequence[float], left: float, right: float) -> bool:
    """Whether no panel is too long for its distance from either birth."""
    a, b = ends[0], ends[-1]
    return all(
        left + high - a <= max(BESIDE, GROWTH * (left + low - a)) * (1 + 1e-9)
        and right + b - low <= max(BESIDE, GROWTH * (right + b - high)) * (1 + 1e-9)
        for low, high in pairwise(ends)
    )
