"""Dimensionless form of a contact problem: units of force and displacement, and moments in place of forces."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.problem import ContactProblem
from gearbench.effects.base import LineLaw
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.scene import Scene


def by_lever(w: NDArray, factor: NDArray, law: LineLaw) -> tuple[NDArray, LineLaw]:
    """Ψ and contact law for moments P̃ = w P in place of forces P, with levers w (T5 of docs/theory.md).

    The moments are about the pinion's axis, divided by its base radius. A lever is a lever arm divided by this radius.
    With compressions s = w (δ − e) the equations keep their form and symmetry.
    """
    return factor / w[..., None], LineLaw(a=(law.a + law.h * np.log(w)) / w**2, h=law.h / w**2)


def typical_compression(law: LineLaw, scene: Scene) -> float:
    """Compression under the mean line load [mm], the unit of displacement of problems with a contact law."""
    line_load = scene.F_bn / scene.pair.meshing.face_width
    # where the logarithmic law is not valid, a tangent of the slope h continues it
    return line_load * max(float(np.mean(law.a - law.h * math.log(line_load))), float(np.mean(law.h)))


def even_deflection(matrix: NDArray, lines: ContactLines) -> float:
    """Mean deflection [mm/N] with H (position, n, n) under a unit force that all segments share equally.

    Raises
    ------
    InputError
        If the compliance of the segments is not positive definite.
    """
    active = np.repeat(lines.active, lines.shape[2], axis=1)
    # absent segments get a diagonal entry, so that their zero rows have no zero eigenvalue
    greatest = np.linalg.norm(matrix, axis=(1, 2))[:, None]
    least = np.linalg.eigvalsh(matrix + np.eye(active.shape[1]) * np.where(active, 0.0, greatest)[:, None, :])[:, :1]
    if np.any(least <= 1e-13 * greatest):  # zero but for rounding
        raise InputError("effects", "no contact law", "the compliance alone does not determine the loads: add hertz")
    return float(np.mean(matrix.sum(axis=(1, 2)) / active.sum(axis=1) ** 2))


def scale_problem(
    lines: ContactLines,
    gap: NDArray,
    factor: NDArray,
    law: LineLaw,
    sigma: NDArray,
    force: float,
    scale: float,
    *,
    coupled: bool,
) -> ContactProblem:
    """Dimensionless problem from the gap, half its variation over a cell ``sigma`` [mm], Ψ [√(mm/N)] and the law.

    All arrays are (position, pair, segment, …); ``force`` [N] and ``scale`` [mm] become the units. ``coupled`` tells
    whether tooth pairs deflect each other.
    """
    positions, pairs, segments = lines.shape
    active = lines.length > 0
    length = np.where(active, lines.length, 1.0)
    unit = force / scale
    flat = (positions, pairs * segments)
    return ContactProblem(
        gap=((gap - sigma) / scale).reshape(flat),
        a=(unit / length * (law.a + law.h * np.log(length / force))).reshape(flat),
        h=(unit / length * law.h).reshape(flat),
        sigma=(sigma / scale).reshape(flat),
        active=active.reshape(flat),
        factor=np.ascontiguousarray((factor * math.sqrt(unit)).reshape(*flat, -1)),
        block=np.zeros(flat[1], dtype=np.int64) if coupled else np.repeat(np.arange(pairs), segments),
        blocks=1 if coupled else pairs,
        force=force,
        length_scale=scale,
        shape=lines.shape,
    )
