"""Elastic wedge loaded on a face near its edge, compared with a half-space: a line load, and a Hertzian strip.

A wedge of the angle 2α in plane strain bears a unit line load at the distance r₀ from its edge. At the distance r the
loaded face moves along its normal by W more than a half-space; by Mellin's transform (E1, E2 of docs/theory.md)

    W(r, r₀) = c₁ [ω(ln r/r₀) − B ln(r r₀)],   c₁ = (1−ν²)/(πE),
    ω(x) = ∫₀^∞ (cos ηx − 1) Δm(η)/η dη,   Δm = m − 2 coth πη,
    m(η) = (cosh 2ηα − cos 2α)/(sinh 2ηα + η sin 2α) + (cosh 2ηα + cos 2α)/(sinh 2ηα − η sin 2α),
    B = (π/2) [(1 − cos 2α)/(2α + sin 2α) + (1 + cos 2α)/(2α − sin 2α)] − 1.

Source: Sneddon, Fourier Transforms, §48; Tranter 1948. B is that of Flamant's wedge loaded at its edge.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.bases import gauss

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

#: Offsets σ of a parabola's vertex from the edge, in Hertzian half-widths, at which strips are computed.
_OFFSETS = np.concatenate([-np.geomspace(12.0, 1.4, 9), np.linspace(-1.2, 1.2, 17), np.geomspace(1.4, 24.0, 11)])
#: Angles between which strips are interpolated [rad].
_ANGLES = np.radians([92.0, 105.0, 120.0, 140.0, 165.0])
#: Number of elements of constant pressure on a strip: accurate to 0.01 c₁ q, a few nanometres.
_ELEMENTS = 24


def softness(angle: float) -> float:
    """B of a wedge of the ``angle`` [rad]; 0 for a half-space."""
    s, c = math.sin(angle), math.cos(angle)
    return math.pi / 2 * ((1 - c) / (angle + s) + (1 + c) / (angle - s)) - 1


def spread(angle: float, x: NDArray) -> NDArray:
    """ω(x) of a wedge of the ``angle`` [rad]: zero at 0, −B |x| far away."""
    eta, factor = _waves(angle)
    x = np.asarray(x, dtype=float)
    return (np.cos(x[..., None] * eta) - 1) @ factor


def _waves(angle: float) -> tuple[NDArray, NDArray]:
    """Gauss points η, and Δm(η)/η times their weights."""
    eta, weight = gauss(160, 0.0, 40.0 / min(angle, math.pi))
    s, c, z = math.sin(angle), math.cos(angle), eta * angle
    # cosh and sinh over e^z, so that nothing overflows
    cosh, sinh, one = (1 + np.exp(-2 * z)) / 2, (1 - np.exp(-2 * z)) / 2, np.exp(-z)
    m = (cosh - c * one) / (sinh + eta * s * one) + (cosh + c * one) / (sinh - eta * s * one)
    return eta, (m - 2 / np.tanh(math.pi * eta)) / eta * weight


def strip_at_edge(angle: float, offset: float, length: float = 2.1) -> float:
    """Approach of a parabola pressed on a wedge near its edge, in units of c₁ q and half-widths a_H (E3).

    The parabola (ξ + σ)²/(2ρ) has its vertex at the ``offset`` σ beyond the edge; the other body is a half-space. Far
    inside the edge the strip is Hertz's, with the approach 4 (ln 2 + ½) + W. If σ ≥ 0, the elements cover
    ``length``/(1 + 1.5 σ) from the edge, which is a fifth more than the loaded length. Elements under tension are
    released, and those that would penetrate are loaded, until neither occurs.
    """
    near = max(0.0, -offset - 1.4)
    far = max(-offset, 0.0) + (1.4 if offset < 0 else length / (1 + 1.5 * offset))
    t = np.linspace(0.0, 1.0, _ELEMENTS + 1)
    # elements crowd at both ends of the strip
    edge = near + (far - near) * (1 - np.cos(math.pi * t)) / 2
    width, middle = np.diff(edge), (edge[1:] + edge[:-1]) / 2

    def log_integral(x: NDArray) -> NDArray:
        return x * np.log(np.abs(np.where(x == 0, 1.0, x))) - x

    d = middle[:, None] - edge
    half_spaces = -4 * (log_integral(d[:, :-1]) - log_integral(d[:, 1:]))
    B = softness(angle)
    spread = spread_table(angle, np.log(middle[:, None] / middle)) - B * np.log(middle)[:, None]
    wedge = spread * width - B * (log_integral(edge[1:]) - log_integral(edge[:-1]))
    K, gap = half_spaces + wedge, 4 * (middle + offset) ** 2
    active = np.full(len(width), True)
    approach = 0.0
    for _ in range(60):
        n = int(active.sum())
        system, right = np.zeros((n + 1, n + 1)), np.append(-gap[active], 1.0)
        system[:n, :n], system[:n, n], system[n, :n] = K[np.ix_(active, active)], -1.0, width[active]
        solution = np.linalg.solve(system, right)
        pressure = np.zeros(len(width))
        pressure[active], approach = solution[:n], float(solution[n])
        wrong = active & (pressure < 0)
        if not wrong.any():
            wrong = ~active & (K @ pressure + gap < approach - 1e-12)
            if not wrong.any():
                break
        active ^= wrong
    return approach


@lru_cache(maxsize=16)
def _spread_nodes(angle: float) -> tuple[NDArray, NDArray]:
    """x from 0 to 14, and ω(x)."""
    eta, factor = _waves(angle)
    step = 14.0 / 699
    # 700 cosines cos(α + β) from 28 α and 25 β
    alpha, beta = (step * at[:, None] * eta for at in (25 * np.arange(28), np.arange(25)))
    waves = (np.cos(alpha) * factor) @ np.cos(beta).T - (np.sin(alpha) * factor) @ np.sin(beta).T
    return step * np.arange(700), (waves - factor.sum()).ravel()


def spread_table(angle: float, x: NDArray) -> NDArray:
    """ω(x), interpolated to 1e-4."""
    return np.interp(np.abs(x), *_spread_nodes(angle))


@lru_cache(maxsize=1)
def _strips() -> CubicSpline:
    """Λ (offset,) as a function of the angle: the approach minus Hertz's approach and minus the gap at the edge."""
    from scipy.interpolate import CubicSpline

    hertz = 4 * (math.log(2) + 0.5)
    return CubicSpline(
        _ANGLES, [[strip_at_edge(a, s) - hertz - 4 * max(s, 0.0) ** 2 for s in _OFFSETS] for a in _ANGLES]
    )


@lru_cache(maxsize=64)
def _strip_table(angle: float) -> tuple[float, NDArray]:
    """Λ at the first offset, and the coefficients (falling power, interval) of monotone cubics between the offsets.

    At both ends the cubics continue the laws beyond, with their slopes.
    """
    from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

    values = _strips()(min(max(angle, _ANGLES[0]), _ANGLES[-1]))
    slopes, B = PchipInterpolator(_OFFSETS, values)(_OFFSETS, 1), softness(angle)
    slopes[[0, -1]] = -2 * B / _OFFSETS[0], (4 + 2 * B) / _OFFSETS[-1]
    return float(values[0]), CubicHermiteSpline(_OFFSETS, values, slopes).c


def strip_softening(angle: float, offset: NDArray) -> tuple[NDArray, NDArray]:
    """Λ(σ) and dΛ/dσ of a Hertzian strip at the ``offset`` σ [half-widths] beyond the edge of a wedge.

    Λ is the compression beyond that of a half-space, in units of c₁ q; lengths are in half-widths. More than twelve
    half-widths inside the edge Λ follows W = −2B ln|σ|. Beyond the largest offset an inclined edge is pressed in, a
    self-similar contact, and Λ grows like (4 + 2B) ln σ.
    """
    (first, cubics), B = _strip_table(angle), softness(angle)
    offset = np.asarray(offset, dtype=float)
    inside = np.minimum(offset, _OFFSETS[0])
    value = np.array(first - 2 * B * np.log(inside / _OFFSETS[0]))
    slope = np.array(-2 * B / inside)
    near = offset > _OFFSETS[0]
    distance = offset[near]
    within = np.minimum(distance, _OFFSETS[-1])
    i = np.minimum(np.searchsorted(_OFFSETS, within, side="right") - 1, len(_OFFSETS) - 2)
    t, (c3, c2, c1, c0) = within - _OFFSETS[i], cubics[:, i]
    value[near] = c0 + t * (c1 + t * (c2 + t * c3)) + (4 + 2 * B) * np.log(np.maximum(distance / _OFFSETS[-1], 1.0))
    slope[near] = np.where(
        distance > _OFFSETS[-1], (4 + 2 * B) / np.maximum(distance, 1.0), c1 + t * (2 * c2 + 3 * t * c3)
    )
    return value, slope
