"""Real balls of FLINT (python-flint) with 60 digits: dense linear algebra that ``mpmath`` is too slow for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import flint
import mpmath as mp

from tests.stability.extended.numbers import DIGITS

#: Digits worked with: systems in monomials lose up to a third of them.
WORKING = 60
Ball = Any  # flint.arb, which has no types
Matrix = Any  # flint.arb_mat


@contextmanager
def working(places: int = WORKING) -> Iterator[None]:
    """FLINT's and mpmath's precision for a while."""
    before = flint.ctx.dps
    flint.ctx.dps = places
    try:
        with mp.workdps(places):
            yield
    finally:
        flint.ctx.dps = before


def ball(x: Any) -> Ball:
    """Of a double, exactly, or of an ``mpmath`` number of ``DIGITS`` digits, taken as exact."""
    return flint.arb(mp.nstr(x, DIGITS + 5)).mid() if isinstance(x, mp.mpf) else flint.arb(x)


def number(x: Ball) -> Any:
    """The ``mpmath`` number in the middle of a ball."""
    return mp.mpf(x.mid().str(DIGITS + 5, radius=False))


def gauss(points: int, low: Ball, high: Ball) -> list[tuple[Ball, Ball]]:
    """Gauss–Legendre nodes and weights on [low, high]."""
    found = (flint.arb.legendre_p_root(points, k, weight=True) for k in range(points))
    return [((low + high + (high - low) * t) / 2, (high - low) / 2 * w) for t, w in found]


def powers(x: Ball, count: int) -> list[Ball]:
    """1, x, x² …"""
    result = [flint.arb(1)]
    while len(result) < count:
        result.append(result[-1] * x)
    return result[:count]


def legendre(count: int, t: Ball) -> list[Ball]:
    """Legendre functions of t = −1 … 1, orthonormal on [0, 1] in (t + 1)/2."""
    return [flint.arb(2 * k + 1).sqrt() * t.legendre_p(k) for k in range(count)]


def solve(K: Matrix, right: Matrix) -> Matrix:
    """K⁻¹ B without the bounds of the balls, which grow as pessimistic as elimination allows."""
    return K.solve(right, algorithm="approx")


def entries(rows: list[list[Ball]]) -> Matrix:
    """Matrix of rows."""
    return flint.arb_mat(len(rows), len(rows[0]), [x for row in rows for x in row])
