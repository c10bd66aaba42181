"""Gears with rim, web and hub: finite elements against one plain mesh of hexahedra, and teeth on three rings."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from numpy.polynomial import legendre
from numpy.testing import assert_allclose

from fem_reference.axis import Axis
from fem_reference.elasticity import Lame, Space, free_dofs, surface_points
from fem_reference.flank import Flank
from fem_reference.refinement import Level, blocks_of, refined_compliance
from fem_reference.section import Body
from fem_reference.sector import Section
from fem_reference.solver import solve
from gearbench.compliance.bases import gauss
from gearbench.compliance.flank import flank_polynomials
from gearbench.compliance.gear_body import ToothedRing
from gearbench.compliance.local import half_space_compression
from gearbench.compliance.solid_tooth import SolidTooth
from gearbench.geometry.material import Material
from gearbench.geometry.web import make_web
from tests.gears import standard_gear

ORDER = (3, 3)


def webbed(teeth: int, width: float, helix: float, offset: float, hub: float | None = 0.55) -> Body:
    """Rim of two modules, web of a third of the face, bore of 0.35 root radii."""
    gear = standard_gear(teeth, width, helix=helix)
    r_f = gear.root_radius
    web = make_web(gear, 0.7 * r_f, 2.0, width / 3, offset, None if hub is None else 2 * hub * r_f)
    return Body(gear=gear, bore_radius=0.35 * r_f, web=web, teeth=5)


# -- one plain mesh of the whole gear -----------------------------------------------------------------------------------
def plain_mesh(level: Level, fine: int, along: Sequence[int]) -> skfem.MeshHex2:
    """All sectors of hexahedra with curved edges: each quadrilateral of a section fine² times, without what is void."""
    body, section, web = level.body, level.section, level.body.web
    assert web is not None
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
    J = np.stack([nodes[:, a] - nodes[:, 0] for a in (np.flatnonzero((where == w).all(1))[0] for w in 2 * np.eye(3))], 1)
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


def plain_blocks(level: Level, steel: Material, fine: int, along: Sequence[int]) -> np.ndarray:
    """C_d of teeth −1, 0, 1 of the surface, (3, p·q, p·q), by hexahedra of 20 nodes."""
    body = level.body
    mesh = plain_mesh(level, fine, along)
    space = Space(mesh, "hex20")
    gear = body.gear
    free = np.hypot(*space.node_positions[:, :2].T) > body.bore_radius * (1 + 1e-6)
    loads, facets = [], mesh.boundary_facets()
    x, y, z = mesh.p[:, mesh.facets[:, facets]]
    R = np.hypot(x, y)
    for d in (-1, 0, 1):
        turn = 2 * np.pi * d / gear.teeth + z * np.tan(gear.beta) / gear.pitch_radius
        off = (np.arctan2(x, y) - turn - gear.involute_half_angle(np.maximum(R, gear.form_radius)) + np.pi) % (2 * np.pi)
        corners = (np.abs(off - np.pi) < 1e-6) & (R > gear.form_radius - 1e-6)
        on = facets[corners.all(axis=0)]
        points = surface_points(space, on, degree=15)
        flank = Flank(gear, d)
        height, across = flank.coordinates(points.position)
        density = flank_polynomials(gear, ORDER, height, across) / flank.stretch(height)[:, None]
        loads.append(points.load(flank.normal(height, across)[:, :, None] * density[:, None, :], space))
    dofs = free_dofs(free, 3)
    u = solve(space.stiffness(Lame.of(steel.E, steel.nu), free), loads[1][dofs]).x
    found = np.array([load[dofs].T @ u for load in loads])
    found[1] -= half_space_compression(gear, steel.E, steel.nu, ORDER, points=24)
    return found
