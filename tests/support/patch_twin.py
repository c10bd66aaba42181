"""Readable version of the search for contact patches in ``gearbench.contact._patch_kernels``."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.action import NEGLIGIBLE_WIDTH, ContactLines
from gearbench.geometry.quadrature import gauss


def patch_nodes(lines: ContactLines, s: NDArray, nodes: int) -> tuple[NDArray, NDArray]:
    """Positions y and widths of ``nodes`` Gauss points on the patches of each line, (position, pair, node) [mm].

    ``s`` is the compression at the beginning, middle and end of each segment. Patches end where ``s`` changes sign or
    the gap has a kink.
    """
    positions, pairs, segments = lines.shape
    assert lines.panel is not None
    half = (lines.length * math.cos(lines.pair.meshing.beta_b) / 2)[..., None]
    low, high = _loaded_part(s)
    low, high = (lines.y[..., None] + half * t for t in (low, high))
    loaded = (high - low > NEGLIGIBLE_WIDTH * lines.pair.meshing.face_width).reshape(-1, 2 * segments)
    low, high = low.reshape(loaded.shape), high.reshape(loaded.shape)
    panel = np.repeat(lines.panel, 2, axis=2).reshape(loaded.shape)
    joint = loaded[:, 1:] & loaded[:, :-1] & (panel[:, 1:] == panel[:, :-1])
    joint &= low[:, 1:] - high[:, :-1] <= NEGLIGIBLE_WIDTH * lines.pair.meshing.face_width
    none = np.zeros((len(loaded), 1), dtype=bool)
    first, last = loaded & ~np.hstack([none, joint]), loaded & ~np.hstack([joint, none])
    line, begin, end = np.nonzero(first)[0], low[first], high[last]
    count = _counts(line, end - begin, nodes)
    y, width = np.zeros((2, len(loaded) * nodes))
    # the nodes of a patch follow the nodes of earlier patches on the same line
    before = np.cumsum(count) - count
    start = line * nodes + before - before[np.searchsorted(line, line)]
    for n in np.unique(count):
        t, w = gauss(int(n))
        these = count == n
        at, reach = start[these, None] + np.arange(n), (end - begin)[these, None] / 2
        y[at], width[at] = begin[these, None] + reach * (1 + t), reach * w
    return y.reshape(positions, pairs, nodes), width.reshape(positions, pairs, nodes)


def _loaded_part(s: NDArray) -> tuple[NDArray, NDArray]:
    """Begin and end of the loaded part of each half of a cell (…, half), on the scale from −1 to 1 of the whole cell.

    The part is empty if both are equal. s is the parabola through the values (…, 3).
    """
    begin, middle, end = np.moveaxis(s, -1, 0)
    linear, square = (end - begin) / 2, (end + begin) / 2 - middle
    root = np.sqrt(np.maximum(linear**2 - 4 * square * middle, 0.0))
    big = -(linear + np.where(linear < 0, -root, root)) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        roots = np.stack([big / square, middle / big])
    lows, highs = [], []
    for a, b, left, right in ((-1.0, 0.0, begin, middle), (0.0, 1.0, middle, end)):
        off = np.where(np.isfinite(roots), np.abs(roots - (a + b) / 2), np.inf)
        at = np.clip(np.take_along_axis(roots, off.argmin(axis=0)[None], axis=0)[0], a, b)
        at = np.where(np.isfinite(at), at, (a + b) / 2)
        lows.append(np.where(left > 0, a, np.where(right > 0, at, b)))
        highs.append(np.where(right > 0, b, np.where(left > 0, at, b)))
    return np.stack(lows, axis=-1), np.stack(highs, axis=-1)


def _counts(line: NDArray, width: NDArray, nodes: int) -> NDArray:
    """Number of nodes of each patch: the nodes of a line are shared in proportion to the roots of the widths."""
    root = np.sqrt(width)
    whole = np.bincount(line, root)[line]
    on_line = np.bincount(line)[line]
    least = np.minimum(2, nodes // on_line)
    count = least + np.floor((nodes - least * on_line) * root / whole + 1e-9).astype(int)
    # the remaining nodes go to the widest patches
    left = nodes - np.bincount(line, count).astype(int)
    order = np.lexsort((-width, line))
    rank = np.arange(len(line)) - np.searchsorted(line, line)
    count[order] += rank < left[line]
    return count
