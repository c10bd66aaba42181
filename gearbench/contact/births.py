"""Births: mesh phases at which a tooth pair takes or leaves its load, elastic deflections included.

Pair k is at x = τ + k, which increases while the pair passes through the mesh. The contact is solved without this pair.
The interference that the pair would then have is the approach minus its gap and the smooth deflection of its flanks.
This curve of x is smooth between the births of other pairs and the kinks of the pair's own gap. A birth is a zero of
it. There are three ways to find a birth; each is more expensive, and is used if the one before is not sure:

1. ``_from_look`` interpolates the coarse solutions around the birth;
2. ``_between`` interpolates values at four x between two coarse phases;
3. ``_located`` evaluates the curve ever closer to the birth.

Contact patches are short near a birth, so (2) and (3) use lines with many segments. A truncated smooth compliance is
accurate enough.

Flanks with the same gap all along their line begin to touch over a short ramp, because the other pairs bend the gears
unevenly. Loads and approach are smooth before and after the ramp. Continued from both sides, they meet where the mean
compression is zero: with a linear law the total force of a line is proportional to the mean compression that it would
have without load. A ramp gets a panel of its own if the whole ramp is longer than ``WIDE``, or if another birth is
close and panels are short there (C10 of docs/algorithms.md).
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.gaps import flank_separation, gap_kinks, gaps_along
from gearbench.contact.lines import smooth_nodes
from gearbench.contact.look import COARSE_SEGMENTS, COARSE_TRUNCATION, Look, scene_lines
from gearbench.contact.patches import compression
from gearbench.contact.problem import ContactProblem, part_of, under
from gearbench.contact.solver import Guess, solve_roughly
from gearbench.geometry.action import ContactLines
from gearbench.scene import Resolution, Scene

#: Segments on lines that begin or cease to touch.
FINE_SEGMENTS = 40
#: Positions between two coarse phases at which the interference is evaluated. A birth is known if the zeros of the
#: polynomials through all values, and through all but one, differ by less than the second number [mesh cycles].
BETWEEN, KNOWN = (1e-3, 1 / 3, 2 / 3, 1 - 1e-3), 2e-4
#: Distance beyond these phases to which a birth is searched, because fine lines may disagree with coarse ones [mesh
#: cycles].
BEYOND = 0.06
#: Coarse phases around a birth, counted from the phase before it, and number of points between two phases.
AROUND, SAMPLED = np.array([-1, 0, 1, 2]), 33
#: Distances from a birth at which the interference is evaluated again [mesh cycles].
NEAR = (3e-3, 1e-4)
#: A ramp of at least the first length has a panel of its own; beyond the second length it is not a ramp [mesh cycles].
WIDE, LONGEST_RAMP = 3e-3, 8e-3
#: Length of a ramp, from first touch to contact of the whole line, over the distance from first touch to zero mean
#: compression. The part that touches first keeps the rest apart. Measured on relieved spur pairs.
WHOLE = 4.0


class Birth(NamedTuple):
    """A tooth pair takes or leaves its load.

    ``load`` is the number of the load case. ``x`` = τ + k is where the mean compression of the line is zero. ``side``
    is 1 if the pair takes its load and −1 if it leaves it. ``ramp`` is the distance from first touch to x [mesh
    cycles], 0 if the ramp needs no panel.
    """

    load: int
    x: float
    side: int
    ramp: float

    @property
    def ends(self) -> tuple[float, float]:
        """x at which the line begins to touch, and x at which all of it touches."""
        first = self.x - self.side * self.ramp
        return first, first + self.side * WHOLE * self.ramp


class Changes(NamedTuple):
    """Lines that begin or cease to be loaded between two coarse phases, as arrays (change,).

    ``load`` is the number of the load case, ``at`` the index in x of the first of the two phases. ``crowded`` tells
    whether another pair also changes within one phase; the interference curve then has a kink there.
    """

    load: NDArray
    at: NDArray
    crowded: NDArray

    def some(self, which: NDArray) -> Changes:
        """The changes selected by ``which``."""
        return Changes(*(each[which] for each in self))


class Located(NamedTuple):
    """x of births, NaN if not found, and distances ``ramp`` from there to first touch, both (change,)."""

    x: NDArray
    ramp: NDArray


class Margin(NamedTuple):
    """Interference of an unloaded pair as ``pressed`` measures it, and its peak along the line."""

    mean: NDArray
    most: NDArray


def births(scene: Scene, look: Look, x: NDArray, greatest: NDArray, *, exact: bool = False) -> list[Birth]:
    """Births under all load cases of the ``look``, bracketed by the sign of the ``greatest`` compression.

    Parameters
    ----------
    scene, look
        The scene and its coarse solution.
    x
        x = τ + k of all pairs and phases, ascending.
    greatest
        Greatest compression on the line at x (load, x); NaN if there is no line.
    exact
        Whether to locate every birth twice more, from solutions with the full compliance.
    """
    loaded, count = np.nan_to_num(greatest, nan=-1.0) > 0, len(look.phase)
    # a pair that is loaded at its first phase took its load before it; loaded at its last phase, it leaves it later
    carrying = np.pad(loaded, ((0, 0), (1, 1)))
    load, at = np.nonzero(carrying[:, 1:] != carrying[:, :-1])
    side = np.where(carrying[load, at], -1, 1)
    at -= 1
    apart = np.abs((at[:, None] - at + count // 2) % count - count // 2)
    changes = Changes(load, at, ((apart <= 1) & (load[:, None] == load)).sum(axis=1) > 1)
    found = Located(np.full(len(at), np.nan), np.zeros(len(at)))
    if not (scene.pair.meshing.overlap_ratio or look.lines.cells or exact):
        smooth = [1 <= i < len(x) - 2 and not _kinks(scene, float(x[i - 1]), float(x[i + 2])) for i in at.tolist()]
        some = np.flatnonzero(np.array(smooth, dtype=bool) & ~changes.crowded)
        if some.size:
            found.x[some], found.ramp[some] = _from_look(scene, look, x, loaded, changes.some(some))
    left = np.flatnonzero(np.isnan(found.x))
    if left.size:
        beyond = np.concatenate([[x[0] - 1 / count], x, [x[-1] + 1 / count]])
        given = beyond[at[left] + 1], beyond[at[left] + 2]
        share, crowded = look.shares[load[left]], changes.crowded[left]
        found.x[left], found.ramp[left] = _between(scene, share, given, crowded, exact=exact)
    # next to long panels none of the Gauss phases falls on the ramp, so it needs no panel
    ramp = np.where(changes.crowded | (found.ramp * WHOLE > WIDE), found.ramp, 0.0)
    each = zip(load.tolist(), found.x.tolist(), side.tolist(), ramp.tolist(), strict=True)
    return [Birth(*birth) for birth in each if math.isfinite(birth[1])]


def _kinks(scene: Scene, low: float, high: float) -> list[float]:
    """x between low and high at which a spur pair passes an end of the path or a kink of its gap; curves kink there."""
    meshing = scene.pair.meshing
    if meshing.overlap_ratio or flank_separation(scene) is not None:
        return []
    phases = meshing.phases_at((meshing.path_start, meshing.path_end, *gap_kinks(scene)[0]))
    return sorted(x for phase in set(phases) for k in range(-1, 2) if low < (x := phase + math.floor(low) + k) < high)


def _between(scene: Scene, share: NDArray, given: tuple[NDArray, NDArray], crowded: NDArray, *, exact: bool) -> Located:
    """Births between two x ``given`` (birth,), under a ``share`` (birth,) of the load, from solutions in between."""
    meshing, (low, high) = scene.pair.meshing, given
    if flank_separation(scene) is None:  # births lie within the path of contact
        low, high = np.maximum(low, -meshing.overlap_ratio), np.minimum(high, meshing.transverse_contact_ratio)
    ends = [[a, *_kinks(scene, a, b), b] for a, b in zip(low, high, strict=True)]
    piece = np.array([(i, a, b) for i, each in enumerate(ends) for a, b in pairwise(each)])
    change, begin, end = piece[:, 0].astype(int), piece[:, 1], piece[:, 2]
    points = begin[:, None] + (end - begin)[:, None] * np.array(BETWEEN)
    margins, _ = _margins(scene, points, share[change])
    # search beyond the coarse phases too, but not beyond an end of the line or a jump of the approach
    begin = np.where(begin == given[0][change], begin - BEYOND, begin)
    end = np.where(end == given[1][change], end + BEYOND, end)
    found, sure = Located(np.full(len(low), np.nan), np.zeros(len(low))), np.ones(len(low), dtype=bool)
    within = np.zeros((2, len(low)))
    crossing = (margins[:, 1:] > 0) != (margins[:, :-1] > 0)
    for i in crossing.any(axis=1).argsort(kind="stable").tolist():  # pieces with a change of sign come last and decide
        x, margin, a, b = points[i], margins[i], float(begin[i]), float(end[i])
        birth = _zero(x, margin, a, b) if crossing[i].any() else None
        if birth is None:  # extrapolate by a straight line instead
            two = np.sort(np.abs(margin).argsort()[:2])
            birth = _zero(x[two], margin[two], a, b)
        if birth is None:
            continue
        near = np.sort(np.abs(x - birth).argsort()[:-1])
        again, j = _zero(x[near], margin[near], a, b), change[i]
        found.x[j], within[:, j] = birth, (a, b)
        sure[j] = crossing[i].any() and again is not None and abs(again - birth) < KNOWN
    left = np.flatnonzero(~sure | crowded & np.isfinite(found.x) | exact & np.isfinite(found.x))
    if left.size:
        found.x[left], found.ramp[left] = _located(scene, share[left], found.x[left], within[:, left], exact=exact)
    return found


def _from_look(scene: Scene, look: Look, x: NDArray, loaded: NDArray, changes: Changes) -> Located:
    """Births of spur pairs between two coarse phases, from the coarse solutions alone.

    The interference that an unloaded pair would have without its gap is a smooth curve of x at each node of its line.
    It is interpolated by the cubic through the four solutions around; then the exact gap is subtracted.
    """
    phases, shape, (load, at, _) = len(look.phase), look.lines.shape, changes
    around = at[:, None] + AROUND
    pair, phase = np.divmod(np.clip(around, 0, len(x) - 1), phases)
    position = load[:, None] * phases + phase
    active = look.lines.active
    there = (around >= 0) & (around < len(x)) & active[position, pair]
    sole = active[position].sum(axis=-1) == 1
    carrying = there & loaded[load[:, None], pair * phases + phase]
    found = Located(np.full(len(at), np.nan), np.zeros(len(at)))
    known = np.flatnonzero((there & ~(carrying & sole)).all(axis=1))
    if not known.size:
        return found
    load, at, pair, position, carrying = load[known], at[known], pair[known], position[known], carrying[known]
    # compressions at the phases around; where the pair is loaded, the contact is solved again without it
    part = part_of(look.problem, position.ravel())
    guess = Guess(q=look.guess.q[position.ravel()].copy(), delta=look.guess.delta[position.ravel()].copy())
    s = _without(part, look.lines.part(position.ravel()), pair.ravel(), guess, carrying.ravel())
    scale = (look.problem.length_scale * look.shares[load])[:, None, None, None]
    own = np.arange(carrying.size), pair.ravel()
    gaps = part.along.gaps[own] if part.along else part.gap.reshape(*part.shape, 1)[own]
    free = s.reshape(*carrying.shape, shape[2], -1)
    free = free + gaps.reshape(free.shape) / (scale if part.along else 1.0)
    # points between the two inner phases
    t = np.linspace(0.0, 1.0, SAMPLED)
    within = x[at, None] + t * (x[at + 1] - x[at])[:, None]
    number = np.floor(within).ravel()
    lines = scene_lines(
        replace(scene, resolution=Resolution(positions=within.size, segments=shape[2])), within.ravel() - number
    )
    number = number.astype(int) - lines.index[0]
    own = np.arange(within.size), np.clip(number, 0, lines.shape[1] - 1)
    gap = gaps_along(scene.acting_effects, lines)[own].reshape(*within.shape, shape[2], -1) / scale
    exists = (lines.active[own] & (number == own[1])).reshape(within.shape)
    length = lines.length[own].reshape(*within.shape, -1)
    cubics = [np.linalg.solve(np.vander(nodes).T, np.vander(t, len(nodes)).T).T for nodes in (AROUND, AROUND[:3])]
    on_lines = [np.einsum("tn,bn...->bt...", c, free[:, : c.shape[1]]) - gap for c in cubics]
    curves = pressed(on_lines[0], length), pressed(on_lines[1], length), greatest_on_lines(on_lines[0])
    for i, each in enumerate(zip(*curves, strict=True)):
        of_four, of_three, first = (_change(within[i], np.where(exists[i], curve, -np.inf)) for curve in each)
        if of_four is not None and of_three is not None and abs(of_four - of_three) < KNOWN:
            found.x[known[i]] = of_four
            found.ramp[known[i]] = 0.0 if first is None else abs(first - of_four)
    return found


def _change(x: NDArray, values: NDArray) -> float | None:
    """x at which a curve changes sign; None unless it does so exactly once, between finite values."""
    change = np.flatnonzero((values[1:] > 0) != (values[:-1] > 0))
    if len(change) != 1 or not np.isfinite(values[change[0] : change[0] + 2]).all():
        return None
    i = int(change[0])
    return float(x[i] + (x[i + 1] - x[i]) * values[i] / (values[i] - values[i + 1]))


def _margins(scene: Scene, x: NDArray, share: NDArray, *, exact: bool = False) -> Margin:
    """Interference at x (birth, point), each row under its ``share`` of the scene's load.

    It is −∞ if the pair has no line, and ∞ if it is the only pair, which must carry the load.
    """
    number = np.floor(x).ravel()
    phase, position = np.unique(x.ravel() - number, return_inverse=True)
    problem, lines = _fine(scene, phase, exact=exact)
    wanted = number.astype(int) - lines.index[0]
    pair = np.clip(wanted, 0, lines.shape[1] - 1)
    there = (pair == wanted) & lines.active[position, pair]
    margins = np.tile(np.where(there, np.inf, -np.inf), (2, 1))
    shared = np.flatnonzero(there & (lines.active.sum(axis=1) > 1)[position])
    if shared.size:
        part = under(part_of(problem, position[shared]), np.repeat(share, x.shape[1])[shared])
        s = _without(part, lines.part(position[shared]), pair[shared], Guess.nothing(part))
        margins[0, shared] = pressed(s, lines.length[position[shared], pair[shared]])
        margins[1, shared] = greatest_on_lines(s)
    return Margin(*margins.reshape(2, *x.shape))


def _fine(scene: Scene, phase: NDArray, *, exact: bool) -> tuple[ContactProblem, ContactLines]:
    """Problem and lines at mesh phases, with many segments and a truncated compliance, or the full one if ``exact``."""
    lines = scene_lines(replace(scene, resolution=Resolution(positions=len(phase), segments=FINE_SEGMENTS)), phase)
    if exact:
        return assemble(scene, lines), lines
    nodes = round(math.sqrt(COARSE_SEGMENTS / FINE_SEGMENTS) * smooth_nodes(lines))
    return assemble(scene, lines, truncation=COARSE_TRUNCATION, nodes=nodes), lines


def _without(
    problem: ContactProblem, lines: ContactLines, pair: NDArray, guess: Guess, left_out: NDArray | bool = True
) -> NDArray:
    """``compression`` on the line of ``pair`` (position,), solved without this pair where it is ``left_out``."""
    others, own = problem.active.copy().reshape(problem.shape), (np.arange(len(pair)), pair)
    others[own] &= ~np.broadcast_to(left_out, len(pair))[:, None]
    solve_roughly(replace(problem, active=others.reshape(problem.active.shape)), guess)
    return compression(problem, lines, guess)[own]


def pressed(s: NDArray, length: NDArray) -> NDArray:
    """Compression of each line whose zero is a birth, from the compressions of its segments and their ``length``.

    It is the mean over the nodes if flanks touch all along their line over a ramp, and the greatest value if segments
    are cells.
    """
    if s.shape[-1] > 1:
        return greatest_on_lines(s)
    whole = length.sum(axis=-1)
    return (s[..., 0] * length).sum(axis=-1) / np.where(whole > 0, whole, 1.0)


def greatest_on_lines(s: NDArray) -> NDArray:
    """Greatest compression on each line, from values at its nodes, or at beginning, middle and end of its cells."""
    if s.shape[-1] == 1:
        return s[..., 0].max(axis=-1)
    begin, middle, end = np.moveaxis(s, -1, 0)
    linear, square = (end - begin) / 2, middle - (end + begin) / 2
    # vertex of the parabola through the three values, if it lies on the cell
    inside = 2 * square > np.abs(linear)
    vertex = middle + linear**2 / (4 * np.where(inside, square, 1.0))
    return np.maximum(s.max(axis=-1), np.where(inside, vertex, -np.inf)).max(axis=-1)


def _located(scene: Scene, share: NDArray, x: NDArray, within: NDArray, *, exact: bool) -> Located:
    """Improve births at x (birth,) by solutions ever closer to them, ``within`` the limits (2, birth)."""
    found, ramp = x.copy(), np.zeros(len(x))
    for reach in NEAR:
        points = np.clip(found[:, None] + reach * np.array([-1.0, 0.0, 1.0]), *within[..., None])
        mean, most = _margins(scene, points, share, exact=exact)
        zeros = [_zero(at, m, at[0] - reach, at[2] + reach) for at, m in zip(points, mean, strict=True)]
        found = np.array([at if zero is None else zero for at, zero in zip(found, zeros, strict=True)])
        with np.errstate(invalid="ignore", divide="ignore"):  # values may be infinite
            ramp = np.abs((most - mean)[:, 1] * np.ptp(points, axis=1) / (mean[:, 2] - mean[:, 0]))
    return Located(found, np.where(WHOLE * ramp < LONGEST_RAMP, ramp, 0.0))


def _zero(x: NDArray, values: NDArray, low: float, high: float) -> float | None:
    """Zero in [low, high] of the polynomial through the finite ``values`` at x, closest to their change of sign.

    If there is no such zero, the middle of the two x between which the sign changes; None if it does not change.
    """
    change = np.flatnonzero((values[1:] > 0) != (values[:-1] > 0))
    near = float(x[change[0]] + x[change[0] + 1]) / 2 if change.size else None
    x, values = x[np.isfinite(values)], values[np.isfinite(values)]
    if len(x) > 1:
        middle, reach = (low + high) / 2, (high - low) / 2
        roots = np.roots(np.polyfit((x - middle) / reach, values, len(x) - 1))
        real = middle + reach * roots[np.abs(roots.imag) < 1e-9].real
        real = real[np.abs(real - middle) <= reach * (1 + 1e-9)]
        if real.size:
            aim = x[np.abs(values).argmin()] if near is None else near
            return float(real[np.abs(real - aim).argmin()])
    return near
