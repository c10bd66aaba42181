"""Stress at the root fillet: the largest principal stress on the loaded side, where a tooth breaks.

The stress is taken at the Gauss points of the facets of the fillet, from the gradients of the displacement itself. Over
a mesh cycle, and in three dimensions, see ``fem_reference.fillet_stress``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature

from fem_reference.elasticity import Lame, Space
from fem_reference.plane import PlaneSolution
from gearbench.geometry.material import Material


def surface_stress(
    space: Space, u: NDArray, material: Material, facets: NDArray, degree: int = 3
) -> tuple[NDArray, NDArray]:
    """Stress at the Gauss points of boundary facets, from nodal displacements u (dim·node, load) [mm].

    Returns
    -------
    Positions (point, dim) [mm] and stresses σ = λ tr(ε) 1 + 2μ ε, (point, load, dim, dim) [N/mm² for loads in N].
    """
    mesh, refdom = space.mesh, space.element.refdom
    element = mesh.f2t[0, facets]
    local = np.argmax(mesh.t2f[:, element] == facets, axis=0)
    nodal = u.reshape(space.n_nodes, space.dim, -1)
    t, _ = get_quadrature(refdom.brefdom, degree)
    positions, stresses = [], []
    for k in np.unique(local):
        corner = refdom.p[:, refdom.facets[k]]
        ends = (1, 3) if corner.shape[1] == 4 else tuple(range(1, corner.shape[1]))
        X = corner[:, :1] + np.stack([corner[:, e] - corner[:, 0] for e in ends], axis=1) @ t
        for e in element[local == k]:
            grad, _ = space.gradients(X, slice(e, e + 1))
            shapes, _ = space.geometry_shapes(X)
            positions.append(np.einsum("ai,aq->qi", space.geometry[e], shapes))
            stresses.append(cauchy_stress(np.einsum("qaj,ail->qlij", grad[0], nodal[space.nodes_of[:, e]]), material))
    return np.concatenate(positions), np.concatenate(stresses)


def cauchy_stress(gradient: NDArray, material: Material) -> NDArray:
    """σ = λ tr(ε) 1 + 2μ ε (…, d, d) [N/mm²] from ∂u_i/∂x_j (…, d, d); plane strain where d = 2."""
    lame, d = Lame.of(material.E, material.nu), gradient.shape[-1]
    epsilon = 0.5 * (gradient + np.swapaxes(gradient, -1, -2))
    trace = np.trace(epsilon, axis1=-2, axis2=-1)[..., None, None]
    return lame.lam * trace * np.eye(d) + 2 * lame.mu * epsilon


def plane_root_stress(solution: PlaneSolution, material: Material) -> float:
    """Largest principal stress on the loaded fillet for unit line load, plane strain [MPa per N/mm]."""
    space = solution.space
    _, stress = surface_stress(space, solution.u, material, space.mesh.boundaries["right_fillet"])
    return float(np.linalg.eigvalsh(stress[:, 0]).max())
