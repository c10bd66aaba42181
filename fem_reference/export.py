"""The loaded tooth for ParaView: a tooth under the line load of a simulation, with displacement and stress."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fem_reference.compliance import FlankSolution, solve_flank
from fem_reference.elasticity import Lame, surface_points
from fem_reference.flank import Flank
from fem_reference.tooth_mesh import Body, Cells, ToothMesh, tooth_mesh
from gearbench.errors import InputError
from gearbench.geometry.material import Material
from gearbench.geometry.pair import Pair

if TYPE_CHECKING:
    import xarray as xr

#: Default mesh of the tooth; takes about a second.
CELLS = Cells(thickness=4, flank=8, fillet=5, width=10)


@dataclass(frozen=True, kw_only=True)
class LineLoad:
    """Load of one contact line, spread over a narrow strip of the flank.

    Parameters
    ----------
    radius, y
        Segment centres on the flank of the mesh [mm], (segment,), y increasing.
    force, width
        Normal force of each segment [N] and its extent in y [mm], (segment,).
    half_width
        Half width of the strip in R [mm].
    """

    radius: NDArray
    y: NDArray
    force: NDArray
    width: NDArray
    half_width: float

    def __call__(self, R: NDArray, y: NDArray) -> NDArray:
        """Force per dR dy at the points, (…, 1) [N/mm²]: parabolic across the strip, uniform along each segment."""
        # the line is as long as its segments and centred on their mean; Gauss weights laid end to end part the nodes
        ends = np.cumsum(np.append(0.0, self.width)) + np.average(self.y, weights=self.width) - self.width.sum() / 2
        room = 1e-9 * self.width.sum()
        inside = (y >= ends[0] - room) & (y <= ends[-1] + room)
        segment = np.clip(np.searchsorted(ends, y) - 1, 0, len(self.y) - 1)
        xi = (R - np.interp(y, self.y, self.radius)) / self.half_width
        across = 0.75 / self.half_width * np.maximum(1 - xi**2, 0.0)
        return np.where(inside, self.force[segment] / self.width[segment] * across, 0.0)[..., None]


def write_loaded_tooth(
    pair: Pair,
    dataset: xr.Dataset,
    path: str | Path,
    *,
    gear: int = 0,
    position: int | None = None,
    cells: Cells = CELLS,
) -> FlankSolution:
    """Write one tooth under its load as VTU, with ``displacement`` [mm] and ``von_mises`` [N/mm²] at the nodes.

    The tooth is clamped at its root. Its load is that of the most loaded pair of teeth at one position of the mesh
    cycle, spread over a strip two cells wide. The stress below the contact line depends on the mesh, the stress at
    the root hardly.

    Parameters
    ----------
    pair, dataset
        The gear pair and its result, from ``gearbench.simulate``.
    path
        File to write, ``.vtu``.
    gear
        0 the pinion, 1 the wheel.
    position
        Number of the position; by default the one with the largest force on a tooth.
    cells
        Fineness of the mesh.

    Raises
    ------
    InputError
        If the position does not exist.
    """
    tooth = tooth_mesh(Body(gear=pair.gears[gear]), cells, "hex27")
    line = line_load(pair, dataset, gear, position, cells)
    scale = float(line.force.sum()) / total_force(tooth, line)  # the edges of the flank cut the strip
    material = pair.materials[gear]
    solution = solve_flank(tooth, material, lambda R, y: scale * line(R, y))
    displacement = solution.u.reshape(-1, 3)
    tooth.write(path, displacement=displacement, von_mises=von_mises(tooth, material, displacement))
    return solution


def line_load(pair: Pair, dataset: xr.Dataset, gear: int, position: int | None, cells: Cells) -> LineLoad:
    """Load of the most loaded pair of teeth at a position, on the flank as it is meshed.

    Raises
    ------
    InputError
        If the position does not exist.
    """
    force = (dataset["line_load"] * dataset["segment_length"]).values
    if position is None:
        position = int(force.sum(axis=2).max(axis=1).argmax())
    if not 0 <= position < len(force):
        raise InputError("position", position, f"must be 0 to {len(force) - 1}")
    tooth = int(force[position].sum(axis=1).argmax())
    u, y = (dataset[name].values[position, tooth] for name in ("path_position", "face_position"))
    body = pair.gears[gear]
    radius = np.hypot(body.base_radius, pair.meshing.along_path(gear, u))
    across = y + pair.overhangs[gear][0]
    if gear == 1:
        across = body.face_width - across  # the driving gear's flank is meshed
    order = np.argsort(across)
    width = dataset["segment_length"].values[position, tooth] * np.cos(pair.meshing.beta_b)
    half = (body.tip_radius - body.form_radius) / cells.flank
    return LineLoad(
        radius=radius[order], y=across[order], force=force[position, tooth][order], width=width[order], half_width=half
    )


def total_force(tooth: ToothMesh, line: LineLoad) -> float:
    """Integral of a load over the right flank of the mesh [N]."""
    flank = Flank(tooth.body.gear)
    points = surface_points(tooth.space, tooth.mesh.boundaries["right_flank"], degree=15)
    R, y = flank.coordinates(points.position)
    return float(points.weight @ (line(R, y)[:, 0] / flank.stretch(R)))


def von_mises(tooth: ToothMesh, material: Material, displacement: NDArray) -> NDArray:
    """Von Mises stress at the nodes, (node,) [N/mm²]: the mean of the values of the elements around a node.

    Each element gives the stress at its points of Gauss' rule of second order, where it is most accurate.
    """
    space = tooth.space
    corners = np.asarray(space.element.doflocs, dtype=float).T
    grad, _ = space.gradients(0.5 + (corners - 0.5) / np.sqrt(3.0))
    stress = cauchy_stress(np.einsum("eqaj,aei->eqij", grad, displacement[space.nodes_of]), material)
    total = np.zeros((space.n_nodes, 3, 3))
    np.add.at(total, space.nodes_of.T, stress)
    mean = total / np.bincount(space.nodes_of.ravel(), minlength=space.n_nodes)[:, None, None]
    deviator = mean - np.trace(mean, axis1=-2, axis2=-1)[:, None, None] / 3 * np.eye(3)
    return np.sqrt(1.5 * np.einsum("nij,nij->n", deviator, deviator))


def cauchy_stress(gradient: NDArray, material: Material) -> NDArray:
    """σ = λ tr(ε) 1 + 2μ ε (…, d, d) [N/mm²] from ∂u_i/∂x_j (…, d, d); plane strain where d = 2."""
    lame, d = Lame.of(material.E, material.nu), gradient.shape[-1]
    epsilon = 0.5 * (gradient + np.swapaxes(gradient, -1, -2))
    trace = np.trace(epsilon, axis1=-2, axis2=-1)[..., None, None]
    return lame.lam * trace * np.eye(d) + 2 * lame.mu * epsilon
