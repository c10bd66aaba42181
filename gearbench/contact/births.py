"""Births: where a pair of teeth takes or leaves its load under load.

Solved without that pair, its least gap beyond the approach is a smooth curve of x = τ + k, which runs on while the pair
passes through the mesh, between the births of other pairs and the kinks of its own gap. A birth is a zero of it. Three
ways lead there, each dearer than the one before and taken where that is not sure: from the coarse solutions around
(``_from_look``), from values at four x in between (``_between``), from values closer and closer to it (``_located``).
Patches are short there, so that lines have many segments; their compliance need not be known well.

Flanks that are equally far apart along their line touch all along it over a short ramp, as others bend the gears
unevenly. On either side of it loads and approach are smooth, and they meet where the mean compression is zero: with a
linear law a fully loaded line would carry nothing there. Such a ramp has panels of its own where it is ``WIDE`` or the
panels beside it are short (C10 of docs/algorithms.md).
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
#: Where between two phases a birth is looked for, and how far the zeros of polynomials through all values there and
#: through all but one may be apart where it is known then [mesh cycles].
BETWEEN, KNOWN = (1e-3, 1 / 3, 2 / 3, 1 - 1e-3), 2e-4
#: How far beyond these phases it may be where finer lines say otherwise than coarse ones [mesh cycles].
BEYOND = 0.06
#: Coarse phases around a birth, counted from the one before it, and points between two of them.
AROUND, SAMPLED = np.array([-1, 0, 1, 2]), 33
#: Distances [mesh cycles] from a birth at which it is looked for once more.
NEAR = (3e-3, 1e-4)
#: A ramp as long as this has a panel of its own; longer than the second it is no ramp [mesh cycles].
WIDE, LONGEST_RAMP = 3e-3, 8e-3
#: From its first touch to where all of the line does, how many times as far as to where the mean compression is zero:
#: what touches first keeps the rest away. Measured on relieved spur pairs.
WHOLE = 4.0


class Birth(NamedTuple):
    """A pair takes or leaves its load.

    ``load`` is the number of the load; ``x`` = τ + k where it does, on the mean of its line; ``side`` 1 where it takes
    it, −1 where it leaves it; ``ramp`` how far from x the line touches first [mesh cycles], 0 where it needs no panel.
    """

    load: int
    x: float
    side: int
    ramp: float

    @property
    def ends(self) -> tuple[float, float]:
        """x at which the first and all of the line touches."""
        first = self.x - self.side * self.ramp
        return first, first + self.side * WHOLE * self.ramp


class Changes(NamedTuple):
    """Lines that begin or cease to be loaded between two phases of a look: load, index of the first phase in x.

    ``crowded`` where another pair does within a phase of it: then the curve of this one has a kink there. (change,)
    """

    load: NDArray
    at: NDArray
    crowded: NDArray

    def some(self, which: NDArray) -> Changes:
        """Some of them."""
        return Changes(*(each[which] for each in self))


class Located(NamedTuple):
    """x of births, NaN where they are not known so, and how far from there their lines touch first, (change,)."""

    x: NDArray
    ramp: NDArray


class Margin(NamedTuple):
    """Interference of an unloaded pair, see ``pressed``, and its peak."""

    mean: NDArray
    most: NDArray


def births(scene: Scene, look: Look, x: NDArray, greatest: NDArray, *, exact: bool = False) -> list[Birth]:
    """Births under each load of the ``look``, from where the ``greatest`` compression is positive.

    ``greatest`` (load, number of the pair · phase) belongs to x = τ + k, ascending, and is NaN where there is no line.
    ``exact``: each is found once more, and once more, from solutions of which nothing is left out.
    """
    loaded, count = np.nan_to_num(greatest, nan=-1.0) > 0, len(look.phase)
    # a pair that carries at its first phase, or at its last, has taken its load before that, or leaves it after
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
    # where panels beside it are long none of their phases is on the ramp
    ramp = np.where(changes.crowded | (found.ramp * WHOLE > WIDE), found.ramp, 0.0)
    each = zip(load.tolist(), found.x.tolist(), side.tolist(), ramp.tolist(), strict=True)
    return [Birth(*birth) for birth in each if math.isfinite(birth[1])]


def _kinks(scene: Scene, low: float, high: float) -> list[float]:
    """x between low and high at which a spur pair passes an end of the path or a kink of its gap: so do curves of x."""
    meshing = scene.pair.meshing
    if meshing.overlap_ratio or flank_separation(scene) is not None:
        return []
    phases = meshing.phases_at((meshing.path_start, meshing.path_end, *gap_kinks(scene)[0]))
    return sorted(x for phase in set(phases) for k in range(-1, 2) if low < (x := phase + math.floor(low) + k) < high)


def _between(scene: Scene, share: NDArray, given: tuple[NDArray, NDArray], crowded: NDArray, *, exact: bool) -> Located:
    """Births between the two x ``given``, under a ``share`` of the load each, from solutions there."""
    meshing, (low, high) = scene.pair.meshing, given
    if flank_separation(scene) is None:  # within the path of contact, whose ends are known beforehand
        low, high = np.maximum(low, -meshing.overlap_ratio), np.minimum(high, meshing.transverse_contact_ratio)
    ends = [[a, *_kinks(scene, a, b), b] for a, b in zip(low, high, strict=True)]
    piece = np.array([(i, a, b) for i, each in enumerate(ends) for a, b in pairwise(each)])
    change, begin, end = piece[:, 0].astype(int), piece[:, 1], piece[:, 2]
    points = begin[:, None] + (end - begin)[:, None] * np.array(BETWEEN)
    margins, _ = _margins(scene, points, share[change])
    # beyond phases at which finer lines say otherwise, but not beyond the ends of a line or where the approach jumps
    begin = np.where(begin == given[0][change], begin - BEYOND, begin)
    end = np.where(end == given[1][change], end + BEYOND, end)
    found, sure = Located(np.full(len(low), np.nan), np.zeros(len(low))), np.ones(len(low), dtype=bool)
    within = np.zeros((2, len(low)))
    crossing = (margins[:, 1:] > 0) != (margins[:, :-1] > 0)
    for i in crossing.any(axis=1).argsort(kind="stable").tolist():  # pieces on which the sign changes last: they decide
        x, margin, a, b = points[i], margins[i], float(begin[i]), float(end[i])
        birth = _zero(x, margin, a, b) if crossing[i].any() else None
        if birth is None:  # a straight line goes on where polynomials turn
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
    """Births of spur pairs between two phases of a look, from it alone.

    By how much a pair would be pressed but for its gap, by gears that it does not carry, is a smooth curve at each node
    of its line: the cubic through the solutions around. The gap is known wherever it is asked for.
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
    # the solutions around, of those that carry once more without them
    part = part_of(look.problem, position.ravel())
    guess = Guess(q=look.guess.q[position.ravel()].copy(), delta=look.guess.delta[position.ravel()].copy())
    s = _without(part, look.lines.part(position.ravel()), pair.ravel(), guess, carrying.ravel())
    scale = (look.problem.length_scale * look.shares[load])[:, None, None, None]
    own = np.arange(carrying.size), pair.ravel()
    gaps = part.along.gaps[own] if part.along else part.gap.reshape(*part.shape, 1)[own]
    free = s.reshape(*carrying.shape, shape[2], -1)
    free = free + gaps.reshape(free.shape) / (scale if part.along else 1.0)
    # between the two amid them
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
    """x at which a curve changes its sign, once, between finite values; None if it does not."""
    change = np.flatnonzero((values[1:] > 0) != (values[:-1] > 0))
    if len(change) != 1 or not np.isfinite(values[change[0] : change[0] + 2]).all():
        return None
    i = int(change[0])
    return float(x[i] + (x[i + 1] - x[i]) * values[i] / (values[i] - values[i + 1]))


def _margins(scene: Scene, x: NDArray, share: NDArray, *, exact: bool = False) -> Margin:
    """Margins of a pair at x, in its shape, each row under its ``share`` of the scene's load.

    −∞ where it has no line, ∞ where it carries alone: there are no others to be solved with.
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
    """Problem of many segments and few functions, or of all (``exact``), and its lines, at mesh phases."""
    lines = scene_lines(replace(scene, resolution=Resolution(positions=len(phase), segments=FINE_SEGMENTS)), phase)
    if exact:
        return assemble(scene, lines), lines
    nodes = round(math.sqrt(COARSE_SEGMENTS / FINE_SEGMENTS) * smooth_nodes(lines))
    return assemble(scene, lines, truncation=COARSE_TRUNCATION, nodes=nodes), lines


def _without(
    problem: ContactProblem, lines: ContactLines, pair: NDArray, guess: Guess, left_out: NDArray | bool = True
) -> NDArray:
    """``compression`` of the ``pair`` (position,) by the others, solved without it where it is ``left_out``."""
    others, own = problem.active.copy().reshape(problem.shape), (np.arange(len(pair)), pair)
    others[own] &= ~np.broadcast_to(left_out, len(pair))[:, None]
    solve_roughly(replace(problem, active=others.reshape(problem.active.shape)), guess)
    return compression(problem, lines, guess)[own]


def pressed(s: NDArray, length: NDArray) -> NDArray:
    """The compression of each line whose zero is a birth, from those of its segments and their ``length``.

    The mean over nodes of flanks that touch all along their line over a ramp, the greatest one on cells of others.
    """
    if s.shape[-1] > 1:
        return greatest_on_lines(s)
    whole = length.sum(axis=-1)
    return (s[..., 0] * length).sum(axis=-1) / np.where(whole > 0, whole, 1.0)


def greatest_on_lines(s: NDArray) -> NDArray:
    """The greatest compression on each line, from those at its nodes, or at beginning, middle and end of its cells."""
    if s.shape[-1] == 1:
        return s[..., 0].max(axis=-1)
    begin, middle, end = np.moveaxis(s, -1, 0)
    linear, square = (end - begin) / 2, middle - (end + begin) / 2
    # the vertex of the parabola through the three, where it lies on the cell
    inside = 2 * square > np.abs(linear)
    vertex = middle + linear**2 / (4 * np.where(inside, square, 1.0))
    return np.maximum(s.max(axis=-1), np.where(inside, vertex, -np.inf)).max(axis=-1)


def _located(scene: Scene, share: NDArray, x: NDArray, within: NDArray, *, exact: bool) -> Located:
    """Births at x once more, from solutions closer and closer to them, ``within`` (2, birth)."""
    found, ramp = x.copy(), np.zeros(len(x))
    for reach in NEAR:
        points = np.clip(found[:, None] + reach * np.array([-1.0, 0.0, 1.0]), *within[..., None])
        mean, most = _margins(scene, points, share, exact=exact)
        zeros = [_zero(at, m, at[0] - reach, at[2] + reach) for at, m in zip(points, mean, strict=True)]
        found = np.array([at if zero is None else zero for at, zero in zip(found, zeros, strict=True)])
        with np.errstate(invalid="ignore", divide="ignore"):  # between values of which one may be infinite
            ramp = np.abs((most - mean)[:, 1] * np.ptp(points, axis=1) / (mean[:, 2] - mean[:, 0]))
    return Located(found, np.where(WHOLE * ramp < LONGEST_RAMP, ramp, 0.0))


def _zero(x: NDArray, values: NDArray, low: float, high: float) -> float | None:
    """Zero in [low, high] of the polynomial through the finite ``values`` at x, nearest to where their sign changes.

    The middle of the two between which they do where there is no such polynomial, None where they do not.
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
