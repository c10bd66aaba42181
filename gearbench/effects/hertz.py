"""Local contact compliance of two teeth pressed together along a line: compression q (a − h ln q) by the line load q.

The coefficients a and h change slowly along the path of contact. With ``off_line_contact`` they take long to compute,
so they are tabulated over u and interpolated.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic.dataclasses import dataclass

from gearbench.effects.base import ComplianceEffect, Effects, LineLaw
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.geometry.separation import NODES, Separation
from gearbench.schema import STRICT

#: Number of polynomials in the radius that describe the profile of solid teeth of the default order. The softening at
#: tip edges leaves out what these polynomials contain; it is the same for teeth of lower order.
FLANK_POLYNOMIALS = 5
#: Length of an interval of the table, in half-widths of the contact strip; parabolas are then accurate to 1e-4 of
#: c = Σ 2(1−ν²)/(πE) of both gears.
_STEP = 0.25
#: Minimum and maximum number of intervals on a base pitch; the separation has ``NODES`` on it.
_FEWEST, _MOST = NODES / 4, 2 * NODES
#: Positions in an interval (0 … 1) at which the law is evaluated: just inside its ends, because the law may jump there.
_NODES_OF_PARABOLA = np.array([1e-9, 0.5, 1 - 1e-9])


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Hertz(ComplianceEffect):
    """Local compression of the flanks, as a law of the line load.

    "yang_sun" is linear (C2 of docs/theory.md). "weber_banaschek" (C3) grows more slowly than the load, and depends on
    the curvature of the flanks and on the distances from flank to tooth centre line.

    Parameters
    ----------
    law
        Contact law.
    """

    law: Literal["weber_banaschek", "yang_sun"] = "weber_banaschek"

    name: ClassVar[str] = "hertz"
    summary: ClassVar[str] = "compliance: local compression of the flanks under the line load"
    source: ClassVar[str] = "Yang & Sun 1985; Weber & Banaschek 1953"
    use: ClassVar[str] = "Always: it determines the distribution of the load."
    example: ClassVar[dict[str, Any]] = {"law": "weber_banaschek"}

    def compliance(self, lines: ContactLines, effects: Effects) -> LineLaw:
        """Law of each segment, (position, pair, segment)."""
        # without helix angle all segments of a line have the same u, so that one of them is enough
        spur = lines.pair.meshing.overlap_ratio == 0
        points = {name: getattr(lines, name)[..., : 1 if spur else None] for name in ("u", "y", "length")}
        if lines.separation is None or self.law == "yang_sun":
            # the panels belong to all points
            law = self.law_on(replace(lines, **points, panel=None))
        else:
            law = law_table(self, lines.pair, lines.separation, lines.typical_load)(points["u"])
        return LineLaw(a=np.broadcast_to(law.a, lines.shape), h=np.broadcast_to(law.h, lines.shape))

    def law_on(self, lines: ContactLines) -> LineLaw:
        """``compliance`` computed directly for each segment, without a table."""
        materials = lines.pair.materials
        compliances = [2 / (math.pi * material.plane_strain_modulus) for material in materials]
        c = sum(compliances)  # Σ 2(1−ν²)/(πE)
        if self.law == "yang_sun":
            return LineLaw(a=np.full(lines.shape, c), h=np.zeros(lines.shape))
        # at an interference point ρ is 0 and the logarithm infinite: keep ρ above a lower limit
        rho = np.maximum(lines.curvature_radius, 1e-9 * abs(lines.pair.meshing.tangent_length))
        a = np.zeros(lines.shape)
        for c_i, material, gear, radius in zip(compliances, materials, lines.pair.gears, lines.radii, strict=True):
            t, nu = gear.flank_depth(radius), material.nu
            # ln(2t/a_H) = ½ ln(4t² / (2cρ)) − ½ ln q, since a_H² = 2cρq
            a += c_i * (0.5 * np.log(2 * t**2 / (c * rho)) - nu / (2 * (1 - nu)))
        h = np.full(lines.shape, c / 2)
        if lines.touch is not None:
            for index in (0, 1):
                addition = _edge(lines, index, rho)
                a, h = a + addition[0], h + addition[1]
                for near, added_a, added_h in _kinks(lines, index, rho, c):
                    a[near] += added_a
                    h[near] += added_h
        return LineLaw(a=a, h=h)


def _edge(lines: ContactLines, index: int, rho: NDArray) -> tuple[NDArray, NDArray]:
    """Additions to a and h near the tip of a gear, (position, pair, segment) [mm²/N] (E4 of docs/theory.md)."""
    from gearbench.compliance.edge import edge_distance, edge_softening

    touch, gear = lines.touch, lines.pair.gears[index]
    assert touch is not None
    half_c = [1 / (math.pi * material.plane_strain_modulus) for material in lines.pair.materials]
    roll = touch.rolls[index]
    # Only the corner at the tip softens; that at the start of a relief is almost flat. cos β_b: to the normal plane.
    tilt = np.where((touch.edge == index) & (edge_distance(gear, roll) < 1e-6 * abs(gear.tip_radius)), touch.tilt, 0.0)
    tilt = tilt * math.cos(gear.beta_b)
    return edge_softening(gear, half_c[index], sum(half_c) / 2, FLANK_POLYNOMIALS, roll, tilt, rho, lines.typical_load)


def _kinks(lines: ContactLines, index: int, rho: NDArray, c: float) -> Iterator[tuple[NDArray, NDArray, NDArray]]:
    """Segments whose contact strip reaches a kink of a profile, and their additions to a and h (E5).

    The additions are exact at two loads: at ``lines.typical_load``, half the mean load of a line (``typical_load`` of
    ``contact.lines`` says why), and at the whole load on a single tooth pair. c = Σ 2(1−ν²)/(πE) of both gears.
    """
    from gearbench.compliance.kink import kink_softening

    touch, separation, meshing = lines.touch, lines.separation, lines.pair.meshing
    assert touch is not None
    assert separation is not None
    # mean is c₁ of (E5), the mean of (1−ν²)/(πE) of both gears
    profile, mean, roll = separation.plane.profiles[index], c / 4, touch.rolls[index]
    # the ratio of these two loads is 2 ε_α
    load_ratio = 2 * max(meshing.transverse_contact_ratio, 1.0)
    # this length is the same in the normal plane, since the profile is perpendicular to the contact line
    half_width = np.sqrt(8 * mean * rho * lines.typical_load)
    for start, rise in profile.kinks:
        along = (roll**2 - start**2) / (2 * profile.base_radius)
        near = np.abs(along) < math.sqrt(load_ratio) * half_width
        # the curvature radius in the transverse plane, in which the slope of the gap is given
        along, narrow, transverse = along[near], half_width[near], rho[near] * math.cos(meshing.beta_b)
        # The gap is a parabola before the kink and another one after it, because its slope rises by κ = rise there.
        # Their vertices along the profile are x_s (vertex) and x_s − κρ (vertex − shift); the kink is at 0.
        shift, tilt = transverse * rise, transverse * touch.tilt[near]
        corner = (touch.edge[near] == index) & (np.abs(along) < 1e-9 * abs(profile.base_radius))
        # before the kink contact lies on the first parabola, after it on the second; at the kink its normal may tilt
        vertex = np.where(corner, shift - tilt, np.where(along < 0, along, along + shift))
        wide = math.sqrt(load_ratio) * narrow
        # c₁Λ of (E5) at the two loads
        low, high = (mean * kink_softening(vertex / width, shift / width) for width in (narrow, wide))
        h = (low - high) / math.log(load_ratio)
        yield near, low + h * math.log(lines.typical_load), h


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class LawTable:
    """Contact law as piecewise parabolas of u; some intervals end where contact moves to another part of a flank.

    Parameters
    ----------
    start, width
        Start and width of the intervals (interval,) [mm].
    coefficients
        Coefficients of a and h in powers of t = 0 … 1 (2, 3, interval) [mm²/N].
    """

    start: NDArray
    width: NDArray
    coefficients: NDArray

    def __call__(self, u: NDArray) -> LineLaw:
        """The law at u [mm]."""
        i = np.clip(np.searchsorted(self.start, u, side="right") - 1, 0, len(self.start) - 1)
        t = np.clip((u - self.start[i]) / self.width[i], 0.0, 1.0)
        a, h = (c[0] + t * (c[1] + t * c[2]) for c in self.coefficients.take(i, axis=2))
        return LineLaw(a=a, h=h)


@lru_cache(maxsize=32)
def law_table(hertz: Hertz, pair: Pair, separation: Separation, typical_load: float) -> LawTable:
    """Table of the law of ``hertz`` over the range of u of the separation; intervals end where the law may jump."""
    rho = float(pair.meshing.curvature_radius(np.array([pair.meshing.pitch_point]))[0])
    pitch = pair.meshing.base_pitch
    half_width = math.sqrt(4 * rho * typical_load / (math.pi * pair.contact_modulus))
    step = float(np.clip(_STEP * half_width, pitch / _MOST, pitch / _FEWEST))
    ends = separation.ends
    parts = np.ceil(np.diff(ends) / step - 1e-9).astype(int)
    edges = np.interp(np.arange(1 + int(parts.sum())), np.append(0, np.cumsum(parts)), ends)
    width = np.diff(edges)
    u = edges[:-1] + width * _NODES_OF_PARABOLA[:, None]
    lines = ContactLines(
        pair=pair, mesh_phase=np.zeros(u.size), index=np.zeros(1, dtype=int), u=u.reshape(-1, 1, 1),
        y=np.zeros((u.size, 1, 1)), length=np.ones((u.size, 1, 1)), separation=separation, typical_load=typical_load,
    )  # fmt: skip
    law = hertz.law_on(lines)
    low, middle, high = np.stack([law.a, law.h]).reshape(2, 3, -1).swapaxes(0, 1)
    coefficients = np.stack([low, 4 * middle - 3 * low - high, 2 * (low + high) - 4 * middle], axis=1)
    return LawTable(start=edges[:-1], width=width, coefficients=coefficients)
