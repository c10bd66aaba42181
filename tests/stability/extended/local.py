"""Compression below the flank with its integrals converged: (L1, L2) of docs/theory.md.

The waves counted are those of ``gearbench.compliance.local``. Its kernel is written again in balls, for comparison
point by point. The integrals across the flank are sums of positive numbers, in which doubles lose nothing: some
hundred tanh-sinh points each way take the place of a few Gauss points; those along it have closed forms.
"""

from __future__ import annotations

import math
from types import SimpleNamespace as Namespace

import flint
import numpy as np
from numpy.typing import NDArray
from scipy.special import k0, k1, spherical_jn

from gearbench.compliance.local import TAIL, WAVES
from tests.stability.extended.balls import Ball


def kernel(k: Ball, r: Ball, t: Ball, E: Ball, nu: Ball) -> Ball:
    """ĝ_k(r) between the surface and a depth t."""
    a, c = 2 * (1 - nu * nu) / (flint.arb.pi() * E), (1 + nu) / (flint.arb.pi() * E)
    R = (r * r + t * t).sqrt()
    if k == 0:
        return a * (R / r).log() - c * t * t / (R * R)
    return a * ((k * r).bessel_k(0) - (k * R).bessel_k(0)) - c * t * t * k * (k * R).bessel_k(1) / R


def tanh_sinh(step: float = 1 / 14) -> tuple[NDArray, NDArray, NDArray]:
    """Nodes t, 1 − t and weights of (0, 1) that cluster at both ends."""
    k = np.arange(-int(3.4 / step), int(3.4 / step) + 1) * step
    x = np.pi / 2 * np.sinh(k)
    return 1 / (1 + np.exp(-2 * x)), 1 / (1 + np.exp(2 * x)), step * np.pi / 4 * np.cosh(k) / np.cosh(x) ** 2


def compression(g: Namespace, b: float, E: float, nu: float, p: int, q: int) -> NDArray:
    """Between the polynomials of the flank, (p q, p q) [mm/N]: what ``half_space_compression`` is."""
    waves, tail = WAVES * q + 1, TAIL * q
    G, T = projected(g, b, E, nu, p, waves), cosines(q, tail)
    # ĝ_m falls like 1/m beyond the last wave computed
    fall = (waves - 1) / np.maximum(np.arange(tail), waves - 1)
    every = np.concatenate([G, np.repeat(G[-1:], tail - waves, axis=0)]) * fall[:, None, None]
    return np.einsum("cm,mij,dm->icjd", T, every, T).reshape(p * q, p * q)


def projected(g: Namespace, b: float, E: float, nu: float, p: int, waves: int) -> NDArray:
    """∬ φ_i(R) ĝ_m(R, R′) φ_j(R′) dR dR′, (wave, p, p): twice the symmetric part over R′ < R."""
    low, high, r_b = float(g.form), float(g.r_a), float(g.r_b)
    span, cos_bb, half = high - low, math.cos(float(g.beta_b)), float(g.half)

    def depth(R: NDArray) -> NDArray:
        """t from the flank to the centre line along the line of action, normal section."""
        roll = np.sqrt(np.maximum((R - r_b) * (R + r_b), 0)) / r_b
        psi = np.maximum(half - (roll - np.arctan(roll)), 0)
        return R * np.sin(psi) / np.cos(np.arctan(roll) - psi) * cos_bb

    def polynomials(x: NDArray) -> NDArray:
        scale = np.sqrt((2 * np.arange(p) + 1) / span)
        return np.polynomial.legendre.legvander(2 * x - 1, p - 1) * scale

    t, _, w = tanh_sinh()
    x, rest, u = (v[:, None] for v in tanh_sinh())
    # R − low = t span; R′ − low = t x span; R − R′ = t (1 − x) span: the logarithm is at x = 1
    R, other = low + t * span, low + t * x * span
    # the involute is square to the generators, b / cos β_b long
    r = t * rest * span * (R + other) / (2 * r_b)
    square = depth(R) * depth(other)
    far = np.sqrt(r * r + square)
    area = w * u * t * span**2 * cos_bb
    a, c = 2 * (1 - nu**2) / (math.pi * E), (1 + nu) / (math.pi * E)
    one, two = polynomials(t), polynomials(t * x)
    G = np.empty((waves, p, p))
    for m in range(waves):
        k = m * math.pi * cos_bb / b
        with np.errstate(under="ignore"):
            plane = a * np.log(far / r) - c * square / far**2
            value = plane if m == 0 else a * (k0(k * r) - k0(k * far)) - c * square * k * k1(k * far) / far
        G[m] = np.einsum("xt,ti,xtj->ij", value * area, one, two, optimize=True)
    return G + G.transpose(0, 2, 1)


def cosines(count: int, waves: int) -> NDArray:
    """∫₀¹ P̂_k(2η − 1) c_m dη, c_0 = 1, c_m = √2 cos mπη: √2 Re i^(k+m) j_k(mπ/2), (k, m)."""
    k, m = np.arange(count)[:, None], np.arange(waves)
    sign = np.array([1.0, 0.0, -1.0, 0.0])[(k + m) % 4]
    return sign * np.where(m, math.sqrt(2), 1) * np.sqrt(2 * k + 1) * spherical_jn(k, m * math.pi / 2)
