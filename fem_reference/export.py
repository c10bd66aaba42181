"""The loaded tooth for ParaView: a tooth under the line load of a simulation, with displacement and stress."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fem_reference.axis import FaceFunctions
from fem_reference.circulant import tensor_stiffness
from fem_reference.section import Body
from fem_reference.sector import Grain, Section, elasticity, lagrange, lobatto, strains
from fem_reference.solver import solve
from gearbench.compliance.bases import gauss
from gearbench.errors import InputError
from gearbench.geometry.material import Material
from gearbench.geometry.pair import Pair

if TYPE_CHECKING:
    import xarray as xr

#: Half width of the loaded strip over the height of the flank.
HALF_WIDTH = 0.125
#: Points of Gauss' rule along the height of each quadrilateral at the flank and across each layer, for the load.
POINTS = 24


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
        """Force per dR dy at the points [N/mm²]: parabolic across the strip, uniform along each segment."""
        # the line is as long as its segments and centred on their mean; Gauss weights laid end to end part the nodes
        ends = np.cumsum(np.append(0.0, self.width)) + np.average(self.y, weights=self.width) - self.width.sum() / 2
        room = 1e-9 * self.width.sum()
        inside = (y >= ends[0] - room) & (y <= ends[-1] + room)
        segment = np.clip(np.searchsorted(ends, y) - 1, 0, len(self.y) - 1)
        xi = (R - np.interp(y, self.y, self.radius)) / self.half_width
        across = 0.75 / self.half_width * np.maximum(1 - xi**2, 0.0)
        return np.where(inside, self.force[segment] / self.width[segment] * across, 0.0)


@dataclass(frozen=True, kw_only=True)
class LoadedTooth:
    """A tooth alone under a load on its right flank.

    Parameters
    ----------
    section, axis
        Its finite elements: of the section, and along the axis.
    material
        Its material.
    u
        Displacements u_R, u_θ, u_y of the nodes of the section (node, 3, function of the axis) [mm].
    """

    section: Section
    axis: FaceFunctions
    material: Material
    u: NDArray

    @cached_property
    def stations(self) -> NDArray:
        """Ends and middles of the layers [mm]."""
        return np.interp(
            np.arange(2 * len(self.axis.counts) + 1), 2 * np.arange(len(self.axis.breaks)), self.axis.breaks
        )

    @cached_property
    def _angle(self) -> NDArray:
        """Angle θ of each node at each station [rad]."""
        gear = self.section.body.gear
        return self.section.positions[:, 1:] + self.stations * math.tan(gear.beta) / gear.pitch_radius

    @cached_property
    def points(self) -> NDArray:
        """Nodes at the stations, (node, station, 3) [mm]; the y axis is the centre line of the tooth at the front."""
        R, theta = self.section.positions[:, :1], self._angle
        return np.stack([R * np.sin(theta), R * np.cos(theta), np.broadcast_to(self.stations, theta.shape)], axis=-1)

    @cached_property
    def displacement(self) -> NDArray:
        """Displacement at the points, (node, station, 3) [mm]."""
        radial, along, y = np.moveaxis(self.u @ self.axis.values(self.stations)[0].T, 1, 0)
        c, s = np.cos(self._angle), np.sin(self._angle)
        return np.stack([s * radial + c * along, c * radial - s * along, y], axis=-1)

    @cached_property
    def von_mises(self) -> NDArray:
        """Von Mises stress at the points, (node, station) [N/mm²]: the mean of the elements around a point.

        Each element gives the stress at as many points of Gauss' rule as it has nodes, where it is most accurate.
        """
        section, axis, n = self.section, self.axis, self.section.grain.degree
        x = gauss(n + 1)[0]
        s, t = (a.ravel() for a in np.meshgrid(x, x))
        (vs, ds), (vt, dt) = lagrange(n, s), lagrange(n, t)
        shapes = tuple(np.einsum("pi,pj->pji", *f).reshape(len(s), -1) for f in ((vs, vt), (ds, vt), (vs, dt)))
        y = np.concatenate([low + (high - low) * gauss(3)[0] for low, high in pairwise(axis.breaks)])
        values, slopes = (each.T for each in axis.values(y))
        station = np.add.outer(2 * np.arange(len(axis.counts)), np.arange(3)).ravel()
        total, count = np.zeros((*self._angle.shape, 6)), np.zeros((*self._angle.shape, 1))
        for at, nodes in zip(section.maps, section.nodes, strict=True):
            R, _, *sides = at(s, t)
            _, *B = strains(R, sides, shapes, section.body.gear)
            u = self.u[nodes].reshape(-1, axis.count)
            strain = sum(b.reshape(6 * len(s), -1) @ (u @ h) for b, h in zip(B, (values, slopes), strict=True))
            stress = np.einsum("ij,pjy->pyi", elasticity(self.material), np.reshape(strain, (len(s), 6, -1)))
            where = nodes[:, None], station[None]
            np.add.at(total, where, stress)
            np.add.at(count, where, 1.0)
        rr, tt, yy, *shear = np.moveaxis(total / count, -1, 0)
        return np.sqrt(0.5 * ((rr - tt) ** 2 + (tt - yy) ** 2 + (yy - rr) ** 2) + 3 * np.sum(np.square(shear), axis=0))

    def write(self, path: str | Path) -> None:
        """Write displacement and stress at the points as VTU."""
        import meshio

        n, count = self.section.grain.degree, len(self.stations)
        corner = np.add.outer((n + 1) * np.arange(n), np.arange(n)).ravel()
        square = self.section.nodes[:, np.add.outer(corner, [0, 1, n + 2, n + 1])].reshape(-1, 1, 4)
        layer = square * count + np.arange(count - 1)[:, None]
        cells = np.concatenate([layer, layer + 1], axis=-1).reshape(-1, 8)
        data = {"displacement": self.displacement.reshape(-1, 3), "von_mises": self.von_mises.ravel()}
        meshio.Mesh(self.points.reshape(-1, 3), [("hexahedron", cells)], point_data=data).write(path)


def write_loaded_tooth(
    pair: Pair,
    dataset: xr.Dataset,
    path: str | Path,
    *,
    gear: int = 0,
    position: int | None = None,
    degree: int = 4,
    layers: int = 10,
) -> LoadedTooth:
    """Write one tooth under its load as VTU, with ``displacement`` [mm] and ``von_mises`` [N/mm²] at the nodes.

    The tooth is clamped at its root. Its load is that of the most loaded pair of teeth at one position of the mesh
    cycle, spread over a strip a quarter of the flank high.

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
    degree, layers
        Fineness of the mesh: polynomial degree in the section, and number of layers across the face width.

    Raises
    ------
    InputError
        If the position does not exist.
    MeshingError
        If flanks or fillets of the section cross.
    """
    tooth = loaded_tooth(pair, line_load(pair, dataset, gear, position), gear, degree, layers)
    tooth.write(path)
    return tooth


def loaded_tooth(pair: Pair, line: LineLoad, gear: int, degree: int, layers: int) -> LoadedTooth:
    """A tooth of a gear under a load on its flank."""
    body, material = Body(gear=pair.gears[gear]), pair.materials[gear]
    section = Section(body=body, grain=Grain(degree=degree))
    breaks = tuple(np.linspace(0.0, body.gear.face_width, layers + 1))
    axis = FaceFunctions(breaks=breaks, counts=(3,) * layers)
    free = section.free
    stiffness = tensor_stiffness(section, axis, np.ones((np.count_nonzero(free), axis.count), dtype=bool), material)
    u = np.zeros((len(free), axis.count))
    u[free] = solve(stiffness, nodal_load(section, axis, line)[free].reshape(-1, 1)).x.reshape(-1, axis.count)
    return LoadedTooth(section=section, axis=axis, material=material, u=u.reshape(-1, 3, axis.count))


def nodal_load(section: Section, axis: FaceFunctions, line: LineLoad) -> NDArray:
    """Forces (3·node, function of the axis) [N] of a load on the right flank, scaled to the force of the line.

    The edges of the flank cut the strip.
    """
    t, weight = gauss(POINTS)
    y = np.concatenate([low + (high - low) * t for low, high in pairwise(axis.breaks)])
    across = np.concatenate([(high - low) * weight for low, high in pairwise(axis.breaks)])
    values, functions = lagrange(section.grain.degree, t)[0], axis.values(y)[0]
    out, total, size = np.zeros((len(section.positions), 3, axis.count)), 0.0, len(lobatto(section.grain.degree))
    for at, nodes in zip(section.maps, section.nodes[: len(section.grain.flank) - 1], strict=False):
        R, _, _, height, *_ = at(np.ones_like(t), t)
        force = line(R[:, None], y) * np.outer(height * weight, across)
        total += force.sum()
        amplitudes = np.einsum("pn,pc,pa->nca", values, section.normal(R), force @ functions)
        out[nodes.reshape(size, size)[:, -1]] += amplitudes
    return (line.force.sum() / total * out).reshape(-1, axis.count)


def line_load(pair: Pair, dataset: xr.Dataset, gear: int, position: int | None) -> LineLoad:
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
    half = HALF_WIDTH * (body.tip_radius - body.form_radius)
    return LineLoad(
        radius=radius[order], y=across[order], force=force[position, tooth][order], width=width[order], half_width=half
    )
