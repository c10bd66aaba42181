"""Readable version of the search for contact patches in ``gearbench.contact._patch_kernels``."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import KroghInterpolator
from scipy.optimize import bisect

from gearbench.contact._patch_kernels import DISTINCT, NEAR
from gearbench.contact.patches import PROBES, patch_rules
from gearbench.geometry.action import NEGLIGIBLE_WIDTH, ContactLines


def patch_nodes(lines: ContactLines, s: NDArray, nodes: int, known: tuple[NDArray, NDArray]) -> tuple[NDArray, NDArray]:
    """Positions y and widths of ``nodes`` points on the patches of each line, and of the probes behind them [mm].

    Both are (position, pair, node and probe). ``s`` is the compression at the beginning, middle and end of each
    segment, ``known`` holds y and s at further points (position, pair, point). Patches end where the cubic through the
    closest points changes sign or the gap has a kink.
    """
    assert lines.panel is not None
    least = NEGLIGIBLE_WIDTH * lines.pair.meshing.face_width
    half = lines.length * math.cos(lines.pair.meshing.beta_b) / 2
    y, width = np.zeros((2, *lines.shape[:2], nodes + PROBES))
    for line in np.argwhere(lines.active).tolist():
        i, k = line
        patches: list[tuple[float, float]] = []
        kinds: list[int] = []
        probes: list[float] = []
        for panel in np.unique(lines.panel[i, k]):
            own = lines.panel[i, k] == panel
            at = _points(lines.y[i, k, own], half[i, k, own], s[i, k, own], *(each[i, k] for each in known))
            parts = list(_loaded_parts(*at))
            patches += (kept := [(a, b) for a, b in parts if b - a > least])
            kinds += [2 * (a > at[0][0]) + (b < at[0][-1]) for a, b in kept]
            probes += [place for place in sorted({x for part in parts for x in part}) if at[0][0] < place < at[0][-1]]
        probes = probes[:PROBES]
        y[i, k, nodes : nodes + len(probes)] = probes
        if not patches:
            continue
        begin, end = np.array(patches).T
        count = _counts(np.zeros(len(begin), dtype=int), end - begin, nodes).tolist()
        rules = [[each[kind, n, :n] for each in patch_rules(nodes)] for kind, n in zip(kinds, count, strict=True)]
        pairs = zip(patches, rules, strict=True)
        parts = [(a + (b - a) / 2 * (1 + t), (b - a) / 2 * w) for (a, b), (t, w) in pairs]
        y[i, k, :nodes], width[i, k, :nodes] = (np.concatenate(each) for each in zip(*parts, strict=True))
    return y, width


def _points(y: NDArray, half: NDArray, s: NDArray, known_y: NDArray, known_s: NDArray) -> tuple[NDArray, NDArray]:
    """Points of a panel at which s is known: ends and middles of its cells, and the known points apart from these."""
    at, value = np.append(np.stack([y - half, y], 1), y[-1] + half[-1]), np.append(s[:, :2], s[-1, 2])
    near = DISTINCT * half[0]
    for a, b in zip(known_y, known_s, strict=True):
        if at[0] < a < at[-1] and np.abs(at - a).min() > near:
            i = np.searchsorted(at, a)
            at, value = np.insert(at, i, a), np.insert(value, i, b)
    return at, value


def _loaded_parts(at: NDArray, value: NDArray) -> Iterator[tuple[float, float]]:
    """Begin and end of the parts where the curve is positive, or twice the place of a maximum below zero."""
    last = len(at) - 1
    crossings = np.flatnonzero((value[1:] > 0) != (value[:-1] > 0))
    zeros = []
    for j in crossings.tolist():
        some = slice(max(j - 1, 0), j + 3)
        cubic = KroghInterpolator(at[some], value[some])
        zeros.append(float(bisect(cubic, at[j], at[j + 1], xtol=1e-13)))
    found = [*([float(at[0])] if value[0] > 0 else []), *zeros, *([float(at[-1])] if value[-1] > 0 else [])]
    parts = list(zip(found[::2], found[1::2], strict=True))
    for j in range(last + 1):
        before, after = (value[i] if 0 <= i <= last else -np.inf for i in (j - 1, j + 1))
        if value[j] <= 0 and before <= value[j] > after:
            low, high = _hump(at, value, min(max(j, 1), last - 1))
            if low == high and j in (0, last):
                low = high = float(at[j] + (at[min(j + 1, last - 1)] - at[j]) / 3)
            if low < high or value[j] >= -NEAR:
                parts.append((low, high))
    yield from sorted(parts)


def _hump(at: NDArray, value: NDArray, j: int) -> tuple[float, float]:
    """Part between the two points around point j where the parabola through the three is positive, or its vertex."""
    low, middle, high = at[j - 1 : j + 2]
    c = np.polyfit(at[j - 1 : j + 2] - middle, value[j - 1 : j + 2], 2)
    roots = middle + np.sort(np.roots(c).real)
    inside = c[0] < 0 and low < roots[0] and roots[1] < high
    return (float(roots[0]), float(roots[1])) if inside else (float(middle), float(middle))


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
