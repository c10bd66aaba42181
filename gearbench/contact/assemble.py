"""From a scene's effects to the contact problem: compliances and gaps are summed, then made dimensionless."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.phases import gauss_phases, uniform_phases
from gearbench.contact.problem import ContactProblem, gram, pivoted_root, reduce_rank
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
    transitions = (*scene.pair.meshing.transition_phases, *scene.pair.meshing.phases_at(kinks))
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
    beside = scene.effects_by_name
    parts = [effect.compliance(lines, beside) for effect in scene.effects if isinstance(effect, ComplianceEffect)]
    smooth = [part for part in parts if not isinstance(part, LineLaw)]
    laws = [part for part in parts if isinstance(part, LineLaw)]
    own = [part for part in smooth if isinstance(part, LowRank) and not part.coupled]
    coupled = not laws or len(own) < len(smooth)
    factor = _shared_factor(smooth, lines) if coupled else _own_factor(own, lines)
    if laws:
        a, h = sum((law.a for law in laws), np.zeros(lines.shape)), sum((law.h for law in laws), np.zeros(lines.shape))
        unit = _typical_compression(a, h, scene)
    else:
        a = h = np.zeros(lines.shape)
        unit = _even_deflection(factor, lines) * scene.F_bn
    problem = scale_problem(lines, total_gap(scene, lines), factor, a, h, scene.F_bn, unit, coupled=coupled)
    # a tooth of high order has more amplitudes than a contact line has segments
    return problem if coupled or factor.shape[-1] <= lines.shape[2] else reduce_rank(problem)


def _typical_compression(a: NDArray, h: NDArray, scene: Scene) -> float:
    """Compression under the mean line load [mm]: unit of displacement where there is a law."""
    line_load = scene.F_bn / scene.pair.face_width
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


def _own_factor(parts: Sequence[LowRank], lines: ContactLines) -> NDArray:
    """Ψ of the sum of compliances that each pair has by itself, (position, pair, segment, rank)."""
    return np.concatenate([np.zeros((*lines.shape, 0)), *(part.factor for part in parts)], axis=-1)


def _shared_factor(parts: Sequence[LowRank | Dense], lines: ContactLines) -> NDArray:
    """Ψ of the sum of compliances through which pairs move each other, (position, pair, segment, rank)."""
    positions, pairs, segments = lines.shape
    H = np.zeros((positions, pairs, segments, pairs, segments))
    whole = H.reshape(positions, pairs * segments, -1)
    pair = np.arange(pairs)
    for part in parts:
        if isinstance(part, Dense):
            whole += _without_negative(part.matrix, lines)
        elif part.coupled:
            whole += gram(part.factor.reshape(*whole.shape[:2], -1))
        else:
            H[:, pair, :, pair] += np.moveaxis(gram(part.factor), 1, 0)
    active = np.repeat(lines.active, segments, axis=1)
    return pivoted_root(np.where(active[:, :, None] & active[:, None, :], whole, 0.0)).reshape(*lines.shape, -1)


def _without_negative(matrix: NDArray, lines: ContactLines) -> NDArray:
    """A dense compliance on the lines that exist, (position, n, n), less its negative part."""
    active = np.repeat(lines.active, lines.shape[2], axis=1)
    value, vector = np.linalg.eigh(np.where(active[:, :, None] & active[:, None, :], matrix, 0.0))
    return gram(vector * np.sqrt(np.maximum(value, 0.0))[:, None, :])
