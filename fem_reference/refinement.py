"""A requested accuracy picks the mesh: a family of refined meshes, Richardson's value and its error bar.

Mesh m of the family has m cells across the tooth and cells in proportion everywhere else, with the same grading.
Compliances of the flank converge with order 2.4–2.8 (measured): the load ends at the form circle, where the traction
jumps, and that, not the polynomial degree of the element, sets the rate. Richardson's value takes 2.6. The error bar is
half the difference of the two last Richardson values (their errors fall by a factor of three or more from mesh to
mesh) or, after the first two meshes, the difference of Richardson's value and the finer mesh; both have bounded the
error against much finer meshes.
"""

from __future__ import annotations

import logging
import math
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fem_reference.blocks import Cells
from fem_reference.compliance import flank_compliance
from fem_reference.section import Body
from fem_reference.tooth_mesh import ToothMesh, tooth_mesh
from gearbench.compliance.flank import FlankCompliance
from gearbench.compliance.local import waves_across
from gearbench.errors import GearbenchError
from gearbench.geometry.gear import Gear
from gearbench.geometry.material import Material

_LOG = logging.getLogger(__name__)

#: Order of convergence that Richardson's value assumes.
RATE = 2.6
#: Meshes tried one after the other: tooth alone, for accuracies down to 0.5 % and for finer ones, and on a rim.
FAMILY, FINE_FAMILY, RIM_FAMILY = (4, 5, 6, 8, 10), (4, 6, 8, 10), (3, 4, 5, 6, 7)
#: Number of unknowns beyond which no mesh is made (about 1.5 GB).
MOST_UNKNOWNS = 130_000


class AccuracyError(GearbenchError):
    """The requested accuracy needs a larger mesh than allowed."""


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
    """Roughly how many displacement unknowns a hex20 mesh has: 4 nodes per cell and some at the surface."""
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


def default_order(gear: Gear) -> tuple[int, int]:
    """Polynomials along height and face width."""
    return 5, waves_across(gear)


def refined_compliance(
    body: Body,
    material: Material,
    accuracy: float = 0.01,
    order: tuple[int, int] | None = None,
) -> FlankCompliance:
    """Compliance of a flank to a relative ``accuracy`` (Frobenius norm), with its estimated error.

    Raises
    ------
    AccuracyError
        If the finest mesh allowed does not reach it; says what was reached.
    MeshingError, MissingDependencyError
        As in ``tooth_mesh``.
    """
    start = time.perf_counter()
    order = order or default_order(body.gear)
    found: list[FlankCompliance] = []
    values: list[NDArray] = []
    error = math.inf
    family = RIM_FAMILY if body.bore_radius is not None else FAMILY if accuracy >= 0.005 else FINE_FAMILY
    for m in family:
        cells = mesh_cells(body, m)
        if unknowns(body, cells) > MOST_UNKNOWNS:
            break
        found.append(flank_compliance(_mesh(body, cells), material, order))
        _LOG.info("mesh %d: %d unknowns, %.1f s so far", m, found[-1].attrs["unknowns"], time.perf_counter() - start)
        if len(found) == 1:
            continue
        fine, coarse = found[-1].blocks, found[-2].blocks
        values.append(fine + (fine - coarse) / ((m / family[len(found) - 2]) ** RATE - 1))
        error = _error_bar(values, fine)
        _LOG.info("estimated error of the compliance %.1e, wanted %.1e", error, accuracy)
        if error <= accuracy:
            break
    if error > accuracy:
        reached = f"{error:.1e} with {found[-1].attrs['unknowns']} unknowns" if values else "nothing"
        raise AccuracyError(f"accuracy = {accuracy:g}: reached {reached}; the next mesh is too large")
    attrs = {**found[-1].attrs, "meshes": len(found), "seconds": time.perf_counter() - start}
    return replace(found[-1], blocks=values[-1], error=error, attrs=attrs)


def _error_bar(values: list[NDArray], fine: NDArray) -> float:
    """Half the difference of the last two Richardson values, or that of the only one and the finer mesh."""
    difference = 0.5 * (values[-1] - values[-2]) if len(values) > 1 else values[-1] - fine
    return float(np.linalg.norm(difference) / np.linalg.norm(values[-1]))


def _mesh(body: Body, cells: Cells) -> ToothMesh:
    return tooth_mesh(body, cells, "hex20")
