"""Fronts and single gears compared: hypervolume, coverage, and by how much a gear beats a front or misses it.

All objectives are made small; ``F`` holds them as (point, objective).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.optimisation.front import hypervolume

#: A gear belongs to the wide front if it is worse than some gear of the front by at most this much in both objectives.
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
    """Points that are worse than some point of the front by at most ``share`` in every objective, (point,)."""
    return np.array([np.min(np.max(f / front, axis=1)) <= 1 + share for f in F], dtype=bool)
