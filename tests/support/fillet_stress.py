"""Stress along the root fillet over the mesh cycle, from the factorisation that gives the compliance of the flanks.

On the fillet, which carries no load, stress has three components: along the section's outline (a), along the helix (b)
and the shear between them. At points of the outline and positions along the axis they are further functionals of
the displacements: the sector is condensed to them and to the loads on the flank, and the circulant system gives the
stress on every tooth under polynomial loads on one. Loads of any mesh cycle are sums of these.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem_reference.circulant import circulant_compliance, condensed_sector
from fem_reference.refinement import NEIGHBOURS, Level, default_order
from fem_reference.section import Body, MeshingError
from fem_reference.sector import Outline, Section, elasticity, lagrange, strains
from gearbench.compliance.bases import gauss
from gearbench.compliance.flank import FlankCompliance
from gearbench.geometry.action import ContactLines
from gearbench.geometry.material import Material

#: Points on each edge of a quadrilateral, and along the axis for each polynomial of the loads.
POINTS, STATIONS = 6, 1.0
#: Height of the row below the teeth [modules]: with a thicker row the peak at level 4 is 12 % too large, not 0.4 %.
RIM = 0.4


@dataclass(frozen=True, kw_only=True)
class FilletStress:
    """Stress on the fillet of the loaded side under loads on the flanks.

    Parameters
    ----------
    flank
        Polynomials of the loads; its blocks are σ_a, σ_b, τ [N/mm² per N], (2n+1, point·station·3, p·q).
    radius, y
        Points on the outline (point,) and stations along the axis (station,) [mm], seen as on a driving gear.
    """

    flank: FlankCompliance
    radius: NDArray
    y: NDArray

    def components(self, lines: ContactLines, force: NDArray) -> NDArray:
        """σ_a, σ_b, τ (position, pair, point, station, 3) [N/mm²] on the tooth of each pair, under the forces on all.

        ``lines``, ``force``: contact lines of the pair and the normal force on their segments [N], (position, pair,
        segment).
        """
        flank, pairs = self.flank, lines.shape[1]
        index = int(flank.driven)
        R = lines.radii[index]
        shapes = flank.shapes(np.where(lines.active[..., None], R - flank.gear.root_radius, 0.0), lines.gear_y(index))
        weight = np.einsum("pks,pksa->pka", np.where(lines.active[..., None], force, 0.0), shapes)
        found = sum(
            np.einsum("sa,pa->ps", self._block(i - j), weight[:, j])[:, None] * (np.arange(pairs) == i)[:, None]
            for i in range(pairs)
            for j in range(pairs)
        )
        return np.asarray(found).reshape(len(weight), pairs, len(self.radius), len(self.y), 3)

    def _block(self, d: int) -> NDArray:
        n = self.flank.neighbours
        if abs(d) > n:
            return np.zeros(self.flank.blocks.shape[1:])
        return self.flank.blocks[n + (-d if self.flank.driven else d)]

    def largest(self, lines: ContactLines, force: NDArray) -> NDArray:
        """Largest principal stress on the fillet of each pair's tooth (position, pair) [N/mm²]; 0 without contact."""
        a, b, tau = np.moveaxis(self.components(lines, force), -1, 0)
        principal = 0.5 * (a + b) + np.hypot(0.5 * (a - b), tau)
        return np.where(lines.active, principal.max(axis=(2, 3)), 0.0)


@dataclass(frozen=True, kw_only=True)
class Fillet:
    """Points on the right fillet of a section, and the stress there as functionals of its displacements.

    Parameters
    ----------
    section
        The section.
    """

    section: Section

    @cached_property
    def _edges(self) -> list[tuple[int, NDArray, NDArray]]:
        """Quadrilaterals with an edge on the fillet, and the reference points s, t on it."""
        gear, outline = self.section.body.gear, Outline(gear=self.section.body.gear)
        x, one, found = gauss(POINTS)[0], np.ones(POINTS), []
        for number, at in enumerate(self.section.maps):
            for s, t in ((one, x), (x, one)):
                R, theta = at(s, t)[:2]
                if np.all((gear.root_radius < R) & (gear.form_radius > R)):
                    on = outline.fillet(gear.fillet.parameter(R))[1]
                    if np.allclose(theta, on, rtol=0, atol=1e-7 * self.section.body.pitch_angle):
                        found.append((number, s, t))
        return found

    @cached_property
    def radius(self) -> NDArray:
        """Radii of the points [mm]."""
        return np.concatenate([self.section.maps[e](s, t)[0] for e, s, t in self._edges])

    def functionals(self, material: Material) -> tuple[NDArray, NDArray]:
        """σ_a, σ_b, τ at the points = F₀ u + F₁ ∂u/∂y, each (3·node, 3·point)."""
        section, n = self.section, self.section.grain.degree
        gear, C = section.body.gear, elasticity(material)
        out = np.zeros((2, 3 * len(section.positions), len(self._edges), POINTS, 3))
        for k, (e, s, t) in enumerate(self._edges):
            (vs, ds), (vt, dt) = lagrange(n, s), lagrange(n, t)
            shapes = tuple(np.einsum("pi,pj->pji", *f).reshape(len(s), -1) for f in ((vs, vt), (ds, vt), (vs, dt)))
            R, _, *slopes = section.maps[e](s, t)
            _, *B = strains(R, slopes, shapes, gear)
            R_s, R_t, theta_s, theta_t = slopes
            along = np.array([R_t, R * theta_t] if s[0] == s[-1] else [R_s, R * theta_s])
            T = _surface_frame(along, R * math.tan(gear.beta) / gear.pitch_radius)
            dofs = (3 * section.nodes[e][:, None] + np.arange(3)).ravel()
            for i, part in enumerate(B):
                out[i][dofs, k] += (T @ (C @ part.reshape(len(s), 6, -1))).transpose(2, 0, 1)
        return out[0].reshape(len(out[0]), -1), out[1].reshape(len(out[1]), -1)


def _surface_frame(along: NDArray, climb: NDArray) -> NDArray:
    """Rows (point, 3, 6) that give σ_a, σ_b, τ from the stress RR, θθ, yy, θy, Ry, Rθ.

    ``along``: tangent of the outline (R, θ) (2, point); ``climb``: R dθ/dy of the helix.
    """
    a = np.stack([*along, np.zeros_like(climb)]) / np.hypot(*along)
    helix = np.stack([np.zeros_like(climb), climb, np.ones_like(climb)])
    b = helix - np.sum(a * helix, axis=0) * a
    b /= np.linalg.norm(b, axis=0)

    def both(x: NDArray, y: NDArray) -> NDArray:
        pairs = ((1, 2), (0, 2), (0, 1))
        return np.stack([*(x * y), *(x[i] * y[j] + x[j] * y[i] for i, j in pairs)], axis=-1)

    return np.stack([both(a, a), both(b, b), both(a, b)], axis=1)


def fillet_stress(
    body: Body, material: Material, number: int = 4, order: tuple[int, int] | None = None, *, driven: bool = False
) -> FilletStress:
    """Stress on the fillets of a gear under polynomial loads on its flanks, by the finite elements of level ``number``.

    Raises
    ------
    MeshingError
        If flanks or fillets of the section cross.
    """
    if body.gear.teeth < 0:
        raise MeshingError("fillet stress supports external gears only")
    order = order or default_order(body.gear)
    level = Level(body=body, number=number, waves=order[1], rim=RIM)
    b = body.gear.face_width
    fillet = Fillet(section=level.section)
    eta = gauss(max(3, math.ceil(STATIONS * order[1])))[0]
    values, slopes = level.axis.values(b * eta)
    F0, F1 = (F[level.section.free] for F in fillet.functionals(material))
    rows = sp.csr_array(sp.kron(F0, values.T) + sp.kron(F1, slopes.T))
    # from (component of a point, station) to (point, station, component)
    turn = np.arange(F0.shape[1] * len(eta)).reshape(-1, 3, len(eta)).transpose(0, 2, 1).ravel()
    S, face = condensed_sector(level.section, level.axis, level.there, material, order, [rows[:, turn]])
    n, loads = min((body.gear.teeth - 1) // 2, NEIGHBOURS), order[0] * order[1]
    if body.bore_radius is None:
        blocks = -S[None, loads:, :loads]
    else:
        blocks = circulant_compliance(S, face, body.gear.teeth, n, loads)[:, loads:]
    flank = FlankCompliance(gear=body.gear, order=order, blocks=blocks, driven=driven)
    return FilletStress(flank=flank, radius=fillet.radius, y=b * eta)
