"""The section of one sector of a gear in curved quadrilaterals of high order with positive Jacobians.

Everything is written in the frame that turns with the screw of the teeth: radius R, angle θ clockwise from the centre
line of the tooth, position y along the axis, cylindrical components u_R, u_θ, u_y. There all sections and all teeth are
equal. The outline of a generated tooth is a function ψ(R) (half tooth angle) down to a point on the fillet and a
function R(θ) below it; each quadrilateral is bounded by such a graph and by lines of constant R or θ, and is mapped
linearly between them. Its Jacobian is then the product of two positive lengths, whatever the outline.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.polynomial import Chebyshev, legendre
from numpy.polynomial.chebyshev import chebval
from numpy.typing import NDArray

from fem_reference.section import Body, check_section
from gearbench.compliance.bases import gauss
from gearbench.compliance.local import flank_functions
from gearbench.geometry.gear import Gear
from gearbench.geometry.material import Material, lame

#: R, θ and their derivatives (R_s, R_t, θ_s, θ_t) at reference points s, t in [0, 1].
Map = Callable[[NDArray, NDArray], tuple[NDArray, ...]]


@dataclass(frozen=True, kw_only=True)
class Outline:
    """Outline of a tooth: the fillet over its parameter φ (0 at the root circle), ψ(R) above the junction.

    Parameters
    ----------
    gear
        The gear.
    """

    gear: Gear

    @cached_property
    def _series(self) -> NDArray:
        """c = √|R² − r_f²| and ψ over φ: both analytic, unlike ψ(R), which starts with a root; and their slopes.

        Coefficients on [0, φ_end], (degree, 4): c, ψ, dc/dφ, dψ/dφ. Those below rounding are left out.
        """
        fillet, r_f, sign = self.gear.fillet, self.gear.root_radius, self.gear.sign
        chord = lambda phi: np.sqrt(np.maximum(sign * (fillet.radius(phi) ** 2 - r_f**2), 0.0))  # noqa: E731
        span = [0.0, fillet.phi_end]
        found = [Chebyshev.interpolate(each, 60, span) for each in (chord, fillet.half_angle)]
        found = [each.trim(1e-15 * np.abs(each.coef).max()) for each in found]
        found += [each.deriv() for each in found]
        out = np.zeros((max(len(each.coef) for each in found), 4))
        for column, each in zip(out.T, found, strict=True):
            column[: len(each.coef)] = each.coef
        return out

    def fillet(self, phi: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """R, ψ, dR/dφ and dψ/dφ."""
        c, psi, c_phi, psi_phi = chebval(2 * phi / self.gear.fillet.phi_end - 1, self._series)
        sign = self.gear.sign
        R = sign * np.sqrt(self.gear.root_radius**2 + sign * c**2)
        return R, psi, sign * c * c_phi / R, psi_phi

    @cached_property
    def junction(self) -> float:
        """φ of the first point above the root circle where the fillet is 45° steep; above it ψ(R) is used."""
        phi = np.linspace(0.0, float(self.gear.fillet.parameter(self.gear.form_radius)), 4001)[1:]
        R, _, R_phi, psi_phi = self.fillet(phi)
        steep = -psi_phi * R < R_phi
        return float(phi[np.argmax(steep)] if steep.any() else phi[-1])

    def half_angle(self, R: NDArray) -> tuple[NDArray, NDArray]:
        """ψ and dψ/dR from the junction to the tip circle."""
        gear, flank = self.gear, self.gear.form_radius <= R
        tan = gear.roll_length(R) / gear.base_radius
        on_flank = gear.involute_half_angle(R), -tan / R
        if flank.all():
            return on_flank
        _, psi, R_phi, psi_phi = self.fillet(gear.fillet.parameter(R))
        return np.where(flank, on_flank[0], psi), np.where(flank, on_flank[1], psi_phi / R_phi)


#: θ and its derivative, upper end of R and its derivative, at x in [0, 1] across a column.
Column = Callable[[NDArray], tuple[NDArray, NDArray, NDArray, NDArray]]


def _on_tooth(outline: Outline, s: tuple[float, float], R: tuple[float, float]) -> Map:
    """θ from s₀ψ(R) to s₁ψ(R), R between two radii."""

    def at(x: NDArray, t: NDArray) -> tuple[NDArray, ...]:
        across, height = s[0] + x * (s[1] - s[0]), R[1] - R[0]
        psi, slope = outline.half_angle(R[0] + t * height)
        return R[0] + t * height, across * psi, 0 * t, height + 0 * t, (s[1] - s[0]) * psi, across * slope * height

    return at


def _in_column(column: Column, low: float, high: float | None = None) -> Map:
    """θ across a column, R between two radii, or up to its upper end."""

    def at(x: NDArray, t: NDArray) -> tuple[NDArray, ...]:
        theta, dtheta, top, slope = column(x)
        if high is not None:
            top, slope = high + 0 * x, 0 * x
        return low + t * (top - low), theta, t * slope, top - low, dtheta, 0 * x

    return at


def _level(start: float, end: float, top: float) -> Column:
    """A column that ends at one radius."""
    return lambda x: (start + x * (end - start), end - start + 0 * x, top + 0 * x, 0 * x)


def _foot(outline: Outline, side: int, end: float) -> Column:
    """The column below the lower fillet, which ends at the angle ``end``."""
    phi = outline.junction
    start, foot = (float(outline.fillet(np.array(x))[1]) for x in (phi, 0.0))
    stretch = (end - start) / (foot - start)

    def at(x: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        top, psi, R_phi, psi_phi = outline.fillet(phi * (1 - x if side > 0 else x))
        turn = -side * phi
        return side * (start + stretch * (psi - start)), side * stretch * psi_phi * turn, top, R_phi * turn

    return at


@dataclass(frozen=True, kw_only=True)
class Grain:
    """Division of a section.

    Parameters
    ----------
    degree
        Polynomial degree of the displacement in each quadrilateral.
    flank, fillet
        Ends of the rows along the flank and along the fillet above the junction, as fractions 0 … 1 of their heights.
    across
        Ends of the columns across the tooth, −1 … 1.
    rim, growth
        Height of the row below the root circle [modules], and growth of rows towards the bore.
    """

    degree: int
    flank: tuple[float, ...] = (0.0, 0.15, 0.55, 0.9, 1.0)
    fillet: tuple[float, ...] = (0.0, 0.6, 1.0)
    across: tuple[float, ...] = (-1.0, -0.6, 0.6, 1.0)
    rim: float = 1.2
    growth: float = 2.5


def quadrilaterals(body: Body, grain: Grain) -> tuple[list[Map], list[Map]]:
    """Maps from [0, 1]² to (R, θ): those next to the loaded flank, from the root upwards, and all others.

    Raises
    ------
    MeshingError
        If the flanks or the fillets of neighbouring teeth cross.
    """
    check_section(body)
    gear, outline = body.gear, Outline(gear=body.gear)
    low, psi, _, _ = (float(x) for x in outline.fillet(np.array(outline.junction)))
    high, strips = gear.form_radius, list(pairwise(grain.across))
    flank = [high + f * (gear.tip_radius - high) for f in grain.flank]
    rows = [(low + f * (high - low), low + g * (high - low)) for f, g in pairwise(grain.fillet) if high > low]
    loaded = [_on_tooth(outline, strips[-1], R) for R in pairwise(flank)]
    others = [_on_tooth(outline, s, R) for R in pairwise(flank) for s in strips[:-1]]
    others += [_on_tooth(outline, s, R) for R in rows for s in strips]
    columns = [_level(a * psi, b * psi, low) for a, b in strips]
    end, half = float(outline.fillet(np.array(0.0))[1]), 0.5 * body.pitch_angle
    if body.bore_radius is None:
        columns += [_foot(outline, side, end) for side in (-1, 1)]
        return loaded, others + [_in_column(column, gear.root_radius) for column in columns]
    if (half - end) / half > LEAST_LAND:
        columns += [_level(end, half, gear.root_radius), _level(-half, -end, gear.root_radius)]
    else:
        end = half
    columns += [_foot(outline, side, end) for side in (-1, 1)]
    layers = layer_radii(body, grain)
    others += [_in_column(column, layers[0]) for column in columns]
    return loaded, others + [_in_column(column, R, top) for column in columns for top, R in pairwise(layers)]


#: A root circle left between two fillets that is shorter than this share of the pitch is closed.
LEAST_LAND = 2e-3


def layer_radii(body: Body, grain: Grain) -> list[float]:
    """Radii from the lower end of the row below the teeth down to the bore; those of rim and hub are among them."""
    bore, web, top = body.bore_radius or 0.0, body.web, body.gear.root_radius
    step, radii = grain.rim * body.gear.normal_module, []
    for end in [bore] if web is None else sorted({web.rim_radius, web.hub_radius, bore}, reverse=True):
        while top - 1.5 * step > end:
            top -= step
            radii.append(top)
            step *= grain.growth
        radii.append(end)
        # stress rises at the edges between the parts, over a distance of the order of the web's thickness
        top, step = end, step if web is None else min(step, web.thickness)
    return radii


@dataclass(frozen=True, kw_only=True)
class Section:
    """Finite elements of the section: three displacements at each node, degree of freedom = 3·node + component.

    Parameters
    ----------
    body, grain
        The body and its division.
    """

    body: Body
    grain: Grain

    @cached_property
    def maps(self) -> list[Map]:
        """The quadrilaterals, those next to the loaded flank first."""
        loaded, others = quadrilaterals(self.body, self.grain)
        return loaded + others

    @cached_property
    def _numbering(self) -> tuple[NDArray, NDArray]:
        """Positions (node, 2) as R and θ, and nodes of each quadrilateral, (quadrilateral, (degree + 1)²)."""
        x = lobatto(self.grain.degree)
        s, t = (a.ravel() for a in np.meshgrid(x, x))
        places = np.array([at(s, t)[:2] for at in self.maps]).transpose(0, 2, 1).reshape(-1, 2)
        gear = self.body.gear
        key = np.round(places * [1, gear.root_radius] / gear.normal_module / 1e-7).astype(np.int64)
        _, first, number = np.unique(key, axis=0, return_index=True, return_inverse=True)
        return places[first], number.reshape(len(self.maps), -1)

    @property
    def positions(self) -> NDArray:
        """R [mm] and θ [rad] of the nodes, (node, 2)."""
        return self._numbering[0]

    @property
    def nodes(self) -> NDArray:
        """Nodes of each quadrilateral, s fastest."""
        return self._numbering[1]

    @cached_property
    def of_web(self) -> NDArray:
        """Whether each quadrilateral belongs to the web, which is narrower than the face."""
        web = self.body.web
        if web is None:
            return np.zeros(len(self.maps), dtype=bool)
        middle = np.array([float(at(np.array(0.5), np.array(0.5))[0]) for at in self.maps])
        return (web.hub_radius < middle) & (middle < web.rim_radius)

    @property
    def held_radius(self) -> float:
        """Radius of the bore, or of the root circle of a tooth alone [mm]."""
        return self.body.bore_radius or self.body.gear.root_radius

    @cached_property
    def held(self) -> NDArray:
        """Fixed nodes; none with springs."""
        if self.body.support is not None:
            return np.zeros(0, dtype=np.intp)
        return np.flatnonzero(self.positions[:, 0] < self.held_radius + 1e-7 * self.body.gear.normal_module)

    @cached_property
    def free(self) -> NDArray:
        """Free degrees of freedom, boolean."""
        free = np.ones((len(self.positions), 3), dtype=bool)
        free[self.held] = False
        return free.ravel()

    def side(self, sign: int) -> NDArray:
        """Nodes at θ = ±π/z, from the bore upwards."""
        R, theta = self.positions.T
        pitch = self.body.pitch_angle
        at = np.flatnonzero(np.abs(theta - sign * 0.5 * pitch) < 1e-7 * abs(pitch))
        return at[np.argsort(R[at])]

    def stiffness(self, material: Material, chosen: NDArray) -> tuple[sp.csr_array, sp.csr_array, sp.csr_array]:
        """∫ B₀ᵀCB₀, ∫ B₀ᵀCB₁ and ∫ B₁ᵀCB₁ R dR dθ over the quadrilaterals ``chosen`` (boolean), of the same pattern.

        Strains are B₀u + B₁ ∂u/∂y; their order: RR, θθ, yy, θy, Ry, Rθ (shear as angles).
        """
        n, gear = self.grain.degree, self.body.gear
        points, weights = gauss(n + 2)
        s, t = (a.ravel() for a in np.meshgrid(points, points))
        weight = np.outer(weights, weights).ravel()
        value, slope = lagrange(n, points)
        N = np.einsum("pi,qj->qpji", value, value).reshape(len(s), -1)
        N_s = np.einsum("pi,qj->qpji", slope, value).reshape(len(s), -1)
        N_t = np.einsum("pi,qj->qpji", value, slope).reshape(len(s), -1)
        C = elasticity(material)
        blocks = []
        for at in (self.maps[e] for e in np.flatnonzero(chosen)):
            R, _, *slopes = at(s, t)
            det, B0, B1 = strains(R, slopes, (N, N_s, N_t), gear)
            scale = np.sqrt(weight * det * R)[:, None, None]
            left = (C @ (scale * B0.reshape(*B0.shape[:2], -1))).reshape(6 * len(s), -1)
            B0, B1 = ((scale * B.reshape(*B.shape[:2], -1)).reshape(6 * len(s), -1) for B in (B0, B1))
            right = (C @ B1.reshape(len(s), 6, -1)).reshape(6 * len(s), -1)
            blocks.append((B0.T @ left + self._springs(at), B0.T @ right, B1.T @ right))
        dofs = (3 * self.nodes[chosen][:, :, None] + np.arange(3)).reshape(len(blocks), -1)
        size = 3 * len(self.positions)
        row, col = np.repeat(dofs, dofs.shape[1], axis=1).ravel(), np.tile(dofs, dofs.shape[1]).ravel()
        made = [
            sp.coo_array((np.array(b).ravel(), (row, col)), shape=(size, size)).tocsr()
            for b in zip(*blocks, strict=True)
        ]
        return made[0], made[1], made[2]

    def _springs(self, at: Map) -> NDArray | float:
        """∫ N K Nᵀ |R dθ| of the springs below a quadrilateral, (dof, dof); 0 without springs."""
        if self.body.support is None:
            return 0.0
        n = self.grain.degree
        points, weights = gauss(n + 2)
        R, _, _, _, theta_s, _ = at(points, np.zeros_like(points))
        if np.any(np.abs(R - self.held_radius) > 1e-7 * self.body.gear.normal_module):
            return 0.0
        value, _ = lagrange(n, points)
        radial, along = self.body.support
        of_edge = value.T @ (value * (weights * np.abs(R * theta_s))[:, None])
        out = np.zeros((3 * (n + 1) ** 2, 3 * (n + 1) ** 2))
        edge = 3 * (n + 1)  # the nodes of t = 0 come first
        out[:edge, :edge] = np.kron(of_edge, np.diag([radial, along, along]))
        return out

    def normal(self, R: NDArray) -> NDArray:
        """Components along R, θ and y of the inward normals of the right flank at radii (point,), (point, 3)."""
        gear = self.body.gear
        cos = np.minimum(gear.base_radius / R, 1.0)
        across, along = math.cos(gear.beta_b), math.sin(gear.beta_b)
        return np.stack([-np.sqrt(1 - cos**2) * across, -cos * across, np.full_like(R, along)], axis=-1)

    def flank_load(self, count: int, *, left: bool = False) -> NDArray:
        """∫ f_i(R) n·N dR on the right flank for the ``count`` polynomials of the height, (3·node, count).

        ``left``: on the left flank of the tooth, with the normal that turning the tooth over gives.
        """
        gear, n = self.body.gear, self.grain.degree
        points, weights = gauss(n + count // 2 + 4)
        value, _ = lagrange(n, points)
        out = np.zeros((3 * len(self.positions), count))
        rows, columns = len(self.grain.flank) - 1, len(self.grain.across) - 1
        for row in range(rows):
            # the left column is the first of the others
            e = rows + row * (columns - 1) if left else row
            R, _, _, height, _, _ = self.maps[e](np.full_like(points, 0.0 if left else 1.0), points)
            f = flank_functions(count, R, gear.form_radius, gear.tip_radius) * (height * weights)[:, None]
            normal = self.normal(R) * ([1.0, -1.0, -1.0] if left else 1.0)
            force = np.einsum("pj,pc,pk->jck", value, normal, f)
            nodes = self.nodes[e].reshape(n + 1, n + 1)[:, 0 if left else -1]
            np.add.at(out, (3 * nodes[:, None] + np.arange(3)), force)
        return out


def strains(
    R: NDArray, slopes: list[NDArray], shapes: tuple[NDArray, NDArray, NDArray], gear: Gear
) -> tuple[NDArray, NDArray, NDArray]:
    """|J| (point,) and strains B₀, B₁ (point, 6, node, 3): RR, θθ, yy, θy, Ry, Rθ are B₀u + B₁ ∂u/∂y, shear as angles.

    ``slopes``: R_s, R_t, θ_s, θ_t; ``shapes``: N and its slopes along s and t, (point, node).
    """
    (R_s, R_t, theta_s, theta_t), (N, N_s, N_t) = slopes, shapes
    det = R_t * theta_s - R_s * theta_t
    N_R = (theta_s[:, None] * N_t - theta_t[:, None] * N_s) / det[:, None]
    N_theta = (R_t[:, None] * N_s - R_s[:, None] * N_t) / det[:, None]
    B0, over = np.zeros((len(R), 6, N.shape[1], 3)), 1 / R[:, None]
    B1, tau = np.zeros_like(B0), math.tan(gear.beta) / gear.pitch_radius
    B0[:, 0, :, 0] = N_R
    B0[:, 1, :, 1], B0[:, 1, :, 0] = N_theta * over, N * over
    B0[:, 2, :, 2], B1[:, 2, :, 2] = -tau * N_theta, N
    B0[:, 3, :, 2], B0[:, 3, :, 1], B1[:, 3, :, 1] = N_theta * over, -tau * N_theta, N
    B0[:, 4, :, 2], B0[:, 4, :, 0], B1[:, 4, :, 0] = N_R, -tau * N_theta, N
    B0[:, 5, :, 0], B0[:, 5, :, 1] = N_theta * over, N_R - N * over
    return det, B0, B1


def elasticity(material: Material) -> NDArray:
    """Stiffness of the material (6, 6) [N/mm²]: stress of the strains RR, θθ, yy, θy, Ry, Rθ."""
    lam, mu = lame(material.E, material.nu)
    C = np.diag([2 * mu] * 3 + [mu] * 3)
    C[:3, :3] += lam
    return C


@lru_cache
def lobatto(n: int) -> NDArray:
    """The n + 1 Gauss–Lobatto points on [0, 1]."""
    inner = legendre.Legendre.basis(n).deriv().roots()
    return 0.5 * (1 + np.concatenate([[-1.0], np.sort(inner.real), [1.0]]))


def lagrange(n: int, at: NDArray) -> tuple[NDArray, NDArray]:
    """Lagrange polynomials of the Lobatto points on [0, 1] and their derivatives, (point, n + 1)."""
    x, at = 2 * lobatto(n) - 1, 2 * np.asarray(at) - 1
    inverse = np.linalg.inv(legendre.legvander(x, n))
    slopes = np.stack([legendre.Legendre.basis(k).deriv()(at) if k else 0 * at for k in range(n + 1)], axis=-1)
    return legendre.legvander(at, n) @ inverse, 2 * slopes @ inverse
