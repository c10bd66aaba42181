"""Gauss–Legendre quadrature and the polynomials through its points."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray


@lru_cache(maxsize=256)
def gauss(count: int) -> tuple[NDArray, NDArray]:
    """Nodes and weights of the Gauss–Legendre rule with ``count`` points on [−1, 1]."""
    return legendre.leggauss(count)


@lru_cache(maxsize=64)
def legendre_transform(count: int) -> NDArray:
    """Matrix from values at ``count`` Gauss points to Legendre coefficients of their polynomial, by the Gauss rule."""
    nodes, weight = gauss(count)
    return (2 * np.arange(count)[:, None] + 1) / 2 * legendre.legvander(nodes, count - 1).T * weight


def interpolation(count: int, t: NDArray) -> NDArray:
    """Matrix from values at ``count`` Gauss points to values of their polynomial at t in [−1, 1], (…, count)."""
    return legendre.legvander(t, count - 1) @ legendre_transform(count)
