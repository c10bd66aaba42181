"""A mesh phase of gears of finite width by contact finite elements: no contact line and no contact law assumed.

CalculiX on one mesh of both gears, fine enough for strips of contact a tenth of a millimetre wide on teeth forty
millimetres wide, would take hours with the solver it comes with. Displacements are small, so that compliances may be
condensed and added instead (F1 of docs/theory.md):

    C_ij = δ_ij (Fᵀ K⁻¹ F − Mᵀ P M)_i + M_iᵀ B_{i−j} M_j.

Fᵀ K⁻¹ F: a tooth clamped at its foot, in elements that resolve the strip (``fem_reference.contact.tooth``), under the
functions of the pressure. B: the whole gear on its bore (``fem_reference.circulant``) under loads that are polynomials
on the flanks, from tooth to tooth. P: the clamped tooth under those polynomials, and M the moments of the pressure with
them, so that the foot is replaced by the whole gear and nothing counts twice. The difference of gear and clamped tooth
is smooth. The pressures then follow from the gaps: none is negative, none acts across a gap.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem_reference.cache import cached_compliance
from fem_reference.contact.laying import Fineness, LineLoad, first_laying, lay_strips, nearest
from fem_reference.contact.result import PhaseResult, joined, kept
from fem_reference.contact.strip import Points, Strip
from fem_reference.contact.tooth import FineTooth, Grading
from fem_reference.flank import Flank
from gearbench.compliance.flank import FlankCompliance, flank_polynomials
from gearbench.compliance.local import half_space_compression
from gearbench.contact.dense import active_set
from gearbench.effects.base import GapEffect
from gearbench.effects.teeth import fe_body, placed_in_mesh
from gearbench.errors import GearbenchError
from gearbench.geometry.gear import Gear
from gearbench.geometry.pair import Pair

#: Largest number of times that strips are laid.
_LAYINGS = 5


class StripError(GearbenchError):
    """Flanks touch outside the strips, or on an unresolved patch, after the last attempt."""


@dataclass(frozen=True, kw_only=True)
class SpatialSettings:
    """Settings for the computation of a phase of gears of finite width.

    Parameters
    ----------
    fineness
        Fineness of strips and teeth.
    accuracy
        Accuracy of the compliance of the whole gears.
    """

    fineness: Fineness = field(default_factory=Fineness)
    accuracy: float = 2e-3


@dataclass(frozen=True, kw_only=True)
class Bodies:
    """Both gears on their bores: displacement of flanks under loads that are polynomials on them."""

    flanks: tuple[FlankCompliance, FlankCompliance]
    pair: Pair

    def block(self, index: int, i: int, j: int) -> NDArray:
        """B of the surface itself [mm/N], between the teeth of the pairs i and j."""
        flank, material = self.flanks[index], self.pair.materials[index]
        of_teeth = flank.at(i, j)
        if i != j:
            return of_teeth
        return of_teeth + half_space_compression(flank.gear, material.E, material.nu, flank.order, points=24)


def bodies_of(pair: Pair, accuracy: float) -> Bodies:
    """Both gears, from the cache if available."""
    flanks = [
        cached_compliance(fe_body(pair, index, on_body=True), pair.materials[index], accuracy) for index in (0, 1)
    ]
    pinion, wheel = (placed_in_mesh(flank, pair, index, False) for index, flank in enumerate(flanks))
    return Bodies(pair=pair, flanks=(pinion, wheel))


def solve_spatial(
    pair: Pair,
    effects: tuple[GapEffect, ...],
    phase: float,
    torques: tuple[float, ...],
    settings: SpatialSettings | None = None,
) -> PhaseResult:
    """A phase under torques [N·m], each with its strips, from the cache if available.

    Raises
    ------
    StripError
        If flanks touch outside the strips.
    AccuracyError, MeshingError
        If the bodies fail.
    """
    chosen = settings or SpatialSettings()
    key = [asdict(pair), [(effect.name, asdict(effect)) for effect in effects], phase, torques, asdict(chosen)]
    return kept(key, lambda: _solve(pair, effects, phase, torques, chosen))


def _solve(
    pair: Pair, effects: tuple[GapEffect, ...], phase: float, torques: tuple[float, ...], settings: SpatialSettings
) -> PhaseResult:
    bodies = bodies_of(pair, settings.accuracy)
    results = []
    for torque in torques:
        force = 1e3 * torque / pair.gears[0].base_radius
        balanced = _settled(pair, effects, phase, force, bodies, settings.fineness)
        share, radius = ({k: [value] for k, value in each.items()} for each in (balanced.share, balanced.radius))
        results.append(
            PhaseResult(approach=[balanced.approach], stiffness=[balanced.stiffness], share=share, radius=radius)
        )
    return joined(results)


def _settled(
    pair: Pair, effects: tuple[GapEffect, ...], phase: float, force: float, bodies: Bodies, fineness: Fineness
) -> _Balance:
    """Balance on sufficient strips, laid again until they suffice."""
    laying, sections = first_laying(pair, effects, phase, force)
    for _ in range(_LAYINGS):
        strips = lay_strips(pair, effects, phase, laying, sections, fineness)
        balanced = balance(pair, strips, strip_compliance(strips, bodies, fineness), force)
        better = laying.corrected(balanced.approach, balanced.loads, fineness, nearest(sections))
        if better == laying:
            return balanced
        laying = better
    raise StripError(f"mesh phase {phase:.4g}: strips do not cover the contact after {_LAYINGS} attempts")


@dataclass(frozen=True, kw_only=True)
class _Balance:
    """One torque: approach [mm], stiffness [N/mm]; of each pair its share, mean radius on the pinion, line load."""

    approach: float
    stiffness: float
    share: dict[int, float]
    radius: dict[int, float]
    loads: dict[int, LineLoad]


def strip_compliance(strips: list[Strip], bodies: Bodies, fineness: Fineness) -> NDArray:
    """C of the functions of the pressure of all strips [mm per N/mm², weighted], both gears together."""
    points = [strip.points for strip in strips]
    ends = np.cumsum([0, *(each.functions for each in points)])
    total = np.zeros((ends[-1], ends[-1]))
    for index in (0, 1):
        moments = []
        for i, (strip, strip_points) in enumerate(zip(strips, points, strict=True)):
            columns = slice(ends[i], ends[i + 1])
            C, P, M = _condensed(bodies, index, strip, strip_points, fineness)
            total[columns, columns] += C - M.T @ P @ M
            moments.append(M)
        for i, left in enumerate(moments):
            for j, right in enumerate(moments):
                block = bodies.block(index, strips[i].k, strips[j].k)
                total[ends[i] : ends[i + 1], ends[j] : ends[j + 1]] += left.T @ block @ right
    return total


def balance(pair: Pair, strips: list[Strip], C: NDArray, force: float) -> _Balance:
    """Pressures from gaps and compliances: forces P, counted by their moments over the base radius, ΣP = F_bt."""
    cos_b, points = math.cos(pair.meshing.beta_b), [strip.points for strip in strips]
    moment = np.concatenate([each.hats.T @ (each.weight * each.lever) for each in points]) * cos_b
    gap = np.concatenate([each.hats.T @ (each.weight * each.gap) for each in points]) * cos_b
    high = np.concatenate([each.hats.T @ (each.weight * each.lever * each.radii[0]) for each in points]) * cos_b
    of_strip = np.concatenate([np.full(each.functions, strip.k) for strip, each in zip(strips, points, strict=True)])
    # functions on nothing, where a strip ends
    there = moment > 1e-9 * moment.max()
    w = moment[there]
    unit = 1 / float(np.median(np.diag(C)[there] / w**2)) / force
    H, e = C[np.ix_(there, there)] / np.outer(w, w) * force * unit, gap[there] / w * unit
    P, delta, stiffness, _ = active_set((H + H.T) / 2, e)
    share, radius, loads = {}, {}, {}
    forces = np.zeros(len(there))
    forces[there] = P * force
    for strip in strips:
        on_strip = of_strip[there] == strip.k
        share[strip.k] = float(P[on_strip].sum())
        mean = float(P[on_strip] @ (high[there][on_strip] / w[on_strip]))
        radius[strip.k] = mean / share[strip.k] if share[strip.k] > 0 else math.nan
        loads[strip.k] = _line_load(strip, forces[of_strip == strip.k])
    return _Balance(approach=delta / unit, stiffness=stiffness * unit * force, share=share, radius=radius, loads=loads)


def _line_load(strip: Strip, forces: NDArray) -> LineLoad:
    """Line load from the ``forces`` of the functions [N], which stand at the ends of layers that are near."""
    near, thickness = np.flatnonzero(strip.near), np.diff(strip.layers)
    room = (np.concatenate([[0.0], thickness]) + np.concatenate([thickness, [0.0]])) / 2
    q = np.zeros(len(strip.layers))
    q[near] = forces.reshape(len(near), -1).sum(axis=1) / room[near]
    return LineLoad(y=strip.layers, q=q)


def _condensed(
    bodies: Bodies, index: int, strip: Strip, points: Points, fineness: Fineness
) -> tuple[NDArray, NDArray, NDArray]:
    """Fᵀ K⁻¹ F, P and M of a strip on one gear."""
    pair, flank = bodies.pair, bodies.flanks[index]
    gear, b = pair.gears[index], pair.meshing.face_width
    y = points.y if index == 0 else b - points.y
    layers = strip.layers if index == 0 else b - strip.layers[::-1]
    bounds, sizes = _bounds(gear, index, strip)
    near = strip.half / fineness.strip * fineness.contact
    grading = Grading(near=near, far=fineness.size * pair.normal_module, growth=fineness.growth, ends=sizes)
    tooth = FineTooth(gear=gear, layers=layers, strip=bounds, grading=grading)
    force = sp.csr_matrix(points.hats.multiply(points.weight[:, None]))
    load = tooth.load(points.radii[index], y, tooth.normals(points.normals[index], y), force)
    smooth = _polynomial_load(tooth, flank.order)
    compliance = tooth.compliance(pair.materials[index], sp.csr_matrix(sp.hstack([load, smooth])))
    m = points.functions
    moments = flank_polynomials(gear, flank.order, points.radii[index], y).T @ force
    return compliance[:m, :m], compliance[m:, m:], np.asarray(moments)


def _bounds(gear: Gear, index: int, strip: Strip) -> tuple[NDArray, NDArray]:
    """Radii between which the strip lies on a gear at the ends of its layers, and sizes there, (2, layer + 1).

    Layers along the gear's own face.
    """
    near = np.flatnonzero(strip.near)
    sections = [strip.stations[i] for i in near]
    # on the wheel x counts towards the root, and layers from the other face
    own = slice(None) if index == 0 else slice(None, None, -1)
    radii = [section.radius(index, np.array(section.window(strip.half)))[own] for section in sections]
    sizes = [section.sizes(strip.half)[own] for section in sections]
    # where the flanks stay apart: as in the nearest section where they do not
    layers = np.arange(len(strip.layers))
    bounds, shares = (np.stack([np.interp(layers, near, each) for each in np.array(both).T]) for both in (radii, sizes))
    bounds = np.clip(bounds, gear.root_radius, gear.tip_radius)
    return bounds[:, own], shares[:, own]


def _polynomial_load(tooth: FineTooth, order: tuple[int, int]) -> sp.csr_matrix:
    """Nodal forces of polynomials of unit norm on the flank."""
    gear = tooth.gear
    t, w = np.polynomial.legendre.leggauss(3)
    t, w = (t + 1) / 2, w / 2
    radii, positions, weight = [], [], []
    for low, high in pairwise(tooth.layers):
        for share, of_y in zip(t, w, strict=True):
            y = low + share * (high - low)
            edges = tooth.section_edges(float(y))
            edges = np.concatenate(
                [[gear.form_radius], edges[(edges > gear.form_radius) & (edges < gear.tip_radius)], [gear.tip_radius]]
            )
            R = (edges[:-1, None] + np.diff(edges)[:, None] * t).ravel()
            radii.append(R)
            positions.append(np.full(len(R), y))
            weight.append((np.diff(edges)[:, None] * w).ravel() * of_y * (high - low))
    R, y, dA = (np.concatenate(each) for each in (radii, positions, weight))
    force = sp.csr_matrix(flank_polynomials(gear, order, R, y) * dA[:, None])
    return tooth.load(R, y, Flank(gear).normal(R, y), force)
