"""From a scene's effects to the contact problem: compliances and gaps are summed, then made dimensionless."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.phases import gauss_phases, uniform_phases
from gearbench.contact.problem import ContactProblem, reduce_rank
from gearbench.effects.base import ComplianceEffect, Dense, GapEffect, LineLaw, LowRank
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines, contact_lines
from gearbench.scene import Scene


def mesh_phases(scene: Scene) -> tuple[NDArray, NDArray]:
    """Mesh phases τ and weights (position,) that the scene's resolution asks for."""
    resolution = scene.resolution
    if resolution.accuracy is not None:
        raise InputError("resolution.accuracy", resolution.accuracy, "is for simulate and robust; here give segments")
    if resolution.positions is not None:
        return uniform_phases(resolution.positions)
    kinks = [u for effect in scene.effects if isinstance(effect, GapEffect) for u in effect.kinks(scene.pair)]
    transitions = (*scene.pair.transition_phases, *scene.pair.phases_at(kinks))
    size = resolution.panel_size
    assert size is not None
    return gauss_phases(transitions, size)


def scene_lines(scene: Scene, mesh_phase: NDArray) -> ContactLines:
    """Contact lines of the scene at the given phases."""
    return contact_lines(scene.pair, mesh_phase, scene.resolution.segments)


def total_gap(scene: Scene, lines: ContactLines) -> NDArray:
    """Sum of the gaps of all effects, (position, pair, segment) [mm]."""
    gaps = [effect.gap(lines) for effect in scene.effects if isinstance(effect, GapEffect)]
    return sum(gaps[1:], gaps[0]) if gaps else np.zeros(lines.shape)


def assemble(scene: Scene, lines: ContactLines) -> ContactProblem:
    """Contact problem of ``scene`` on ``lines``: the sum over its effects."""
    parts = [effect.compliance(lines) for effect in scene.effects if isinstance(effect, ComplianceEffect)]
    smooth = [part for part in parts if not isinstance(part, LineLaw)]
    laws = [part for part in parts if isinstance(part, LineLaw)]
    factor, coupled = _join(smooth, lines)
    if laws:
        a, h = sum((law.a for law in laws), np.zeros(lines.shape)), sum((law.h for law in laws), np.zeros(lines.shape))
        unit = _typical_compression(a, h, scene)
    else:
        factor, coupled = factor if coupled else _own_columns(factor), True
        a = h = np.zeros(lines.shape)
        unit = _even_deflection(factor, lines) * scene.normal_force
    problem = scale_problem(lines, total_gap(scene, lines), factor, a, h, scene.normal_force, unit, coupled=coupled)
    # a tooth of high order has more amplitudes than a contact line has segments
    return reduce_rank(problem) if laws and factor.shape[-1] > len(problem.block) // problem.blocks else problem


def _typical_compression(a: NDArray, h: NDArray, scene: Scene) -> float:
    """Compression under the mean line load [mm]: unit of displacement where there is a law."""
    line_load = scene.normal_force / scene.pair.face_width
    # a law driven beyond its validity still has the slope h of its continuation
    return line_load * max(float(np.mean(a - h * math.log(line_load))), float(np.mean(h)))


def _even_deflection(factor: NDArray, lines: ContactLines) -> float:
    """Mean deflection under a unit force shared evenly by all segments [mm/N].

    Raises
    ------
    InputError
        If the compliance of the segments is not positive definite.
    """
    active = np.repeat(lines.active, lines.shape[2], axis=1)
    flat = np.where(active[..., None], factor.reshape(*active.shape, -1), 0.0)
    matrix = flat @ np.swapaxes(flat, 1, 2)
    greatest = np.linalg.norm(matrix, axis=(1, 2))[:, None]
    least = np.linalg.eigvalsh(matrix + np.eye(active.shape[1]) * np.where(active, 0.0, greatest)[:, None, :])[:, :1]
    if np.any(least <= 1e-13 * greatest):
        raise InputError("effects", "no contact law", "the compliance alone does not determine the loads: add hertz")
    return float(np.mean((flat.sum(axis=1) ** 2).sum(axis=1) / active.sum(axis=1) ** 2))


def scale_problem(
    lines: ContactLines,
    gap: NDArray,
    factor: NDArray,
    a: NDArray,
    h: NDArray,
    force: float,
    scale: float,
    *,
    coupled: bool,
) -> ContactProblem:
    """Dimensionless problem from gap [mm], Ψ [√(mm/N)] and the law's a, h [mm²/N], (position, pair, segment, …).

    ``force`` [N] and ``scale`` [mm] become the units.
    """
    positions, pairs, segments = lines.shape
    active = np.broadcast_to(lines.active[..., None], lines.shape)
    length = np.where(active, lines.length[..., None], 1.0)
    unit = force / scale
    flat = (positions, pairs * segments)
    return ContactProblem(
        gap=(gap / scale).reshape(flat),
        a=(unit / length * (a + h * np.log(length / force))).reshape(flat),
        h=(unit / length * h).reshape(flat),
        active=active.reshape(flat),
        factor=np.ascontiguousarray((factor * math.sqrt(unit)).reshape(*flat, -1)),
        block=np.zeros(flat[1], dtype=np.int64) if coupled else np.repeat(np.arange(pairs), segments),
        blocks=1 if coupled else pairs,
        force=force,
        length_scale=scale,
        shape=lines.shape,
    )


def _join(parts: Sequence[LowRank | Dense], lines: ContactLines) -> tuple[NDArray, bool]:
    """One factor Ψ for the sum of the smooth compliances, and whether its columns are shared by all pairs."""
    factors = [
        (part.factor, part.coupled) if isinstance(part, LowRank) else _dense_factor(part, lines) for part in parts
    ]
    if not factors:
        return np.zeros((*lines.shape, 0)), False
    coupled = any(shared for _, shared in factors)
    if coupled:
        factors = [(f if shared else _own_columns(f), True) for f, shared in factors]
    return np.concatenate([f for f, _ in factors], axis=-1), coupled


def _own_columns(factor: NDArray) -> NDArray:
    """Give each pair columns of its own in a factor whose columns are shared."""
    positions, pairs, segments, rank = factor.shape
    wide = np.zeros((positions, pairs, segments, pairs, rank))
    index = np.arange(pairs)
    wide[:, index, :, index, :] = np.moveaxis(factor, 1, 0)
    return wide.reshape(positions, pairs, segments, pairs * rank)


def _dense_factor(part: Dense, lines: ContactLines) -> tuple[NDArray, bool]:
    """Symmetric factor of a dense compliance, absent segments left out."""
    active = np.repeat(lines.active, lines.shape[2], axis=1)
    value, vector = np.linalg.eigh(np.where(active[:, :, None] & active[:, None, :], part.matrix, 0.0))
    factor = vector * np.sqrt(np.maximum(value, 0.0))[:, None, :]
    return factor.reshape(*lines.shape, -1), True
