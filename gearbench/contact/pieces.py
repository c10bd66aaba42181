"""From the Gauss points of uncut contact lines to any others: what is smooth on each piece is a polynomial there."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.action import ContactLines
from gearbench.geometry.quadrature import gauss


def rows_of_cells(uncut: ContactLines, cells: ContactLines) -> NDArray:
    """Values at the nodes of ``uncut`` lines → at beginning, middle and end of cells, (…, segment, 3, node)."""
    half = cells.length * math.cos(cells.pair.meshing.beta_b) / 2
    y = cells.y[..., None] + half[..., None] * np.array([-1.0, 0.0, 1.0])
    return rows_at(uncut, y.reshape(*y.shape[:2], -1)).reshape(*y.shape, -1)


def rows_at(uncut: ContactLines, y: NDArray) -> NDArray:
    """Values at the nodes of ``uncut`` lines → at y (position, pair, point), (…, point, node); zero on no line."""
    from gearbench.contact._patch_kernels import rows_on_pieces

    assert uncut.panel is not None
    rows = np.zeros((*y.shape, uncut.shape[2]))
    half = uncut.length * math.cos(uncut.pair.meshing.beta_b) / 2
    rows_on_pieces(uncut.y, half, uncut.panel, uncut.active, np.ascontiguousarray(y), *_rules(uncut.shape[2]), rows)
    return rows


@lru_cache(maxsize=16)
def _rules(most: int) -> tuple[NDArray, NDArray]:
    """Nodes of the rules of 1 to ``most`` points, and the weights of barycentric interpolation, one a row.

    Those of Gauss points are (−1)ʲ √((1 − t²) w) (Wang, Huybrechs and Vandewalle, Math. Comp. 83, 2014).
    """
    nodes, weights = np.zeros((2, most + 1, most))
    for n in range(1, most + 1):
        t, w = gauss(n)
        nodes[n, :n], weights[n, :n] = t, (-1.0) ** np.arange(n) * np.sqrt((1 - t**2) * w)
    return nodes, weights
