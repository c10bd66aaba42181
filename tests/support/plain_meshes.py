"""A family of plain meshes of 20-node hexahedra, to check the condensed sector.

Mesh m of the family has m cells across the tooth and cells in proportion everywhere else, with the same grading.
Compliances of the flank converge with order 2.4–2.8 (measured): the traction jumps at the form circle, which limits
the rate. Richardson's value assumes 2.6. The error bar is
half the difference of the two last Richardson values (their errors fall by a factor of three or more from mesh to
mesh) or, of two meshes, the difference of Richardson's value and the finer mesh; both have bounded the error against
much finer meshes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from fem_reference.blocks import Cells
from fem_reference.compliance import solve_flank
from fem_reference.section import Body
from fem_reference.tooth_mesh import ToothMesh, tooth_mesh
from gearbench.compliance.flank import FlankCompliance, flank_polynomials
from gearbench.compliance.local import half_space_compression
from gearbench.geometry.material import Material

#: Order of convergence that Richardson's value assumes.
RATE = 2.6
#: Largest number of unknowns of meshes of the family (about 1.5 GB).
MOST_UNKNOWNS = 130_000
#: Neighbours on each side whose displacements are stored.
NEIGHBOURS = 3


def mesh_cells(body: Body, m: int) -> Cells:
    """Cells of mesh m of the family."""
    gear, on_rim = body.gear, body.bore_radius is not None
    depth_in_modules = (gear.root_radius - (body.bore_radius or 0.0)) / gear.normal_module
    # below and beside the sector cells grow in proportion to their distance
    grown = [math.ceil(m / 4 * math.log2(1 + depth_in_modules / first)) for first in (0.4, 1.5)]
    return Cells(
        thickness=m,
        flank=math.ceil(1.5 * m),
        fillet=math.ceil(m / 2) if on_rim else m,
        width=max(3, math.ceil(0.4 * gear.face_width / gear.normal_module * m)),
        foot=math.ceil(m / 4),
        land=math.ceil(m / 6),
        rim=max(2, grown[0]),
        rest=(max(2, grown[1]), m + 1),
    )


def unknowns(body: Body, cells: Cells) -> int:
    """Approximate number of unknowns of a hex20 mesh: 4 nodes per cell and some at the surface."""
    section = cells.thickness * (cells.flank + cells.fillet)
    if body.bore_radius is not None:
        side = cells.of_tooth(1)
        others = body.teeth - 1
        section += others * side.thickness * (side.flank + side.fillet) + cells.rim * (
            cells.thickness + others * side.thickness + (body.teeth + 1) * (2 * cells.foot + cells.land)
        )
        if body.rest == "ring" and not body.closed:
            section += 2 * cells.rim * sum(cells.rest)
    return round(12 * section * cells.width * 1.3)


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


def plain_compliance(body: Body, material: Material, meshes: Sequence[int], order: tuple[int, int]) -> FlankCompliance:
    """Richardson's value of two or more ``meshes`` of the family, with its error bar."""
    found = [flank_compliance(tooth_mesh(body, mesh_cells(body, m), "hex20"), material, order) for m in meshes]
    values = [
        fine.blocks + (fine.blocks - coarse.blocks) / ((m / before) ** RATE - 1)
        for (coarse, fine), (before, m) in zip(pairwise(found), pairwise(meshes), strict=True)
    ]
    difference = 0.5 * (values[-1] - values[-2]) if len(values) > 1 else values[-1] - found[-1].blocks
    error = float(np.linalg.norm(difference) / np.linalg.norm(values[-1]))
    return replace(found[-1], blocks=values[-1], error=error, attrs={**found[-1].attrs, "meshes": len(found)})
