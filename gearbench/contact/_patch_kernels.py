"""Compiled search for contact patches on lines of cells, for ``patches``.

A patch is a part of a contact line on which the compression s (in units of ``length_scale``) is positive. s is known at
the ends and middles of the cells, and at the points of earlier patches. tests/support/patch_twin.py is the readable
version.
"""

from __future__ import annotations

import math

import numpy as np

from gearbench.compiled import entry, part

#: Points of earlier patches that are closer to an end or the middle of a cell than this part of half the cell are left
#: out.
DISTINCT = 1e-3
#: A maximum of s below zero is kept as a probe if s > −NEAR there: the flanks may touch beside it.
NEAR = 0.2
#: Halvings of the interval of a zero: enough to reach rounding.
HALVINGS = 48


@entry()
def compressions(interpolation, factor, q, block, delta, gaps, scale, active, s):
    """Fill s = δ − e − Ψ q at the beginning, middle and end of each cell; −1 if there is no line.

    Shapes: interpolation (position, pair, segment, 3, node), factor (position, pair, node, rank), q (position, block,
    rank), gaps and s (position, pair, segment, 3), block (pair,), delta (position,), and scale (position,), the unit of
    δ.
    """
    positions, pairs, segments = gaps.shape[:3]
    nodes = factor.shape[2]
    for i in range(positions):
        unit = 1.0 / scale[i]
        for k in range(pairs):
            on_line = s[i, k].reshape(3 * segments)
            if not active[i, k]:
                on_line[:] = -1.0
                continue
            smooth = np.dot(interpolation[i, k].reshape((3 * segments, nodes)), np.dot(factor[i, k], q[i, block[k]]))
            gap = gaps[i, k].reshape(3 * segments)
            for j in range(3 * segments):
                on_line[j] = delta[i] - gap[j] * unit - smooth[j]


@part()
def known_points(s, y, half, panel, known_y, known_s, at, value, at_panel):
    """Fill positions, s and panels of the points of a line at which s is known, and return their number.

    They are the ends and middles of the cells and, in between, the points ``known_y``. Where two panels meet, each has
    a point.
    """
    count, k = 0, 0
    for i in range(y.size):
        near = DISTINCT * half[i]
        begins = i == 0 or panel[i] != panel[i - 1]
        for side in range(0 if begins else 1, 3):
            point = y[i] + (side - 1) * half[i]
            while k < known_y.size and known_y[k] < point + near:
                if side > 0 and at[count - 1] + near < known_y[k] < point - near:
                    at[count], value[count], at_panel[count] = known_y[k], known_s[k], panel[i]
                    count += 1
                k += 1
            at[count], value[count], at_panel[count] = point, s[i, side], panel[i]
            count += 1
    return count


@part()
def zero_between(at, value, j):
    """Zero, between points j and j + 1, of the cubic through the four points around it; at an end of three of them."""
    first, last = max(j - 1, 0), min(j + 2, at.size - 1)
    n = last - first + 1
    x, c = at[first : last + 1], value[first : last + 1].copy()
    for order in range(1, n):  # divided differences
        for i in range(n - 1, order - 1, -1):
            c[i] = (c[i] - c[i - 1]) / (x[i] - x[i - order])
    low, high = at[j], at[j + 1]
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        s = c[n - 1]
        for i in range(n - 2, -1, -1):
            s = s * (middle - x[i]) + c[i]
        if (s > 0) == (value[j] > 0):
            low = middle
        else:
            high = middle
    return (low + high) / 2


@part()
def hump(at, value, j):
    """Beginning and end of the part where the parabola through point j and its neighbours is positive.

    If the parabola is negative everywhere, both are its vertex. If the part reaches beyond a neighbour, both are point
    j.
    """
    low, middle, high = at[j - 1], at[j], at[j + 1]
    left, right = (value[j] - value[j - 1]) / (middle - low), (value[j + 1] - value[j]) / (high - middle)
    square = (right - left) / (high - low)
    slope = left + square * (middle - low)  # at the middle
    if not square < 0:
        return middle, middle
    vertex = middle - slope / (2 * square)
    reach = -math.sqrt(max(slope * slope - 4 * square * value[j], 0.0)) / (2 * square)
    if not (low < vertex - reach and vertex + reach < high):
        return middle, middle
    return vertex - reach, vertex + reach


@part()
def loaded_parts(at, value, begin, end):
    """Find the patches on one panel: fill their beginnings and ends, and return their number.

    A patch of zero length marks a maximum of s below zero.
    """
    count, last = 0, at.size - 1
    for j in range(last + 1):
        if value[j] > 0:
            low = at[j] if j == 0 or value[j - 1] > 0 else zero_between(at, value, j - 1)
            high = at[j] if j == last else at[j + 1] if value[j + 1] > 0 else zero_between(at, value, j)
        elif (j == 0 or value[j - 1] <= value[j]) and (j == last or value[j + 1] < value[j]):
            low, high = hump(at, value, min(max(j, 1), last - 1))
            if low == high and value[j] < -NEAR:
                continue
            if low == high and (j == 0 or j == last):
                # s is known at the end itself; beside it s may be positive, as at the corner of a relief: look a third
                # of the way to the next point
                low = high = at[j] + (at[min(j + 1, last - 1)] - at[j]) / 3
        else:
            continue
        if count > 0 and j > 0 and value[j] > 0 and value[j - 1] > 0:
            end[count - 1] = high
        else:
            begin[count], end[count] = low, high
            count += 1
    return count


@part()
def share_nodes(width, nodes, count):
    """Fill ``count`` with the nodes of each patch: ``nodes``, in proportion to the square roots of the widths."""
    n, total, remaining = width.size, 0.0, nodes
    for i in range(n):
        total += math.sqrt(width[i])
    least = min(2, nodes // n)
    for i in range(n):
        # 1e-9: rounding does not take a node away
        count[i] = least + math.floor((nodes - least * n) * math.sqrt(width[i]) / total + 1e-9)
        remaining -= count[i]
    # the remaining nodes go to the widest patches
    order = np.argsort(-width[:n], kind="mergesort")
    for i in range(remaining):
        count[order[i]] += 1


@entry()
def patch_nodes(s, y, half, panel, active, known_y, known_s, least, rule_nodes, rule_weights, at, width):
    """Fill positions and widths of the points on the patches of each line, followed by probes of zero width.

    ``s`` (position, pair, segment, 3) belongs to beginning, middle and end of the cells; ``y`` and ``half`` are middles
    and half widths of the cells, ``panel`` their panels. Probes are ends of patches and maxima of s below zero. ``at``
    and ``width`` (position, pair, node and probe) are zero where there is neither. ``known_y`` and ``known_s``
    (position, pair, point) are the points of earlier patches, ascending, and s there. ``rule_nodes`` and
    ``rule_weights`` hold the ``patches.patch_rules``; the last row has as many points as there are nodes on a line.
    Patches not longer than ``least`` are ignored.
    """
    positions, pairs, segments = y.shape
    nodes, most = rule_nodes.shape[2], 3 * segments + known_y.shape[2]
    point, value, begin, end = np.empty((4, most))
    at_panel, count, kind = np.empty((3, most), dtype=np.int64)
    for i in range(positions):
        for k in range(pairs):
            at[i, k], width[i, k] = 0.0, 0.0
            if not active[i, k]:
                continue
            points = known_points(
                s[i, k], y[i, k], half[i, k], panel[i, k], known_y[i, k], known_s[i, k], point, value, at_panel
            )
            n, probe, first = 0, nodes, 0
            for j in range(1, points + 1):
                if j < points and at_panel[j] == at_panel[first]:
                    continue
                patches = loaded_parts(point[first:j], value[first:j], begin[n:], end[n:])
                for patch in range(n, n + patches):
                    for place in (begin[patch], end[patch]):
                        inside = max(point[first], at[i, k, probe - 1]) < place < point[j - 1]
                        if inside and probe < at.shape[2]:
                            at[i, k, probe] = place
                            probe += 1
                    if end[patch] - begin[patch] > least:
                        begin[n], end[n] = begin[patch], end[patch]
                        # number of the rule: which ends are free, not ends of the panel
                        kind[n] = 2 * (begin[n] > point[first]) + (end[n] < point[j - 1])
                        n += 1
                first = j
            if n == 0:
                continue
            share_nodes(end[:n] - begin[:n], nodes, count)
            node = 0
            for patch in range(n):
                m, reach = count[patch], (end[patch] - begin[patch]) / 2
                for j in range(m):
                    at[i, k, node + j] = begin[patch] + reach * (1 + rule_nodes[kind[patch], m, j])
                    width[i, k, node + j] = reach * rule_weights[kind[patch], m, j]
                node += m


@entry()
def rows_on_pieces(y, half, piece, active, at, gauss_nodes, weights, rows):
    """Fill ``rows`` (position, pair, point, node), initially zero, which interpolate from nodes y to the points ``at``.

    Each piece of a line has a polynomial through its nodes; points beyond an end of the line get the value at the end.
    ``half`` (position, pair, node) holds half the widths of the nodes, which sum to half the width of a piece. Row n of
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


@entry()
def values_of_lines(rows, values, active, result):
    """Fill ``result`` (position, pair, point, column) with rows · values of each line; zero if there is no line.

    Shapes: rows (position, pair, point, node), values (position, pair, node, column), active (position, pair).
    """
    positions, pairs = active.shape
    for i in range(positions):
        for k in range(pairs):
            if active[i, k]:
                np.dot(rows[i, k], values[i, k], result[i, k])
            else:
                result[i, k] = 0.0
