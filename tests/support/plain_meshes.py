"""A plain mesh of a whole gear in curved hexahedra of 20 nodes, to check the condensed sector."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import skfem

from fem_reference.elasticity import Lame, Space, free_dofs
from fem_reference.flank import Flank
from fem_reference.section import Body
from fem_reference.sector import Grain, Section
from fem_reference.solver import solve
from gearbench.compliance.flank import flank_polynomials
from gearbench.compliance.local import half_space_compression
from gearbench.geometry.material import Material
from tests.support.node_positions import node_positions
from tests.support.surface_points import surface_points


def plain_mesh(section: Section, fine: int, along: Sequence[int]) -> skfem.MeshHex2:
    """All sectors of hexahedra with curved edges: each quadrilateral of a section fine² times, without what is void."""
    body = section.body
    z, x = body.gear.teeth, np.linspace(0, 1, 2 * fine + 1)
    breaks = body.axis_breaks
    y = np.concatenate([np.linspace(*ends, 2 * k + 1)[:-1] for ends, k in zip(pairwise(breaks), along, strict=True)])
    y, first = np.append(y, breaks[-1]), np.cumsum([0, *along])
    s, t = np.meshgrid(x, x, indexing="ij")
    turn = np.tan(body.gear.beta) / body.gear.pitch_radius
    corners = []
    for at, narrow in zip(section.maps, section.of_web, strict=True):
        R, theta = at(s.ravel(), t.ravel())[:2]
        cells = range(first[body.web_piece], first[body.web_piece + 1]) if narrow else range(first[-1])
        for k in range(z):
            angle = theta[:, None] + 2 * np.pi * k / z + turn * y
            points = np.stack([R[:, None] * np.sin(angle), R[:, None] * np.cos(angle), y + 0 * angle], -1)
            points = points.reshape(*s.shape, len(y), 3)
            corners += [
                points[2 * i : 2 * i + 3, 2 * j : 2 * j + 3, 2 * c : 2 * c + 3]
                for i in range(fine)
                for j in range(fine)
                for c in cells
            ]
    return hexahedra(np.array(corners))


def hexahedra(points: np.ndarray) -> skfem.MeshHex2:
    """Mesh of (cell, 3, 3, 3, xyz) nodes; those of the same position are one."""
    element = skfem.MeshHex2().elem()
    where = np.rint(2 * np.asarray(element.doflocs)).astype(int)
    nodes = points[:, where[:, 0], where[:, 1], where[:, 2]]
    # cells whose corners run the other way round are mirrored
    J = np.stack(
        [nodes[:, a] - nodes[:, 0] for a in (np.flatnonzero((where == w).all(1))[0] for w in 2 * np.eye(3))], 1
    )
    left = np.linalg.det(J) < 0
    flipped = points[left][:, ::-1]
    nodes[left] = flipped[:, where[:, 0], where[:, 1], where[:, 2]]
    key = np.round(nodes.reshape(-1, 3) / 1e-6).astype(np.int64)
    _, index, number = np.unique(key, axis=0, return_index=True, return_inverse=True)
    number = number.reshape(len(nodes), -1)
    corner = number[:, :8]
    some, compact = np.unique(corner, return_inverse=True)
    straight = skfem.MeshHex1(nodes.reshape(-1, 3)[index][some].T, compact.reshape(corner.shape).T)
    mesh = skfem.MeshHex2.from_mesh(straight)
    doflocs = mesh.doflocs.copy()
    doflocs[:, mesh.dofs.element_dofs.T] = nodes.transpose(2, 0, 1)
    return skfem.MeshHex2(doflocs, mesh.t)


def plain_blocks(body: Body, material: Material, order: tuple[int, int], fine: int, along: Sequence[int]) -> np.ndarray:
    """C_d of teeth −1, 0, 1 of the surface, (3, p·q, p·q), by hexahedra of 20 nodes."""
    mesh = plain_mesh(Section(body=body, grain=Grain(degree=3)), fine, along)
    space = Space(mesh, "hex20")
    gear = body.gear
    assert body.bore_radius is not None
    free = np.hypot(*node_positions(space)[:, :2].T) > body.bore_radius * (1 + 1e-6)
    loads, facets = [], mesh.boundary_facets()
    x, y, z = mesh.p[:, mesh.facets[:, facets]]
    R = np.hypot(x, y)
    for d in (-1, 0, 1):
        turn = 2 * np.pi * d / gear.teeth + z * np.tan(gear.beta) / gear.pitch_radius
        theta = turn + gear.involute_half_angle(np.maximum(R, gear.form_radius))
        off = np.abs((np.arctan2(x, y) - theta + np.pi) % (2 * np.pi) - np.pi)
        corners = (off < 1e-6) & (gear.form_radius - 1e-6 < R)
        on = facets[corners.all(axis=0)]
        points = surface_points(space, on, degree=15)
        flank = Flank(gear, d)
        height, across = flank.coordinates(points.position)
        density = flank_polynomials(gear, order, height, across) / flank.stretch(height)[:, None]
        loads.append(points.load(flank.normal(height, across)[:, :, None] * density[:, None, :], space))
    dofs = free_dofs(free, 3)
    u = solve(space.stiffness(Lame.of(material.E, material.nu), free), loads[1][dofs]).x
    found = np.array([load[dofs].T @ u for load in loads])
    found[1] -= half_space_compression(gear, material.E, material.nu, order, points=24)
    return found
