"""Fronts and single gears compared: hypervolume, coverage, and by how much a gear beats a front or misses it.

All objectives are made small; ``F`` holds them as (point, objective).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.optimise.front import hypervolume, non_dominated

#: A gear belongs to the wide front if making it better by this much in both objectives would put it on the front.
WIDE = 0.10


def coverage(A: NDArray, B: NDArray) -> float:
    """Share of the points of B that some point of A equals or dominates (Zitzler & Thiele 1999)."""
    return float(np.mean([np.any(np.all(b >= A, axis=1)) for b in B])) if len(B) else float("nan")


def reference_point(*fronts: NDArray) -> NDArray:
    """Worst of each objective over all the fronts, and 10 % more, (objective,)."""
    return 1.1 * np.max([F.max(axis=0) for F in fronts], axis=0)


def shares(ours: NDArray, theirs: NDArray) -> tuple[float, float]:
    """Hypervolumes of two fronts, as shares of the box below their common reference point."""
    reference = reference_point(ours, theirs)
    return hypervolume(ours / reference), hypervolume(theirs / reference)


def lead(point: NDArray, front: NDArray) -> float:
    """By which share ``point`` beats some point of the front in both objectives; negative where it beats none."""
    return float(np.max(np.min(1 - point / front, axis=1)))


def distance(point: NDArray, front: NDArray) -> float:
    """By which share the front must become better to reach ``point``; negative where it goes beyond it."""
    return float(np.min(np.max(front / point, axis=1)) - 1)


def wide(F: NDArray, front: NDArray, share: float = WIDE) -> NDArray:
    """Which points the front does not dominate once they are better by ``share`` in both objectives, (point,)."""
    return np.array([not np.any(np.all(front < (1 - share) * f, axis=1)) for f in F], dtype=bool)


def front_of(F: NDArray) -> NDArray:
    """The points that no other dominates, by the first objective."""
    kept = F[non_dominated(F)]
    return kept[np.lexsort(kept.T[::-1])]
