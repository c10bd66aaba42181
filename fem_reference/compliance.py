"""Compliance of a tooth flank from one factorisation: all loads at once, displacements of every tooth.

Compliance c(P, Q) [mm/N] is the displacement along the inward normal at P due to a unit force along the inward normal
at Q. The contact law contains the compression between flank and centre line, see
``gearbench.compliance.local``.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from fem_reference.elasticity import Lame, free_dofs, surface_points
from fem_reference.flank import Flank
from fem_reference.section import on_tooth
from fem_reference.solver import solve
from fem_reference.tooth_mesh import ToothMesh
from gearbench.compliance.flank import FlankCompliance, flank_polynomials
from gearbench.compliance.local import half_space_compression
from gearbench.geometry.material import Material

#: Neighbours on each side whose displacements are stored.
NEIGHBOURS = 3

#: Force densities per dR dy on the flank: (R, y) -> (…, load).
Loads = Callable[[NDArray, NDArray], NDArray]


@dataclass(frozen=True, kw_only=True)
class FlankSolution:
    """Displacements of the body under loads on the flank of tooth 0.

    Parameters
    ----------
    tooth
        The mesh.
    u
        Nodal displacements (3·node, load) [mm], for loads of the total force of the densities.
    solver, seconds
        Solver used; time of assembly and solution.
    """

    tooth: ToothMesh
    u: NDArray
    solver: str
    seconds: float

    def surface(self, weights: Loads, d: int = 0) -> NDArray:
        """Normal displacement of the flank of tooth d, weighted with ``weights`` dR dy: (weight, load)."""
        force = flank_load(self.tooth, weights, d)
        touched = np.flatnonzero(force.any(axis=1))
        return force[touched].T @ self.u[touched]


def solve_flank(tooth: ToothMesh, material: Material, loads: Loads, solver: str | None = None) -> FlankSolution:
    """Solve for all ``loads`` on the right flank of tooth 0 with one factorisation."""
    start = time.perf_counter()
    space = tooth.space
    free = np.ones(space.n_nodes, dtype=bool)
    for name in tooth.body.held:
        free[space.boundary_nodes(name)] = False
    stiffness = space.stiffness(Lame.of(material.E, material.nu), free)
    dofs = free_dofs(free, 3)
    force = flank_load(tooth, loads)[dofs]
    solution = solve(stiffness, force, solver)
    u = np.zeros((3 * space.n_nodes, force.shape[1]))
    u[dofs] = solution.x
    return FlankSolution(tooth=tooth, u=u, solver=solution.solver, seconds=time.perf_counter() - start)


def flank_load(tooth: ToothMesh, loads: Loads, d: int = 0) -> NDArray:
    """Consistent nodal forces (3·node, load) of densities per dR dy on the right flank of tooth d."""
    space, flank = tooth.space, Flank(tooth.body.gear, d)
    points = surface_points(space, tooth.mesh.boundaries[on_tooth("right_flank", d)], degree=15)
    R, y = flank.coordinates(points.position)
    R = np.maximum(R, tooth.body.gear.base_radius)
    density = loads(R, y) / flank.stretch(R)[:, None]
    return points.load(flank.normal(R, y)[:, :, None] * density[:, None, :], space)


def flank_compliance(tooth: ToothMesh, material: Material, order: tuple[int, int]) -> FlankCompliance:
    """Compliance of a meshed body, projected onto polynomial loads of the given order, without the local part.

    It is the displacement of the flank surface minus the compression of the half-space down to the centre line
    (``gearbench.compliance.local``), and symmetric.
    """
    gear = tooth.body.gear
    basis = partial(flank_polynomials, gear, order)
    solution = solve_flank(tooth, material, basis)
    n = min(tooth.body.teeth // 2, NEIGHBOURS)
    raw = np.array([solution.surface(basis, d) for d in range(-n, n + 1)])
    raw[n] -= half_space_compression(gear, material.E, material.nu, order, points=24)
    blocks = 0.5 * (raw + raw[::-1].transpose(0, 2, 1))
    attrs = {
        "solver": solution.solver,
        "unknowns": 3 * tooth.space.n_nodes,
        "element": tooth.kind,
        "mesh_seconds": tooth.seconds,
        "solve_seconds": solution.seconds,
    }
    return FlankCompliance(gear=gear, order=order, blocks=blocks, attrs=attrs)
