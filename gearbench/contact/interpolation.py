"""Interpolation from the Gauss points of contact lines to other points, by one polynomial for each smooth piece.

Cells are short pieces of a line that carry a load. ``smooth_lines`` are the same lines with Gauss points, at which the
smooth compliance (all but the contact law) is computed; their ``panel`` numbers the piece of each point.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.action import ContactLines
from gearbench.geometry.quadrature import gauss


def interpolation_to_cells(smooth_lines: ContactLines, cells: ContactLines) -> NDArray:
    """Matrix from values at the nodes of ``smooth_lines`` to values on cells, (position, pair, segment, 3, node).

    The 3 values belong to the beginning, the middle and the end of a cell.
    """
    # half the width of a cell over the face
    half = cells.length * math.cos(cells.pair.meshing.beta_b) / 2
    y = cells.y[..., None] + half[..., None] * np.array([-1.0, 0.0, 1.0])
    return interpolation_matrix(smooth_lines, y.reshape(*y.shape[:2], -1)).reshape(*y.shape, -1)


def interpolation_matrix(smooth_lines: ContactLines, y: NDArray) -> NDArray:
    """Matrix (…, point, node) from values at the nodes of ``smooth_lines`` to values at other points on the lines.

    ``y`` (position, pair, point) holds the positions of the points over the face [mm]. Rows are zero where no line
    exists.
    """
    from gearbench.contact._patch_kernels import rows_on_pieces

    assert smooth_lines.panel is not None
    rows = np.zeros((*y.shape, smooth_lines.shape[2]))
    half = smooth_lines.length * math.cos(smooth_lines.pair.meshing.beta_b) / 2
    rows_on_pieces(
        smooth_lines.y,
        half,
        smooth_lines.panel,
        smooth_lines.active,
        np.ascontiguousarray(y),
        *_rules(smooth_lines.shape[2]),
        rows,
    )
    return rows


def values_at(rows: NDArray, values: NDArray, active: NDArray) -> NDArray:
    """Values at points (position, pair, point, column) from ``values`` at the nodes (position, pair, node, column).

    ``rows`` is an ``interpolation_matrix``, ``active`` (position, pair) tells where lines exist; other values are 0.
    """
    from gearbench.contact._patch_kernels import values_of_lines

    result = np.empty((*rows.shape[:3], values.shape[3]))
    values_of_lines(np.ascontiguousarray(rows), np.ascontiguousarray(values), active, result)
    return result


@lru_cache(maxsize=16)
def _rules(most: int) -> tuple[NDArray, NDArray]:
    """Nodes and barycentric weights of the Gauss rules of 1 to ``most`` points; row n holds the rule of n points.

    ``most`` is the number of nodes on a line; no piece has more. The barycentric weights of Gauss points are
    (−1)ʲ √((1 − t²) w) (Wang, Huybrechs and Vandewalle, Math. Comp. 83, 2014).
    """
    nodes, weights = np.zeros((2, most + 1, most))
    for n in range(1, most + 1):
        t, w = gauss(n)
        nodes[n, :n], weights[n, :n] = t, (-1.0) ** np.arange(n) * np.sqrt((1 - t**2) * w)
    return nodes, weights
