"""The strip along which the flanks of a tooth pair come close, section by section across the face width.

Points keep their y when a gear turns, so each transverse section is a spur pair at its mesh phase. The closest points
of its flanks, tips included, are found by search. Around that point both flanks are heights over the common
tangent; x counts along it, towards the tip of the pinion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem_reference.contact.placement import AT_EDGE, Placement
from fem_reference.contact.profile import Profile
from gearbench.effects.base import GapEffect
from gearbench.geometry.pair import Pair

#: Gauss points of a cell in x and in y.
_POINTS = 3
#: How fast cells of the pressure grow away from an edge.
_GROWTH = 0.45


@dataclass(frozen=True, kw_only=True)
class Slice:
    """Both flanks in one transverse section.

    Parameters
    ----------
    gap
        Least separation along the line of action, transverse [mm]; infinite if the flanks cannot touch.
    lever
        Lever arm of the common normal about the pinion's axis over its base radius.
    radii
        Radii of the touching points [mm].
    normals
        Inward normals of pinion and wheel in the frames of their teeth, tooth on +y, flank at the right, (2, 2).
    x, height, R
        Of points of the flanks of pinion and wheel, x ascending: along the tangent, material missing below it [mm],
        radii [mm].
    """

    gap: float
    lever: float
    radii: tuple[float, float]
    normals: NDArray
    x: tuple[NDArray, NDArray]
    height: tuple[NDArray, NDArray]
    R: tuple[NDArray, NDArray]

    @property
    def ends(self) -> tuple[float, float]:
        """Range of x in which both flanks are."""
        return max(x[0] for x in self.x), min(x[-1] for x in self.x)

    def window(self, half: float) -> tuple[float, float]:
        """Range of x no farther than ``half`` from the touching point in which both flanks are."""
        low, high = self.ends
        return min(max(low, -half), 0.0), max(min(high, half), 0.0)

    def sizes(self, half: float) -> NDArray:
        """Sizes of cells and elements at both ends of the window, as shares of the usual size.

        An edge near the touching point takes the load on a small part of the strip.
        """
        return np.clip(np.abs(self.window(half)) / half, AT_EDGE, 1.0)

    def cells(self, half: float, count: int) -> NDArray:
        """Ends of the cells of the pressure in the window, (count + 1,)."""
        low, high = self.window(half)
        x, usual = np.linspace(low, high, 1000), 2 * half / count
        away = np.stack([x - low, high - x], axis=1) / usual
        size = np.minimum((self.sizes(half) + _GROWTH * away).min(axis=1), 1.0)
        number = np.concatenate([[0.0], np.cumsum((1 / size[1:] + 1 / size[:-1]) / 2)])
        return np.interp(np.linspace(0.0, number[-1], count + 1), number, x)

    def separation(self, x: NDArray) -> NDArray:
        """Gap at x along the common normal, transverse [mm]."""
        first, second = (np.interp(x, *pair) for pair in zip(self.x, self.height, strict=True))
        return self.gap * self.lever + first + second

    def radius(self, index: int, x: NDArray) -> NDArray:
        """Radius on a gear at x [mm]."""
        return np.interp(x, self.x[index], self.R[index])


def slice_at(pair: Pair, effects: tuple[GapEffect, ...], phase: float, k: int, y: float) -> Slice:
    """Section at y [mm] of tooth pair k at a mesh phase."""
    meshing = pair.meshing
    profiles = (
        Profile(pair=pair, gear=0, effects=effects, y=y),
        Profile(pair=pair, gear=1, effects=effects, y=y),
    )
    turned = phase + y * math.tan(meshing.beta_b) / meshing.base_pitch
    rest = Placement(pair=pair, phase=turned, profiles=profiles)
    touch = rest.touch(k)
    # the pinion turned until the flanks just touch
    met = replace(rest, advance=touch.gap if math.isfinite(touch.gap) else 0.0)
    outlines = [met.outline(index, k) for index in (0, 1)]
    nearest = [int(np.argmin(np.abs(R - radius))) for (R, _), radius in zip(outlines, touch.radii, strict=True)]
    # of the flank that is not at its edge
    smooth = 1 if nearest[0] >= len(outlines[0][0]) - 2 else 0
    xy, i = outlines[smooth][1], min(max(nearest[smooth], 1), len(outlines[smooth][0]) - 2)
    tangent = (xy[:, i + 1] - xy[:, i - 1]) * (1 if smooth == 0 else -1)
    tangent /= np.hypot(*tangent)
    normal = np.array([tangent[1], -tangent[0]])  # out of the pinion
    R, xy = outlines[0]
    origin = np.array([np.interp(touch.radii[0], R, xy[0]), np.interp(touch.radii[0], R, xy[1])])
    x, height, radii = [], [], []
    for index, (R, xy) in enumerate(outlines):
        away = xy - origin[:, None]
        order = slice(None) if index == 0 else slice(None, None, -1)
        x.append((tangent @ away)[order])
        height.append((normal @ away * (-1 if index == 0 else 1))[order])
        radii.append(R[order])
    return Slice(
        gap=touch.gap,
        lever=float(abs(origin[0] * normal[1] - origin[1] * normal[0])) / pair.gears[0].base_radius,
        radii=touch.radii,
        normals=np.stack([met.in_tooth(0, k, -normal), met.in_tooth(1, k, normal)]),
        x=(x[0], x[1]),
        height=(height[0], height[1]),
        R=(radii[0], radii[1]),
    )


@dataclass(frozen=True, kw_only=True)
class Points:
    """Quadrature points of a strip, and the functions of the pressure there.

    Parameters
    ----------
    x, y, weight
        Along the tangent and across the face [mm], and ∫ dx dy [mm²].
    radii
        On pinion and wheel [mm], (2, point).
    normals
        Inward normals as in ``Slice``, (2, point, 2).
    lever, gap
        As in ``Slice``; the gap at the point, along the common normal, transverse [mm].
    hats
        Values of the functions of the pressure, (point, function).
    """

    x: NDArray
    y: NDArray
    weight: NDArray
    radii: NDArray
    normals: NDArray
    lever: NDArray
    gap: NDArray
    hats: sp.csr_matrix

    @property
    def functions(self) -> int:
        """Number of functions of the pressure."""
        return self.hats.get_shape()[1]


@dataclass(frozen=True, kw_only=True)
class Strip:
    """Strip of tooth pair k at a mesh phase, in cells.

    Parameters
    ----------
    pair, effects, phase, k
        The pair, its gaps, the mesh phase τ and the number of the tooth pair.
    half
        Half its width [mm].
    cells
        Number of cells in x.
    layers
        Ends of the cells across the face, from 0 to b [mm].
    reach
        Separation [mm] beyond which flanks are not expected to touch.
    """

    pair: Pair
    effects: tuple[GapEffect, ...]
    phase: float
    k: int
    half: float
    cells: int
    layers: NDArray
    reach: float

    def at(self, y: float) -> Slice:
        """Section at y."""
        return slice_at(self.pair, self.effects, self.phase, self.k, y)

    @cached_property
    def stations(self) -> list[Slice]:
        """Sections at the ends of the layers."""
        return [self.at(float(y)) for y in self.layers]

    @property
    def near(self) -> NDArray:
        """Whether flanks may touch at the end of a layer."""
        return np.array([section.gap < self.reach for section in self.stations])

    @cached_property
    def points(self) -> Points:
        """Quadrature points on the layers where flanks may touch."""
        t, w = np.polynomial.legendre.leggauss(_POINTS)
        t, w = (t + 1) / 2, w / 2
        n, near = self.cells, self.near
        along = (np.arange(n)[:, None] + t).ravel()
        blocks = []
        for i in np.flatnonzero(near[1:] | near[:-1]):
            width = self.layers[i + 1] - self.layers[i]
            for share, of_y in zip(t, w, strict=True):
                y = float(self.layers[i] + share * width)
                section = self.at(y)
                if not math.isfinite(section.gap):
                    continue
                ends = section.cells(self.half, n)
                x = (ends[:-1, None] + np.diff(ends)[:, None] * t).ravel()
                weight = (np.diff(ends)[:, None] * w).ravel() * of_y * width
                blocks.append((section, x, y, weight, along, i + share))
        return self._collected(blocks)

    def _collected(self, blocks: list[tuple]) -> Points:
        n, near = self.cells, self.near
        count = np.where(near)[0]
        number = np.full(len(near), -1)
        number[count] = np.arange(count.size)
        rows, columns, values = [], [], []
        for block, (_, x, _, _, along, across) in enumerate(blocks):
            row = block * len(x) + np.arange(len(x))
            j, i = np.minimum(along.astype(int), n - 1), int(across)
            for di, in_y in ((0, 1 - (across - i)), (1, across - i)):
                if number[i + di] < 0:
                    continue
                for dj, in_x in ((0, 1 - (along - j)), (1, along - j)):
                    rows.append(row)
                    columns.append(number[i + di] * (n + 1) + j + dj)
                    values.append(in_x * in_y)
        size = (sum(len(each[1]) for each in blocks), count.size * (n + 1))
        hats = sp.csr_matrix(
            (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))) if values else size, shape=size
        )
        of_point = [np.full(len(each[1]), i) for i, each in enumerate(blocks)]
        which = np.concatenate(of_point) if blocks else np.zeros(0, dtype=int)
        sections, x, y, weight = ([each[c] for each in blocks] for c in range(4))
        pairs = list(zip(sections, x, strict=True))
        return Points(
            x=np.concatenate([*x, []]),
            y=np.array([*y, 0.0])[which],
            weight=np.concatenate([*weight, []]),
            radii=np.stack([np.concatenate([*(s.radius(index, at) for s, at in pairs), []]) for index in (0, 1)]),
            normals=np.stack([s.normals for s in sections], axis=1)[:, which] if blocks else np.zeros((2, 0, 2)),
            lever=np.array([*(s.lever for s in sections), 0.0])[which],
            gap=np.concatenate([*(s.separation(at) for s, at in pairs), []]),
            hats=hats,
        )
