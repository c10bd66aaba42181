"""Loads on the flank of a meshed tooth: displacements of all loads from one factorisation."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_reference.elasticity import Lame, free_dofs, surface_points
from fem_reference.flank import Flank
from fem_reference.section import on_tooth
from fem_reference.solver import solve
from fem_reference.tooth_mesh import ToothMesh
from gearbench.geometry.material import Material

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


def solve_flank(tooth: ToothMesh, material: Material, loads: Loads) -> FlankSolution:
    """Solve for all ``loads`` on the right flank of tooth 0 with one factorisation."""
    start = time.perf_counter()
    space = tooth.space
    free = np.ones(space.n_nodes, dtype=bool)
    for name in tooth.body.held:
        free[space.boundary_nodes(name)] = False
    stiffness = space.stiffness(Lame.of(material.E, material.nu), free)
    dofs = free_dofs(free, 3)
    force = flank_load(tooth, loads)[dofs]
    solution = solve(stiffness, force)
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
