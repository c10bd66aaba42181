"""Numbers of 40 digits, dense linear algebra on them, and the digits a double has in common with them."""

from __future__ import annotations

from typing import Any

import mpmath as mp

DIGITS = 40
Number = Any  # mpmath.mpf, which has no types


def cholesky(K: Any) -> list[list[Number]]:
    """Rows of the lower Cholesky factor; columns of a semi-definite matrix that depend on earlier ones are zero."""
    L: list[list[Number]] = []
    for i in range(K.rows):
        row: list[Number] = []
        for j in range(i + 1):
            t = K[i, j] - mp.fdot(zip(row, L[j] if j < i else row, strict=False)) if j else K[i, j]
            if i == j:
                row.append(mp.sqrt(t) if t > mp.mpf(10) ** (10 - DIGITS) * K[i, i] else mp.mpf(0))
            else:
                row.append(t / L[j][j] if L[j][j] else mp.mpf(0))
        L.append(row)
    return L


def forward(triangle: list[list[Number]], right: list[Number]) -> list[Number]:
    """L⁻¹ right."""
    x: list[Number] = []
    for row, r in zip(triangle, right, strict=True):
        x.append((r - mp.fdot(zip(row, x, strict=False))) / row[-1])
    return x


def digits(value: float, exact: Number, scale: Number | None = None) -> float:
    """Correct decimal digits of ``value`` relative to ``scale`` (to itself by default); at most 17."""
    with mp.workdps(DIGITS):
        error = abs(mp.mpf(float(value)) - exact) / abs(exact if scale is None else scale)
        return 17.0 if error == 0 else min(17.0, float(-mp.log10(error)))
