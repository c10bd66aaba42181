"""Mesh phases at which the contact changes under load: where panels of Gauss phases have to end.

A coarse solution at uniform phases says which lines touch where. With x = τ + k, which runs on while a tooth pair
passes through the mesh, the compression of a line at its ends and the greatest one on it are curves of one pair: a
patch is born or vanishes where the greatest changes its sign, it reaches or leaves an end of the line where that of the
end does. Of the phases known beforehand, at which an end of the face passes an end of the path of contact or a kink of
the gap, those matter where the flanks touch there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.births import Birth, births, greatest_on_lines
from gearbench.contact.gaps import conforming, flank_separation, gap_kinks
from gearbench.contact.look import COARSE_PHASES, first_look, greatest_deflection
from gearbench.contact.panels import CLOSE, LONGEST, Change, panel_ends
from gearbench.contact.patches import compression
from gearbench.contact.phases import gauss_phases, uniform_phases
from gearbench.errors import InputError
from gearbench.scene import Resolution, Scene
from gearbench.threads import single_threaded_blas

#: Gauss points on each panel unless a scene gives them.
GAUSS_POINTS = 5
#: Uniform phases of the coarse solution, and closeness, where more than five Gauss points follow.
MORE_PHASES, CLOSER = 72, (1e-5, 1e-3, 1e-5)


def mesh_phases(scene: Scene) -> tuple[NDArray, NDArray]:
    """Mesh phases τ and weights (position,) that the scene's resolution asks for."""
    resolution = scene.one_load.resolution
    if resolution.accuracy is not None:
        raise InputError("resolution.accuracy", resolution.accuracy, "is for simulate and robust; here give segments")
    if resolution.positions is not None:
        return uniform_phases(resolution.positions)
    meshing, flanks = scene.pair.meshing, flank_separation(scene)
    kinks, face = gap_kinks(scene)
    changes = tuple(kinks) if flanks is not None else (meshing.path_start, meshing.path_end, *kinks)
    if flanks is not None and not meshing.overlap_ratio:
        # spur pairs take and leave their load, with a kink, where they are as far apart as the others are deflected
        changes += flanks.reach(greatest_deflection(scene))
    transitions = meshing.phases_at(changes, face)
    size = scene.resolution.panel_size
    assert size is not None
    return gauss_phases(transitions, size)


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
    (found,) = phases_of_loads(scene, np.ones(1))
    return found


def phases_of_loads(scene: Scene, shares: NDArray) -> list[tuple[NDArray, NDArray, int]]:
    """``loaded_phases`` under each of the ``shares`` of the scene's load, of a resolution that leaves them to us."""
    size = scene.resolution.gauss_points or GAUSS_POINTS
    longest = LONGEST if scene.pair.meshing.overlap_ratio else 1.0
    exact = size > GAUSS_POINTS
    free = replace(scene, resolution=Resolution())
    found = [transitions(free, exact=exact)] if len(shares) == 1 else transitions_of_loads(free, shares, exact=exact)
    close = CLOSER if exact else CLOSE
    return [(*gauss_phases(panel_ends(changes, longest, close), size), size) for changes in found]


@lru_cache(maxsize=64)
def transitions(scene: Scene, *, exact: bool = False) -> list[Change]:
    """Phases at which the contact changes under load.

    Where flanks touch all along their lines at every phase these are known beforehand. ``exact``: with more uniform
    phases, and those at which a pair takes or leaves its load are found once more, on finer lines close to them.
    """
    (found,) = transitions_of_loads(scene, np.ones(1), exact=exact)
    return found


@single_threaded_blas()
def transitions_of_loads(scene: Scene, shares: NDArray, *, exact: bool = False) -> list[list[Change]]:
    """``transitions`` under each of the ``shares`` of the scene's load, found together.

    Of flanks that touch on the line of action where they may part: elsewhere contact lines follow the load.
    """
    meshing = scene.pair.meshing
    if conforming(scene):
        passages = _passages(scene, (meshing.path_start, meshing.path_end))
        known = [_change(each.x, 0, _steep_side(scene, each)) for each in passages]
        if scene.operation is not None:  # sliding changes its sign at the pitch point
            known += [Change(phase, 1) for phase in meshing.phases_at((meshing.pitch_point,))]
        return [known] * len(shares)
    look = first_look(scene, MORE_PHASES if exact else COARSE_PHASES)
    look = look if np.array_equal(shares, look.shares) else look.under(shares)
    lines, s = look.lines, compression(look.problem, look.lines, look.guess)
    on_line = np.stack([greatest_on_lines(s), s[:, :, 0, 0], s[:, :, -1, -1]])  # and those at both ends
    on_line = np.where(lines.active, on_line, np.nan).reshape(3, len(shares), len(look.phase), -1)
    on_line = on_line.transpose(1, 0, 3, 2).reshape(len(shares), 3, -1)
    x = (lines.index[:, None] + look.phase).ravel()
    born = births(scene, look, x, on_line[:, 0], exact=exact)
    found = []
    for load, (curves, known) in enumerate(zip(on_line, _known(scene, x, on_line), strict=True)):
        changes = list(known)
        changes += [change for birth in born if birth.load == load for change in _of_birth(birth)]
        if scene.pair.meshing.overlap_ratio or lines.cells:
            changes += [_change(_root(x, curve, i), 1) for curve in curves[1:] for i in _sign_changes(curve)]
        found.append(changes)
    return found


def _change(x: float, rank: int, side: int = 0) -> Change:
    """A change at the phase of x = τ + k."""
    return Change(x % 1.0 % 1.0, rank, side)


def _of_birth(birth: Birth) -> list[Change]:
    """The changes that a birth is: one, or both ends of its ramp."""
    if not birth.ramp:
        return [_change(birth.x, 0, birth.side)]
    first, whole = birth.ends
    return [_change(first, -1), _change(whole, -1, birth.side)]


class Passage(NamedTuple):
    """At x = τ + k the y of an end of the face, or of a kink of the gap along it, passes a position u of the path."""

    x: float
    u: float
    y: float


def _passages(scene: Scene, positions: Iterable[float], face: Iterable[float] = ()) -> Iterator[Passage]:
    """Passages of the ends of the face, and of each y of ``face``, at the ``positions``; a spur pair's is one."""
    meshing = scene.pair.meshing
    b, helical = meshing.face_width, meshing.overlap_ratio > 0
    for y in (0.0, b, *face) if helical else (0.0,):
        for u in positions:
            yield Passage((u - meshing.path_start) / meshing.base_pitch - meshing.overlap_ratio * y / b, u, y)


def _steep_side(scene: Scene, passage: Passage) -> int:
    """On which side of a passage curves are steep: 1 after, −1 before, 0 neither.

    After the line of a helical pair has begun, at the far end of the face, and before it ends, at the near one. The
    load of a spur pair jumps there, with level sides; off the line of action it touches at an edge, or at the corner of
    a relief, up to there, whose law goes over into that of the flank.
    """
    meshing, (_, u, y) = scene.pair.meshing, passage
    if not meshing.overlap_ratio:
        flanks = flank_separation(scene)
        if flanks is None:
            return 0
        inwards = 1 if 2 * u < meshing.path_start + meshing.path_end else -1
        # behind the corner of a relief the flank carries less
        behind = u in flanks.changes and inwards * (u - min(flanks.kinks, key=lambda kink: abs(kink - u))) < 0
        return 0 if behind else inwards
    return int((u, y) == (meshing.path_start, meshing.face_width)) - int((u, y) == (meshing.path_end, 0.0))


def _known(scene: Scene, x: NDArray, on_line: NDArray) -> list[list[Change]]:
    """Changes where an end of the face passes an end of the path (rank 0) or a kink, where the flanks touch there.

    Under each load of ``on_line`` (load, 3, x): the greatest compression on a line, and those at its ends.
    """
    meshing, flanks = scene.pair.meshing, flank_separation(scene)
    kinks, face = gap_kinks(scene)
    if flanks is not None and not meshing.overlap_ratio:  # the line stands at the corner of a relief as a whole
        kinks = [*(u for u in kinks if u not in flanks.kinks), *flanks.changes]
    ends = (meshing.path_start, meshing.path_end)
    found: list[list[Change]] = [[] for _ in on_line]
    for passage in _passages(scene, (*ends, *kinks), face):
        side, (at, u, y) = _steep_side(scene, passage), passage
        # where a line begins or ends it is short; those of spur pairs pass as a whole, wherever the flanks touch
        ended = side != 0 or not meshing.overlap_ratio or y in face
        rows = on_line[:, 0 if ended else 2 if y else 1]
        i = np.searchsorted(x, at)
        for j in np.flatnonzero(np.any(rows[:, max(i - 1, 0) : i + 1] > 0, axis=1)):
            found[j].append(_change(at, 0 if u in ends or not meshing.overlap_ratio else 1, side))
    return found


def _sign_changes(curve: NDArray) -> NDArray:
    """Indices i between which and i + 1 the curve changes its sign."""
    with np.errstate(invalid="ignore"):
        return np.flatnonzero((curve[1:] > 0) & (curve[:-1] <= 0) | (curve[1:] <= 0) & (curve[:-1] > 0))


def _root(x: NDArray, curve: NDArray, i: int) -> float:
    a, b = curve[i], curve[i + 1]
    return float(x[i] + (x[i + 1] - x[i]) * a / (a - b))
