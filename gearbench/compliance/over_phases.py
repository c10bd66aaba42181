"""Flank compliance at many mesh phases, interpolated between phases at which the ends of contact lines pass a corner.

Between these phases the ends of a line move linearly with the phase τ, and the Gauss points on the line with them. The
compliance between two points is a product of polynomials of their positions. It is therefore smooth in τ, and its
values at a few phases determine it to rounding (Trefethen, Approximation Theory and Approximation Practice, 2013,
ch. 8).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.flank import FlankCompliance, flank_matrix
from gearbench.geometry.action import ContactLines, contact_lines
from gearbench.geometry.pair import Pair
from gearbench.geometry.quadrature import gauss, interpolation, legendre_transform

#: Number of phases beyond those that resolve the waves of the polynomials; their last two Legendre coefficients must be
#: below NEGLIGIBLE of the greatest compliance. The error is then a hundredth of it.
MORE_PHASES, NEGLIGIBLE = 8, 1e-9
#: Greatest distance of a node from its interpolated position, relative to the face width: rounding only.
ON_LINES = 1e-9
#: Number of panels whose matrices are kept: loads of a sweep that are solved one after the other use the same.
KEPT = 8


def matrix_at_phases(flanks: Sequence[FlankCompliance], lines: ContactLines) -> NDArray:
    """``flank_matrix`` of many positions: H of the flanks of pinion and wheel, (position, n, n) [mm/N].

    Positions on a panel between two corners are interpolated if they are more than the phases that determine H there.
    All others are computed one by one, also if the nodes of ``lines`` do not move linearly or the contact is off the
    line of action.
    """
    positions, pairs, segments = lines.shape
    interpolated, one_by_one = [], np.ones(positions, dtype=bool)
    for begin, end in _panels(lines):
        at = np.flatnonzero((begin <= lines.mesh_phase) & (lines.mesh_phase < end))
        count = phases_needed(flanks, lines.pair, end - begin)
        if len(at) <= count:
            continue
        nodes, known = _on_panel(tuple(flanks), lines.pair, lines.span, lines.coast, (begin, end), count, segments)
        rows = interpolation(count, 2 * (lines.mesh_phase[at] - begin) / (end - begin) - 1)
        if known is not None and _follows(lines.part(at), nodes, rows):
            interpolated.append((at, rows @ known))
            one_by_one[at] = False
    if not interpolated:
        return flank_matrix(flanks, lines)
    H = np.empty((positions, pairs * segments, pairs * segments))
    for at, values in interpolated:
        H[at] = values.reshape(len(at), *H.shape[1:])
    if one_by_one.any():
        H[one_by_one] = flank_matrix(flanks, lines.part(np.flatnonzero(one_by_one)))
    return H


def _panels(lines: ContactLines) -> Iterator[tuple[float, float]]:
    """Begin and end of the panels of mesh phases in [0, 1); none off the line of action."""
    if lines.separation is not None:
        return
    meshing = lines.pair.meshing
    corners = meshing.phases_at(lines.span or (meshing.path_start, meshing.path_end))
    yield from ((a, b) for a, b in pairwise(sorted({0.0, *corners, 1.0})) if b > a)


def phases_needed(flanks: Sequence[FlankCompliance], pair: Pair, length: float) -> int:
    """Number of phases that determine H on a panel of a ``length`` [mesh periods].

    A Legendre polynomial of degree n is a wave of the phase n arccos x. Products of two have twice the degree. Waves
    are resolved from two phases for each wave length, and nodes move by a share of path and face on the panel.
    """
    ratios = pair.meshing.transverse_contact_ratio, pair.meshing.overlap_ratio
    shares = [min(length / ratio, 1.0) if ratio else 0.0 for ratio in ratios]
    waves = [sum((n - 1) * math.acos(1 - 2 * c) for n, c in zip(f.order, shares, strict=True)) for f in flanks]
    return MORE_PHASES + math.ceil(max(waves))


@lru_cache(maxsize=KEPT)
def _on_panel(
    flanks: tuple[FlankCompliance, ...],
    pair: Pair,
    span: tuple[float, float] | None,
    coast: bool,
    panel: tuple[float, float],
    count: int,
    segments: int,
) -> tuple[ContactLines, NDArray | None]:
    """Lines at the ``count`` Gauss phases of a panel, and H there, (phase, n²); None if these are too few."""
    begin, end = panel
    phase = begin + (end - begin) * (1 + gauss(count)[0]) / 2
    lines = contact_lines(pair, phase, segments, coast=coast, span=span)
    H = flank_matrix(flanks, lines).reshape(count, -1)
    last = np.abs(legendre_transform(count)[-2:] @ H).max(initial=0.0)
    return lines, H if last <= NEGLIGIBLE * H.max(initial=0.0) else None


def _follows(lines: ContactLines, nodes: ContactLines, rows: NDArray) -> bool:
    """Whether the nodes of ``lines`` are where ``rows``, the matrix of interpolation, puts those of ``nodes``."""
    if not (np.array_equal(lines.index, nodes.index) and (lines.active == nodes.active[0]).all()):
        return False
    pairs = nodes.active[0]
    both = ((getattr(each, name)[:, pairs].reshape(len(each.u), -1) for each in (lines, nodes)) for name in "uy")
    most = ON_LINES * lines.pair.meshing.face_width
    return all(np.abs(own - rows @ known).max(initial=0.0) <= most for own, known in both)
