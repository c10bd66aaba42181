"""Births: where a pair of teeth takes or leaves its load under load.

Solved without that pair, its least gap beyond the approach is a smooth curve of x = τ + k, which runs on while the pair
passes through the mesh: the polynomial through a few values between two phases, of which one is loaded and the other is
not, has its zero where the load begins. Patches are short there, so that lines have many segments; their compliance
need not be known well.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import (
    COARSE_SEGMENTS,
    COARSE_TRUNCATION,
    Look,
    assemble,
    flank_separation,
    gaps_along,
    scene_lines,
    smooth_nodes,
)
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


def births(
    scene: Scene, look: Look, x: NDArray, greatest: NDArray, *, exact: bool = False
) -> list[list[tuple[float, int]]]:
    """x at which a pair takes (side 1) or leaves (−1) its load, from where the ``greatest`` compression is positive.

    Under each load of the ``look``. Those of spur pairs that touch all along their lines are found from it alone where
    that says well enough when they are: short patches would need finer lines.

    ``greatest`` (load, number of the pair · phase) belongs to x = τ + k, ascending, and is NaN where there is no line.
    ``exact``: each is found once more, and once more, from solutions of which nothing is left out.
    """
    meshing = scene.pair.meshing
    loaded = np.nan_to_num(greatest, nan=-1.0) > 0
    load, at = np.nonzero(loaded[:, 1:] != loaded[:, :-1])
    known: list[tuple[int, float, int]] = []
    if at.size and not (meshing.overlap_ratio or look.lines.cells or exact):
        known, left = _from_look(scene, look, x, loaded, load, at)
        load, at = load[left], at[left]
    if at.size:
        known += _between(scene, look.shares, x, loaded, load, at, exact=exact)
    return [[(birth, side) for i, birth, side in known if i == j] for j in range(len(loaded))]


def _between(
    scene: Scene, shares: NDArray, x: NDArray, loaded: NDArray, load: NDArray, at: NDArray, *, exact: bool
) -> list[tuple[int, float, int]]:
    """Load, x and side of births between x[at] and x[at + 1], under the ``load`` of each: from solutions there."""
    meshing = scene.pair.meshing
    low, high = x[at], x[at + 1]
    if flank_separation(scene) is None:  # within the path of contact, whose ends are known beforehand
        low, high = np.maximum(low, -meshing.overlap_ratio), np.minimum(high, meshing.transverse_contact_ratio)
    inside = low[:, None] + (high - low)[:, None] * np.array(BETWEEN)
    margins = _margins(scene, inside, shares[load])
    # beyond phases at which finer lines say otherwise, but not beyond the ends of a line
    low, high = np.where(low == x[at], low - BEYOND, low), np.where(high == x[at + 1], high + BEYOND, high)
    found: list[tuple[int, float, int]] = []
    doubtful: list[tuple[int, float, int]] = []
    for j, i, points, margin, a, b in zip(load.tolist(), at, inside, margins, low, high, strict=True):
        birth = _zero(points, margin, a, b)
        if birth is None:  # a straight line goes on where polynomials turn
            ends = np.abs(margin).argsort()[:2]
            birth = _zero(points[ends], margin[ends], a, b)
        if birth is not None:
            near = np.sort(np.abs(points - birth).argsort()[:-1])
            again = _zero(points[near], margin[near], a, b)
            sure = again is not None and abs(again - birth) < KNOWN and not exact
            (found if sure else doubtful).append((j, birth, -1 if loaded[j, i] else 1))
    return found + _located(scene, shares, doubtful, NEAR if exact else NEAR[:1], exact=exact)


def _from_look(
    scene: Scene, look: Look, x: NDArray, loaded: NDArray, load: NDArray, at: NDArray
) -> tuple[list[tuple[int, float, int]], NDArray]:
    """Births of spur pairs between x[at] and x[at + 1], and which of them are not known so.

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
    from_here = (there & ~(carrying & sole)).all(axis=1)
    known, left = np.flatnonzero(from_here), np.flatnonzero(~from_here).tolist()
    if not known.size:
        return [], np.array(left)
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
    own = np.arange(within.size), number.astype(int) - lines.index[0]
    gap = gaps_along(scene, lines)[own].reshape(*within.shape, shape[2], -1) / scale
    exists = lines.active[own].reshape(within.shape)
    cubics = [np.linalg.solve(np.vander(nodes).T, np.vander(t, len(nodes)).T).T for nodes in (AROUND, AROUND[:3])]
    margins = [greatest_on_lines(np.einsum("tn,bn...->bt...", c, free[:, : c.shape[1]]) - gap) for c in cubics]
    found = []
    for i, (j, index) in enumerate(zip(load.tolist(), at, strict=True)):
        of_four, of_three = (_change(within[i], np.where(exists[i], margin[i], -np.inf)) for margin in margins)
        if of_four is None or of_three is None or abs(of_four - of_three) > KNOWN:
            left.append(int(known[i]))
        else:
            found.append((j, of_four, -1 if loaded[j, index] else 1))
    return found, np.sort(np.array(left, dtype=np.int64))


def _change(x: NDArray, values: NDArray) -> float | None:
    """x at which a curve changes its sign, once, between finite values; None if it does not."""
    change = np.flatnonzero((values[1:] > 0) != (values[:-1] > 0))
    if len(change) != 1 or not np.isfinite(values[change[0] : change[0] + 2]).all():
        return None
    i = int(change[0])
    return float(x[i] + (x[i + 1] - x[i]) * values[i] / (values[i] - values[i + 1]))


def _margins(scene: Scene, x: NDArray, share: NDArray, *, exact: bool = False) -> NDArray:
    """By how much a pair would be pressed at x, at most, by gears that it does not carry, in the shape of x.

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


def _located(
    scene: Scene, shares: NDArray, births: list[tuple[int, float, int]], reaches: tuple[float, ...], *, exact: bool
) -> list[tuple[int, float, int]]:
    """Births once more, from solutions as close to their x as each of ``reaches``."""
    if not births:
        return []
    load, found, sides = map(np.array, zip(*births, strict=True))
    for reach in reaches:
        x = found[:, None] + reach * np.array([-1.0, 0.0, 1.0])
        margins = _margins(scene, x, shares[load], exact=exact)
        zeros = [_zero(at, m, at[0] - 2 * reach, at[2] + 2 * reach) for at, m in zip(x, margins, strict=True)]
        found = np.array([at if zero is None else zero for at, zero in zip(found, zeros, strict=True)])
    return list(zip(load.tolist(), found.tolist(), sides.tolist(), strict=True))


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
