"""Panels of the mesh cycle between transitions of the contact, short next to load transfers and longer away from them.

A panel is an interval of mesh phases with Gauss points of its own. A load transfer is a phase at which a tooth pair
takes up or sheds its load. There the compliance of the pair's contact changes like a logarithm or a power of the load.
STE and stiffness are therefore steep on one side of a load transfer, and one polynomial over a long panel converges
slowly. They converge exponentially on panels whose lengths grow geometrically from the load transfer (Gui and Babuška,
The h, p and h-p versions of the finite element method in one dimension, Numer. Math. 49, 1986).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

#: Distance within which transitions are merged [mesh periods], indexed by rank: of ranks 0 and 1, and last of rank −1.
#: A jump of the stiffness that is misplaced by d changes each harmonic by up to 2d of the jump.
CLOSE = (5e-4, 5e-3, 2e-4)
#: Maximum length of a panel next to a load transfer [mesh periods].
FIRST_PANEL = 0.04
#: Maximum ratio of the distances from a load transfer to the far and to the near end of a panel.
GROWTH = 8.0
#: Maximum length of a panel of helical pairs [mesh periods].
LONGEST = 0.25


class Transition(NamedTuple):
    """A change of the contact at a mesh phase; the lower its rank, the more exactly a panel must begin there.

    ``rank`` is 0 if a pair takes up or sheds its load or a contact line passes an end of the path of contact, −1 at
    both ends of a ramp, and 1 otherwise. A ramp reaches from the first touch of a contact line to contact over its
    whole length. ``side`` tells where STE and stiffness are steep: 1 after the transition, −1 before it, 0 neither.
    """

    phase: float
    rank: int
    side: int = 0


def panel_starts(
    transitions: Iterable[Transition],
    longest: float = 1.0,
    close: tuple[float, float, float] = CLOSE,
    length: int = 1,
) -> list[float]:
    """Starts of the panels of a cycle of ``length`` mesh periods: phases in [0, ``length``), ascending, including 0.

    Panels begin at the ``transitions`` and are split if they are longer than ``longest`` or too long for their distance
    from a load transfer. Of several transitions within ``close`` (as ``CLOSE``), the one of the lowest rank is kept.
    """
    transitions = list(transitions)
    kept = [0.0]
    for phase, rank, _ in sorted(transitions, key=lambda transition: (transition.rank, transition.phase)):
        from_0, *others = (abs(_distance_after(phase, other, length, length / 2)) for other in kept)
        # phase 0 begins a panel but need not be a transition: merged with it, a load transfer is misplaced by their
        # distance, which must be at most close[-1]
        if from_0 > close[rank if rank > 0 else -1] and min(others, default=1.0) > close[rank]:
            kept.append(phase)
    after, before = ([transition.phase for transition in transitions if transition.side == side] for side in (1, -1))
    starts: list[float] = []
    for a, b in pairwise([*sorted(kept), float(length)]):
        # distances from the previous load transfer to the beginning of the panel, and from its end to the next one
        left = min((max(_distance_after(a, s, length), 0.0) for s in after), default=1.0)
        right = min((max(_distance_after(s, b, length), 0.0) for s in before), default=1.0)
        starts += _split(a, b, left, right, longest)[:-1]
    return starts


def _distance_after(phase: float, other: float, length: int, margin: float = CLOSE[1]) -> float:
    """``phase`` minus ``other`` on the cycle, in [−margin, length − margin).

    It is negative, instead of almost a whole cycle, if ``phase`` lies at most ``margin`` before ``other``.
    """
    return (phase - other + margin) % length - margin


def _split(a: float, b: float, left: float, right: float, longest: float) -> list[float]:
    """Ends of the panels that split [a, b], with load transfers at a − ``left`` and b + ``right``."""
    middle = (a + b) / 2
    inside = [*_geometric(left, middle - a, a, 1), *_geometric(right, b - middle, b, -1)[::-1]]
    ends = [a, *inside, b]
    if not _fits(ends, left, right):
        ends = sorted([*ends, middle])
    pieces = [math.ceil((high - low) / longest - 1e-9) for low, high in pairwise(ends)]
    each = zip(pairwise(ends), pieces, strict=True)
    return [low + i * (high - low) / n for (low, high), n in each for i in range(n)] + [b]


def _geometric(distance: float, length: float, start: float, sign: int) -> list[float]:
    """Ends of panels inside an interval, in geometric progression from a load transfer outside it.

    The interval begins at ``start``, at the given ``distance`` from the load transfer, and extends over ``length`` in
    the direction ``sign``.
    """
    first = max(distance, FIRST_PANEL / GROWTH)
    count = math.ceil(math.log((distance + length) / first) / math.log(GROWTH) - 1e-9)
    ratio = ((distance + length) / first) ** (1 / max(count, 1))
    return [start + sign * (first * ratio**i - distance) for i in range(1, count)]


def _fits(ends: Sequence[float], left: float, right: float) -> bool:
    """Whether all panels are short enough for their distances from both load transfers."""
    a, b = ends[0], ends[-1]
    return all(
        left + high - a <= max(FIRST_PANEL, GROWTH * (left + low - a)) * (1 + 1e-9)
        and right + b - low <= max(FIRST_PANEL, GROWTH * (right + b - high)) * (1 + 1e-9)
        for low, high in pairwise(ends)
    )
