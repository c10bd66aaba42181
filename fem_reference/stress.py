"""Stress at the root fillet: the largest principal stress on the loaded side, where a tooth breaks.

The stress is taken at the Gauss points of the facets of the fillet, from the gradients of the displacement itself.
It is linear in the loads, so any load that is a sum of solved ones needs no further solution.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature

from fem_reference.compliance import FlankSolution, Loads
from fem_reference.elasticity import Lame, Space
from fem_reference.plane import PlaneSolution
from gearbench.geometry.action import ContactLines
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
    return _largest(stress[:, 0])


def root_stress(
    solution: FlankSolution,
    basis: Loads,
    material: Material,
    lines: ContactLines,
    force: NDArray,
    *,
    driven: bool = False,
) -> NDArray:
    """Largest principal stress on the loaded fillet under the load of each contact line, (position, pair) [MPa].

    Only the load on the tooth itself is seen, not that on its neighbours.

    Parameters
    ----------
    solution
        Solution under the polynomial loads ``basis`` (``fem_reference.compliance.solve_flank``).
    lines, force
        Contact lines of the pair and the normal force on their segments [N], (position, pair, segment). They act
        through the polynomials of the basis, Σ P_i φ(R_i, y_i), which keeps force and moment.
    driven
        Whether the gear is the driven one of the pair; contact then climbs towards the tip the other way along y.
    """
    space = solution.tooth.space
    _, stress = surface_stress(space, solution.u, material, space.mesh.boundaries["right_fillet"])
    R, y = lines.radii[int(driven)], solution.tooth.body.gear.face_width - lines.y if driven else lines.y
    weight = np.einsum("pks,pksa->pka", force, basis(R, y))
    return np.array([[_largest(np.tensordot(a, stress, (0, 1))) for a in pairs] for pairs in weight])


def _largest(stress: NDArray) -> float:
    """Largest principal stress of (point, d, d)."""
    return float(np.linalg.eigvalsh(stress).max())
