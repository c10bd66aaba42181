"""Finite element mesh of a gear tooth, alone or on a sector of its gear.

gmsh meshes the straight body over the section bounded by the exact involute and the generated fillet; every boundary
node, also those in the middle of quadratic edges, is then placed exactly on its curve, and the body is turned by the
screw motion of the helix, θ → θ + y tan β / r. Seen from the loaded (right) flank, contact then climbs towards the tip
as y grows, as on the driving gear of ``gearbench.geometry.action``.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
import skfem
from numpy.typing import NDArray
from scipy.sparse.linalg import splu
from skfem.quadrature import get_quadrature

from fem_reference.blocks import Blocks, Cells
from fem_reference.elasticity import ELEMENTS, Space
from fem_reference.environment import gmsh_model
from fem_reference.section import Body, MeshingError, check_section, polar, split_name

__all__ = ["Body", "Cells", "MeshingError", "ToothMesh", "tooth_mesh"]

# gmsh's and scikit-fem's order of the vertices of a hexahedron
_HEX = [0, 4, 3, 1, 7, 5, 2, 6]
_GMSH_TYPE = {"hex": (5, 8, 3, 4), "tet": (4, 4, 2, 3)}


@dataclass(frozen=True, kw_only=True)
class ToothMesh:
    """Mesh of a body.

    Parameters
    ----------
    body, cells, kind
        The settings; ``kind`` is a 3D key of ``fem_reference.elasticity.ELEMENTS``.
    mesh
        scikit-fem mesh [mm] in Cartesian coordinates: y axis = centre line of the loaded tooth at the front face,
        z = position across the face width. Named boundaries: "left_flank", "right_flank", "left_fillet",
        "right_fillet", "tip" (with "+1", "-1", … appended for the neighbours), "front" (z = 0), "back" (z = b), and
        "clamp" for a tooth alone or "root", "bore", "cut_left", "cut_right" on a rim.
    seconds
        Time of meshing.
    """

    body: Body
    cells: Cells
    kind: str
    mesh: Any
    seconds: float

    @cached_property
    def space(self) -> Space:
        """Displacement space on this mesh."""
        return Space(self.mesh, self.kind)

    @cached_property
    def quality(self) -> float:
        """Smallest ratio of Jacobian determinants within an element, over the quadrature points; > 0."""
        X, _ = get_quadrature(self.space.element.refdom, ELEMENTS[self.kind].quadrature)
        _, det = self.space.gradients(X)
        return float((det.min(axis=1) / det.max(axis=1)).min())

    def write(self, path: str | Path, **point_data: NDArray) -> None:
        """Write VTU (ParaView) or MSH (Gmsh) by the suffix; ``point_data`` per mesh node, vectors as (node, 3)."""
        import meshio
        from skfem.io.meshio import HEX_MAPPING, TYPE_MESH_MAPPING

        cells = self.mesh.dofs.element_dofs
        if self.kind.startswith("hex"):
            cells = cells[HEX_MAPPING[: cells.shape[0]]]
        block: Any = [(TYPE_MESH_MAPPING[type(self.mesh)], cells.T)]
        out = meshio.Mesh(self.mesh.doflocs.T, block, point_data=dict(point_data))
        form = {"file_format": "gmsh", "binary": True} if Path(path).suffix == ".msh" else {}
        out.write(path, **form)


def tooth_mesh(body: Body, cells: Cells, kind: str = "hex20") -> ToothMesh:
    """Mesh a body.

    Raises
    ------
    MeshingError
        If the section crosses itself, gmsh fails, an element is turned inside out, or the body has a web.
    MissingDependencyError
        If gmsh cannot be loaded.
    """
    start = time.perf_counter()
    if body.web is not None:
        raise MeshingError("plain meshes do not support webs")
    if body.gear.teeth < 0 or body.support is not None:
        raise MeshingError("plain meshes support rigidly held external gears only")
    check_section(body)
    flat = _straight(body, cells, kind)
    mesh = screw(_quadratic(flat, body) if kind != "hex8" else flat, body)
    made = ToothMesh(body=body, cells=cells, kind=kind, mesh=mesh, seconds=0.0)
    try:
        _ = made.quality
    except ValueError as error:
        raise MeshingError(f"teeth = {body.gear.teeth}: {error}") from None
    return replace(made, seconds=time.perf_counter() - start)


def _straight(body: Body, cells: Cells, kind: str) -> Any:
    """Straight first-order mesh of the extruded section [mm], boundary nodes on the exact curves, not yet screwed."""
    gear, family = body.gear, kind[:3]
    with gmsh_model("tooth") as gmsh:
        try:
            names = _model(gmsh, body, cells, family == "hex")
            gmsh.model.mesh.generate(3)
            points, elements, facets = _harvest(gmsh, names, family)
        except Exception as error:  # gmsh raises bare Exceptions
            raise MeshingError(f"gmsh: {error}") from error
    points *= gear.normal_module
    if family == "hex":
        elements = elements[_HEX]
    mesh = ELEMENTS[kind].straight(points, elements, sort_t=False, validate=False)
    boundaries = match_facets(mesh.facets, facets, points.shape[1])
    for name, found in boundaries.items():
        nodes = np.unique(mesh.facets[:, found])
        points[:2, nodes] = snapped(body, name, points[:2, nodes])
    return replace(mesh, doflocs=points).with_boundaries(boundaries)


def _model(gmsh: Any, body: Body, cells: Cells, structured: bool) -> dict[str, list[int]]:
    """Build the extruded body; surfaces of each named boundary."""
    geo = gmsh.model.geo
    blocks = Blocks(geo, body, cells, structured)
    blocks.build()
    width = body.gear.face_width / body.gear.normal_module
    heights = layer_heights(cells.width)
    layers = {"numElements": [1] * cells.width, "heights": heights, "recombine": True} if structured else {}
    names: dict[str, list[int]] = {"front": list(blocks.surfaces), "back": []}
    for surface, curves in zip(blocks.surfaces, blocks.names, strict=True):
        out = geo.extrude([(2, surface)], 0.0, 0.0, width, **layers)
        names["back"].append(out[0][1])
        for name, (_, tag) in zip(curves, out[2:], strict=True):
            if name is not None:
                names.setdefault(name, []).append(tag)
    geo.synchronize()
    if not structured:
        # as fine as the structured mesh: the flank's cells over the tooth's height
        size = 1.5 * (body.gear.tip_radius - body.gear.form_radius) / body.gear.normal_module / cells.flank
        middle = 0.5 * (body.gear.tip_radius + body.gear.form_radius) / body.gear.normal_module
        number = gmsh.model.mesh.field.add("MathEval")
        far = f"0.3*Max(0,Sqrt(x^2+(y-{middle:.12g})^2)-2.5)"
        gmsh.model.mesh.field.setString(number, "F", f"{size:.6g}+{far}")
        gmsh.model.mesh.field.setAsBackgroundMesh(number)
        for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
            gmsh.option.setNumber(f"Mesh.{option}", 0)
    return names


def layer_heights(n: int) -> list[float]:
    """Ends of n layers across the face width (0, 1]: thinner towards both faces, where loads leave the flank."""
    x = np.linspace(0.0, 1.0, n + 1)[1:]
    return list(x - END_GRADING * np.sin(2 * np.pi * x) / (2 * np.pi))


#: 0 is uniform; the layers at the faces are 1 − END_GRADING of the mean.
END_GRADING = 0.5


def _harvest(gmsh: Any, names: dict[str, list[int]], family: str) -> tuple[NDArray, NDArray, dict[str, NDArray]]:
    """Points (3, n), elements (k, n), and boundary facets (m, n) by name, numbered from 0."""
    cell, n_cell, face, n_face = _GMSH_TYPE[family]
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    _, nodes = gmsh.model.mesh.getElementsByType(cell)
    number = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    used = np.unique(nodes)
    number[used] = np.arange(used.size)
    position = np.empty_like(number)
    position[tags] = np.arange(tags.size)
    points = coordinates.reshape(-1, 3)[position[used]].T.copy()
    facets = {
        name: np.concatenate(
            [number[gmsh.model.mesh.getElementsByType(face, tag)[1].reshape(-1, n_face)] for tag in surfaces]
        ).T
        for name, surfaces in names.items()
    }
    return points, np.ascontiguousarray(number[nodes.reshape(-1, n_cell)].T, dtype=np.int32), facets


def match_facets(facets: NDArray, named: dict[str, NDArray], n: int) -> dict[str, NDArray]:
    """Numbers of the mesh facets that are the given facets (by their two or three smallest vertices)."""

    def key(f: NDArray) -> NDArray:
        s = np.sort(f, axis=0).astype(np.int64)
        return s[0] * n + s[1] if len(s) == 2 else (s[0] * n + s[1]) * n + s[2]

    keys = key(facets)
    order = np.argsort(keys)
    return {name: order[np.searchsorted(keys, key(f), sorter=order)].astype(np.int32) for name, f in named.items()}


def snapped(body: Body, name: str, xy: NDArray, ends: tuple[NDArray, NDArray] | None = None) -> NDArray:
    """Points (2, n) moved onto the exact curve of a boundary."""
    R, theta = polar(body.gear.sign * xy)
    R *= body.gear.sign
    exact_R, exact = body.snap(name, R, theta, ends)
    if exact is theta and exact_R is R:
        return xy
    return np.array([exact_R * np.sin(exact), exact_R * np.cos(exact)])


def _quadratic(mesh: Any, body: Body) -> Any:
    """Quadratic geometry: middles of boundary edges on the exact curves, inner nodes blended between them."""
    curved = {skfem.MeshHex1: skfem.MeshHex2, skfem.MeshTet1: skfem.MeshTet2}[type(mesh)].from_mesh(mesh)
    points, dofs = curved.doflocs.copy(), curved.dofs
    middle = dofs.edge_dofs[0]
    fixed = []
    for name, facets in mesh.boundaries.items():
        if split_name(name)[0] in ("front", "back"):
            continue
        edges = np.unique(edges_of(mesh, facets))
        ends = mesh.edges[:, edges]
        radii = np.hypot(*mesh.p[:2, ends[0]]), np.hypot(*mesh.p[:2, ends[1]])
        points[:2, middle[edges]] = snapped(body, name, points[:2, middle[edges]], radii)
        fixed.append(edges)
    if mesh.elem.refdom.nnodes == 4:
        straighten_bad(points, mesh, mesh.edges, mesh.t2e, middle)
    else:
        _blend(points, mesh, middle, np.unique(np.concatenate(fixed)))
        vertex, edge = points[:, mesh.t], points[:, middle[mesh.t2e]]
        points[:, dofs.interior_dofs[0]] = 0.25 * (edge.sum(axis=1) - vertex.sum(axis=1))
        for local, corners in enumerate(mesh.elem.refdom.facets):
            around = [i for i, e in enumerate(mesh.elem.refdom.edges) if set(e) <= set(corners)]
            face = 0.5 * edge[:, around].sum(axis=1) - 0.25 * vertex[:, corners].sum(axis=1)
            points[:, dofs.facet_dofs[0][mesh.t2f[local]]] = face
    return replace(curved, doflocs=points).with_boundaries(mesh.boundaries)


def _blend(points: NDArray, mesh: Any, middle: NDArray, fixed: NDArray) -> None:
    """Let the middles of inner edges follow those of the boundary edges ``fixed``, linearly from row to row.

    An edge and the opposite ones in the quadrilaterals of its section are coupled; the harmonic displacement on that
    graph is the linear blend, and keeps the Jacobians of thin cells at a curved boundary positive.
    """
    flat = np.flatnonzero(np.ptp(mesh.p[2, mesh.facets], axis=0) < 1e-9 * np.ptp(mesh.p[2]))
    a, b, c, d = edges_of(mesh, flat)
    i, j = np.concatenate([a, b]), np.concatenate([c, d])
    n = mesh.edges.shape[1]
    graph = sp.csr_matrix((np.ones(2 * i.size), (np.concatenate([i, j]), np.concatenate([j, i]))), shape=(n, n))
    free = np.zeros(n, dtype=bool)
    free[i], free[j] = True, True
    free[fixed] = False
    moved = points[:2, middle] - mesh.p[:2, mesh.edges].mean(axis=1)
    degree = sp.diags_array(np.asarray(graph.sum(axis=1)).ravel()[free])
    inner, outer = graph[free][:, free], graph[free][:, ~free]
    laplacian = sp.csc_matrix(degree - inner)
    moved[:, free] = splu(laplacian, permc_spec="MMD_AT_PLUS_A").solve(outer @ moved[:, ~free].T).T
    points[:2, middle] = mesh.p[:2, mesh.edges].mean(axis=1) + moved


def straighten_bad(points: NDArray, mesh: Any, edges: NDArray, of_element: NDArray, middle: NDArray) -> None:
    """Straighten the edges of curved simplices with a negative Jacobian (in the cusp at the clamped root).

    ``edges`` (2, edge): vertices; ``of_element`` (k, element): edges; ``middle`` (edge,): their nodes in ``points``.
    """
    element = skfem.ElementTetP2() if mesh.dim() == 3 else skfem.ElementTriP2()
    inner = get_quadrature(mesh.elem.refdom, 6)[0]
    # nor where matrices are integrated
    X = np.hstack([inner, *(get_quadrature(mesh.elem.refdom, degree)[0] for degree in (4, 5))])
    shapes = np.stack([element.lbasis(X, i)[1] for i in range(len(element.doflocs))])
    for _ in range(5):
        positions = np.concatenate([points[:, mesh.t], points[:, middle[of_element]]], axis=1)
        det = np.linalg.det(np.einsum("iae,ajq->eqij", positions, shapes))
        det *= np.sign(det.mean(axis=1, keepdims=True))
        least = det[:, : inner.shape[1]].min(axis=1)
        bad = np.unique(of_element[:, (least <= 0.05 * np.abs(det).max(axis=1)) | (det.min(axis=1) <= 0)])
        if bad.size == 0:
            return
        points[:, middle[bad]] = points[:, edges[:, bad]].mean(axis=1)


def edges_of(mesh: Any, facets: NDArray) -> NDArray:
    """Edges of the given facets, (k, facet), in the order in which they run around the facet."""
    element = mesh.f2t[0, facets]
    local = np.argmax(mesh.t2f[:, element] == facets, axis=0)
    refdom = mesh.elem.refdom
    table = {frozenset(e): i for i, e in enumerate(refdom.edges)}
    around = [[table[frozenset(pair)] for pair in zip(f, [*f[1:], f[0]], strict=True)] for f in refdom.facets]
    return mesh.t2e[np.array(around)[local].T, element]


def screw(mesh: Any, body: Body) -> Any:
    """Turn every section clockwise by z tan β / r."""
    x, y, z = mesh.doflocs
    turn = z * math.tan(body.gear.beta) / body.gear.pitch_radius
    c, s = np.cos(turn), np.sin(turn)
    return replace(mesh, doflocs=np.array([c * x + s * y, c * y - s * x, z]))
