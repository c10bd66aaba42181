"""Complex mesh orders of a variable over the mesh cycle, from the phases it was computed at."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError


def order_rows(phase: NDArray, orders: int, panel: int | None) -> NDArray:
    """Rows (order + 1, position) that turn values at the phases into ŷ_0 … ŷ_n, y = Σ ŷ_n e^{2πinτ} (D3).

    Parameters
    ----------
    phase
        Mesh phases (position,), as ``phases`` makes them.
    orders
        Highest order n.
    panel
        Gauss points on each panel: their polynomials are integrated exactly. None: uniform phases.

    Raises
    ------
    InputError
        If uniform phases do not resolve the orders.
    """
    n = np.arange(orders + 1)
    if panel is None:
        if 2 * orders >= len(phase):
            allowed = f"must be more than {2 * orders} for {orders} orders of the mesh frequency, or left out"
            raise InputError("resolution.positions", len(phase), allowed)
        return np.exp(-2j * np.pi * np.outer(n, phase)) / len(phase)
    from scipy.special import spherical_jn

    t, w = np.polynomial.legendre.leggauss(panel)
    k = np.arange(panel)
    project = (2 * k[:, None] + 1) / 2 * np.polynomial.legendre.legvander(t, panel - 1).T * w
    rows = np.empty((orders + 1, len(phase)), dtype=complex)
    for start in range(0, len(phase), panel):
        x = phase[start : start + panel]
        half = (x[-1] - x[0]) / (t[-1] - t[0]) if panel > 1 else 0.5
        # ∫ P_k(s) e^{−iωs} ds over [−1, 1] = 2 (−i)^k j_k(ω)
        waves = 2 * (-1j) ** k * spherical_jn(k, (2 * np.pi * n * half)[:, None])
        carrier = np.exp(-2j * np.pi * n * x.mean())
        rows[:, start : start + panel] = half * carrier[:, None] * (waves @ project)
    return rows
