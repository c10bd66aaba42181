"""Points on the boundary of a mesh, with interpolation from its nodes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature

from fem_reference.elasticity import Space


@dataclass(frozen=True)
class Points:
    """Points in the body with interpolation matrix.

    Parameters
    ----------
    position
        (point, dim) [mm].
    interpolation
        Sparse (point, node): value at the points = interpolation · nodal values.
    weight
        Quadrature weight (area or length) of each point; ones for bare points.
    """

    position: NDArray
    interpolation: sp.csr_matrix
    weight: NDArray

    def load(self, traction: NDArray, space: Space) -> NDArray:
        """Consistent nodal forces (dim·node, k) of tractions (point, dim, k) [N/mm² if the weights are areas]."""
        weighted = traction * self.weight[:, None, None]
        n, dim, k = weighted.shape
        return (self.interpolation.T @ weighted.reshape(n, dim * k)).reshape(space.n_nodes * dim, k)

    def displacement(self, u: NDArray, direction: NDArray) -> NDArray:
        """Displacement (point, k) along ``direction`` (point, dim) for nodal displacements u (dim·node, k)."""
        dim, k = direction.shape[1], u.shape[1]
        values = (self.interpolation @ u.reshape(-1, dim * k)).reshape(-1, dim, k)
        return np.einsum("pi,pik->pk", direction, values)


def surface_points(space: Space, facets: NDArray, degree: int = 7) -> Points:
    """Quadrature points of the given boundary facets, exact to polynomial ``degree`` in the reference facet."""
    mesh, refdom = space.mesh, space.element.refdom
    element = mesh.f2t[0, facets]
    local = np.argmax(mesh.t2f[:, element] == facets, axis=0)
    found = [_facet_points(space, element[local == k], refdom.facets[k], degree) for k in np.unique(local)]
    position, values, nodes, weight = (np.concatenate(parts) for parts in zip(*found, strict=True))
    row = np.broadcast_to(np.arange(len(position))[:, None], values.shape)
    matrix = sp.csr_matrix((values.ravel(), (row.ravel(), nodes.ravel())), shape=(len(position), space.n_nodes))
    matrix.eliminate_zeros()
    return Points(position, matrix, weight)


def _facet_points(space: Space, element: NDArray, corners: list[int], degree: int) -> tuple:
    """Positions, shape functions, nodes (point, local node) and weights on one local facet of some elements."""
    refdom = space.element.refdom
    at = refdom.p[:, corners]
    # the facet's reference cell has its first corner at one end, and its neighbours along the axes
    ends = (1, 3) if len(corners) == 4 else tuple(range(1, len(corners)))
    axes = np.stack([at[:, e] - at[:, 0] for e in ends], axis=1)
    t, w = get_quadrature(refdom.brefdom, degree)
    X = at[:, :1] + axes @ t
    values, _ = space.reference_gradients(X)
    shapes, grads = space.geometry_shapes(X)
    geometry = space.geometry[element]
    position = np.einsum("eai,aq->eqi", geometry, shapes)
    tangents = np.einsum("eai,qaj,jk->eqik", geometry, grads, axes)
    if space.dim == 3:
        area = np.linalg.norm(np.cross(tangents[..., 0], tangents[..., 1]), axis=-1)
    else:
        area = np.linalg.norm(tangents[..., 0], axis=-1)
    n = len(element) * len(w)
    shape = (len(element), len(w), len(values))
    nodes = np.broadcast_to(space.nodes_of[:, element].T[:, None, :], shape).reshape(n, -1)
    spread = np.broadcast_to(values.T, shape).reshape(n, -1)
    return position.reshape(n, -1), spread, nodes, (area * w).ravel()
