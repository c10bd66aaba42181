"""Line loads on strips of a flank in plane strain: displacements at points inside, and stress along the root fillet."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import KDTree
from skfem.quadrature import get_quadrature

from fem_reference.elasticity import Lame, Space, free_dofs
from fem_reference.flank import Flank
from fem_reference.plane import Patch, section_mesh
from fem_reference.section import Body
from fem_reference.solver import solve
from gearbench.geometry.material import Material
from tests.support.surface_points import Points, surface_points


@dataclass(frozen=True, kw_only=True)
class Strip:
    """Contact strip on the loaded flank, with Hertz's pressure p = 2q/(πa) √(1 − (s/a)²).

    Parameters
    ----------
    radius
        Radius R of its middle [mm].
    half_width
        a [mm], measured along the flank.
    """

    radius: float
    half_width: float

    def pressure(self, s: NDArray) -> NDArray:
        """Pressure at the distance s along the flank from the middle, for unit line load [1/mm]."""
        return 2 / (np.pi * self.half_width) * np.sqrt(np.maximum(1 - (s / self.half_width) ** 2, 0.0))


@dataclass(frozen=True, kw_only=True)
class PlaneSolution:
    """Displacements under a unit line load [1 N/mm] on a strip.

    Parameters
    ----------
    body, strip
        The body loaded.
    space
        Displacement space (tri6).
    u
        Nodal displacements (2·node, 1) [mm per N/mm].
    """

    body: Body
    strip: Strip
    space: Space
    u: NDArray

    @cached_property
    def surface(self) -> float:
        """Displacement of the middle of the strip along the line of action [mm per N/mm]."""
        return self.at(*self._flank_point())

    @cached_property
    def smooth(self) -> float:
        """Displacement where the line of action meets the centre line of the tooth [mm per N/mm]."""
        flank = Flank(self.body.gear)
        zero, R = np.zeros(1), np.array([self.strip.radius])
        if self.body.bore_radius is None and np.hypot(*flank.below(R, zero)[0, :2]) <= self.body.gear.root_radius:
            return 0.0
        return self.at(flank.below(R, zero)[:, :2], flank.normal(R, zero)[:, :2])

    def _flank_point(self) -> tuple[NDArray, NDArray]:
        flank, zero, R = Flank(self.body.gear), np.zeros(1), np.array([self.strip.radius])
        return flank.position(R, zero)[:, :2], flank.normal(R, zero)[:, :2]

    def at(self, position: NDArray, direction: NDArray) -> float:
        """Displacement at one position along a direction (normalised) [mm per N/mm]."""
        direction = direction / np.linalg.norm(direction)
        return float(interior_points(self.space, position).displacement(self.u, direction)[0, 0])


def solve_strip(
    body: Body, material: Material, strip: Strip, size: float = 0.15, solver: str | None = None
) -> PlaneSolution:
    """Plane-strain solution for a unit line load on a strip; ``size`` of the triangles in normal modules.

    Raises
    ------
    MeshingError
        If the section cannot be meshed.
    """
    mesh = plane_mesh(body, strip, size)
    space = Space(mesh, "tri6")
    free = np.ones(space.n_nodes, dtype=bool)
    free[space.boundary_nodes(body.held)] = False
    dofs = free_dofs(free, 2)
    points = surface_points(space, mesh.boundaries["right_flank"], degree=10)
    force = points.load(_pressure(points, body, strip)[:, :, None], space)
    force /= np.linalg.norm(force.reshape(-1, 2).sum(axis=0))  # unit total force in spite of quadrature errors
    stiffness = space.stiffness(Lame.of(material.E, material.nu), free)
    u = np.zeros((2 * space.n_nodes, 1))
    u[dofs] = solve(stiffness, force[dofs], solver).x
    return PlaneSolution(body=body, strip=strip, space=space, u=u)


def _pressure(points: Points, body: Body, strip: Strip) -> NDArray:
    """Traction (point, 2) of the strip along the line of action."""
    gear = body.gear
    R = np.maximum(np.hypot(*points.position.T), gear.base_radius)
    # arc length of the involute, s = (R² − r_b²) / 2 r_b
    s = (R**2 - strip.radius**2) / (2 * gear.base_radius)
    normal = Flank(gear).normal(R, np.zeros_like(R))[:, :2]
    return strip.pressure(s)[:, None] * normal / np.linalg.norm(normal, axis=1, keepdims=True)


def plane_mesh(body: Body, strip: Strip, size: float) -> Any:
    """Curved triangles of the section, boundary nodes on the exact curves, fine at the strip."""
    at = Flank(body.gear).position(np.array([strip.radius]), np.zeros(1))[0, :2]
    return section_mesh(body, [Patch(x=at[0], y=at[1], radius=1.5 * strip.half_width, size=strip.half_width / 6)], size)


def surface_stress(space: Space, u: NDArray, material: Material, facets: NDArray, degree: int = 3) -> NDArray:
    """σ = λ tr(ε) 1 + 2μ ε at the Gauss points of boundary facets, (point, load, dim, dim) [N/mm² for loads in N].

    ``u``: nodal displacements (dim·node, load) [mm].
    """
    mesh, refdom = space.mesh, space.element.refdom
    element = mesh.f2t[0, facets]
    local = np.argmax(mesh.t2f[:, element] == facets, axis=0)
    nodal = u.reshape(space.n_nodes, space.dim, -1)
    t, _ = get_quadrature(refdom.brefdom, degree)
    stresses = []
    for k in np.unique(local):
        corner = refdom.p[:, refdom.facets[k]]
        ends = (1, 3) if corner.shape[1] == 4 else tuple(range(1, corner.shape[1]))
        X = corner[:, :1] + np.stack([corner[:, e] - corner[:, 0] for e in ends], axis=1) @ t
        for e in element[local == k]:
            grad, _ = space.gradients(X, slice(e, e + 1))
            stresses.append(cauchy_stress(np.einsum("qaj,ail->qlij", grad[0], nodal[space.nodes_of[:, e]]), material))
    return np.concatenate(stresses)


def cauchy_stress(gradient: NDArray, material: Material) -> NDArray:
    """σ = λ tr(ε) 1 + 2μ ε (…, d, d) [N/mm²] from ∂u_i/∂x_j (…, d, d); plane strain where d = 2."""
    lame, d = Lame.of(material.E, material.nu), gradient.shape[-1]
    epsilon = 0.5 * (gradient + np.swapaxes(gradient, -1, -2))
    trace = np.trace(epsilon, axis1=-2, axis2=-1)[..., None, None]
    return lame.lam * trace * np.eye(d) + 2 * lame.mu * epsilon


def plane_root_stress(solution: PlaneSolution, material: Material) -> float:
    """Largest principal stress on the loaded fillet for unit line load, plane strain [MPa per N/mm]."""
    space = solution.space
    stress = surface_stress(space, solution.u, material, space.mesh.boundaries["right_fillet"])
    return float(np.linalg.eigvalsh(stress[:, 0]).max())


def interior_points(space: Space, position: NDArray, candidates: int = 24) -> Points:
    """Interpolation at the points ``position`` (point, dim) [mm].

    Points up to 1 % of an element outside use the nearest element (boundaries of curved meshes).
    """
    position = np.asarray(position, dtype=float)
    n, dim = position.shape
    k = min(candidates, space.mesh.nelements)
    _, near = KDTree(space.geometry.mean(axis=1)).query(position, k=k)
    near = np.asarray(near).reshape(n, k)
    best, excess, reference = near[:, 0].copy(), np.full(n, np.inf), np.zeros((n, dim))
    for j in range(k):
        open_ = np.flatnonzero(excess > 1e-9)
        if open_.size == 0:
            break
        X = _invert(space, near[open_, j], position[open_])
        outside = _outside(X, simplex=space.kind.startswith("t"))
        better = outside < excess[open_]
        who = open_[better]
        best[who], excess[who], reference[who] = near[who, j], outside[better], X[better]
    assert excess.max() <= 0.01, f"the point {position[np.argmax(excess)]} mm lies outside the mesh"
    values, _ = space.reference_gradients(reference.T)
    nodes = space.nodes_of[:, best]
    row = np.broadcast_to(np.arange(n), nodes.shape)
    matrix = sp.csr_matrix((values.ravel(), (row.ravel(), nodes.ravel())), shape=(n, space.n_nodes))
    return Points(position, matrix, np.ones(n))


def _outside(X: NDArray, *, simplex: bool) -> NDArray:
    """Distance of reference points (point, dim) from their cell, 0 inside."""
    over = (X.sum(axis=1) - 1 if simplex else (X - 1).max(axis=1)) * 1.0
    return np.nan_to_num(np.maximum(np.maximum(over, (-X).max(axis=1)), 0.0), nan=np.inf)


def _invert(space: Space, element: NDArray, position: NDArray, steps: int = 12) -> NDArray:
    """Reference coordinates (point, dim) of the points in the given elements."""
    geometry = space.geometry[element]
    X = np.full_like(position, 0.25 if space.kind.startswith("t") else 0.5)
    for _ in range(steps):
        shapes, grads = space.geometry_shapes(np.clip(X, -0.5, 1.5).T)
        residual = position - np.einsum("pai,ap->pi", geometry, shapes)
        J = np.einsum("pai,paj->pij", geometry, grads)
        try:
            step = np.linalg.solve(J, residual[..., None])[..., 0]
        except np.linalg.LinAlgError:  # singular far outside a curved element: not this one
            step = np.full_like(X, np.nan)
        X = np.clip(X, -0.5, 1.5) + step
        if np.nanmax(np.abs(step), initial=0.0) < 1e-12:
            break
    return X
