"""Contact lines of all tooth pairs over a mesh cycle, with the segments on them.

A line is cut into panels at the kinks of the gap, where a profile relief (at some u) or an end relief (at some y)
begins. Segments are the nodes and weights of a quadrature on each panel. If the flanks touch all along the line, these
are Gauss points, which converge exponentially. If the flanks may part, the integrand has a kink at an unknown
position, and equal cells of second order are used, over which compliance and law are averaged (G9, C7 of
docs/algorithms.md).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.geometry.pair import Pair
from gearbench.geometry.quadrature import gauss
from gearbench.geometry.separation import Separation, Touch

#: Smallest number of segments of a panel.
MIN_SEGMENTS = 2
#: Width [modules] that is added to that of each piece of a line when they share the points of the smooth compliance.
PIECE_MODULES = 2.0
#: Panels shorter than this part of the face width count as rounding.
NEGLIGIBLE_WIDTH = 1e-13


@dataclass(frozen=True, kw_only=True)
class ContactLines:
    """Segments of the contact lines in the base tangent plane: u along the path of contact, y along the face width.

    Pair k at mesh phase τ touches along u = u_A + (τ + k) p_bt + y tan β_b, within u_A ≤ u ≤ u_E, 0 ≤ y ≤ b. All
    arrays are (position, pair, segment) unless stated otherwise; a pair without a line has segments of zero length in
    the middle of the rectangle.

    Parameters
    ----------
    pair
        The gear pair.
    mesh_phase
        Mesh phases τ, one per position [–].
    index
        Number k of each tooth pair, shape (pair,).
    u, y
        Nodes, one per segment [mm].
    length
        Length of each segment along the contact line, Δy / cos β_b [mm]: the weight of its node.
    panel
        Number of the panel of each segment, if known.
    cells
        Whether the segments are cells (nodes in the middle) or Gauss points.
    separation
        Separation of the flanks; None if contact is assumed on the line of action.
    typical_load
        Line load [N/mm] at which laws near an edge are exact in value and slope; needed with ``separation``.
    span
        Range of u [mm]; by default the path of contact.
    coast
        Whether these are lines of the coast flanks; u and y then belong to the mirrored pair (G10 of docs/theory.md).
    """

    pair: Pair
    mesh_phase: NDArray
    index: NDArray
    u: NDArray
    y: NDArray
    length: NDArray
    panel: NDArray | None = None
    cells: bool = False
    separation: Separation | None = None
    typical_load: float = 0.0
    span: tuple[float, float] | None = None
    coast: bool = False

    @property
    def face(self) -> NDArray:
        """Position along the face of the real gears: y, or b − y for coast flanks [mm]."""
        return self.pair.meshing.face_width - self.y if self.coast else self.y

    def gear_y(self, index: int) -> NDArray:
        """y counted from the end of the face of gear ``index``, which may overhang that of its mate [mm]."""
        return self.y + self.pair.overhangs[index][1 if self.coast else 0]

    def gear_face(self, index: int) -> NDArray:
        """Position as ``face``, but counted from the end of the face of gear ``index`` [mm]."""
        return self.face + self.pair.overhangs[index][0]

    @property
    def shape(self) -> tuple[int, int, int]:
        """(positions, pairs, segments)."""
        p, k, s = self.u.shape
        return p, k, s

    @property
    def active(self) -> NDArray:
        """Whether a pair has a contact line at a position, (position, pair)."""
        return self.length[..., 0] > 0

    def part(self, positions: slice | NDArray) -> ContactLines:
        """The lines at selected positions."""
        arrays = {name: getattr(self, name)[positions] for name in ("mesh_phase", "u", "y", "length")}
        return replace(self, **arrays, panel=None if self.panel is None else self.panel[positions])

    def moved(self, share: float) -> ContactLines:
        """The lines with each node moved by ``share`` of half its segment along the line: ±1 are the ends."""
        meshing = self.pair.meshing
        half, tan_b = self.length * math.cos(meshing.beta_b) / 2, math.tan(meshing.beta_b)
        y = np.clip(self.y + share * half, 0.0, self.pair.meshing.face_width)
        u = self.u + (y - self.y) * tan_b
        if self.separation is None:
            u = np.clip(u, meshing.path_start, meshing.path_end)
        return replace(self, u=u, y=y)

    @property
    def ends(self) -> tuple[NDArray, NDArray]:
        """y of both ends of lines whose segments are cells, (position, pair, 1) each [mm]."""
        half = self.length * math.cos(self.pair.meshing.beta_b) / 2
        return (self.y - half)[..., :1], (self.y + half)[..., -1:]

    @property
    def deflection_kinks(self) -> tuple[float, ...]:
        """u at which deflections along oblique lines have a kink [mm]."""
        if self.separation is None or self.span is None or not self.pair.meshing.overlap_ratio:
            return ()
        return tuple(u for u in self.separation.kinks if self.span[0] < u < self.span[1])

    def smooth_lines(self, nodes: int) -> ContactLines:
        """The same lines with ``nodes`` Gauss points per line, shared among its pieces (numbered by ``panel``).

        Off the line of action, deflections along an oblique line have a kink where an edge or a relief begins to touch.
        Lines are cut into pieces there.
        """
        low, high = self.ends
        meshing, deflection_kinks = self.pair.meshing, self.deflection_kinks
        tan_b = math.tan(meshing.beta_b)
        inside = [self.y[..., :1] + (u - self.u[..., :1]) / tan_b for u in deflection_kinks]
        edges = np.sort(np.clip(np.stack([low, *inside, high]), low, high), axis=0)[..., 0]
        widest = _widest(self.pair, self.span or (meshing.path_start, meshing.path_end), deflection_kinks, ())
        sizes = widest + PIECE_MODULES * self.pair.normal_module
        y, width, piece = _on_panels(edges, sizes, nodes, self.pair, cells=False)
        return replace(self.at(np.where(high > low, y, low), width), panel=piece)

    def at(self, y: NDArray, width: NDArray) -> ContactLines:
        """The lines with other nodes on them, (position, pair, node): at y, with widths Δy [mm]."""
        meshing = self.pair.meshing
        u = self.u[..., :1] + (y - self.y[..., :1]) * math.tan(meshing.beta_b)
        if self.separation is None:
            u = np.clip(u, meshing.path_start, meshing.path_end)
        return replace(self, u=u, y=y, length=width / math.cos(meshing.beta_b), panel=None, cells=False)

    @cached_property
    def touch(self) -> Touch | None:
        """First contact of the flanks; None if contact is assumed on the line of action."""
        if self.separation is None:
            return None
        if self.pair.meshing.overlap_ratio > 0:
            return self.separation(self.u)
        # without helix angle all segments of a line have the same u
        return self.separation(self.u[..., :1]).broadcast(self.shape[2])

    @property
    def rolls(self) -> tuple[NDArray, NDArray]:
        """Roll lengths of the nodes on pinion and wheel [mm]."""
        if self.touch is not None:
            return self.touch.rolls[0], self.touch.rolls[1]
        return self.u, self.pair.meshing.tangent_length - self.u

    @cached_property
    def radii(self) -> tuple[NDArray, NDArray]:
        """Radii of the nodes on pinion and wheel [mm]."""
        if self.touch is None:
            return self.pair.meshing.radii(self.u)
        # an edge with missing material has a roll length beyond the tip circle, but lies on the circle
        first, second = (
            np.minimum(gear.radius_at(roll), gear.tip_radius)
            for gear, roll in zip(self.pair.gears, self.rolls, strict=True)
        )
        return first, second

    @property
    def levers(self) -> tuple[NDArray | float, NDArray | float]:
        """Lever arms of the normal force about both axes, divided by the base radii; 1 on the line of action."""
        return (1.0, 1.0) if self.touch is None else (self.touch.levers[0], self.touch.levers[1])

    @property
    def lever(self) -> NDArray | float:
        """Lever arm about the pinion's axis, see ``levers``."""
        return self.levers[0]

    @property
    def curvature_radius(self) -> NDArray:
        """Relative radius of curvature in the normal plane ρ [mm]."""
        if self.touch is None:
            return self.pair.meshing.curvature_radius(self.u)
        first, second = self.touch.radii
        return first * second / (first + second) / math.cos(self.pair.meshing.beta_b)


def pair_indices(pair: Pair, span: tuple[float, float] | None = None) -> NDArray:
    """Numbers k of the tooth pairs that touch at some phase of the mesh cycle, (pair,).

    ``span`` is the range of u [mm] within which pairs can touch, by default the path of contact.
    """
    meshing = pair.meshing
    if span is None:
        before, after = 0.0, meshing.transverse_contact_ratio
    else:
        before, after = ((u - meshing.path_start) / meshing.base_pitch for u in span)
    return np.arange(math.floor(before) - math.ceil(meshing.overlap_ratio), math.floor(after) + 1)


def contact_lines(
    pair: Pair,
    mesh_phase: ArrayLike,
    segments: int,
    kinks: Iterable[float] = (),
    face_kinks: Iterable[float] = (),
    *,
    cells: bool = False,
    coast: bool = False,
    span: tuple[float, float] | None = None,
) -> ContactLines:
    """Contact lines of ``pair`` at the phases ``mesh_phase`` (position,) in [0, 2), each with ``segments`` segments.

    Phases from 1 on are those of the next mesh cycle, in which the same teeth have moved on.

    Parameters
    ----------
    kinks, face_kinks
        Positions u on the path of contact and y along the face where the gap has a kink [mm]; panels end there.
    cells
        Whether segments are equal cells on each panel, as needed if flanks may separate, instead of Gauss points.
    coast
        Whether these are lines of the coast flanks; u and y belong to the mirrored pair.
    span
        Range of u [mm] of the lines, which may exceed the path of contact.
    """
    tau = np.atleast_1d(np.asarray(mesh_phase, dtype=float))
    meshing, b = pair.meshing, pair.meshing.face_width
    u_a, u_e = ends = (meshing.path_start, meshing.path_end) if span is None else span
    tan_b = math.tan(meshing.beta_b)
    kinks_within = sorted({u for u in kinks if u_a < u < u_e}), sorted({y for y in face_kinks if 0 < y < b})
    index = pair_indices(pair, span)
    if np.any(tau >= 1.0):
        index = np.append(index[0] - 1, index)
    start = meshing.path_start + (tau[:, None] + index) * meshing.base_pitch  # u at y = 0
    edges = _panel_edges(pair, start, ends, *kinks_within)
    widest = _widest(pair, ends, *map(tuple, kinks_within))
    y, width, panel = _on_panels(edges, np.sqrt(widest), segments, pair, cells=cells)
    # lines of zero length, up to rounding
    absent = (edges[-1] - edges[0] <= NEGLIGIBLE_WIDTH * b)[..., None]
    return ContactLines(
        pair=pair,
        mesh_phase=tau,
        index=index,
        u=np.where(absent, (u_a + u_e) / 2, np.clip(start[..., None] + y * tan_b, u_a, u_e)),
        y=np.where(absent, b / 2, y),
        length=np.where(absent, 0.0, width / math.cos(meshing.beta_b)),
        panel=panel,
        cells=cells,
        span=span,
        coast=coast,
    )


def _panel_edges(
    pair: Pair, start: NDArray, ends: tuple[float, float], kinks: Sequence[float], face_kinks: Sequence[float]
) -> NDArray:
    """Panel ends y, (edge, …) [mm], of lines that cover ``ends`` in u and have u = ``start`` (…) at y = 0."""
    (u_a, u_e), tan_b, b = ends, math.tan(pair.meshing.beta_b), pair.meshing.face_width
    if tan_b > 0:
        low, high = np.clip((u_a - start) / tan_b, 0.0, b), np.clip((u_e - start) / tan_b, 0.0, b)
        inside = [(u - start) / tan_b for u in kinks]
    else:
        low, inside = np.zeros_like(start), []
        high = np.where((start >= u_a) & (start <= u_e), b, 0.0)
    inside += [np.full_like(start, y) for y in face_kinks]
    return np.sort(np.clip(np.stack([low, *inside, high]), low, high), axis=0)


@lru_cache(maxsize=64)
def _widest(pair: Pair, ends: tuple[float, float], kinks: tuple[float, ...], face_kinks: tuple[float, ...]) -> NDArray:
    """Largest width of each panel over all positions of a line, (panel,) [mm].

    A corner is a point where an end or kink in u meets one in y. From one position at which the line passes a corner to
    the next, panel ends move linearly. The maximum therefore occurs at a corner.
    """
    tan_b, b = math.tan(pair.meshing.beta_b), pair.meshing.face_width
    start = np.subtract.outer([*ends, *kinks], tan_b * np.array([0.0, b, *face_kinks])).ravel()
    return np.diff(_panel_edges(pair, start, ends, kinks, face_kinks), axis=0).max(axis=1, initial=0.0)


def _on_panels(
    edges: NDArray, sizes: NDArray, segments: int, pair: Pair, *, cells: bool
) -> tuple[NDArray, NDArray, NDArray]:
    """Nodes y and widths of the segments [mm], and their panels between ``edges``, all (position, pair, segment).

    Segments are shared in proportion to the ``sizes`` (panel,) of the panels that a line has. Their numbers are
    constant between two transitions of the mesh cycle, so that sums over the nodes are as smooth as the integrals.
    """
    exists = np.diff(edges, axis=0) > NEGLIGIBLE_WIDTH * pair.meshing.face_width
    y, width = np.zeros((2, *edges.shape[1:], segments))
    number = np.zeros(y.shape, dtype=np.intp)
    # lines with the same panels are treated together
    for pattern in set(zip(*exists.reshape(len(exists), -1).tolist(), strict=True)):
        alike = np.all(exists == np.array(pattern)[:, None, None], axis=0)
        panel = [i for i, is_there in enumerate(pattern) if is_there]
        if not panel:
            continue
        if len(panel) > segments:
            counts, ends = (segments,), edges[[0, -1]][:, alike]
        else:
            counts = _shares(segments, tuple(sizes[panel].tolist()), last=pair.wheel.teeth > pair.pinion.teeth)
            ends = edges[[*panel, panel[-1] + 1]][:, alike]
        of, node, weight = _rules(counts, cells)
        low, half = ends[:-1][of].T, (np.diff(ends, axis=0) / 2)[of].T
        number[alike], y[alike], width[alike] = of, low + half * (1 + node), half * weight
    return y, width, number


@lru_cache(maxsize=256)
def _shares(segments: int, sizes: tuple[float, ...], *, last: bool = False) -> tuple[int, ...]:
    """Share ``segments`` among panels in proportion to ``sizes``, at least ``MIN_SEGMENTS`` each if possible.

    A remainder goes to the first of equal panels, or to the ``last``.
    """
    fewest, total = min(MIN_SEGMENTS, segments // len(sizes)), sum(sizes)
    exact = [segments * size / total for size in sizes]
    counts = [max(fewest, math.floor(x + 1e-9)) for x in exact]
    while missing := segments - sum(counts):
        step = 1 if missing > 0 else -1
        least = 0 if step > 0 else fewest
        remainder = [
            (round(step * (x - n) * 1e6), i) for i, (x, n) in enumerate(zip(exact, counts, strict=True)) if n > least
        ]
        # equal panels get equal shares if possible: a line and its mirror image are cut alike
        groups = [[i for r, i in remainder if r == value] for value in sorted({r for r, _ in remainder}, reverse=True)]
        one = [groups[0][-1 if last else 0]]
        for i in next((group for group in groups if len(group) <= abs(missing)), one):
            counts[i] += step
    return tuple(counts)


@lru_cache(maxsize=256)
def _rules(counts: tuple[int, ...], cells: bool) -> tuple[NDArray, NDArray, NDArray]:
    """Panel, node and weight on [−1, 1] of each segment of a line, from the ``counts`` of segments of its panels.

    Nodes are midpoints of equal cells, or Gauss–Legendre points.
    """
    rules = [((np.arange(n) + 0.5) * 2 / n - 1, np.full(n, 2 / n)) if cells else gauss(n) for n in counts]
    nodes, weights = zip(*rules, strict=True)
    return np.repeat(np.arange(len(counts)), counts), np.concatenate(nodes), np.concatenate(weights)
