"""The section of a body in curved triangles, fine where contact strips press on its flanks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature

from fem_reference.blocks import Blocks
from fem_reference.environment import gmsh_model
from fem_reference.section import Body, MeshingError, check_section, polar


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
            blocks = Blocks(gmsh.model.geo, body)
            blocks.build()
            gmsh.model.geo.synchronize()
            _size_field(gmsh, patches, m, size, growth)
            gmsh.model.mesh.generate(2)
            points, elements, edges = _harvest(gmsh, blocks)
        except Exception as error:  # gmsh raises bare Exceptions
            raise MeshingError(f"gmsh: {error}") from error
    points *= m
    mesh: Any = skfem.MeshTri1(points, elements, sort_t=False, validate=False)
    boundaries = _match(mesh.facets, edges)
    for name, found in boundaries.items():
        nodes = np.unique(mesh.facets[:, found])
        points[:, nodes] = _snapped(body, name, points[:, nodes])
    mesh = replace(mesh, doflocs=points)
    curved: Any = skfem.MeshTri2.from_mesh(mesh)
    positions = curved.doflocs.copy()
    middle = curved.dofs.facet_dofs[0]
    for name, found in boundaries.items():
        ends = mesh.facets[:, found]
        radii = body.gear.sign * np.hypot(*points[:, ends[0]]), body.gear.sign * np.hypot(*points[:, ends[1]])
        positions[:, middle[found]] = _snapped(body, name, positions[:, middle[found]], radii)
    _straighten_bad(positions, mesh, middle)
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
    for name, curve in blocks.named_curves:
        edges.setdefault(name, []).append(number[gmsh.model.mesh.getElementsByType(1, curve)[1].reshape(-1, 2)])
    points = coordinates.reshape(-1, 3)[position[used]].T[:2].copy()
    elements = np.ascontiguousarray(number[nodes.reshape(-1, 3)].T, dtype=np.int32)
    return points, elements, {name: np.concatenate(found).T for name, found in edges.items()}


def _match(facets: NDArray, named: dict[str, NDArray]) -> dict[str, NDArray]:
    """Numbers of the edges of the mesh that are the given edges, by their vertices."""

    def key(edges: NDArray) -> NDArray:
        low, high = np.sort(edges, axis=0).astype(np.int64)
        return low * (int(facets.max()) + 1) + high

    order = np.argsort(key(facets))
    keys = key(facets)[order]
    return {name: order[np.searchsorted(keys, key(edges))].astype(np.int32) for name, edges in named.items()}


def _snapped(body: Body, name: str, xy: NDArray, ends: tuple[NDArray, NDArray] | None = None) -> NDArray:
    """Points (2, n) moved onto the exact curve of a boundary."""
    R, theta = polar(body.gear.sign * xy)
    R *= body.gear.sign
    exact_R, exact = body.snap(name, R, theta, ends)
    if exact is theta and exact_R is R:
        return xy
    return np.array([exact_R * np.sin(exact), exact_R * np.cos(exact)])


def _straighten_bad(points: NDArray, mesh: Any, middle: NDArray) -> None:
    """Straighten the edges of curved triangles with a negative Jacobian (in the cusp at the clamped root).

    ``middle`` (edge,): nodes in the middle of the edges, in ``points``.
    """
    element = skfem.ElementTriP2()
    inner = get_quadrature(mesh.elem.refdom, 6)[0]
    # nor where matrices are integrated
    X = np.hstack([inner, *(get_quadrature(mesh.elem.refdom, degree)[0] for degree in (4, 5))])
    shapes = np.stack([element.lbasis(X, i)[1] for i in range(len(element.doflocs))])
    for _ in range(5):
        positions = np.concatenate([points[:, mesh.t], points[:, middle[mesh.t2f]]], axis=1)
        det = np.linalg.det(np.einsum("iae,ajq->eqij", positions, shapes))
        det *= np.sign(det.mean(axis=1, keepdims=True))
        least = det[:, : inner.shape[1]].min(axis=1)
        bad = np.unique(mesh.t2f[:, (least <= 0.05 * np.abs(det).max(axis=1)) | (det.min(axis=1) <= 0)])
        if bad.size == 0:
            return
        points[:, middle[bad]] = points[:, mesh.facets[:, bad]].mean(axis=1)
