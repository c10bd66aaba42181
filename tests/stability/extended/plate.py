"""The Ritz plate in extended precision: monomials instead of Legendre polynomials, tanh-sinh instead of Gauss."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import Any

import mpmath as mp

from gearbench.geometry.pair import Pair
from tests.stability.extended.geometry import geometry, half_angle
from tests.stability.extended.numbers import DIGITS, Number, cholesky, forward


def tanh_sinh(step: Number) -> list[tuple[Number, Number, Number]]:
    """Nodes t, 1 − t and weights on (0, 1): end points may be singular."""
    nodes = []
    k = 0
    while True:
        x = mp.pi / 2 * mp.sinh(k * step)
        weight = step * mp.pi / 4 * mp.cosh(k * step) / mp.cosh(x) ** 2
        if weight < mp.mpf(10) ** (-DIGITS - 5):
            return nodes
        small = 1 / (1 + mp.exp(2 * x))  # distance from the end
        nodes.append((1 - small, small, weight))
        if k > 0:
            nodes.append((small, 1 - small, weight))
        k += 1


@lru_cache(maxsize=256)
def plate(pair: Pair, index: int, basis: Any) -> tuple[list[tuple[int, int]], Any]:
    """Exponents (i, j) of ξ^{i+1} η^j and the factor W with φᵀ W Wᵀ φ the compliance of the plate."""
    G = geometry(pair)
    g = G.gears[index]
    nu, E = mp.mpf(pair.material.poisson_ratio), 1000 * mp.mpf(pair.material.youngs_modulus)
    height, b = g.r_a - g.r_f, G.b
    terms = [(0, 0), (0, 1), (1, 0)] if basis == "paper" else [(i, j) for i in range(basis[0]) for j in range(basis[1])]
    most = max(i for i, _ in terms)
    edges = [mp.mpf(0), *([(g.r_b - g.r_f) / height] if g.r_f < g.r_b < g.r_a else []), mp.mpf(1)]
    D, S = [mp.mpf(0)] * (2 * most + 3), [mp.mpf(0)] * (2 * most + 3)
    for low, high in pairwise(edges):
        for t, _, weight in tanh_sinh(mp.mpf(1) / 16):
            xi = low + (high - low) * t
            R = g.r_f + xi * height
            h = 2 * R * half_angle(g, R) / mp.sqrt(1 + (R * mp.tan(g.beta) / g.r) ** 2)
            d = weight * (high - low) * E * h**3 / (12 * (1 - nu**2))
            s = weight * (high - low) * 5 * E * h / (12 * (1 + nu))
            power = mp.mpf(1)
            for n in range(len(D)):
                D[n] += d * power
                S[n] += s * power
                power *= xi
    n = len(terms)
    K = mp.matrix(3 * n)
    for p, (i, j) in enumerate(terms):
        for q, (k, l) in enumerate(terms):

            def yy(a: int, c: int, j: int = j, l: int = l) -> Number:
                """∫ η derivatives of order a, c."""
                power = j + l - a - c
                return (j if a else 1) * (l if c else 1) * b ** (1 - a - c) / (power + 1) if power >= 0 else mp.mpf(0)

            def xx(M: list, a: int, c: int, i: int = i, k: int = k) -> Number:
                """∫ ξ derivatives of order a, c with the weight of the moments M."""
                factor = (i + 1 if a else 1) * (k + 1 if c else 1)
                return factor * M[i + k + 2 - a - c] * height ** (1 - a - c)

            K[p, q] = xx(D, 0, 0) * yy(1, 1) + (1 - nu) / 2 * xx(D, 1, 1) * yy(0, 0) + xx(S, 0, 0) * yy(0, 0)
            K[n + p, n + q] = xx(D, 1, 1) * yy(0, 0) + (1 - nu) / 2 * xx(D, 0, 0) * yy(1, 1) + xx(S, 0, 0) * yy(0, 0)
            K[2 * n + p, 2 * n + q] = xx(S, 1, 1) * yy(0, 0) + xx(S, 0, 0) * yy(1, 1)
            # θ_x (p) with θ_y (q): −ν θ_x,y θ_y,x − (1−ν)/2 θ_x,x θ_y,y; θ_x with w: −θ_x w,y; θ_y with w: θ_y w,x
            K[p, n + q] = -nu * xx(D, 0, 1) * yy(1, 0) - (1 - nu) / 2 * xx(D, 1, 0) * yy(0, 1)
            K[p, 2 * n + q] = -xx(S, 0, 0) * yy(0, 1)
            K[n + p, 2 * n + q] = xx(S, 0, 1) * yy(0, 0)
    for p in range(3 * n):
        for q in range(p):
            K[p, q] = K[q, p]
    L = cholesky(K)
    # trailing triangle of L: the w–w block of K⁻¹ is its inverse, transposed, times its inverse
    triangle = [[L[2 * n + p][2 * n + q] for q in range(p + 1)] for p in range(n)]
    return terms, triangle


def plate_factor(pair: Pair, index: int, order: tuple[int, int] | None, xi: Number, eta: Number) -> list[Number]:
    """ψ of one tooth at ξ = (R − r_f)/h, η = y/b [√(mm/N)]."""
    terms, triangle = plate(pair, index, order or "paper")
    return forward(triangle, [xi ** (i + 1) * eta**j for i, j in terms])
