"""One-dimensional polynomials of the Ritz fields, with derivatives and quadrature.

Height functions vanish at the clamped root: f_k(ξ) = ∫₀^ξ P_k with shifted Legendre polynomials P_k, scaled so that
the derivatives are orthonormal. They span ξ·(polynomials) and keep the stiffness well conditioned at any order. Width
(and thickness) functions are orthonormal Legendre polynomials. Source: Szabó & Babuška, Finite Element Analysis, ch. 3.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike, NDArray


def height_functions(count: int, xi: ArrayLike) -> tuple[NDArray, NDArray]:
    """Height functions f_0 … f_{count−1} and their derivatives at ξ ∈ [0, 1], each (…, count)."""
    t = 2 * np.asarray(xi, dtype=float) - 1
    p = legendre.legvander(t, count).reshape(*t.shape, -1)
    k = np.arange(1, count)
    integral = np.empty((*t.shape, count))
    integral[..., 0] = (t + 1) / 2
    # ∫₀^ξ P_k dξ = (P_{k+1} − P_{k−1}) / (2(2k+1))
    integral[..., 1:] = (p[..., 2 : count + 1] - p[..., : count - 1]) / (2 * (2 * k + 1))
    scale = np.sqrt(2 * np.arange(count) + 1)
    return integral * scale, p[..., :count] * scale


def jointed_height_functions(counts: tuple[int, int], joint: float, xi: ArrayLike) -> tuple[NDArray, NDArray]:
    """Height functions of two families that meet at ξ = ``joint``, and their derivatives, each (…, lower + upper).

    The lower functions are constant above the joint, the upper ones begin there. Sums are continuous with a kink at the
    joint, and the derivatives are orthogonal.
    """
    xi = np.asarray(xi, dtype=float)
    low, high = xi / joint, (xi - joint) / (1 - joint)
    (f, df), (g, dg) = (height_functions(n, np.clip(t, 0, 1)) for n, t in zip(counts, (low, high), strict=True))
    above = (xi > joint)[..., None]
    slopes = [np.where(above, 0.0, df / joint), np.where(above, dg / (1 - joint), 0.0)]
    return np.concatenate([f, g], axis=-1), np.concatenate(slopes, axis=-1)


def legendre_functions(count: int, eta: ArrayLike) -> NDArray:
    """Legendre functions g_0 … g_{count−1}, orthonormal on η ∈ [0, 1], (…, count)."""
    t = 2 * np.asarray(eta, dtype=float) - 1
    return legendre.legvander(t, count - 1).reshape(*t.shape, -1) * np.sqrt(2 * np.arange(count) + 1)


def width_functions(count: int, eta: ArrayLike) -> tuple[NDArray, NDArray]:
    """Legendre functions as ``legendre_functions``, and their derivatives by η, each (…, count)."""
    t = 2 * np.asarray(eta, dtype=float) - 1
    p = legendre.legvander(t, count - 1).reshape(*t.shape, -1)
    slope = np.zeros_like(p)
    # P'_k = Σ (2j+1) P_j over j = k−1, k−3, …
    for k in range(1, count):
        j = np.arange(k - 1, -1, -2)
        slope[..., k] = p[..., j] @ (2 * j + 1.0)
    scale = np.sqrt(2 * np.arange(count) + 1)
    return p * scale, 2 * slope * scale


def axis_functions(count: int, eta: ArrayLike) -> tuple[NDArray, NDArray]:
    """1, t and integrated Legendre functions of t = 2η − 1, alternately even and odd, and their derivatives by η.

    They span the same polynomials as ``width_functions``. ∫ a b, ∫ a b′ and ∫ a′ b′ vanish beyond the next but one
    neighbour, so that systems are chains.
    """
    t = 2 * np.asarray(eta, dtype=float) - 1
    p = legendre.legvander(t, max(count, 1)).reshape(*t.shape, -1)
    value, slope = p[..., :count].copy(), np.zeros((*t.shape, count))
    slope[..., 1:2] = 2.0
    for k in range(2, count):
        # ∫ P_{k−1} dt = (P_k − P_{k−2}) / (2k−1), scaled so that the slopes by η are orthonormal
        value[..., k] = (p[..., k] - p[..., k - 2]) / (2 * math.sqrt(2 * k - 1))
        slope[..., k] = p[..., k - 1] * math.sqrt(2 * k - 1)
    return value, slope


def gauss(points: int, start: float = 0.0, stop: float = 1.0) -> tuple[NDArray, NDArray]:
    """Gauss–Legendre nodes and weights on [start, stop]."""
    t, w = _leggauss(points)
    half = (stop - start) / 2
    return start + half * (t + 1), half * w


@lru_cache(maxsize=128)
def _leggauss(points: int) -> tuple[NDArray, NDArray]:
    """Nodes and weights on [−1, 1], cached."""
    t, w = legendre.leggauss(points)
    t.flags.writeable = w.flags.writeable = False
    return t, w


def height_quadrature(
    points: int, breaks: Iterable[float] = (), branches: Iterable[float] = (0.0,)
) -> tuple[NDArray, NDArray]:
    """Nodes and weights on ξ ∈ [0, 1], one Gauss panel between ``breaks``.

    ``branches``: positions c at which the thickness grows like a power of √(ξ − c): root circle and base circle, inside
    [0, 1] or below it. A panel above such a position is mapped by ξ = c + t², in which the thickness is smooth.
    """
    inside = [x for x in breaks if 1e-6 < x < 1 - 1e-6]
    nodes, weights = [], []
    for start, stop in pairwise([0.0, *sorted(inside), 1.0]):
        below = [c for c in branches if c <= start + 1e-6]
        if below:
            origin = min(max(below), start)
            t, w = gauss(points, math.sqrt(start - origin), math.sqrt(stop - origin))
            x, w = origin + t**2, 2 * t * w
        else:
            x, w = gauss(points, start, stop)
        nodes.append(x)
        weights.append(w)
    return np.concatenate(nodes), np.concatenate(weights)


def sampled(most: int, ratio: float) -> NDArray:
    """Whole numbers 0, 1, … 5, then about a geometric progression with ``ratio``, up to ``most``."""
    n = [0, 1, 2, 3, 4, 5]
    while n[-1] < most:
        n.append(min(most, max(n[-1] + 1, round(n[-1] * ratio))))
    return np.array([k for k in n if k <= most], dtype=float)


def spline_weights(knots: NDArray, points: NDArray, degree: int) -> NDArray:
    """Weights of values at ``knots`` in the values at ``points`` of their not-a-knot spline, (point, knot).

    The ``degree`` is odd; with too few knots it is reduced to the next lower odd one.
    """
    from scipy.interpolate import make_interp_spline

    most = min(degree, len(knots) - 1)
    return make_interp_spline(knots, np.eye(len(knots)), k=most - (most + 1) % 2)(points)
