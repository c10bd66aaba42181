"""Plane strain: the section of the body in triangles, refined where a contact strip presses on the flank."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray

from fem_reference.blocks import Blocks, Cells
from fem_reference.elasticity import Lame, Points, Space, free_dofs, surface_points
from fem_reference.environment import gmsh_model
from fem_reference.flank import Flank
from fem_reference.locate import interior_points
from fem_reference.section import Body, MeshingError, check_section
from fem_reference.solver import solve
from fem_reference.tooth_mesh import match_facets, snapped, straighten_bad
from gearbench.geometry.material import Material


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
    for name in body.held:
        free[space.boundary_nodes(name)] = False
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


@dataclass(frozen=True, kw_only=True)
class Patch:
    """Patch of fine triangles: within ``radius`` of a point (x, y), of edge length ``size`` [mm]."""

    x: float
    y: float
    radius: float
    size: float


def section_mesh(body: Body, patches: Sequence[Patch], size: float, growth: float = 0.15) -> Any:
    """Curved triangles of the section, boundary nodes on the exact curves, fine in the patches.

    ``size`` of the triangles elsewhere, in normal modules; sizes grow by ``growth`` per distance.

    Raises
    ------
    MeshingError
        If the section cannot be meshed.
    """
    check_section(body)
    m = body.gear.normal_module
    with gmsh_model("section") as gmsh:
        try:
            blocks = Blocks(gmsh.model.geo, body, Cells(thickness=8, flank=8, fillet=8, width=1), structured=False)
            blocks.build()
            gmsh.model.geo.synchronize()
            _size_field(gmsh, patches, m, size, growth)
            gmsh.model.mesh.generate(2)
            points, elements, edges = _harvest(gmsh, blocks)
        except Exception as error:  # gmsh raises bare Exceptions
            raise MeshingError(f"gmsh: {error}") from error
    points *= m
    mesh: Any = skfem.MeshTri1(points, elements, sort_t=False, validate=False)
    boundaries = match_facets(mesh.facets, edges, points.shape[1])
    for name, found in boundaries.items():
        nodes = np.unique(mesh.facets[:, found])
        points[:, nodes] = snapped(body, name, points[:, nodes])
    mesh = replace(mesh, doflocs=points)
    curved: Any = skfem.MeshTri2.from_mesh(mesh)
    positions = curved.doflocs.copy()
    middle = curved.dofs.facet_dofs[0]
    for name, found in boundaries.items():
        ends = mesh.facets[:, found]
        radii = body.gear.sign * np.hypot(*points[:, ends[0]]), body.gear.sign * np.hypot(*points[:, ends[1]])
        positions[:, middle[found]] = snapped(body, name, positions[:, middle[found]], radii)
    straighten_bad(positions, mesh, mesh.facets, mesh.t2f, middle)
    return replace(curved, doflocs=positions).with_boundaries(boundaries)


def _size_field(gmsh: Any, patches: Sequence[Patch], module: float, size: float, growth: float) -> None:
    """Triangles of the size of the patches growing to ``size`` away from them (on a rim, further to the bore)."""
    field, numbers = gmsh.model.mesh.field, []
    for patch in patches:
        x, y, radius, fine = (value / module for value in (patch.x, patch.y, patch.radius, patch.size))
        distance = f"Sqrt((x-({x:.12g}))^2+(y-({y:.12g}))^2)"
        reach = f"{min(fine, size):.6g}+{growth:.6g}*Max(0,{distance}-{radius:.6g})"
        far = f"{size:.6g}+0.25*Max(0,{distance}-4)"
        numbers.append(field.add("MathEval"))
        field.setString(numbers[-1], "F", f"Min({reach},{far})")
    field.setNumbers(least := field.add("Min"), "FieldsList", numbers)
    field.setAsBackgroundMesh(least)
    for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)


def _harvest(gmsh: Any, blocks: Blocks) -> tuple[NDArray, NDArray, dict[str, NDArray]]:
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    nodes = gmsh.model.mesh.getElementsByType(2)[1]
    used = np.unique(nodes)
    number = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    number[used] = np.arange(used.size)
    position = np.empty_like(number)
    position[tags] = np.arange(tags.size)
    edges: dict[str, list[NDArray]] = {}
    for name, curve in blocks.named_curves():
        edges.setdefault(name, []).append(number[gmsh.model.mesh.getElementsByType(1, curve)[1].reshape(-1, 2)])
    points = coordinates.reshape(-1, 3)[position[used]].T[:2].copy()
    elements = np.ascontiguousarray(number[nodes.reshape(-1, 3)].T, dtype=np.int32)
    return points, elements, {name: np.concatenate(found).T for name, found in edges.items()}
