"""Strips where flanks are expected to touch, corrected by solutions on them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fem_reference.contact.strip import Slice, Strip, slice_at
from gearbench.effects.base import GapEffect
from gearbench.geometry.pair import Pair

#: Stiffness of a pair of steel teeth for a first guess of the deflection [N/mm per mm].
_STIFFNESS = 14e3
#: Factors on the expected and on the known deflection up to which flanks are meshed.
_MARGIN, _KNOWN = 2.5, 1.2
#: Half-widths of Hertz's strip that must fit into a strip.
_ROOM = 1.2
#: Least number of loaded ends of layers that resolves a short patch.
_FEW, _ENOUGH = 6, 14
#: Share of the largest line load below which a short patch is ignored.
_FAINT = 0.1
#: How fast layers grow beside a short patch, per distance.
_GROWTH = 0.4


@dataclass(frozen=True, kw_only=True)
class Fineness:
    """Fineness of strips and teeth.

    Parameters
    ----------
    strip
        Half width of a strip, in half-widths of Hertz's contact strip.
    cells
        Cells of the pressure across a strip.
    contact
        Edge length of the elements in a strip, in half-widths of Hertz's contact strip.
    size
        Edge length away from it, in normal modules.
    growth
        How fast it grows between the two, per distance.
    layer
        Thickness of the layers across the face, in normal modules; those at the ends of faces and lines are thinner.
    """

    strip: float = 2.0
    cells: int = 32
    contact: float = 0.33
    size: float = 0.3
    growth: float = 0.45
    layer: float = 0.5

    def coarser(self) -> Fineness:
        """Edges √2 longer."""
        return self._scaled(math.sqrt(2), 1.2)

    def finer(self) -> Fineness:
        """Edges √2 shorter."""
        return self._scaled(1 / math.sqrt(2), 1 / 1.2)

    def _scaled(self, r: float, growth: float) -> Fineness:
        return replace(
            self, cells=round(self.cells / r), contact=self.contact * r, size=self.size * r, layer=self.layer * r,
            growth=self.growth * growth,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class LineLoad:
    """Load on one strip at the ends of its layers, zero where the flanks part.

    Parameters
    ----------
    y
        Ends of the layers [mm].
    q
        Transverse force a length of the face [N/mm].
    """

    y: NDArray
    q: NDArray

    @property
    def patch(self) -> tuple[float, float] | None:
        """The part of the face between the unloaded ends beside a patch that too few ends resolve; None of others."""
        loaded = np.flatnonzero(self.q > 0)
        if not 0 < len(loaded) < min(_FEW, len(self.y)):
            return None
        return float(self.y[max(loaded[0] - 1, 0)]), float(self.y[min(loaded[-1] + 1, len(self.y) - 1)])


@dataclass(frozen=True, kw_only=True)
class Laying:
    """Load and approach that strips are laid for.

    Parameters
    ----------
    reach
        Separation [mm] beyond which flanks are not expected to touch.
    load
        Line load [N/mm] whose Hertzian half-width strips and elements are measured in.
    patches
        Tooth pair → short part of the face where it touches [mm].
    """

    reach: float
    load: float
    patches: dict[int, tuple[float, float]] = field(default_factory=dict)

    def corrected(self, approach: float, loads: dict[int, LineLoad], fineness: Fineness, least: float) -> Laying:
        """The laying for the computed ``approach`` [mm] and ``loads`` of the tooth pairs; unchanged if it sufficed.

        ``least``: separation of the flanks that are nearest [mm].
        """
        laying = self
        if approach > self.reach:
            laying = replace(laying, reach=least + _KNOWN * (approach - least))
        greatest = max(float(each.q.max(initial=0.0)) for each in loads.values())
        if greatest > self.load * (fineness.strip / _ROOM) ** 2:
            laying = replace(laying, load=greatest)
        heard = {k: each for k, each in loads.items() if each.q.max(initial=0.0) > _FAINT * greatest}
        short = {k: patch for k, each in heard.items() if (patch := each.patch) is not None}
        return replace(laying, patches={**self.patches, **short}) if short else laying


def first_laying(
    pair: Pair, effects: tuple[GapEffect, ...], phase: float, force: float
) -> tuple[Laying, dict[int, list[Slice]]]:
    """Laying for a force F_bt [N] shared evenly by all lines, and sections of all tooth pairs that come near."""
    meshing, b = pair.meshing, pair.meshing.face_width
    rise = b * math.tan(meshing.beta_b) / meshing.base_pitch
    length = (meshing.path_end - meshing.path_start) / meshing.base_pitch
    first, last = math.floor(-phase - rise), math.ceil(length - phase)
    load = force / b / max(1.0, 0.8 * length)
    sections = {
        k: [slice_at(pair, effects, phase, k, float(y)) for y in np.linspace(0, b, 9)] for k in range(first, last + 1)
    }
    softer = 210.0 / min(material.youngs_modulus for material in pair.materials)
    return Laying(reach=nearest(sections) + _MARGIN * load / _STIFFNESS * softer, load=load), sections


def nearest(sections: dict[int, list[Slice]]) -> float:
    """Least separation of all sections [mm]."""
    return min(section.gap for some in sections.values() for section in some)


def lay_strips(
    pair: Pair,
    effects: tuple[GapEffect, ...],
    phase: float,
    laying: Laying,
    sections: dict[int, list[Slice]],
    fineness: Fineness,
) -> list[Strip]:
    """Strips of all tooth pairs that may touch."""
    meshing = pair.meshing
    middle = (meshing.path_start + meshing.path_end) / 2
    rho = middle * (meshing.tangent_length - middle) / meshing.tangent_length / math.cos(meshing.beta_b)
    half_width = math.sqrt(4 * laying.load * rho / (math.pi * pair.contact_modulus)) / math.cos(meshing.beta_b)
    strips = []
    for k, some in sections.items():
        if not any(section.gap < laying.reach for section in some):
            continue
        layers = _layers(pair, effects, phase, k, fineness.layer * pair.normal_module)
        if k in laying.patches:
            layers = _crowded(layers, laying.patches[k], fineness)
        strip = Strip(
            pair=pair, effects=effects, phase=phase, k=k, half=fineness.strip * half_width, cells=fineness.cells,
            layers=layers, reach=laying.reach,
        )  # fmt: skip
        if strip.near.any():
            strips.append(strip)
    return strips


def _layers(pair: Pair, effects: tuple[GapEffect, ...], phase: float, k: int, thickness: float) -> NDArray:
    """Ends of the layers of a strip, thinner towards both faces.

    So they are where the line of contact leaves a flank and where it crosses the beginning of a relief.
    """
    meshing, b = pair.meshing, pair.meshing.face_width
    tan_b = math.tan(meshing.beta_b)
    ends = [0.0, b]
    if tan_b:
        kinks = [u for effect in effects for u in effect.kinks(pair)]
        inner_ends = [
            (u - meshing.path_start - (phase + k) * meshing.base_pitch) / tan_b
            for u in (meshing.path_start, meshing.path_end, *kinks)
        ]
        ends += [y for y in inner_ends if 0.02 * b < y < 0.98 * b]
    ends = np.unique(ends)
    ends_of_layers = [np.zeros(1)]
    for low, high in pairwise(ends):
        count = max(3, math.ceil((high - low) / thickness))
        x = np.linspace(0.0, 1.0, count + 1)[1:]
        ends_of_layers.append(low + (high - low) * (x - 0.75 * np.sin(2 * np.pi * x) / (2 * np.pi)))
    return np.concatenate(ends_of_layers)


def _crowded(layers: NDArray, patch: tuple[float, float], fineness: Fineness) -> NDArray:
    """Ends of layers that are no thicker than those given, and thin on a ``patch`` of the face."""
    low, high = patch
    thin = (high - low) / _ENOUGH * fineness.layer / Fineness().layer
    y = np.linspace(layers[0], layers[-1], 4000)
    away = np.maximum(np.maximum(low - y, y - high), 0.0)
    given = np.diff(layers)[np.clip(np.searchsorted(layers, y, side="right") - 1, 0, len(layers) - 2)]
    size = np.minimum(thin + _GROWTH * away, given)
    number = np.concatenate([[0.0], np.cumsum((1 / size[1:] + 1 / size[:-1]) / 2 * np.diff(y))])
    count = math.ceil(number[-1])
    return np.interp(np.linspace(0.0, number[-1], count + 1), number, y)
