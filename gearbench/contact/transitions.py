"""Mesh phases at which the contact changes under load: where panels of Gauss phases have to end.

A coarse solution at uniform phases says which lines touch where. With x = τ + k, which runs on while a tooth pair
passes through the mesh, the compression of a line at its ends and the greatest one on it are curves of one pair: a
patch is born or vanishes where the greatest changes its sign, it reaches or leaves an end of the line where that of the
end does. Of the phases known beforehand, at which an end of the face passes an end of the path of contact or a kink of
the gap, those matter where the flanks touch there.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble, conforming, flank_separation, gap_kinks, scene_lines, smooth_nodes
from gearbench.contact.patches import compression
from gearbench.contact.phases import gauss_phases, mirrored_phases, uniform_phases
from gearbench.contact.problem import ContactProblem, part_of
from gearbench.contact.solver import Guess, solve_roughly
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.scene import Resolution, Scene
from gearbench.threads import single_threaded_blas

#: Gauss points on each panel unless a scene gives them.
GAUSS_POINTS = 5
#: Uniform phases of the coarse solution, segments on its lines, share of the nodes their compliance would have, and how
#: much of it is left out.
COARSE_PHASES, COARSE_SEGMENTS, COARSE_NODES, COARSE_TRUNCATION = 24, 12, 0.7, 1e-3
#: Phases near the birth of a patch that it is found from.
POINTS = 4
#: Distances [mesh cycles] from a birth at which it is looked for once more, and once more, and segments there.
NEAR, FINE_SEGMENTS = (3e-3, 1e-4), 40
#: Changes closer than this are one, by rank, and panels wider are split [mesh cycles].
CLOSE, WIDEST = (1e-3, 0.02), 0.25
#: Uniform phases of the coarse solution, and closeness, where more than five Gauss points follow.
MORE_PHASES, CLOSER = 72, (1e-5, 1e-3)


@lru_cache(maxsize=64)
def loaded_phases(scene: Scene) -> tuple[NDArray, NDArray, int | None]:
    """Mesh phases τ and weights (position,) that the scene's resolution asks for, on panels between changes of contact.

    And the number of Gauss points on each panel, ``GAUSS_POINTS`` unless the scene gives it; None where the phases are
    uniform.
    """
    scene = scene.one_load
    if scene.resolution.positions is not None:
        return *uniform_phases(scene.resolution.positions), None
    if scene.resolution.accuracy is not None:
        raise InputError("resolution.accuracy", scene.resolution.accuracy, "is for simulate and robust")
    size = scene.resolution.gauss_points or GAUSS_POINTS
    widest = WIDEST if scene.pair.meshing.overlap_ratio else 1.0
    exact = size > GAUSS_POINTS
    changes = transitions(replace(scene, resolution=Resolution()), exact=exact)
    return *gauss_phases(panel_ends(changes, widest, CLOSER if exact else CLOSE), size), size


def panel_ends(
    changes: Iterable[tuple[float, int]], widest: float = 1.0, close: tuple[float, float] = CLOSE
) -> list[float]:
    """Ends of panels from changes (phase, rank): of ``close`` ones that of the lowest rank; wide panels split."""
    kept = [0.0]
    for phase, rank in sorted(changes, key=lambda change: (change[1], change[0])):
        if min(abs((phase - other + 0.5) % 1.0 - 0.5) for other in kept) > close[rank]:
            kept.append(phase)
    ends = np.array([*sorted(kept), 1.0])
    pieces = np.ceil(np.diff(ends) / widest).astype(int)
    return [a + i * (b - a) / n for a, b, n in zip(ends[:-1], ends[1:], pieces, strict=True) for i in range(n)]


@lru_cache(maxsize=64)
@single_threaded_blas()
def transitions(scene: Scene, *, exact: bool = False) -> list[tuple[float, int]]:
    """Phases at which the contact changes under load, with ranks: 0 where a pair takes or leaves its load, 1 otherwise.

    Where flanks touch all along their lines at every phase these are known beforehand. ``exact``: with more uniform
    phases, and those at which a pair takes or leaves its load are found once more, on finer lines close to them.
    """
    meshing = scene.pair.meshing
    if conforming(scene):
        known = [(phase, 0) for phase in meshing.transition_phases]
        if scene.operation is not None:  # sliding changes its sign at the pitch point
            known += [(phase, 1) for phase in meshing.phases_at((meshing.pitch_point,))]
        return known
    count = MORE_PHASES if exact else COARSE_PHASES
    coarse = replace(scene, resolution=Resolution(positions=count, segments=COARSE_SEGMENTS))
    phase = mirrored_phases(scene.pair, count)
    lines = scene_lines(coarse, phase)
    nodes = round(COARSE_NODES * smooth_nodes(lines))
    problem = assemble(coarse, lines, truncation=COARSE_TRUNCATION, nodes=nodes)
    guess = Guess.nothing(problem)
    solve_roughly(problem, guess)
    s = compression(problem, lines, guess)
    s = s.reshape(*s.shape[:2], -1)
    on_line = np.stack([s.max(axis=2), s[..., 0], s[..., -1]])  # the greatest, and those at both ends
    on_line = np.where(lines.active, on_line, np.nan).swapaxes(1, 2).reshape(3, -1)
    x = (lines.index[:, None] + phase).ravel()
    changes = [(at % 1.0 % 1.0, rank) for at, rank in _known(scene, x, on_line)]
    births = _births(problem, lines, x, _sign_changes(on_line[0]))
    births = _located(scene, births) if exact else births
    changes += [(at % 1.0 % 1.0, 0) for at in births]
    if scene.pair.meshing.overlap_ratio or lines.cells:
        changes += [(_root(x, curve, i) % 1.0 % 1.0, 1) for curve in on_line[1:] for i in _sign_changes(curve)]
    return changes


def _births(problem: ContactProblem, lines: ContactLines, x: NDArray, at: NDArray) -> list[float]:
    """x between ``x[i]`` and ``x[i + 1]`` of each i of ``at`` at which a pair takes or leaves its load.

    Solved without that pair, its least gap beyond the approach is smooth,
    and the polynomial through a few values has its zero where the load begins.
    """
    if not at.size:
        return []
    shared = lines.active & (lines.active.sum(axis=1) > 1)[:, None]
    count, active = len(lines.mesh_phase), shared.T.ravel()
    near = [np.array(sorted(np.flatnonzero(active), key=lambda j, i=i: abs(j - i - 0.5))[:POINTS]) for i in at]
    if not active.any():
        return [(float(x[i]) + float(x[i + 1])) / 2 for i in at]
    margins = _margins(problem, lines, *np.divmod(np.concatenate(near), count))
    margin = np.split(margins, np.cumsum([len(each) for each in near])[:-1])
    return [_zero(x[j], m, float(x[i]), float(x[i + 1])) for j, m, i in zip(near, margin, at, strict=True)]


def _margins(problem: ContactProblem, lines: ContactLines, pair: NDArray, position: NDArray) -> NDArray:
    """By how much each ``pair`` at its ``position`` would be pressed, at most, by gears that it does not carry.

    NaN where it carries alone: there are no others to be solved with.
    """
    margins = np.full(len(pair), np.nan)
    shared = np.flatnonzero(lines.active.sum(axis=1)[position] > 1)
    if not shared.size:
        return margins
    pair, position = pair[shared], position[shared]
    part = part_of(problem, position)
    alone = part.active.copy().reshape(part.shape)
    alone[np.arange(len(pair)), pair] = False
    guess = Guess.nothing(part)
    solve_roughly(replace(part, active=alone.reshape(part.active.shape)), guess)
    s = compression(part, lines.part(position), guess)[np.arange(len(pair)), pair]
    margins[shared] = s.reshape(len(s), -1).max(axis=1)
    return margins


def _located(scene: Scene, births: list[float]) -> list[float]:
    """The x of births once more, from solutions close to them on finer lines."""
    for reach in NEAR:
        if not births:
            break
        x = (np.array(births)[:, None] + reach * np.array([-1.0, 0.0, 1.0])).ravel()
        lines = scene_lines(replace(scene, resolution=Resolution(positions=len(x), segments=FINE_SEGMENTS)), x % 1.0)
        problem = assemble(scene, lines)
        number = np.floor(x).astype(int) - lines.index[0]
        margins = _margins(problem, lines, number, np.arange(len(x))).reshape(-1, 3)
        on_lines = lines.active[np.arange(len(x)), number].reshape(-1, 3) & np.isfinite(margins)
        births = [
            _zero(at, margin, at[1] - 3 * reach, at[1] + 3 * reach) if there.all() else float(at[1])
            for at, margin, there in zip(x.reshape(-1, 3), margins, on_lines, strict=True)
        ]
    return births


def _zero(x: NDArray, values: NDArray, low: float, high: float) -> float:
    """Zero in [low, high] of the polynomial through ``values`` at x; the middle where there is none."""
    middle, reach = (low + high) / 2, (high - low) / 2
    roots = np.roots(np.polyfit((x - middle) / reach, values, len(x) - 1))
    real = roots[np.abs(roots.imag) < 1e-9].real
    real = real[np.abs(real) <= 1 + 1e-9]
    return middle + reach * float(real[0] if real.size else 0.0)


def _known(scene: Scene, x: NDArray, on_line: NDArray) -> list[tuple[float, int]]:
    """x at which an end of the face passes an end of the path (rank 0) or a kink, where the flanks touch there."""
    meshing = scene.pair.meshing
    kinks, face = gap_kinks(scene, flank_separation(scene))
    ends, found = (meshing.path_start, meshing.path_end), []
    b = meshing.face_width
    for y in (0.0, b, *face):
        # the lines of spur pairs pass as a whole, wherever on them the flanks touch
        row = on_line[0 if not meshing.overlap_ratio else 1 if y == 0 else 2 if y == b else 0]
        for u in (*ends, *kinks):
            at = (u - meshing.path_start) / meshing.base_pitch - meshing.overlap_ratio * y / b
            i = np.searchsorted(x, at)
            if np.any(row[max(i - 1, 0) : i + 1] > 0):
                found.append((at, 0 if u in ends else 1))
    return found


def _sign_changes(curve: NDArray) -> NDArray:
    """Indices i between which and i + 1 the curve changes its sign."""
    with np.errstate(invalid="ignore"):
        return np.flatnonzero((curve[1:] > 0) & (curve[:-1] <= 0) | (curve[1:] <= 0) & (curve[:-1] > 0))


def _root(x: NDArray, curve: NDArray, i: int) -> float:
    a, b = curve[i], curve[i + 1]
    return float(x[i] + (x[i + 1] - x[i]) * a / (a - b))
