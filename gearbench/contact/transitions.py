"""Mesh phases at which the contact changes under load, where the panels of Gauss phases must end.

A coarse solution at uniform phases tells which lines touch, and where. Pair k is at x = τ + k, which increases while
the pair passes through the mesh; the compressions of its line are curves of x. Where the greatest compression changes
sign, a contact patch appears or vanishes. Where the compression at an end of the line changes sign, a patch reaches or
leaves this end. Further phases are known beforehand: an end of the face passes an end of the path of contact or a kink
of the gap. They count only if the flanks touch there.
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

#: Default number of Gauss points on each panel.
GAUSS_POINTS = 5
#: With more than five Gauss points: number of uniform phases of the coarse solution, and ``close`` of ``panel_ends``.
MORE_PHASES, CLOSER = 72, (1e-5, 1e-3, 1e-5)


def mesh_phases(scene: Scene) -> tuple[NDArray, NDArray]:
    """Mesh phases τ and weights (position,) by the scene's resolution, on panels that do not depend on the load."""
    resolution = scene.one_load.resolution
    if resolution.accuracy is not None:
        raise InputError("resolution.accuracy", resolution.accuracy, "is for simulate and robust; here give segments")
    if resolution.positions is not None:
        return uniform_phases(resolution.positions)
    meshing, flanks = scene.pair.meshing, flank_separation(scene)
    kinks, face = gap_kinks(scene)
    changes = tuple(kinks) if flanks is not None else (meshing.path_start, meshing.path_end, *kinks)
    if flanks is not None and not meshing.overlap_ratio:
        # spur pairs take and leave their load, with a kink, where their separation equals the deflection of the others
        changes += flanks.reach(greatest_deflection(scene))
    transitions = meshing.phases_at(changes, face)
    size = scene.resolution.panel_size
    assert size is not None
    return gauss_phases(transitions, size)


@lru_cache(maxsize=64)
def loaded_phases(scene: Scene) -> tuple[NDArray, NDArray, int | None]:
    """Mesh phases τ, weights and panel size by the scene's resolution, on panels between changes of contact.

    Phases and weights are (position,). The panel size is the number of Gauss points on each panel, by default
    ``GAUSS_POINTS``; None if the phases are uniform.
    """
    scene = scene.one_load
    if scene.resolution.positions is not None:
        return *uniform_phases(scene.resolution.positions), None
    if scene.resolution.accuracy is not None:
        raise InputError("resolution.accuracy", scene.resolution.accuracy, "is for simulate and robust")
    (found,) = phases_of_loads(scene, np.ones(1))
    return found


def phases_of_loads(scene: Scene, shares: NDArray) -> list[tuple[NDArray, NDArray, int]]:
    """``loaded_phases`` under each of the ``shares`` of the scene's load, for a resolution without given phases."""
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

    They are known beforehand if the flanks touch all along their lines at every phase. ``exact``: use more uniform
    phases, and locate the births of pairs again on finer lines.
    """
    (found,) = transitions_of_loads(scene, np.ones(1), exact=exact)
    return found


@single_threaded_blas()
def transitions_of_loads(scene: Scene, shares: NDArray, *, exact: bool = False) -> list[list[Change]]:
    """``transitions`` under each of the ``shares`` of the scene's load, from one coarse solution.

    Contact must be on the line of action if there are several shares; off it the contact lines depend on the load.
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
    on_line = np.stack([greatest_on_lines(s), s[:, :, 0, 0], s[:, :, -1, -1]])  # greatest, and at both ends
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
    """Change at the phase τ of x = τ + k."""
    return Change(x % 1.0 % 1.0, rank, side)


def _of_birth(birth: Birth) -> list[Change]:
    """Changes that a birth causes: a single one, or both ends of its ramp."""
    if not birth.ramp:
        return [_change(birth.x, 0, birth.side)]
    first, whole = birth.ends
    return [_change(first, -1), _change(whole, -1, birth.side)]


class Passage(NamedTuple):
    """At x the position y on the face (an end, or a kink of the gap) passes the position u on the path of contact."""

    x: float
    u: float
    y: float


def _passages(scene: Scene, positions: Iterable[float], face: Iterable[float] = ()) -> Iterator[Passage]:
    """Passages of the ends of the face, and of the y in ``face``, through the ``positions``; spur pairs have one y."""
    meshing = scene.pair.meshing
    b, helical = meshing.face_width, meshing.overlap_ratio > 0
    for y in (0.0, b, *face) if helical else (0.0,):
        for u in positions:
            yield Passage((u - meshing.path_start) / meshing.base_pitch - meshing.overlap_ratio * y / b, u, y)


def _steep_side(scene: Scene, passage: Passage) -> int:
    """Side of a passage on which curves are steep: 1 after it, −1 before it, 0 neither.

    For helical pairs, curves are steep after the line has begun at the far end of the face, and before it ends at the
    near end. On the line of action, the load of a spur pair jumps and curves are flat on both sides. Off the line of
    action, a spur pair touches with an edge or the corner of a relief before the passage, and with its flank after it;
    the law changes continuously from one to the other.
    """
    meshing, (_, u, y) = scene.pair.meshing, passage
    if not meshing.overlap_ratio:
        flanks = flank_separation(scene)
        if flanks is None:
            return 0
        inwards = 1 if 2 * u < meshing.path_start + meshing.path_end else -1
        # behind the corner of a relief the flank carries less load
        behind = u in flanks.changes and inwards * (u - min(flanks.kinks, key=lambda kink: abs(kink - u))) < 0
        return 0 if behind else inwards
    return int((u, y) == (meshing.path_start, meshing.face_width)) - int((u, y) == (meshing.path_end, 0.0))


def _known(scene: Scene, x: NDArray, on_line: NDArray) -> list[list[Change]]:
    """Changes at passages of the face through an end of the path (rank 0) or a kink, if the flanks touch there.

    One list for each load case of ``on_line`` (load, 3, x), which holds the greatest compression on a line and the
    compressions at its ends.
    """
    meshing, flanks = scene.pair.meshing, flank_separation(scene)
    kinks, face = gap_kinks(scene)
    if flanks is not None and not meshing.overlap_ratio:  # the whole line touches at the corner of a relief
        kinks = [*(u for u in kinks if u not in flanks.kinks), *flanks.changes]
    ends = (meshing.path_start, meshing.path_end)
    found: list[list[Change]] = [[] for _ in on_line]
    for passage in _passages(scene, (*ends, *kinks), face):
        side, (at, u, y) = _steep_side(scene, passage), passage
        # A line is short where it begins or ends, and the line of a spur pair passes as a whole: any contact counts.
        ended = side != 0 or not meshing.overlap_ratio or y in face
        rows = on_line[:, 0 if ended else 2 if y else 1]
        i = np.searchsorted(x, at)
        for j in np.flatnonzero(np.any(rows[:, max(i - 1, 0) : i + 1] > 0, axis=1)):
            found[j].append(_change(at, 0 if u in ends or not meshing.overlap_ratio else 1, side))
    return found


def _sign_changes(curve: NDArray) -> NDArray:
    """Indices i such that the curve changes sign between i and i + 1."""
    with np.errstate(invalid="ignore"):
        return np.flatnonzero((curve[1:] > 0) & (curve[:-1] <= 0) | (curve[1:] <= 0) & (curve[:-1] > 0))


def _root(x: NDArray, curve: NDArray, i: int) -> float:
    a, b = curve[i], curve[i + 1]
    return float(x[i] + (x[i + 1] - x[i]) * a / (a - b))
