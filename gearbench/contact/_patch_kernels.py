"""Compiled search for contact patches on lines of cells; tests/support/patch_twin.py is the readable version."""

from __future__ import annotations

import math

import numpy as np

from gearbench.compiled import entry, part


@entry()
def compressions(rows, factor, q, block, delta, gaps, scale, active, s):
    """Fill s = δ − e − Ψ q at the beginning, middle and end of each cell; −1 if there is no line.

    Shapes: rows (position, pair, segment, 3, node), factor (position, pair, node, rank), gaps and s (position, pair,
    segment, 3), block (pair,), and scale (position,), the unit of δ.
    """
    positions, pairs, segments = gaps.shape[:3]
    nodes = factor.shape[2]
    for i in range(positions):
        unit = 1.0 / scale[i]
        for k in range(pairs):
            own = s[i, k].reshape(3 * segments)
            if not active[i, k]:
                own[:] = -1.0
                continue
            smooth = np.dot(rows[i, k].reshape((3 * segments, nodes)), np.dot(factor[i, k], q[i, block[k]]))
            gap = gaps[i, k].reshape(3 * segments)
            for j in range(3 * segments):
                own[j] = delta[i] - gap[j] * unit - smooth[j]


@part()
def zero_within(begin, middle, end, a, b):
    """Zero in [a, b] of the parabola through the values at −1, 0 and 1, the one closest to the middle of [a, b]."""
    linear, square = (end - begin) / 2, (end + begin) / 2 - middle
    root = math.sqrt(max(linear * linear - 4 * square * middle, 0.0))
    big = -(linear + (-root if linear < 0 else root)) / 2
    first, second = big / square, middle / big
    centre = (a + b) / 2
    off_first = abs(first - centre) if math.isfinite(first) else math.inf
    off_second = abs(second - centre) if math.isfinite(second) else math.inf
    at = second if off_second < off_first else first
    if math.isnan(at):
        return centre
    return min(max(at, a), b)


@part()
def loaded_halves(s, y, half, panel, least, begin, end):
    """Find the patches of one line: fill their beginnings and ends, and return their number.

    Adjacent loaded halves of cells form one patch if they are in the same panel between kinks.
    """
    count, last, at_panel = 0, -math.inf, -1
    for i in range(y.size):
        for side in range(2):
            a, b = -1.0 + side, 0.0 + side
            left, right = s[i, side], s[i, side + 1]
            if not (left > 0 or right > 0):
                continue
            at = 0.0
            if not (left > 0 and right > 0):
                at = zero_within(s[i, 0], s[i, 1], s[i, 2], a, b)
            low = y[i] + half[i] * (a if left > 0 else at)
            high = y[i] + half[i] * (b if right > 0 else at)
            if not high - low > least:
                last = -math.inf
                continue
            if panel[i] == at_panel and low - last <= least:
                end[count - 1] = high
            else:
                begin[count], end[count] = low, high
                count += 1
            last, at_panel = high, panel[i]
    return count


@part()
def share_nodes(width, nodes, count):
    """Fill ``count`` with the number of nodes of each patch: ``nodes`` shared by the square roots of the widths."""
    n, whole, left = width.size, 0.0, nodes
    for i in range(n):
        whole += math.sqrt(width[i])
    least = min(2, nodes // n)
    for i in range(n):
        count[i] = least + math.floor((nodes - least * n) * math.sqrt(width[i]) / whole + 1e-9)
        left -= count[i]
    # the remaining nodes go to the widest patches
    order = np.argsort(-width[:n], kind="mergesort")
    for i in range(left):
        count[order[i]] += 1


@entry()
def patch_nodes(s, y, half, panel, active, least, gauss_nodes, gauss_weights, at, width):
    """Fill positions and widths of Gauss points on the patches of each line, (position, pair, node).

    Row n of ``gauss_nodes`` and ``gauss_weights`` holds the rule of n points. Patches not longer than ``least`` are
    ignored.
    """
    positions, pairs, segments = y.shape
    nodes = at.shape[2]
    begin, end = np.empty(2 * segments), np.empty(2 * segments)
    count = np.empty(2 * segments, dtype=np.int64)
    for i in range(positions):
        for k in range(pairs):
            at[i, k], width[i, k] = 0.0, 0.0
            if not active[i, k]:
                continue
            n = loaded_halves(s[i, k], y[i, k], half[i, k], panel[i, k], least, begin, end)
            if n == 0:
                continue
            share_nodes(end[:n] - begin[:n], nodes, count)
            first = 0
            for patch in range(n):
                m, reach = count[patch], (end[patch] - begin[patch]) / 2
                for j in range(m):
                    at[i, k, first + j] = begin[patch] + reach * (1 + gauss_nodes[m, j])
                    width[i, k, first + j] = reach * gauss_weights[m, j]
                first += m


@entry()
def rows_on_pieces(y, half, piece, active, at, gauss_nodes, weights, rows):
    """Fill ``rows`` (position, pair, point, node), initially zero, which interpolate from nodes y to the points ``at``.

    Each piece of a line has a polynomial through its nodes; beyond the ends of a line the end values are used. ``half``
    (position, pair, node) holds half the widths of the nodes, which sum to half the width of a piece. Row n of
    ``gauss_nodes`` and ``weights`` holds the rule of n points and its barycentric weights (Berrut and Trefethen, SIAM
    Review 46, 2004).
    """
    positions, pairs, nodes = y.shape
    points = at.shape[2]
    first, last = np.empty(nodes, dtype=np.int64), np.empty(nodes, dtype=np.int64)
    middle, reach = np.empty(nodes), np.empty(nodes)
    for i in range(positions):
        for k in range(pairs):
            if not active[i, k]:
                continue
            count, j = 0, 0
            while j < nodes:
                begin, width = j, 0.0
                while j < nodes and piece[i, k, j] == piece[i, k, begin]:
                    width += half[i, k, j]
                    j += 1
                first[count], last[count], reach[count] = begin, j, width
                # the rule is symmetric
                middle[count] = (y[i, k, begin] + y[i, k, j - 1]) / 2
                count += 1
            for m in range(points):
                p = 0
                while p < count - 1 and at[i, k, m] > middle[p] + reach[p]:
                    p += 1
                a, n = first[p], last[p] - first[p]
                t, total, exact = min(max((at[i, k, m] - middle[p]) / reach[p], -1.0), 1.0), 0.0, -1
                for j in range(n):
                    distance = t - gauss_nodes[n, j]
                    if distance == 0.0:
                        exact = j
                        break
                    rows[i, k, m, a + j] = weights[n, j] / distance
                    total += rows[i, k, m, a + j]
                for j in range(n):
                    if exact >= 0:
                        rows[i, k, m, a + j] = 1.0 if j == exact else 0.0
                    else:
                        rows[i, k, m, a + j] /= total
