"""Pareto-optimal points of objectives to be minimised, and their hypervolume."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def non_dominated(F: NDArray) -> NDArray:
    """Flag the rows of ``F`` (point, objective) that no other row dominates, (point,).

    A row dominates another if it is at least as good in all objectives and better in one; smaller is better.
    """
    keep = np.ones(len(F), dtype=bool)
    order = np.lexsort(F.T[::-1])  # a point comes after every point that dominates it
    front = np.empty((0, F.shape[1]))
    for i in order:
        keep[i] = not np.any(np.all(front <= F[i], axis=1) & np.any(front < F[i], axis=1))
        if keep[i]:
            front = np.concatenate([front, F[i : i + 1]])
    return keep


def hypervolume(F: NDArray) -> float:
    """Share of the unit box that the points ``F`` ≥ 0 (point, objective) dominate; points outside are ignored."""
    inside = F[np.all(F < 1.0, axis=1)]
    if len(inside) == 0:
        return 0.0
    if F.shape[1] == 1:
        return float(1.0 - inside.min())
    if F.shape[1] == 2:
        x, y = inside[np.lexsort(inside.T[::-1])].T
        lowest = np.minimum.accumulate(np.concatenate([[1.0], y]))
        return float(np.sum((1.0 - x) * np.maximum(lowest[:-1] - y, 0.0)))
    from pymoo.indicators.hv import Hypervolume

    value = Hypervolume(ref_point=np.ones(F.shape[1]), norm_ref_point=False)(inside)
    return float(value)  # pyright: ignore[reportArgumentType]
