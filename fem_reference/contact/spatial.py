"""A mesh phase of gears of finite width by contact finite elements: no contact line and no contact law assumed.

CalculiX on one mesh of both gears, fine enough for strips of contact a tenth of a millimetre wide on teeth forty
millimetres wide, would take hours with the solver it comes with. Displacements are small, so that compliances may be
condensed and added instead (F1 of docs/theory.md):

    C_ij = δ_ij (Fᵀ K⁻¹ F − Mᵀ P M)_i + M_iᵀ B_{i−j} M_j.

Fᵀ K⁻¹ F: a tooth clamped at its foot, in elements that resolve the strip (``fem_reference.contact.tooth``), under the
functions of the pressure. B: the whole gear on its bore (``fem_reference.circulant``) under loads that are polynomials
on the flanks, from tooth to tooth. P: the clamped tooth under those polynomials, and M the moments of the pressure with
them, so that the foot and the rest of the gear are exchanged and nothing counts twice: by how much the gear is softer
than the clamped tooth is smooth. The pressures then follow from the gaps: none is negative, none acts across a gap.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem_reference.cache import cached_compliance
from fem_reference.contact.result import PhaseResult, kept
from fem_reference.contact.strip import Points, Strip, slice_at
from fem_reference.contact.tooth import FineTooth, Grading
from fem_reference.flank import Flank
from gearbench.compliance.flank import FlankCompliance, flank_polynomials
from gearbench.compliance.local import half_space_compression
from gearbench.contact.dense import active_set
from gearbench.effects.base import GapEffect
from gearbench.effects.teeth import meshed_body
from gearbench.errors import GearbenchError
from gearbench.geometry.gear import Gear
from gearbench.geometry.pair import Pair
from gearbench.geometry.role import Role

#: Stiffness of a pair of steel teeth for a first guess of the deflection [N/mm per mm].
_STIFFNESS = 14e3
#: How far beyond the expected deflection flanks are meshed.
_MARGIN = 2.5


class StripError(GearbenchError):
    """Flanks touch outside the strips that were meshed."""


@dataclass(frozen=True, kw_only=True)
class Fineness:
    """How fine strips and teeth are.

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
    cells: int = 16
    contact: float = 0.33
    size: float = 0.3
    growth: float = 0.45
    layer: float = 0.7

    def coarser(self) -> Fineness:
        """Edges √2 longer."""
        r = math.sqrt(2)
        return replace(
            self, cells=round(self.cells / r), contact=self.contact * r, size=self.size * r, layer=self.layer * r,
            growth=self.growth * 1.2,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class SpatialSettings:
    """How a phase of gears of finite width is computed.

    Parameters
    ----------
    fineness
        Of strips and teeth.
    accuracy
        Of the compliance of the whole gears.
    """

    fineness: Fineness = field(default_factory=Fineness)
    accuracy: float = 2e-3


@dataclass(frozen=True, kw_only=True)
class Bodies:
    """Both gears on their bores: displacement of flanks under loads that are polynomials on them."""

    flanks: tuple[FlankCompliance, FlankCompliance]
    pair: Pair

    def block(self, role: Role, d: int) -> NDArray:
        """B_d of the surface itself [mm/N], between the teeth of the pairs ``d`` ahead and the loaded one."""
        flank, material = self.flanks[role], self.pair.materials[role]
        own = flank.block(d)
        if d:
            return own
        return own + half_space_compression(flank.gear, material.E, material.nu, flank.order, points=24)


def bodies_of(pair: Pair, accuracy: float) -> Bodies:
    """Both gears, from the cache where they were computed before."""
    found = [cached_compliance(meshed_body(pair, role, on_body=True), pair.materials[role], accuracy) for role in Role]
    return Bodies(pair=pair, flanks=(found[0], replace(found[1], driven=True)))


def solve_spatial(
    pair: Pair,
    effects: tuple[GapEffect, ...],
    phase: float,
    torques: tuple[float, ...],
    settings: SpatialSettings | None = None,
) -> PhaseResult:
    """A phase under torques [N·m], each with strips of its own; from the cache where the same was computed before.

    Raises
    ------
    StripError
        If flanks touch where no strip was laid.
    AccuracyError, MeshingError
        As the bodies fail.
    """
    chosen = settings or SpatialSettings()
    key = [asdict(pair), [(effect.name, asdict(effect)) for effect in effects], phase, torques, asdict(chosen)]
    return kept(key, lambda: _solve(pair, effects, phase, torques, chosen))


def _solve(
    pair: Pair, effects: tuple[GapEffect, ...], phase: float, torques: tuple[float, ...], settings: SpatialSettings
) -> PhaseResult:
    bodies = bodies_of(pair, settings.accuracy)
    found = []
    for torque in torques:
        force = 1e3 * torque / pair.gears[0].base_radius
        strips = lay_strips(pair, effects, phase, force, settings.fineness)
        found.append(_balanced(pair, strips, _compliance(strips, bodies, settings.fineness), force))
    pairs = sorted({k for each in found for k in each.share})
    return PhaseResult(
        approach=[each.approach for each in found],
        stiffness=[each.stiffness for each in found],
        share={k: [each.share.get(k, 0.0) for each in found] for k in pairs},
        radius={k: [each.radius.get(k, math.nan) for each in found] for k in pairs},
    )


@dataclass(frozen=True, kw_only=True)
class _Balance:
    """One torque: approach [mm], stiffness [N/mm], and of each pair its share and mean radius on the pinion."""

    approach: float
    stiffness: float
    share: dict[int, float]
    radius: dict[int, float]


def _compliance(strips: list[Strip], bodies: Bodies, fineness: Fineness) -> NDArray:
    """C of the functions of the pressure of all strips [mm per N/mm², weighted], both gears together."""
    points = [strip.points for strip in strips]
    ends = np.cumsum([0, *(each.functions for each in points)])
    total = np.zeros((ends[-1], ends[-1]))
    for role in Role:
        moments = []
        for i, (strip, at) in enumerate(zip(strips, points, strict=True)):
            own = slice(ends[i], ends[i + 1])
            C, P, M = _condensed(bodies, role, strip, at, fineness)
            total[own, own] += C - M.T @ P @ M
            moments.append(M)
        for i, left in enumerate(moments):
            for j, right in enumerate(moments):
                block = bodies.block(role, strips[i].k - strips[j].k)
                total[ends[i] : ends[i + 1], ends[j] : ends[j + 1]] += left.T @ block @ right
    return total


def _balanced(pair: Pair, strips: list[Strip], C: NDArray, force: float) -> _Balance:
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
    approach, reach = delta / unit, strips[0].reach
    if approach > reach:
        raise StripError(f"flanks approach by {approach:.4g} mm, strips were laid for {reach:.4g} mm")
    share, radius = {}, {}
    for strip in strips:
        own = of_strip[there] == strip.k
        share[strip.k] = float(P[own].sum())
        mean = float(P[own] @ (high[there][own] / w[own]))
        radius[strip.k] = mean / share[strip.k] if share[strip.k] > 0 else math.nan
    return _Balance(approach=approach, stiffness=stiffness * unit * force, share=share, radius=radius)


def lay_strips(
    pair: Pair, effects: tuple[GapEffect, ...], phase: float, force: float, fineness: Fineness
) -> list[Strip]:
    """Strips of all tooth pairs that may touch under a force F_bt [N]."""
    meshing, b = pair.meshing, pair.meshing.face_width
    rise = b * math.tan(meshing.beta_b) / meshing.base_pitch
    length = (meshing.path_end - meshing.path_start) / meshing.base_pitch
    first, last = math.floor(-phase - rise), math.ceil(length - phase)
    load = force / b / max(1.0, 0.8 * length)
    sections = {
        k: [slice_at(pair, effects, phase, k, float(y)) for y in np.linspace(0, b, 9)] for k in range(first, last + 1)
    }
    least = min(section.gap for some in sections.values() for section in some)
    reach = least + _MARGIN * load / _STIFFNESS * 210.0 / min(material.youngs_modulus for material in pair.materials)
    beta_b = meshing.beta_b
    middle = (meshing.path_start + meshing.path_end) / 2
    rho = middle * (meshing.tangent_length - middle) / meshing.tangent_length / math.cos(beta_b)
    modulus = pair.contact_modulus
    half_width = math.sqrt(4 * load * rho / (math.pi * modulus)) / math.cos(beta_b)
    found = []
    for k in range(first, last + 1):
        if not any(section.gap < reach for section in sections[k]):
            continue
        strip = Strip(
            pair=pair, effects=effects, phase=phase, k=k, half=fineness.strip * half_width, cells=fineness.cells,
            layers=_layers(pair, phase, k, fineness.layer * pair.normal_module), reach=reach,
        )  # fmt: skip
        if strip.near.any():
            found.append(strip)
    return found


def _layers(pair: Pair, phase: float, k: int, thickness: float) -> NDArray:
    """Ends of the layers of a strip, thinner towards both faces and where the line of contact leaves a flank."""
    meshing, b = pair.meshing, pair.meshing.face_width
    tan_b = math.tan(meshing.beta_b)
    ends = [0.0, b]
    if tan_b:
        at = [
            (u - meshing.path_start - (phase + k) * meshing.base_pitch) / tan_b
            for u in (meshing.path_start, meshing.path_end)
        ]
        ends += [y for y in at if 0.02 * b < y < 0.98 * b]
    ends = np.unique(ends)
    found = [np.zeros(1)]
    for low, high in pairwise(ends):
        count = max(3, math.ceil((high - low) / thickness))
        x = np.linspace(0.0, 1.0, count + 1)[1:]
        found.append(low + (high - low) * (x - 0.75 * np.sin(2 * np.pi * x) / (2 * np.pi)))
    return np.concatenate(found)


def _condensed(
    bodies: Bodies, role: Role, strip: Strip, at: Points, fineness: Fineness
) -> tuple[NDArray, NDArray, NDArray]:
    """Fᵀ K⁻¹ F, P and M of a strip on one gear."""
    pair, flank = bodies.pair, bodies.flanks[role]
    gear, b = pair.gears[role], pair.meshing.face_width
    y = at.y if role == Role.PINION else b - at.y
    layers = strip.layers if role == Role.PINION else b - strip.layers[::-1]
    bounds = _bounds(gear, role, strip)
    near = strip.half / fineness.strip * fineness.contact
    grading = Grading(near=near, far=fineness.size * pair.normal_module, growth=fineness.growth)
    tooth = FineTooth(gear=gear, layers=layers, strip=bounds, grading=grading)
    force = sp.csr_matrix(at.hats.multiply(at.weight[:, None]))
    load = tooth.load(at.radii[role], y, tooth.normals(at.normals[role], y), force)
    smooth = _polynomial_load(tooth, flank.order)
    whole = tooth.compliance(pair.materials[role], sp.csr_matrix(sp.hstack([load, smooth])))
    m = at.functions
    moments = flank_polynomials(gear, flank.order, at.radii[role], y).T @ force
    return whole[:m, :m], whole[m:, m:], np.asarray(moments)


def _bounds(gear: Gear, role: Role, strip: Strip) -> NDArray:
    """Radii between which the strip lies on a gear at the ends of its layers, along its own face, (2, layer + 1)."""
    near = np.flatnonzero(strip.near)
    found = []
    for i in near:
        section = strip.stations[i]
        ends = [float(section.radius(role, np.array(x))) for x in section.window(strip.half)]
        found.append([min(ends), max(ends)])
    # where the flanks stay apart: as in the nearest section where they do not
    index = np.arange(len(strip.layers))
    bounds = np.stack([np.interp(index, near, each) for each in np.array(found).T])
    bounds = np.clip(bounds, gear.root_radius, gear.tip_radius)
    return bounds if role == Role.PINION else bounds[:, ::-1]


def _polynomial_load(tooth: FineTooth, order: tuple[int, int]) -> sp.csr_matrix:
    """Nodal forces of polynomials of unit norm on the flank."""
    gear = tooth.gear
    t, w = np.polynomial.legendre.leggauss(3)
    t, w = (t + 1) / 2, w / 2
    radii, at, weight = [], [], []
    for low, high in pairwise(tooth.layers):
        for share, of_y in zip(t, w, strict=True):
            y = low + share * (high - low)
            edges = tooth.section_edges(float(y))
            edges = np.concatenate(
                [[gear.form_radius], edges[(edges > gear.form_radius) & (edges < gear.tip_radius)], [gear.tip_radius]]
            )
            R = (edges[:-1, None] + np.diff(edges)[:, None] * t).ravel()
            radii.append(R)
            at.append(np.full(len(R), y))
            weight.append((np.diff(edges)[:, None] * w).ravel() * of_y * (high - low))
    R, y, dA = (np.concatenate(each) for each in (radii, at, weight))
    force = sp.csr_matrix(flank_polynomials(gear, order, R, y) * dA[:, None])
    return tooth.load(R, y, Flank(gear).normal(R, y), force)
