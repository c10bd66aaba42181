"""Kinematic separation of two flanks in the transverse plane, and their point of first contact.

Points keep their y when a gear turns. Flanks of helical gears therefore approach each other section by section: every
section is a pair of profiles at a nominal coordinate u. At each u the separation is the lowest of all curves on which
two parts of the profiles touch (``touching``); it is tabulated and interpolated.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.pair import Pair
from gearbench.geometry.profile import Modification, Profile, profile
from gearbench.geometry.touching import Plane, TouchingCurve

#: Number of nodes per base pitch; cubic Hermite polynomials between them are accurate to 1e-10 mm.
NODES = 400
#: Nodes are refined where the radius of curvature is below ``SHARP`` times T₁T₂, or the error of the cubics exceeds
#: ``ERROR`` [mm]; by at most the factor ``FINER``.
SHARP, ERROR, FINER = 0.1, 5e-10, 16
#: Tolerance at the ends of intervals [mm].
_ROUNDING = 1e-11
#: Separations are computed up to this length before and after the path of contact [base pitches], and proportionally
#: farther if 1/z₁ + 1/z₂ is below ``CONFORMING``, at most ``FARTHEST``: such flanks part slowly beyond the path.
REACH, CONFORMING, FARTHEST = 0.45, 0.02, 1.5


@dataclass(frozen=True, kw_only=True, eq=False)
class Touch:
    """Point of first contact of the flanks, interpolated in the table of their separation.

    Parameters
    ----------
    columns
        Columns of the table, see ``Separation._table``.
    row, t
        Interval of the table, and relative position in it, 0 … 1. If t is outside 0 … 1, the flanks cannot touch.
    """

    columns: NDArray
    row: NDArray
    t: NDArray

    def broadcast(self, segments: int) -> Touch:
        """Expand arrays with one value per line to all ``segments`` of the line."""
        row, t = (np.broadcast_to(x, (*x.shape[:-1], segments)) for x in (self.row, self.t))
        return Touch(columns=self.columns, row=row, t=t)

    @cached_property
    def gap(self) -> NDArray:
        """Separation along the transverse line of action [mm]; infinite if the flanks cannot touch."""
        t, (width, y, a, b, c) = self.t, self.columns[1:6].take(self.row, axis=1)
        # between intervals of the table no point of one flank reaches the other
        beyond = np.maximum(t - 1, -t) * width
        return np.where(beyond <= _ROUNDING, y + t * (a + t * (b + t * c)), np.inf)

    @cached_property
    def rolls(self) -> NDArray:
        """Roll lengths of the touching point [mm], (2, …)."""
        return self._linear(slice(0, 2))

    @cached_property
    def levers(self) -> NDArray:
        """Lever arms of the common normal, divided by the base radii, (2, …)."""
        return self._linear(slice(2, 4))

    @cached_property
    def radii(self) -> NDArray:
        """Radii of curvature of the profiles, transverse [mm], (2, …)."""
        return self._linear(slice(4, 6))

    @cached_property
    def tilt(self) -> NDArray:
        """Angle between the flank at a touching edge and the mate's flank [rad]; 0 if two smooth flanks touch."""
        return self._linear(slice(6, 7))[0]

    @cached_property
    def edge(self) -> NDArray:
        """Gear whose corner touches, 0 or 1; −1 if two smooth flanks touch."""
        return self.columns[20, self.row].astype(int)

    def _linear(self, number: slice) -> NDArray:
        """Interpolate the rows ``number`` linearly in their interval; constant between intervals."""
        low, rise = self.columns[6:13][number], self.columns[13:20][number]
        return low.take(self.row, axis=1) + np.clip(self.t, 0.0, 1.0) * rise.take(self.row, axis=1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Separation:
    """Separation of a pair of profiles as a function of the nominal coordinate u, tabulated between its kinks.

    Parameters
    ----------
    plane
        Profiles of both gears.
    path
        u at which the path of contact begins and ends [mm].
    low, high
        Range of u [mm].
    step
        Distance of nodes [mm].
    """

    plane: Plane
    path: tuple[float, float]
    low: float
    high: float
    step: float

    @cached_property
    def curves(self) -> tuple[TouchingCurve, ...]:
        """All touching curves within the range."""
        first, second = self.plane.profiles
        curves: list[TouchingCurve | None] = []
        for piece in first.pieces:
            for other in second.pieces:
                # a rounding must be the first curve, see ``piece_on_piece``
                k, own, mate = (1, other, piece) if other.is_rounding else (0, piece, other)
                # between involutes the separation is zero and everything else is linear
                straight = own.is_involute and mate.is_involute
                roll = self.plane.common_nodes(own, mate, own.high - own.low if straight else self.step)
                if not roll.size:
                    continue
                if straight:
                    curves.append(self.plane.piece_on_piece(k, own, mate, roll))
                    continue
                curves.append(self._resolved(partial(self.plane.piece_on_piece, k, own, mate), roll))
        for k, (own, mate) in enumerate(((first, second), (second, first))):
            for roll, piece in own.corners:
                # the corner touches close to the position at which it lies on the line of action, v = roll
                far = self.path[0] - self.low
                v = self._nodes(roll - far, roll + far)
                meetings = [
                    meeting
                    for other in mate.pieces
                    for end in (other.low, other.high)
                    for meeting in self.plane.meeting(k, roll, piece, end, other)
                    if abs(meeting - roll) < far
                ]
                v = np.unique([*v, roll, *meetings])
                touch = self.plane.corner_on_piece
                curves += [self._resolved(partial(touch, k, roll, piece, other), v) for other in mate.pieces]
        return tuple(curve for curve in curves if curve is not None)

    def _resolved(self, touch: Callable[[NDArray], TouchingCurve | None], nodes: NDArray) -> TouchingCurve | None:
        """Curve through ``nodes``, refined up to ``FINER`` times near base circles, where the curvature is high.

        There roll lengths vary like the root of u. Their linear interpolation has an error of the order h²/R³, where h
        is the distance of nodes and R the radius of curvature. The error of the cubics is about h⁴/R³.
        """
        curve = touch(nodes)
        if curve is None:
            return None
        radius = np.full(len(nodes), np.nan)
        radius[np.searchsorted(nodes, curve.node)] = np.maximum(np.abs(curve.radii).min(axis=0), 1e-3 * self.step)
        least = np.minimum(radius[:-1], radius[1:])
        parts = np.maximum((SHARP * self.plane.size / least) ** 1.5, (self.step**4 / least**3 / ERROR) ** 0.25)
        if not np.nanmax(parts, initial=0.0) > 1:
            return curve
        parts = np.ceil(np.clip(parts, 1.0, FINER))
        # the curve ends between a valid node and an invalid one
        parts = np.where(np.isfinite(parts), parts, np.where(np.isnan(radius[:-1]) & np.isnan(radius[1:]), 1, FINER))
        index = np.arange(len(nodes))
        refined = np.interp(np.arange(1 + int(parts.sum())), np.append(0, np.cumsum(parts)), index)
        return touch(np.interp(refined, index, nodes))

    def _nodes(self, low: float, high: float) -> NDArray:
        return np.linspace(low, high, max(5, math.ceil((high - low) / self.step) + 1))

    @cached_property
    def _pieces(self) -> list[tuple[float, float, TouchingCurve]]:
        """Intervals of u in which one curve is the lowest, as (start, end, curve)."""
        curves = self.curves
        ends = np.unique([x for c in curves for x in (c.u[0], c.u[-1]) if self.low <= x <= self.high])
        # between the end of one curve and the beginning of another a corner may touch
        uniform = np.linspace(self.low, self.high, math.ceil((self.high - self.low) / self.step))
        grid = np.unique([*uniform, *ends, *((ends[:-1] + ends[1:]) / 2)])
        values = np.stack([hermite(c, grid) for c in curves])
        least = values.min(axis=0)
        # if curves are equal, smooth contact takes precedence over an edge
        is_edge = np.array([c.edge >= 0 for c in curves])[:, None] * 1.0
        near = values <= least + 1e-13 * self.plane.size
        lowest = np.argmin(np.where(near, is_edge, np.inf), axis=0)
        lowest = np.where(np.isfinite(least), lowest, -1)
        pieces, start = [], grid[0]
        for i in np.flatnonzero(np.diff(lowest)):
            a, b = lowest[i], lowest[i + 1]
            crossing = self._crossing(a, b, grid[i], grid[i + 1])
            if a >= 0:
                pieces.append((start, crossing, curves[a]))
            start = crossing
        if lowest[-1] >= 0:
            pieces.append((start, grid[-1], curves[lowest[-1]]))
        return pieces

    def _crossing(self, a: int, b: int, low: float, high: float) -> float:
        """u between two nodes of the grid where curve b falls below curve a."""
        if a < 0 or b < 0:
            return high if a < 0 else low
        first, second = self.curves[a], self.curves[b]
        rounding = 1e-13 * self.plane.size
        begin, end = second.u[:1], first.u[-1:]
        # one curve begins or ends on the other: they meet without crossing
        if begin[0] > low and hermite(second, begin)[0] <= hermite(first, begin)[0] + rounding:
            return float(begin[0])
        if end[0] < high and hermite(first, end)[0] <= hermite(second, end)[0] + rounding:
            return float(end[0])
        low, high = max(low, begin[0]), min(high, end[0])
        from scipy.optimize import root_scalar

        if low >= high:
            return low

        def difference(u: float) -> float:
            position = np.array([u])
            return float(hermite(first, position)[0] - hermite(second, position)[0])

        if difference(low) * difference(high) >= 0:
            return low if abs(difference(low)) < abs(difference(high)) else high
        return root_scalar(difference, bracket=(low, high), method="brentq", xtol=1e-13).root

    @cached_property
    def kinks(self) -> tuple[float, ...]:
        """u [mm] where the touching point moves to another part of a flank, within the range that load can reach.

        The gap has no kink there, but its curvature jumps. Neighbours closer than a twentieth of the base pitch, around
        a short corner contact, count as one.
        """
        base_pitch = self.step * NODES
        groups: list[list[float]] = []
        for start in self.changes:
            if groups and start - groups[-1][-1] < 0.05 * base_pitch:
                groups[-1].append(start)
            else:
                groups.append([start])
        return tuple(sum(group) / len(group) for group in groups)

    @cached_property
    def changes(self) -> tuple[float, ...]:
        """All u [mm] where the touching point moves to another part of a flank, without merging neighbours.

        They lie within 0.25 base pitches of the path of contact, proportionally farther if flanks part slowly.
        """
        beyond = 0.25 / REACH * (self.path[0] - self.low)
        return tuple(start for start, *_ in self._pieces[1:] if self.path[0] - beyond < start < self.path[1] + beyond)

    @cached_property
    def _table(self) -> NDArray:
        """Table with a row for each interval, (interval, 21).

        Columns: u, width, four coefficients of the separation, seven values (rolls, levers, radii, tilt), their seven
        increments, and the edge. No interval extends across the end of a piece.
        """
        rows, edges = [], []
        for start, end, c in self._pieces:
            u = np.array([start, *c.u[(c.u > start) & (c.u < end)], end])
            width = np.diff(u)
            gap, slope = hermite(c, u), hermite_slope(c, u)
            values = np.stack([np.interp(u, c.u, row) for row in (*c.rolls, *c.levers, *c.radii, c.tilt)])
            cubic = _coefficients(width, gap[:-1], gap[1:], slope[:-1], slope[1:])
            rows.append(np.stack([u[:-1], width, *cubic, *values[:, :-1], *np.diff(values)], axis=-1))
            edges.append(np.full(len(width), c.edge))
        table = np.concatenate(rows)
        # intervals of zero length, up to rounding, have no slopes
        table[~np.isfinite(table[:, 3:6]).all(axis=1), 3:6] = 0.0
        return np.column_stack([table, np.concatenate(edges)])

    @cached_property
    def _columns(self) -> NDArray:
        """Transpose of the table: contiguous columns for fast reading."""
        return np.ascontiguousarray(self._table.T)

    @property
    def ends(self) -> NDArray:
        """Ends u of the intervals of the table, ascending [mm]."""
        start, width = self._columns[:2]
        return np.unique(np.append(start, start[-1] + width[-1]))

    @cached_property
    def least(self) -> float:
        """Least separation [mm]; 0 for flanks without excess material."""
        return min(float(self._table[:, 2].min()), 0.0)

    def __call__(self, u: NDArray) -> Touch:
        """Point of first contact and separation at the nominal coordinates u [mm]."""
        start, width = self._columns[:2]
        u = np.asarray(u, dtype=float)
        row = np.clip(np.searchsorted(start, u, side="right") - 1, 0, len(start) - 1)
        interval = width[row]
        return Touch(columns=self._columns, row=row, t=(u - start[row]) / np.where(interval > 0, interval, self.step))

    def reach(self, gap: float) -> tuple[float, float]:
        """Range of u [mm] outside which the flanks stay farther apart than ``gap`` [mm]."""
        near = np.flatnonzero(self._table[:, 2] <= max(gap, float(self._table[:, 2].min())))
        last = self._table[near[-1]]
        return float(self._table[max(near[0] - 1, 0), 0]), float(last[0] + last[1])


def _coefficients(width: NDArray, y0: NDArray, y1: NDArray, d0: NDArray, d1: NDArray) -> tuple[NDArray, ...]:
    """Coefficients of the cubic Hermite polynomial in t = 0 … 1, from values y and derivatives d at both ends."""
    rise = y1 - y0
    return y0, width * d0, 3 * rise - width * (2 * d0 + d1), width * (d0 + d1) - 2 * rise


def _interval(c: TouchingCurve, u: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Interval of the curve that contains u, its width, and the relative position in it."""
    i = np.clip(np.searchsorted(c.u, u, side="right") - 1, 0, len(c.u) - 2)
    width = c.u[i + 1] - c.u[i]
    return i, width, (u - c.u[i]) / width


def hermite(c: TouchingCurve, u: NDArray) -> NDArray:
    """Separation of a curve at u [mm]; infinite beyond its ends."""
    i, width, t = _interval(c, u)
    a, b, d, e = _coefficients(width, c.gap[i], c.gap[i + 1], c.slope[i], c.slope[i + 1])
    value = a + t * (b + t * (d + t * e))
    return np.where((u >= c.u[0]) & (u <= c.u[-1]), value, np.inf)


def hermite_slope(c: TouchingCurve, u: NDArray) -> NDArray:
    """Derivative of a curve at u."""
    i, width, t = _interval(c, u)
    rise = (c.gap[i + 1] - c.gap[i]) / width
    a, b = c.slope[i], c.slope[i + 1]
    return a + t * (2 * (3 * rise - 2 * a - b) + 3 * t * (a + b - 2 * rise))


def farthest(pair: Pair) -> float:
    """Length [mm] before and after the path of contact up to which separations are computed."""
    closeness = sum(1 / gear.teeth for gear in pair.gears)
    return min(REACH * max(CONFORMING / closeness, 1.0), FARTHEST) * pair.meshing.base_pitch


@lru_cache(maxsize=128)
def separation(pair: Pair, modifications: tuple[Modification, ...] = ()) -> Separation:
    """Separation of the flanks of ``pair`` with the ``modifications`` of their profiles."""
    first, second = (profile(pair.gears[index], tuple(m for m in modifications if m.gear == index)) for index in (0, 1))
    reach = farthest(pair)
    return Separation(
        plane=Plane(profiles=(first, second), tangent_length=pair.meshing.tangent_length),
        path=(pair.meshing.path_start, pair.meshing.path_end),
        low=pair.meshing.path_start - reach,
        high=pair.meshing.path_end + reach,
        step=pair.meshing.base_pitch / NODES,
    )


__all__ = ["Modification", "Profile", "Separation", "Touch", "separation"]
