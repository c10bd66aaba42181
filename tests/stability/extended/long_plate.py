"""The plate in ``numpy.longdouble`` (64-bit mantissa, 19 digits) for Ritz orders too large for ``mpmath``."""

from __future__ import annotations

from types import SimpleNamespace as Namespace
from typing import Any

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

L = np.longdouble


def long(x: Any) -> Any:
    """A long double from an mpmath number."""
    return L(mp.nstr(x, 25))


def legendre(count: int, t: NDArray) -> tuple[NDArray, NDArray]:
    """P_0 … P_{count−1} and derivatives at t, (…, count), by their recurrences."""
    p, d = np.zeros((*t.shape, count + 1), L), np.zeros((*t.shape, count + 1), L)
    p[..., 0], p[..., 1], d[..., 1] = 1, t, 1
    for k in range(1, count):
        p[..., k + 1] = ((2 * k + 1) * t * p[..., k] - k * p[..., k - 1]) / (k + 1)
        d[..., k + 1] = d[..., k - 1] + (2 * k + 1) * p[..., k]
    return p[..., :count], d[..., :count]


def gauss(n: int) -> tuple[NDArray, NDArray]:
    """Gauss–Legendre nodes and weights on (0, 1), Newton's method from the double ones."""
    t = np.polynomial.legendre.leggauss(n)[0].astype(L)
    for _ in range(3):
        p, d = legendre(n + 1, t)
        t = t - p[:, n] / d[:, n]
    d = legendre(n + 1, t)[1][:, n]
    return (t + 1) / 2, 1 / ((1 - t * t) * d * d)


def height_functions(count: int, xi: NDArray) -> tuple[NDArray, NDArray]:
    """∫₀^ξ of shifted Legendre polynomials, and these: scaled like the double basis only to keep K well conditioned."""
    p, _ = legendre(count + 1, 2 * xi - 1)
    k = np.arange(1, count)
    f = np.empty((*xi.shape, count), L)
    f[..., 0] = xi
    f[..., 1:] = (p[..., 2:] - p[..., : count - 1]) / (2 * (2 * k + 1)).astype(L)
    scale = np.sqrt((2 * np.arange(count) + 1).astype(L))
    return f * scale, p[..., :count] * scale


def width_functions(count: int, eta: NDArray) -> tuple[NDArray, NDArray]:
    p, d = legendre(count, 2 * eta - 1)
    scale = np.sqrt((2 * np.arange(count) + 1).astype(L))
    return p * scale, 2 * d * scale


def products(f: NDArray, g: NDArray, weight: NDArray) -> NDArray:
    return (f.T * weight) @ g


def thickness(g: Namespace, R: NDArray) -> NDArray:
    """Normal thickness of the involute; below the base circle at the angle it has there."""
    r_b, r, half, tan_beta = (long(x) for x in (g.r_b, g.r, g.half, mp.tan(g.beta)))
    t = np.sqrt(np.maximum((R - r_b) * (R + r_b), L(0))) / r_b
    return 2 * R * (half - (t - np.arctan(t))) / np.sqrt(1 + (R * tan_beta / r) ** 2)


def plate(g: Namespace, b: Any, E: Any, nu: Any, order: tuple[int, int]) -> tuple[Any, NDArray]:
    """Functions (ξ, η) → φ of the field w, and the trailing triangle of the Cholesky factor of K."""
    p, q = order
    r_f, height, width, nu = long(g.r_f), long(g.r_a - g.r_f), long(b), long(nu)
    base = long((g.r_b - g.r_f) / (g.r_a - g.r_f))
    t, w = gauss(2 * p + 30)
    nodes, weights = [], []
    for start, stop in [(L(0), base), (base, L(1))] if 0 < base < 1 else [(L(0), L(1))]:
        if start >= base:
            s0, s1 = np.sqrt(start - base), np.sqrt(stop - base)
            s = s0 + (s1 - s0) * t
            nodes.append(base + s * s)
            weights.append(2 * s * (s1 - s0) * w)
        else:
            nodes.append(start + (stop - start) * t)
            weights.append((stop - start) * w)
    xi, weight = np.concatenate(nodes), np.concatenate(weights) * height
    h = thickness(g, r_f + xi * height)
    D, S = weight * long(E) * h**3 / (12 * (1 - nu * nu)), weight * L(5) / 6 * long(E) / (2 * (1 + nu)) * h
    f = height_functions(p, xi)
    f = (f[0], f[1] / height)
    eta, v = gauss(q + 1)
    e = width_functions(q, eta)
    e = (e[0], e[1] / width)
    d, s = ([[products(f[a], f[c], weight) for c in (0, 1)] for a in (0, 1)] for weight in (D, S))
    y = [[products(e[a], e[c], v * width) for c in (0, 1)] for a in (0, 1)]
    half = (1 - nu) / 2
    xx = np.kron(d[0][0], y[1][1]) + half * np.kron(d[1][1], y[0][0]) + np.kron(s[0][0], y[0][0])
    yy = np.kron(d[1][1], y[0][0]) + half * np.kron(d[0][0], y[1][1]) + np.kron(s[0][0], y[0][0])
    ww = np.kron(s[1][1], y[0][0]) + np.kron(s[0][0], y[1][1])
    xy = -nu * np.kron(d[0][1], y[1][0]) - half * np.kron(d[1][0], y[0][1])
    xw, yw = -np.kron(s[0][0], y[0][1]), np.kron(s[0][1], y[0][0])
    K = np.block([[xx, xy, xw], [xy.T, yy, yw], [xw.T, yw.T, ww]])
    scale = 1 / np.sqrt(np.diagonal(K))
    G = cholesky(K * scale * scale[:, None])[-p * q :, -p * q :]

    def factor(x: Any, z: Any) -> NDArray:
        a = height_functions(p, np.array([long(x)], L))[0][0]
        c = width_functions(q, np.array([long(z)], L))[0][0]
        return forward(G, np.kron(a, c) * scale[-p * q :])

    return factor, G


def cholesky(K: NDArray) -> NDArray:
    """Lower factor, column by column: LAPACK knows no long double."""
    C = np.tril(K)
    for j in range(len(C)):
        C[j:, j] -= C[j:, :j] @ C[j, :j]
        C[j:, j] /= np.sqrt(C[j, j])
    return C


def forward(G: NDArray, right: NDArray) -> NDArray:
    x = right.copy()
    for i in range(len(x)):
        x[i] = (x[i] - G[i, :i] @ x[:i]) / G[i, i]
    return x
