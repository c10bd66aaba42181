"""Compression below the flank in extended precision: the integrals of (L1, L2) of docs/theory.md, converged.

The waves counted are those of ``gearbench.compliance.local``; across the flank tanh-sinh points take the place of a
few Gauss points, and the integrals along it have closed forms.
"""

from __future__ import annotations

from functools import lru_cache
from types import SimpleNamespace as Namespace

import flint
import mpmath as mp

from gearbench.compliance.local import _TAIL, _WAVES
from tests.stability.extended.balls import Ball, Matrix, ball, legendre
from tests.stability.extended.numbers import DIGITS

#: Digits aimed at by the quadrature across the flank.
AIM = 20


@lru_cache(maxsize=4)
def ends() -> list[tuple[Ball, Ball, Ball]]:
    """Nodes t, 1 − t and weights of (0, 1) that cluster at both ends."""
    step, nodes, k = mp.mpf(1) / 8, [], 0
    while True:
        x = mp.pi / 2 * mp.sinh(k * step)
        weight = step * mp.pi / 4 * mp.cosh(k * step) / mp.cosh(x) ** 2
        if weight < mp.mpf(10) ** -AIM:
            return [(ball(t), ball(r), ball(w)) for t, r, w in nodes]
        small = 1 / (1 + mp.exp(2 * x))
        nodes += [(1 - small, small, weight)] + ([(small, 1 - small, weight)] if k else [])
        k += 1


def depth(g: Namespace, R: Ball) -> Ball:
    """t from the flank to the centre line along the line of action, normal section."""
    r_b = ball(g.r_b)
    roll = ((R - r_b) * (R + r_b)).sqrt() / r_b
    psi = ball(g.half) - (roll - roll.atan())
    return R * psi.sin() / (roll.atan() - psi).cos() * ball(mp.cos(g.beta_b))


def wave(k: Ball, r: Ball, square: Ball, E: Ball, nu: Ball) -> Ball:
    """ĝ_k(r) between the surface and a depth t, t² = ``square``."""
    a, c = 2 * (1 - nu * nu) / (flint.arb.pi() * E), (1 + nu) / (flint.arb.pi() * E)
    R = (r * r + square).sqrt()
    if k == 0:
        return a * (R / r).log() - c * square / (R * R)
    return a * ((k * r).bessel_k(0) - (k * R).bessel_k(0)) - c * square * k * (k * R).bessel_k(1) / R


def compression(g: Namespace, b: Ball, E: Ball, nu: Ball, p: int, q: int) -> Matrix:
    """Between the polynomials of the flank, (p q, p q) [mm/N]: what ``half_space_compression`` is."""
    waves, tail = _WAVES * q + 1, _TAIL * q
    G = projected(g, b, E, nu, p, waves)
    T = cosines(q, tail)
    result = flint.arb_mat(p * q, p * q)
    for c in range(q):
        for d in range(c, q):
            weights = [T[c][m] * T[d][m] for m in range(tail)]
            # ĝ_m falls like 1/m beyond the last wave computed
            last = sum((w * (waves - 1) / m for m, w in enumerate(weights) if m >= waves), flint.arb(0))
            for i in range(p):
                for j in range(p):
                    total = last * G[waves - 1][i][j]
                    for m in range(waves):
                        total += weights[m] * G[m][i][j]
                    result[i * q + c, j * q + d] = result[i * q + d, j * q + c] = total
    return result


def projected(g: Namespace, b: Ball, E: Ball, nu: Ball, p: int, waves: int) -> list[list[list[Ball]]]:
    """∬ φ_i(R) ĝ_m(R, R′) φ_j(R′) dR dR′, (wave, p, p): twice the symmetric part over R′ < R."""
    low, high, r_b = ball(g.form), ball(g.r_a), ball(g.r_b)
    span, cos_bb = high - low, ball(mp.cos(g.beta_b))
    k = [m * flint.arb.pi() / b for m in range(waves)]
    result = [[[flint.arb(0)] * p for _ in range(p)] for _ in range(waves)]
    for t, _, w in ends():
        # R − low = t span; R′ − low = t span · v, R − R′ = t span (1 − v): logarithm at v = 1
        R = low + t * span
        one, t_R = legendre(p, 2 * t - 1), depth(g, R)
        for v, rest, u in ends():
            other = low + t * v * span
            two = legendre(p, 2 * t * v - 1)
            r = t * rest * span * (R + other) / (2 * r_b) * cos_bb
            square = t_R * depth(g, other)
            factor = w * u * t * span
            for m in range(waves):
                value = factor * wave(k[m], r, square, E, nu)
                for i in range(p):
                    for j in range(i, p):
                        result[m][i][j] += value * (one[i] * two[j] + one[j] * two[i])
    for G in result:
        for i in range(p):
            for j in range(i):
                G[i][j] = G[j][i]
    return result


def cosines(count: int, waves: int) -> list[list[Ball]]:
    """∫₀¹ P̂_k(2η − 1) c_m dη, c_0 = 1, c_m = √2 cos mπη: Re of i^k e^{imπ/2} j_k(mπ/2), (k, m)."""
    result = []
    for k in range(count):
        scale = flint.arb(2 * k + 1).sqrt()
        row = [flint.arb(1 if k == 0 else 0)]
        for m in range(1, waves):
            # Re i^(k+m): zero, or ±1
            sign = (1, 0, -1, 0)[(k + m) % 4]
            x = flint.arb(m) * flint.arb.pi() / 2
            spherical = (flint.arb.pi() / (2 * x)).sqrt() * x.bessel_j(flint.arb(2 * k + 1) / 2)
            row.append(sign * flint.arb(2).sqrt() * scale * spherical)
        result.append(row)
    return result


assert DIGITS > AIM
