"""Births: where a pair of teeth takes or leaves its load under load.

Solved without that pair, its least gap beyond the approach is a smooth curve of x = τ + k, which runs on while the pair
passes through the mesh: the polynomial through a few values between two phases, of which one is loaded and the other is
not, has its zero where the load begins. Patches are short there, so that lines have many segments; their compliance
need not be known well.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import COARSE_SEGMENTS, COARSE_TRUNCATION, Look, assemble, scene_lines, smooth_nodes
from gearbench.contact.gaps import flank_separation, gap_kinks, gaps_along
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
#: Phases of a first look around a birth, counted from the one before it, and points between two of them.
AROUND, SAMPLED = np.array([-1, 0, 1, 2]), 33
#: Distances [mesh cycles] from a birth at which it is looked for once more.
NEAR = (3e-3, 1e-4)


def _fine(scene: Scene, phase: NDArray, *, exact: bool) -> tuple[ContactProblem, ContactLines]:
    """Problem of many segments and few functions, or of all (``exact``), and its lines, at mesh phases."""
    lines = scene_lines(replace(scene, resolution=Resolution(positions=len(phase), segments=FINE_SEGMENTS)), phase)
    if exact:
        return assemble(scene, lines), lines
    nodes = round(math.sqrt(COARSE_SEGMENTS / FINE_SEGMENTS) * smooth_nodes(lines))
    return assemble(scene, lines, truncation=COARSE_TRUNCATION, nodes=nodes), lines


class Birth(NamedTuple):
    """A pair takes (side 1) or leaves (−1) its load at x = τ + k, under the load of this number."""

    load: int
    x: float
    side: int


def births(scene: Scene, look: Look, x: NDArray, greatest: NDArray, *, exact: bool = False) -> list[Birth]:
    """Births under each load of the ``look``, from where the ``greatest`` compression is positive.

    Those of spur pairs that touch all along their lines are found from it alone where that says well enough when they
    are: short patches would need finer lines.

    ``greatest`` (load, number of the pair · phase) belongs to x = τ + k, ascending, and is NaN where there is no line.
    ``exact``: each is found once more, and once more, from solutions of which nothing is left out.
    """
    loaded = np.nan_to_num(greatest, nan=-1.0) > 0
    # a pair that carries at its first phase, or at its last, has taken its load before that, or leaves it after
    carrying = np.pad(loaded, ((0, 0), (1, 1)))
    load, at = np.nonzero(carrying[:, 1:] != carrying[:, :-1])
    at -= 1
    side = np.where(carrying[load, at + 1], -1, 1)
    found = np.full(len(at), np.nan)
    if not (scene.pair.meshing.overlap_ratio or look.lines.cells or exact):
        amid = [1 <= i < len(x) - 2 and not _passages(scene, float(x[i - 1]), float(x[i + 2])) for i in at.tolist()]
        some = np.flatnonzero(np.array(amid, dtype=bool))
        if some.size:
            found[some] = _from_look(scene, look, x, loaded, load[some], at[some])
    left = np.flatnonzero(np.isnan(found))
    if left.size:
        beyond = np.concatenate([[x[0] - 1 / len(look.phase)], x, [x[-1] + 1 / len(look.phase)]])
        low, high = beyond[at[left] + 1], beyond[at[left] + 2]
        found[left] = _between(scene, look.shares[load[left]], low, high, exact=exact)
    known = np.isfinite(found)
    return [
        Birth(*each) for each in zip(load[known].tolist(), found[known].tolist(), side[known].tolist(), strict=True)
    ]


def _passages(scene: Scene, low: float, high: float) -> list[float]:
    """x between low and high at which a spur pair passes an end of the path or a kink of its gap: so do curves of x."""
    meshing = scene.pair.meshing
    if meshing.overlap_ratio or flank_separation(scene) is not None:
        return []
    phases = meshing.phases_at((meshing.path_start, meshing.path_end, *gap_kinks(scene, None)[0]))
    return sorted(x for phase in set(phases) for k in range(-1, 2) if low < (x := phase + math.floor(low) + k) < high)


def _between(scene: Scene, share: NDArray, low: NDArray, high: NDArray, *, exact: bool) -> NDArray:
    """x of births between low and high, under a share of the load each, from solutions there; NaN for none."""
    meshing, given = scene.pair.meshing, np.array([low, high])
    if flank_separation(scene) is None:  # within the path of contact, whose ends are known beforehand
        low, high = np.maximum(low, -meshing.overlap_ratio), np.minimum(high, meshing.transverse_contact_ratio)
    ends = [[a, *_passages(scene, a, b), b] for a, b in zip(low, high, strict=True)]
    piece = np.array([(i, a, b) for i, each in enumerate(ends) for a, b in pairwise(each)])
    change, begin, end = piece[:, 0].astype(int), piece[:, 1], piece[:, 2]
    points = begin[:, None] + (end - begin)[:, None] * np.array(BETWEEN)
    margins = _margins(scene, points, share[change])
    # beyond phases at which finer lines say otherwise, but not beyond the ends of a line or where the approach jumps
    begin, end = (
        np.where(begin == given[0, change], begin - BEYOND, begin),
        np.where(end == given[1, change], end + BEYOND, end),
    )
    found, sure = np.full(len(low), np.nan), np.ones(len(low), dtype=bool)
    within = np.zeros((2, len(low)))
    crossing = (margins[:, 1:] > 0) != (margins[:, :-1] > 0)
    for i in crossing.any(axis=1).argsort(kind="stable").tolist():  # pieces on which the sign changes last: they decide
        x, margin, a, b = points[i], margins[i], float(begin[i]), float(end[i])
        birth = _zero(x, margin, a, b)
        if birth is None:  # a straight line goes on where polynomials turn
            two = np.abs(margin).argsort()[:2]
            birth = _zero(x[two], margin[two], a, b)
        if birth is None:
            continue
        near = np.sort(np.abs(x - birth).argsort()[:-1])
        again, j = _zero(x[near], margin[near], a, b), change[i]
        found[j], within[:, j] = birth, (a, b)
        sure[j] = again is not None and abs(again - birth) < KNOWN and not exact
    left = np.flatnonzero(~sure)
    if left.size:
        found[left] = _located(scene, share[left], found[left], within[:, left], exact=exact)
    return found


def _from_look(scene: Scene, look: Look, x: NDArray, loaded: NDArray, load: NDArray, at: NDArray) -> NDArray:
    """x of births of spur pairs between x[at] and x[at + 1]; NaN where they are not known so.

    By how much a pair would be pressed but for its gap, by gears that it does not carry, is a smooth curve at each node
    of its line: the cubic through the solutions around. The gap is known wherever it is asked for.
    """
    phases, shape = len(look.phase), look.lines.shape
    around = at[:, None] + AROUND
    pair, phase = np.divmod(np.clip(around, 0, len(x) - 1), phases)
    position = load[:, None] * phases + phase
    active = look.lines.active
    there = (around >= 0) & (around < len(x)) & active[position, pair]
    sole = active[position].sum(axis=-1) == 1
    carrying = there & loaded[load[:, None], pair * phases + phase]
    known, births = np.flatnonzero((there & ~(carrying & sole)).all(axis=1)), np.full(len(at), np.nan)
    if not known.size:
        return births
    load, at, pair, position, carrying = load[known], at[known], pair[known], position[known], carrying[known]
    # the solutions around, of those that carry once more without them
    part = part_of(look.problem, position.ravel())
    others = part.active.copy().reshape(part.shape)
    others[np.arange(carrying.size), pair.ravel()] &= ~carrying.ravel()[:, None]
    guess = Guess(q=look.guess.q[position.ravel()].copy(), delta=look.guess.delta[position.ravel()].copy())
    solve_roughly(replace(part, active=others.reshape(part.active.shape)), guess)
    scale = (look.problem.length_scale * look.shares[load])[:, None, None, None]
    own = np.arange(carrying.size), pair.ravel()
    s = compression(part, look.lines.part(position.ravel()), guess)[own]
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
    gap = gaps_along(scene, lines)[own].reshape(*within.shape, shape[2], -1) / scale
    exists = (lines.active[own] & (number == own[1])).reshape(within.shape)
    cubics = [np.linalg.solve(np.vander(nodes).T, np.vander(t, len(nodes)).T).T for nodes in (AROUND, AROUND[:3])]
    margins = [greatest_on_lines(np.einsum("tn,bn...->bt...", c, free[:, : c.shape[1]]) - gap) for c in cubics]
    for i in range(len(at)):
        of_four, of_three = (_change(within[i], np.where(exists[i], margin[i], -np.inf)) for margin in margins)
        if of_four is not None and of_three is not None and abs(of_four - of_three) < KNOWN:
            births[known[i]] = of_four
    return births


def _change(x: NDArray, values: NDArray) -> float | None:
    """x at which a curve changes its sign, once, between finite values; None if it does not."""
    change = np.flatnonzero((values[1:] > 0) != (values[:-1] > 0))
    if len(change) != 1 or not np.isfinite(values[change[0] : change[0] + 2]).all():
        return None
    i = int(change[0])
    return float(x[i] + (x[i + 1] - x[i]) * values[i] / (values[i] - values[i + 1]))


def _margins(scene: Scene, x: NDArray, share: NDArray, *, exact: bool = False) -> NDArray:
    """Peak interference of an unloaded pair at x, in the shape of x.

    Each row under its ``share`` of the scene's load. −∞ where it has no line, ∞ where it carries alone: there are no
    others to be solved with.
    """
    number = np.floor(x).ravel()
    phase, position = np.unique(x.ravel() - number, return_inverse=True)
    problem, lines = _fine(scene, phase, exact=exact)
    pair = number.astype(int) - lines.index[0]
    there = lines.active[position, pair]
    margins = np.where(there, np.inf, -np.inf)
    shared = np.flatnonzero(there & (lines.active.sum(axis=1) > 1)[position])
    if shared.size:
        part = under(part_of(problem, position[shared]), np.repeat(share, x.shape[1])[shared])
        alone = part.active.copy().reshape(part.shape)
        alone[np.arange(len(shared)), pair[shared]] = False
        guess = Guess.nothing(part)
        solve_roughly(replace(part, active=alone.reshape(part.active.shape)), guess)
        s = compression(part, lines.part(position[shared]), guess)[np.arange(len(shared)), pair[shared]]
        margins[shared] = greatest_on_lines(s)
    return margins.reshape(x.shape)


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


def _located(scene: Scene, share: NDArray, x: NDArray, within: NDArray, *, exact: bool) -> NDArray:
    """Births at x once more, from solutions closer and closer to them, ``within`` (2, birth)."""
    found = x.copy()
    for reach in NEAR if exact else NEAR[:1]:
        points = np.clip(found[:, None] + reach * np.array([-1.0, 0.0, 1.0]), *within[..., None])
        margins = _margins(scene, points, share, exact=exact)
        zeros = [_zero(at, m, at[0] - reach, at[2] + reach) for at, m in zip(points, margins, strict=True)]
        found = np.array([at if zero is None else zero for at, zero in zip(found, zeros, strict=True)])
    return found


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
