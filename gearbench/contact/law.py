"""Contact law of a segment, g(P) = P (a − h ln P), continued by its tangent, in NumPy.

With L = a/h − ln P the law reads g = h P L. Its slope h (L − 1) is zero at L = 1, far beyond its validity. Below L = 2
(half-width of contact 0.6 times the depth t of the centre line of the tooth, C3) its tangent continues the law, so that
it is monotone at any load. With h = 0 the law is linear, g = a P.

A segment may be a cell along which the initial gap, and thus the compression, varies by ±σ. Its compression s is that
of the end which touches first, because that of the middle, s − σ, would lose all digits if the gap varies by a million
compressions. If s < 2σ, only the part t = s/(2σ) of the cell is loaded, and P = P_σ t² with P_σ = g⁻¹(σ). For a linear
law this is the mean of the law over the cell; for other laws it is continuous at s = 2σ. The compiled kernels contain
the same law (C5, C7 of docs/algorithms.md).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: L = a/h − ln P below which the law is continued by its tangent.
TANGENT_FROM = 2.0
#: Minimum of 1/φ in ``steepening``: where the tangent continues the law, g⁻¹(2σ) ≤ 3 g⁻¹(σ), so a cell is at most 3/2
#: as stiff as (C7) says.
STEEPEST = 2 / 3
#: Largest exponent passed to exp, so that small multiples of the result are finite.
LARGEST_EXPONENT = 690.0
#: Coefficient of r⁸ in the approximation −r²/6 − … of the mean of ln(1 + ξr) over |ξ| < 1, which is ln 2 − 1 at r = 1.
TAIL = 5 / 6 - math.log(2)


def tangent_force(a: NDArray, h: NDArray) -> NDArray:
    """P₀ = exp(a/h − 2), above which the tangent continues the law; infinite for a linear law."""
    logarithmic = h > 0
    with np.errstate(over="ignore"):
        return np.where(logarithmic, np.exp(a / np.where(logarithmic, h, 1.0) - TANGENT_FROM), np.inf)


def compression(P: NDArray, a: NDArray, h: NDArray, sigma: ArrayLike = 0.0) -> NDArray:
    """Compression s of the end that touches first, under forces P ≥ 0."""
    sigma = np.broadcast_to(np.asarray(sigma, dtype=float), np.shape(P))
    part = sigma > 0
    if part.any():
        P_sigma = inverse(np.where(part, sigma, 0.0), a, h)[0]
        part = part & (P_sigma > P)
        t = np.sqrt(np.divide(P, P_sigma, out=np.zeros_like(P_sigma), where=part))
        return np.where(part, 2 * sigma * t, sigma + compression(P, a, h))
    edge = tangent_force(a, h)
    with np.errstate(invalid="ignore"):
        low = np.minimum(P, edge)
        return low * (a - h * np.log(np.where(low > 0, low, 1.0))) + np.where(edge < P, h * (P - edge), 0.0)


def slope(P: NDArray, a: NDArray, h: NDArray, sigma: ArrayLike = 0.0) -> NDArray:
    """Slope dg/dP at forces P > 0."""
    sigma = np.broadcast_to(np.asarray(sigma, dtype=float), np.shape(P))
    P_sigma = inverse(sigma, a, h)[0]
    part = P_sigma > P
    return np.where(
        part,
        sigma / np.sqrt(np.where(part, P * P_sigma, 1.0)),
        np.where(h > 0, np.maximum(a - h * np.log(P) - h, h), a),
    )


def inverse(s: NDArray, a: NDArray, h: NDArray, sigma: ArrayLike = 0.0) -> tuple[NDArray, NDArray, NDArray]:
    """Force P = g⁻¹(s), slope dP/ds and energy ∫P ds of segments compressed by s; all zero for s ≤ 0."""
    sigma = np.broadcast_to(np.asarray(sigma, dtype=float), np.shape(s))
    cell = sigma > 0
    if not cell.any():
        return _inverse(s, a, h)
    (P, w, e), (P_sigma, _, e_sigma) = _inverse(np.maximum(s - sigma, sigma), a, h), _inverse(sigma, a, h)
    width = np.where(cell, 2 * sigma, 1.0)
    t = np.where(cell, np.clip(s / width, 0.0, 1.0), 1.0)
    below = P_sigma * sigma * 2 / 3  # energy at s = 2σ
    return P * t**2, np.where(t < 1, 2 * P * t / width, w), np.where(t < 1, below * t**3, e - e_sigma + below)


def steepening(t: NDArray, h: NDArray, slope: NDArray) -> NDArray:
    """Factor φ by which the stiffness of cells with t = s/2σ exceeds the ``slope`` dP/ds of (C7), to 1e-3 (C11).

    If the compression varies linearly along a cell, the mean of g⁻¹ has the slope (g⁻¹(s) − g⁻¹(s − 2σ))/2σ. (C7)
    evaluates the logarithm of the law at one point: at σ instead of s if only the part t < 1 is loaded, and otherwise
    at the middle of the cell, whose error vanishes for s ≫ σ.
    """
    part = t < 1
    r = 1 / np.where(part, 1.0, 2 * t - 1)  # half the variation of the compression over its mean
    log = np.where(part, np.log(2 * np.minimum(t, 1.0)), -(r**2) / 6 - TAIL * r**8)
    level = 1 / (h * slope)  # L − 1, or L/t
    return 1 / np.maximum(1 - log / np.where(part, np.maximum(t * level - 1, 1.0), level), STEEPEST)


def _inverse(s: NDArray, a: NDArray, h: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """P, dP/ds and ∫P ds of a single point."""
    from scipy.special import lambertw

    s = np.maximum(s, 0.0)
    linear = (h == 0) | (s == 0)
    safe_h, safe_s = np.where(linear, 1.0, h), np.where(linear, 1.0, s)
    ratio = np.where(linear, 3.0, a / safe_h)  # any number: linear and unloaded segments are replaced at the end
    small = np.minimum(np.exp(np.log(safe_s / safe_h) - ratio), TANGENT_FROM * np.exp(-TANGENT_FROM))
    L = np.where(linear, TANGENT_FROM, -lambertw(-small, -1).real)  # L e^{-L} = small, L ≥ 2
    edge = np.exp(ratio - TANGENT_FROM)
    over = np.maximum(safe_s - TANGENT_FROM * safe_h * edge, 0.0)
    p = np.where(over > 0, edge + over / safe_h, safe_s / (safe_h * L))
    w = np.where(over > 0, 1 / safe_h, 1 / (safe_h * (L - 1)))
    base = safe_h * np.where(over > 0, edge, p) ** 2 * (L / 2 - 0.25)
    e = base + over * (edge + over / (2 * safe_h))
    straight = np.where(h == 0, a, 1.0)
    p = np.where(linear, np.where(h == 0, s / straight, 0.0), p)
    w = np.where(linear, np.where((h == 0) & (s > 0), 1 / straight, 0.0), w)
    return p, w, np.where(linear, np.where(h == 0, s * s / (2 * straight), 0.0), e)


def kernel_coefficients(a: NDArray, h: NDArray) -> NDArray:
    """a, h, κ = a/h + ln h, the compression 2h P₀ from which the tangent continues the law, and 1/h, along axis 1.

    They are the rows of ``Batch.laws`` for the compiled kernels.
    """
    logarithmic = h > 0
    per_h = 1 / np.where(logarithmic, h, 1.0)
    ratio = np.where(logarithmic, a, 0.0) * per_h
    kappa = ratio + np.log(np.where(logarithmic, h, 1.0))
    exponent = np.minimum(ratio, LARGEST_EXPONENT) - TANGENT_FROM
    edge = np.where(logarithmic, TANGENT_FROM * h * np.exp(exponent), np.inf)
    return np.ascontiguousarray(np.stack([a, h, kappa, edge, per_h], axis=1))
