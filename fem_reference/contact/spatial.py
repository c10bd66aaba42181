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
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem_reference.contact.strip import Points, Strip, slice_at
from fem_reference.contact.tooth import FineTooth, Grading
from fem_reference.flank import Flank
from gearbench.compliance.flank import FlankCompliance, flank_polynomials
from gearbench.compliance.local import half_space_compression
from gearbench.contact.dense import active_set
from gearbench.effects.base import GapEffect
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
class SpatialResult:
    """A mesh phase under one torque.

    Parameters
    ----------
    approach
        q [mm], as in ``fem_reference.contact.phase.PhaseResult``.
    stiffness
        ∂F_bt/∂q [N/mm].
    share
        Tooth pair → its share of the torque.
    line
        Tooth pair → sections y [mm] and line loads there [N/mm].
    peak
        Greatest pressure [MPa].
    unknowns
        Displacements of all teeth.
    """

    approach: float
    stiffness: float
    share: dict[int, float]
    line: dict[int, tuple[list[float], list[float]]] = field(default_factory=dict)
    peak: float = 0.0
    unknowns: int = 0


@dataclass(frozen=True, kw_only=True)
class Bodies:
    """Both gears on their bores: displacement of flanks under loads that are polynomials on them."""

    flanks: tuple[FlankCompliance, FlankCompliance]
    pair: Pair

    def block(self, role: Role, d: int) -> NDArray:
        """B_d of the surface itself [mm/N], between the teeth of the pairs ``d`` ahead and the loaded one."""
        flank, material = self.flanks[role], self.pair.material
        own = flank.block(d)
        if d:
            return own
        return own + half_space_compression(flank.gear, material.E, material.nu, flank.order, points=24)


def solve_spatial(
    pair: Pair, effects: tuple[GapEffect, ...], phase: float, torque: float, bodies: Bodies, fineness: Fineness
) -> SpatialResult:
    """A phase under a torque [N·m].

    Raises
    ------
    StripError
        If flanks touch where no strip was laid.
    """
    force = 1e3 * torque / pair.gears[0].base_radius
    strips = lay_strips(pair, effects, phase, force, fineness)
    points = [strip.points for strip in strips]
    ends = np.cumsum([0, *(each.hats.shape[1] for each in points)])
    total, unknowns = np.zeros((ends[-1], ends[-1])), 0
    for role in Role:
        moments = []
        for i, (strip, at) in enumerate(zip(strips, points, strict=True)):
            own = slice(ends[i], ends[i + 1])
            C, P, M, size = _condensed(pair, role, strip, at, bodies.flanks[role], fineness)
            total[own, own] += C - M.T @ P @ M
            moments.append(M)
            unknowns += size
        for i, left in enumerate(moments):
            for j, right in enumerate(moments):
                block = bodies.block(role, strips[i].k - strips[j].k)
                total[ends[i] : ends[i + 1], ends[j] : ends[j + 1]] += left.T @ block @ right
    return _balanced(pair, strips, points, total, force, unknowns)


def _balanced(
    pair: Pair, strips: list[Strip], points: list[Points], C: NDArray, force: float, unknowns: int
) -> SpatialResult:
    """Pressures from gaps and compliances: those of ΣP = F_bt of moments P over the base radius."""
    cos_b = math.cos(pair.meshing.beta_b)
    moment = np.concatenate([each.hats.T @ (each.weight * each.lever) for each in points]) * cos_b
    gap = np.concatenate([each.hats.T @ (each.weight * each.gap) for each in points]) * cos_b
    # functions on nothing, where a strip ends
    there = moment > 1e-9 * moment.max()
    w = moment[there]
    unit = 1 / float(np.median(np.diag(C)[there] / w**2)) / force
    H, e = C[np.ix_(there, there)] / np.outer(w, w) * force * unit, gap[there] / w * unit
    P, delta, stiffness, _ = active_set((H + H.T) / 2, e)
    approach = delta / unit
    amplitude = np.zeros(len(moment))
    amplitude[there] = P * force / w
    share, line, peak = {}, {}, 0.0
    for i, strip in enumerate(strips):
        first = sum(each.hats.shape[1] for each in points[:i])
        own = amplitude[first : first + points[i].hats.shape[1]]
        mine = moment[first : first + len(own)]
        share[strip.k] = float(mine @ own / force)
        line[strip.k] = _line_load(strip, own)
        peak = max(peak, float(own.max(initial=0.0)) * cos_b)
    if strips and approach > 0.98 * strips[0].reach:
        raise StripError(f"flanks approach by {approach:.4g} mm, strips were laid for {strips[0].reach:.4g} mm")
    return SpatialResult(
        approach=approach, stiffness=stiffness * unit * force, share=share, line=line, peak=peak, unknowns=unknowns
    )


def _line_load(strip: Strip, amplitude: NDArray) -> tuple[list[float], list[float]]:
    """Force normal to the flank per length of the face, in the sections between the layers [N/mm]."""
    n, near = strip.cells, strip.near
    rows = amplitude.reshape(-1, n + 1)
    sections = [s for s, here in zip(strip.stations[::2], near, strict=True) if here]
    hats = np.ones(n + 1)
    hats[[0, -1]] = 0.5
    found = []
    for row, section in zip(rows, sections, strict=True):
        low, high = section.window(strip.half)
        found.append(float(row @ hats * (high - low) / n))
    return [float(y) for y in strip.layers[near]], found


def lay_strips(
    pair: Pair, effects: tuple[GapEffect, ...], phase: float, force: float, fineness: Fineness
) -> list[Strip]:
    """Strips of all tooth pairs that may touch under a force F_bt [N]."""
    meshing, b = pair.meshing, pair.face_width
    rise = b * math.tan(meshing.beta_b) / meshing.base_pitch
    length = (meshing.path_end - meshing.path_start) / meshing.base_pitch
    first, last = math.floor(-phase - rise), math.ceil(length - phase)
    load = force / b / max(1.0, 0.8 * length)
    sections = {k: [slice_at(pair, effects, phase, k, float(y)) for y in np.linspace(0, b, 9)] for k in range(first, last + 1)}
    least = min(section.gap for some in sections.values() for section in some)
    reach = least + _MARGIN * load / _STIFFNESS * 210.0 / pair.material.youngs_modulus
    beta_b = meshing.beta_b
    middle = (meshing.path_start + meshing.path_end) / 2
    rho = middle * (meshing.tangent_length - middle) / meshing.tangent_length / math.cos(beta_b)
    modulus = pair.material.plane_strain_modulus / 2
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
    meshing, b = pair.meshing, pair.face_width
    tan_b = math.tan(meshing.beta_b)
    ends = [0.0, b]
    if tan_b:
        at = [(u - meshing.path_start - (phase + k) * meshing.base_pitch) / tan_b for u in (meshing.path_start, meshing.path_end)]
        ends += [y for y in at if 0.02 * b < y < 0.98 * b]
    ends = np.unique(ends)
    found = [np.zeros(1)]
    for low, high in zip(ends[:-1], ends[1:], strict=True):
        count = max(3, math.ceil((high - low) / thickness))
        x = np.linspace(0.0, 1.0, count + 1)[1:]
        found.append(low + (high - low) * (x - 0.75 * np.sin(2 * np.pi * x) / (2 * np.pi)))
    return np.concatenate(found)


def _condensed(
    pair: Pair, role: Role, strip: Strip, at: Points, flank: FlankCompliance, fineness: Fineness
) -> tuple[NDArray, NDArray, NDArray, int]:
    """Fᵀ K⁻¹ F, P and M of a strip on one gear, and the number of unknowns."""
    gear, b = pair.gears[role], pair.face_width
    y = at.y if role == Role.PINION else b - at.y
    layers = strip.layers if role == Role.PINION else b - strip.layers[::-1]
    bounds = _bounds(gear, role, strip)
    near = strip.half / fineness.strip * fineness.contact
    grading = Grading(near=near, far=fineness.size * pair.normal_module, growth=fineness.growth)
    tooth = FineTooth(gear=gear, layers=layers, strip=bounds, grading=grading)
    force = sp.csr_matrix(at.hats.multiply(at.weight[:, None]))
    load = tooth.load(at.radii[role], y, tooth.normals(at.normals[role], y), force)
    smooth = _polynomial_load(tooth, flank.order)
    whole = tooth.compliance(pair.material, sp.csr_matrix(sp.hstack([load, smooth])))
    m = load.shape[1]
    moments = flank_polynomials(gear, flank.order, at.radii[role], y).T @ force
    return whole[:m, :m], whole[m:, m:], np.asarray(moments), 3 * tooth.space.n_nodes


def _bounds(gear: Gear, role: Role, strip: Strip) -> NDArray:
    """Radii between which the strip lies on a gear, along its own face, (2, station)."""
    found = []
    for section in strip.stations:
        if math.isfinite(section.gap):
            ends = [float(section.radius(role, np.array(x))) for x in section.window(strip.half)]
        else:
            ends = [section.radii[role]] * 2
        found.append([min(ends), max(ends)])
    bounds = np.clip(np.array(found).T, gear.root_radius, gear.tip_radius)
    return bounds if role == Role.PINION else bounds[:, ::-1]


def _polynomial_load(tooth: FineTooth, order: tuple[int, int]) -> sp.csr_matrix:
    """Nodal forces of polynomials of unit norm on the flank."""
    gear = tooth.gear
    t, w = np.polynomial.legendre.leggauss(3)
    t, w = (t + 1) / 2, w / 2
    radii, at, weight = [], [], []
    for low, high in zip(tooth.layers[:-1], tooth.layers[1:], strict=True):
        for share, of_y in zip(t, w, strict=True):
            y = low + share * (high - low)
            edges = tooth.section_edges(float(y))
            edges = np.concatenate([[gear.form_radius], edges[(edges > gear.form_radius) & (edges < gear.tip_radius)], [gear.tip_radius]])
            R = (edges[:-1, None] + np.diff(edges)[:, None] * t).ravel()
            radii.append(R)
            at.append(np.full(len(R), y))
            weight.append((np.diff(edges)[:, None] * w).ravel() * of_y * (high - low))
    R, y, dA = (np.concatenate(each) for each in (radii, at, weight))
    force = sp.csr_matrix(flank_polynomials(gear, order, R, y) * dA[:, None])
    return tooth.load(R, y, Flank(gear).normal(R, y), force)
