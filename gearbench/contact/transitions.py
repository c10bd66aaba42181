"""Mesh phases at which the contact changes under load, where the panels of Gauss phases must end.

A coarse solution at uniform phases tells which lines touch, and where. Pair k is at x = τ + k, which increases while
the pair passes through the mesh; the compressions of its line are curves of x. Where the greatest compression changes
sign, a contact patch appears or vanishes. Where the compression at an end of the line changes sign, a patch reaches or
leaves this end; patches on helical lines reach and leave kinks of the gap in the same way. The geometry
determines further transitions, at which an end of the face passes an end of the path of contact or a kink of the gap;
they are left out if the flanks do not touch there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.coarse_solution import COARSE_PHASES, coarse_solution, greatest_deflection
from gearbench.contact.gaps import conforming, flank_separation, gap_kinks
from gearbench.contact.load_transfer import LoadTransfer, load_transfers, peak_compression
from gearbench.contact.panels import CLOSE, LONGEST, Transition, panel_starts
from gearbench.contact.patches import compression
from gearbench.contact.phases import gauss_phases, uniform_phases
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.scene import Resolution, Scene
from gearbench.threads import single_threaded_blas

#: Default number of Gauss points on each panel.
GAUSS_POINTS = 5
#: With more than ``GAUSS_POINTS``: number of uniform phases of the coarse solution, and ``close`` of ``panel_starts``.
MORE_PHASES, CLOSER = 72, (1e-5, 1e-3, 1e-5)


def mesh_phases(scene: Scene) -> tuple[NDArray, NDArray]:
    """Mesh phases τ and weights (position,) by the scene's resolution, on panels that do not depend on the load."""
    resolution = scene.one_load.resolution
    if resolution.accuracy is not None:
        raise InputError("resolution.accuracy", resolution.accuracy, "is for simulate and robust: give segments")
    if resolution.positions is not None:
        return uniform_phases(resolution.positions)
    meshing, flanks = scene.pair.meshing, flank_separation(scene)
    kinks, face = gap_kinks(scene)
    positions = tuple(kinks) if flanks is not None else (meshing.path_start, meshing.path_end, *kinks)
    if flanks is not None and not meshing.overlap_ratio:
        # spur pairs take up and shed their load, with a kink, where their separation equals the deflection of the other
        # pairs
        positions += flanks.reach(greatest_deflection(scene))
    size = scene.resolution.panel_size
    assert size is not None
    return gauss_phases(meshing.phases_at(positions, face), size)


@lru_cache(maxsize=64)
def loaded_phases(scene: Scene) -> tuple[NDArray, NDArray, int | None]:
    """Mesh phases τ, weights and panel size by the scene's resolution, on panels between the transitions under load.

    Phases and weights are (position,). The panel size is the number of Gauss points on a panel, by default
    ``GAUSS_POINTS``; None if the phases are uniform.
    """
    scene = scene.one_load
    if scene.resolution.positions is not None:
        return *uniform_phases(scene.resolution.positions), None
    if scene.resolution.accuracy is not None:
        raise InputError("resolution.accuracy", scene.resolution.accuracy, "is for simulate and robust")
    (phases,) = phases_of_loads(scene, np.ones(1))
    return phases


def phases_of_loads(scene: Scene, shares: NDArray) -> list[tuple[NDArray, NDArray, int]]:
    """``loaded_phases`` under each of the ``shares`` of the scene's load, for a resolution without given phases."""
    size = scene.resolution.gauss_points or GAUSS_POINTS
    longest = LONGEST if scene.pair.meshing.overlap_ratio else 1.0
    exact = size > GAUSS_POINTS
    close = CLOSER if exact else CLOSE
    scene = replace(scene, resolution=Resolution())  # ``transitions`` is cached, for scenes of any resolution
    one = len(shares) == 1
    of_loads = [transitions(scene, exact=exact)] if one else transitions_of_loads(scene, shares, exact=exact)
    return [(*gauss_phases(panel_starts(of_load, longest, close), size), size) for of_load in of_loads]


@lru_cache(maxsize=64)
def transitions(scene: Scene, *, exact: bool = False) -> list[Transition]:
    """Phases at which the contact changes under load.

    If the flanks touch all along their lines at every phase, the geometry determines them. With ``exact``, the coarse
    solution has more phases, and load transfers are located again on finer lines.
    """
    (of_load,) = transitions_of_loads(scene, np.ones(1), exact=exact)
    return of_load


@single_threaded_blas()
def transitions_of_loads(scene: Scene, shares: NDArray, *, exact: bool = False) -> list[list[Transition]]:
    """``transitions`` under each of the ``shares`` of the scene's load, from one coarse solution.

    Contact must be on the line of action if there are several shares; off it the contact lines depend on the load.
    """
    meshing = scene.pair.meshing
    if conforming(scene):
        passages = _passages(scene, (meshing.path_start, meshing.path_end))
        by_geometry = [_transition(passage.x, 0, _steep_side(scene, passage)) for passage in passages]
        if scene.operation is not None:  # sliding changes its sign at the pitch point
            by_geometry += [Transition(phase, 1) for phase in meshing.phases_at((meshing.pitch_point,))]
        return [by_geometry] * len(shares)
    coarse = coarse_solution(scene, MORE_PHASES if exact else COARSE_PHASES)
    coarse = coarse if np.array_equal(shares, coarse.shares) else coarse.under(shares)
    lines, s = coarse.lines, compression(coarse.problem, coarse.lines, coarse.guess)
    # curves over x for each load: the greatest compression on a line, and those at both its ends and at its kinks
    on_line = np.stack([peak_compression(s), s[:, :, 0, 0], s[:, :, -1, -1], *_at_kinks(scene, lines, s)])
    on_line = np.where(lines.active, on_line, np.nan).reshape(len(on_line), len(shares), len(coarse.phase), -1)
    on_line = on_line.transpose(1, 0, 3, 2).reshape(len(shares), len(on_line), -1)
    x = (lines.index[:, None] + coarse.phase).ravel()
    transfers = load_transfers(scene, coarse, x, on_line[:, 0], exact=exact)
    of_loads = _at_passages(scene, x, on_line)
    for transfer in transfers:
        of_loads[transfer.load] += _at_transfer(transfer)
    if scene.pair.meshing.overlap_ratio or lines.cells:
        for of_load, curves in zip(of_loads, on_line, strict=True):
            of_load += [_transition(_root(x, curve, i), 1) for curve in curves[1:] for i in _sign_changes(curve)]
    return of_loads


def _transition(x: float, rank: int, side: int = 0) -> Transition:
    """Transition at the phase τ of x = τ + k."""
    # a tiny negative x % 1.0 is rounded to 1.0
    return Transition(x % 1.0 % 1.0, rank, side)


def _at_transfer(transfer: LoadTransfer) -> list[Transition]:
    """Transitions at a load transfer: a single one, or both ends of its ramp."""
    if not transfer.ramp:
        return [_transition(transfer.x, 0, transfer.side)]
    first, whole = transfer.ends
    return [_transition(first, -1), _transition(whole, -1, transfer.side)]


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
    action, a spur pair touches with an edge or the corner of a relief before the passage and with its flank after it,
    or the reverse; the contact law changes continuously from one to the other. Curves are steep on the inner sides of
    the ends of the path, and outside the two passages between which the corner of a relief touches.
    """
    meshing, (_, u, y) = scene.pair.meshing, passage
    if not meshing.overlap_ratio:
        flanks = flank_separation(scene)
        if flanks is None:
            return 0
        inwards = 1 if 2 * u < meshing.path_start + meshing.path_end else -1
        nearest_kink = min(flanks.kinks, key=lambda kink: abs(kink - u), default=u)
        outer_passage = u in flanks.changes and inwards * (u - nearest_kink) < 0
        return -inwards if outer_passage else inwards
    return int((u, y) == (meshing.path_start, meshing.face_width)) - int((u, y) == (meshing.path_end, 0.0))


def _at_kinks(scene: Scene, lines: ContactLines, s: NDArray) -> list[NDArray]:
    """Compressions of helical lines at the kinks of their gap in u, each (position, pair).

    They are zero where an end of a patch passes a kink; there curves bend. NaN if the line has no such kink, or if it
    touches at one of its ends.
    """
    meshing = scene.pair.meshing
    if not (meshing.overlap_ratio and lines.cells):
        return []
    inside = np.maximum(s[:, :, 0, 0], s[:, :, -1, -1]) <= 0
    width = lines.length * math.sin(meshing.beta_b)
    begin, width, at_kinks = lines.u - width / 2, np.where(width > 0, width, np.inf), []
    for kink in _under_load(scene, gap_kinks(scene)[0]):
        t = (kink - begin) / width
        cell = np.argmax((t >= 0) & (t <= 1), axis=2)[..., None]
        t = np.take_along_axis(t, cell, axis=2)[..., 0]
        a, m, e = np.moveaxis(np.take_along_axis(s, cell[..., None], axis=2)[:, :, 0], -1, 0)
        # parabola through the values at beginning, middle and end of the cell
        value = a * (1 - t) * (1 - 2 * t) + 4 * m * t * (1 - t) + e * t * (2 * t - 1)
        at_kinks.append(np.where(inside & (t >= 0) & (t <= 1), value, np.nan))
    return at_kinks


def _under_load(scene: Scene, kinks: Iterable[float]) -> list[float]:
    """``kinks`` in u; off the line of action, both ends of the contact at a corner replace the kink between them."""
    flanks = flank_separation(scene)
    return [*kinks] if flanks is None else [*(u for u in kinks if u not in flanks.kinks), *flanks.changes]


def _at_passages(scene: Scene, x: NDArray, on_line: NDArray) -> list[list[Transition]]:
    """Transitions at passages through an end of the path (rank 0) or a kink, if the flanks touch there.

    One list for each load case of ``on_line`` (load, curve, x), whose curves are the greatest compression on a line and
    the compressions at its beginning, at its end, and at its kinks.
    """
    meshing = scene.pair.meshing
    kinks, face = gap_kinks(scene)
    if not meshing.overlap_ratio:  # the whole line touches at the corner of a relief
        kinks = _under_load(scene, kinks)
    ends = (meshing.path_start, meshing.path_end)
    of_loads: list[list[Transition]] = [[] for _ in on_line]
    for passage in _passages(scene, (*ends, *kinks), face):
        side, (x_passage, u, y) = _steep_side(scene, passage), passage
        # contact anywhere on the line counts, except where an end of a long helical line passes
        anywhere = side != 0 or not meshing.overlap_ratio or y in face
        curve = on_line[:, 0 if anywhere else 2 if y else 1]
        i = np.searchsorted(x, x_passage)
        for load in np.flatnonzero(np.any(curve[:, max(i - 1, 0) : i + 1] > 0, axis=1)):
            rank = 0 if u in ends or not meshing.overlap_ratio else 1
            of_loads[load].append(_transition(x_passage, rank, side))
    return of_loads


def _sign_changes(curve: NDArray) -> NDArray:
    """Indices i such that the curve changes sign between i and i + 1."""
    with np.errstate(invalid="ignore"):
        return np.flatnonzero((curve[1:] > 0) & (curve[:-1] <= 0) | (curve[1:] <= 0) & (curve[:-1] > 0))


def _root(x: NDArray, curve: NDArray, i: int) -> float:
    """x at which the straight line through the points i and i + 1 of the curve is zero."""
    a, b = curve[i], curve[i + 1]
    return float(x[i] + (x[i + 1] - x[i]) * a / (a - b))
