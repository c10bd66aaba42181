"""Load transfers: mesh phases at which a tooth pair takes up or sheds its load, under elastic deflections.

Pair k is at x = τ + k, which increases while the pair passes through the mesh. The contact is solved without this pair.
The interference that the pair would then have is the approach minus its gap and the smooth deflection of its flanks.
The pair takes up or sheds its load where the interference is zero. Between the load transfers of other pairs and the
kinks of the pair's gap it is a smooth function of x. Coarse solutions bracket the zeros. Three methods locate them; the
next, more expensive one is used if a method is not accurate enough:

1. ``_from_coarse`` interpolates the coarse solutions around the zero;
2. ``_between`` interpolates values at four x between two coarse phases;
3. ``_refined`` evaluates the interference ever closer to the zero.

Contact patches are short near a load transfer, so (2) and (3) use lines with many cells where flanks may part along
them, and the other pairs carry their loads on patches. A truncated smooth compliance is accurate enough.

If the gap is the same all along a line, the line begins to touch over a short ramp, a range of x, because the other
pairs bend the gears unevenly. Loads and approach are smooth before and after the ramp. Their smooth curves meet where
the mean compression is zero: with a linear law the total force of a line is proportional to the mean compression that
it would have without load. A ramp gets a panel of its own if it is longer than ``LONG_RAMP``, or if another load
transfer is close and panels are short there (C10 of docs/algorithms.md).
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import COARSE_SEGMENTS, COARSE_TRUNCATION, CoarseSolution, scene_lines
from gearbench.contact.gaps import flank_separation, gap_kinks, gaps_along
from gearbench.contact.lines import smooth_nodes
from gearbench.contact.patches import compression, next_round
from gearbench.contact.problem import ContactProblem, part_of, under_shares
from gearbench.contact.solver import Guess, solve_roughly
from gearbench.geometry.action import ContactLines
from gearbench.scene import Resolution, Scene

#: Number of segments on a line that begins or ceases to touch.
FINE_SEGMENTS = 40
#: Points between two coarse phases at which the interference is evaluated, as fractions of their distance.
TRIAL_POINTS = (1e-3, 1 / 3, 2 / 3, 1 - 1e-3)
#: A zero is accurate enough if two polynomials agree on it within this distance [mesh periods].
AGREEMENT = 2e-4
#: Distance beyond two coarse phases to which a zero is searched [mesh periods], because fine lines may disagree with
#: coarse ones.
SEARCH_MARGIN = 0.06
#: Coarse phases through which a cubic is laid, counted from the last phase before the zero, and number of points at
#: which it is evaluated.
CUBIC_PHASES, SAMPLES = np.array([-1, 0, 1, 2]), 33
#: Distances from an estimated zero at which the interference is evaluated again [mesh periods].
REFINING_DISTANCES = (3e-3, 1e-4)
#: Ramps longer than the first length get a panel; contact that spreads over more than the second length is not treated
#: as a ramp [mesh periods].
LONG_RAMP, RAMP_LIMIT = 3e-3, 8e-3
#: Length of a ramp, from first touch to contact of the whole line, divided by the distance from first touch to zero
#: mean compression. It was measured on relieved spur pairs. It exceeds 2, since the part that touches first keeps the
#: rest apart.
RAMP_RATIO = 4.0


class LoadTransfer(NamedTuple):
    """A tooth pair takes up or sheds its load.

    ``load`` is the number of the load case. ``x`` = τ + k is where the mean compression of the line is zero. ``side``
    is 1 if the pair takes up its load and −1 if it sheds it. ``ramp`` is the distance from first touch to x [mesh
    periods], 0 if the ramp needs no panel.
    """

    load: int
    x: float
    side: int
    ramp: float

    @property
    def ends(self) -> tuple[float, float]:
        """x at which the line begins to touch, and x at which all of it touches."""
        first = self.x - self.side * self.ramp
        return first, first + self.side * RAMP_RATIO * self.ramp


class Brackets(NamedTuple):
    """Pairs of coarse phases between which a line takes up or sheds its load, as arrays (transfer,).

    ``load`` is the number of the load case, ``first`` the index in x of the first of the two phases. ``crowded`` tells
    whether another pair of a spur gear takes up or sheds its load within one phase; the interference then has a kink.
    On helical gears lines take up their load gradually, and the interference is smooth enough.
    """

    load: NDArray
    first: NDArray
    crowded: NDArray

    def some(self, which: NDArray) -> Brackets:
        """The brackets selected by ``which``."""
        return Brackets(*(each[which] for each in self))


class Estimates(NamedTuple):
    """x of load transfers, NaN if not located, and distances ``ramp`` from first touch to x, both (transfer,)."""

    x: NDArray
    ramp: NDArray


class Interference(NamedTuple):
    """Interference that an unloaded pair would have: its ``transfer_compression`` and its peak along the line."""

    at_transfer: NDArray
    peak: NDArray


def load_transfers(
    scene: Scene, coarse: CoarseSolution, x: NDArray, peak: NDArray, *, exact: bool = False
) -> list[LoadTransfer]:
    """Load transfers under all load cases of the ``coarse`` solution, bracketed by changes of sign of the compression.

    Parameters
    ----------
    scene, coarse
        The scene and its coarse solution.
    x
        x = τ + k of all pairs and phases, ascending.
    peak
        Greatest compression on the line at x (load, x); NaN if there is no line.
    exact
        Whether to improve every load transfer by ``_refined``, with the full compliance.
    """
    loaded, count = np.nan_to_num(peak, nan=-1.0) > 0, len(coarse.phase)
    # a pair that is loaded at its first phase took up its load before; loaded at its last phase, it sheds it later
    loaded_at = np.pad(loaded, ((0, 0), (1, 1)))
    load, first = np.nonzero(loaded_at[:, 1:] != loaded_at[:, :-1])
    side = np.where(loaded_at[load, first], -1, 1)
    first -= 1
    distance = np.abs((first[:, None] - first + count // 2) % count - count // 2)
    neighbours = (distance <= 1) & (load[:, None] == load)
    crowded = (neighbours.sum(axis=1) > 1) & (scene.pair.meshing.overlap_ratio == 0)
    brackets = Brackets(load, first, crowded)
    estimates = Estimates(np.full(len(first), np.nan), np.zeros(len(first)))
    if not (scene.pair.meshing.overlap_ratio or coarse.lines.cells or exact):
        smooth = [1 <= i < len(x) - 2 and not _kinks(scene, float(x[i - 1]), float(x[i + 2])) for i in first.tolist()]
        simple = np.flatnonzero(np.array(smooth, dtype=bool) & ~brackets.crowded)
        if simple.size:
            estimates.x[simple], estimates.ramp[simple] = _from_coarse(scene, coarse, x, loaded, brackets.some(simple))
    unlocated = np.flatnonzero(np.isnan(estimates.x))
    if unlocated.size:
        extended = np.concatenate([[x[0] - 1 / count], x, [x[-1] + 1 / count]])
        limits = extended[first[unlocated] + 1], extended[first[unlocated] + 2]
        share = coarse.shares[load[unlocated]]
        estimates.x[unlocated], estimates.ramp[unlocated] = _between(
            scene, share, limits, crowded[unlocated], exact=exact
        )
    # next to long panels none of the Gauss phases falls on the ramp, so it needs no panel
    ramp = np.where(crowded | (estimates.ramp * RAMP_RATIO > LONG_RAMP), estimates.ramp, 0.0)
    each = zip(load.tolist(), estimates.x.tolist(), side.tolist(), ramp.tolist(), strict=True)
    return [LoadTransfer(*transfer) for transfer in each if math.isfinite(transfer[1])]


def _kinks(scene: Scene, low: float, high: float) -> list[float]:
    """x between low and high at which a spur pair passes an end of the path or a kink of its gap; curves kink there."""
    meshing = scene.pair.meshing
    if meshing.overlap_ratio or flank_separation(scene) is not None:
        return []
    phases = meshing.phases_at((meshing.path_start, meshing.path_end, *gap_kinks(scene)[0]))
    return sorted(x for phase in set(phases) for k in range(-1, 2) if low < (x := phase + math.floor(low) + k) < high)


def _between(
    scene: Scene, share: NDArray, brackets: tuple[NDArray, NDArray], crowded: NDArray, *, exact: bool
) -> Estimates:
    """Load transfers between the lower and the upper x of ``brackets``, under a ``share`` of the load (bracket,).

    The contact is solved at the ``TRIAL_POINTS`` of each bracket.
    """
    meshing, (low, high) = scene.pair.meshing, brackets
    if flank_separation(scene) is None:  # load transfers lie within the path of contact
        low, high = np.maximum(low, -meshing.overlap_ratio), np.minimum(high, meshing.transverse_contact_ratio)
    # a bracket with kinks is searched piece by piece; ``index`` is the bracket of a piece
    ends = [[a, *_kinks(scene, a, b), b] for a, b in zip(low, high, strict=True)]
    piece = np.array([(i, a, b) for i, each in enumerate(ends) for a, b in pairwise(each)])
    index, begin, end = piece[:, 0].astype(int), piece[:, 1], piece[:, 2]
    points = begin[:, None] + (end - begin)[:, None] * np.array(TRIAL_POINTS)
    interference, _ = _interference_at(scene, points, share[index])
    # search beyond the coarse phases too, but not beyond an end of the line or a jump of the approach
    begin = np.where(begin == brackets[0][index], begin - SEARCH_MARGIN, begin)
    end = np.where(end == brackets[1][index], end + SEARCH_MARGIN, end)
    estimates, accurate = Estimates(np.full(len(low), np.nan), np.zeros(len(low))), np.ones(len(low), dtype=bool)
    within = np.zeros((2, len(low)))
    crossing = (interference[:, 1:] > 0) != (interference[:, :-1] > 0)
    for i in crossing.any(axis=1).argsort(kind="stable").tolist():  # pieces with a change of sign come last and decide
        x, values, a, b = points[i], interference[i], float(begin[i]), float(end[i])
        transfer = _zero(x, values, a, b) if crossing[i].any() else None
        if transfer is None:  # extrapolate by a straight line instead
            two = np.sort(np.abs(values).argsort()[:2])
            transfer = _zero(x[two], values[two], a, b)
        if transfer is None:
            continue
        # the polynomial without the farthest point must agree
        nearest = np.sort(np.abs(x - transfer).argsort()[:-1])
        by_nearest, j = _zero(x[nearest], values[nearest], a, b), index[i]
        estimates.x[j], within[:, j] = transfer, (a, b)
        accurate[j] = crossing[i].any() and by_nearest is not None and abs(by_nearest - transfer) < AGREEMENT
    inaccurate = np.flatnonzero(~accurate | crowded & np.isfinite(estimates.x) | exact & np.isfinite(estimates.x))
    if inaccurate.size:
        refined = _refined(scene, share[inaccurate], estimates.x[inaccurate], within[:, inaccurate], exact=exact)
        estimates.x[inaccurate], estimates.ramp[inaccurate] = refined
    return estimates


def _from_coarse(scene: Scene, coarse: CoarseSolution, x: NDArray, loaded: NDArray, brackets: Brackets) -> Estimates:
    """Load transfers of spur pairs between two coarse phases, from the coarse solutions alone.

    At a node of the line, interference plus gap is a smooth function of x. The cubic through the values at four coarse
    phases interpolates it; the exact gap is then subtracted. The result must agree with that of a parabola.
    """
    phases, shape, (load, first, _) = len(coarse.phase), coarse.lines.shape, brackets
    around = first[:, None] + CUBIC_PHASES
    pair, phase = np.divmod(np.clip(around, 0, len(x) - 1), phases)
    position = load[:, None] * phases + phase
    active = coarse.lines.active
    has_line = (around >= 0) & (around < len(x)) & active[position, pair]
    only_pair = active[position].sum(axis=-1) == 1
    loaded_at = has_line & loaded[load[:, None], pair * phases + phase]
    estimates = Estimates(np.full(len(first), np.nan), np.zeros(len(first)))
    # transfers whose pair has a line at all four phases, and is not the only pair where it is loaded
    known = np.flatnonzero((has_line & ~(loaded_at & only_pair)).all(axis=1))
    if not known.size:
        return estimates
    load, first, pair, position, loaded_at = (each[known] for each in (load, first, pair, position, loaded_at))
    # compressions at the four phases; where the pair is loaded, the contact is solved again without it
    part = part_of(coarse.problem, position.ravel())
    guess = Guess(q=coarse.guess.q[position.ravel()].copy(), delta=coarse.guess.delta[position.ravel()].copy())
    s = _without(part, coarse.lines.part(position.ravel()), pair.ravel(), guess, loaded_at.ravel())
    scale = (coarse.problem.length_scale * coarse.shares[load])[:, None, None, None]
    line = np.arange(loaded_at.size), pair.ravel()
    gaps = part.cells.gaps[line] if part.cells else part.gap.reshape(*part.shape, 1)[line]
    smooth = s.reshape(*loaded_at.shape, shape[2], -1)
    smooth = smooth + gaps.reshape(smooth.shape) / (scale if part.cells else 1.0)
    # points between the two inner phases
    t = np.linspace(0.0, 1.0, SAMPLES)
    within = x[first, None] + t * (x[first + 1] - x[first])[:, None]
    number = np.floor(within).ravel()
    lines = scene_lines(
        replace(scene, resolution=Resolution(positions=within.size, segments=shape[2])), within.ravel() - number
    )
    number = number.astype(int) - lines.index[0]
    line = np.arange(within.size), np.clip(number, 0, lines.shape[1] - 1)
    gap = gaps_along(scene.acting_effects, lines)[line].reshape(*within.shape, shape[2], -1) / scale
    exists = (lines.active[line] & (number == line[1])).reshape(within.shape)
    length = lines.length[line].reshape(*within.shape, -1)
    stencils = CUBIC_PHASES, CUBIC_PHASES[:3]
    weights = [np.linalg.solve(np.vander(nodes).T, np.vander(t, len(nodes)).T).T for nodes in stencils]
    on_lines = [np.einsum("tn,bn...->bt...", c, smooth[:, : c.shape[1]]) - gap for c in weights]
    curves = (
        transfer_compression(on_lines[0], length),
        transfer_compression(on_lines[1], length),
        peak_compression(on_lines[0]),
    )
    for i, each in enumerate(zip(*curves, strict=True)):
        signs = (_sign_change(within[i], np.where(exists[i], curve, -np.inf)) for curve in each)
        by_cubic, by_parabola, first_touch = signs
        if by_cubic is not None and by_parabola is not None and abs(by_cubic - by_parabola) < AGREEMENT:
            estimates.x[known[i]] = by_cubic
            estimates.ramp[known[i]] = 0.0 if first_touch is None else abs(first_touch - by_cubic)
    return estimates


def _sign_change(x: NDArray, values: NDArray) -> float | None:
    """x at which a curve changes sign; None unless it does so exactly once, between finite values."""
    index = np.flatnonzero((values[1:] > 0) != (values[:-1] > 0))
    if len(index) != 1 or not np.isfinite(values[index[0] : index[0] + 2]).all():
        return None
    i = int(index[0])
    return float(x[i] + (x[i + 1] - x[i]) * values[i] / (values[i] - values[i + 1]))


def _interference_at(scene: Scene, x: NDArray, share: NDArray, *, exact: bool = False) -> Interference:
    """Interference at x (transfer, point), each transfer under its ``share`` (transfer,) of the scene's load.

    The interference is −∞ if the pair has no line, and ∞ if this is the only pair, which must carry the load.
    """
    number = np.floor(x).ravel()
    phase, position = np.unique(x.ravel() - number, return_inverse=True)
    problem, lines = _fine(scene, phase, exact=exact)
    wanted = number.astype(int) - lines.index[0]
    pair = np.clip(wanted, 0, lines.shape[1] - 1)
    has_line = (pair == wanted) & lines.active[position, pair]
    interference = np.tile(np.where(has_line, np.inf, -np.inf), (2, 1))
    shared = np.flatnonzero(has_line & (lines.active.sum(axis=1) > 1)[position])
    if shared.size:
        part = under_shares(part_of(problem, position[shared]), np.repeat(share, x.shape[1])[shared])
        s = _without(part, lines.part(position[shared]), pair[shared], Guess.empty(part))
        interference[0, shared] = transfer_compression(s, lines.length[position[shared], pair[shared]])
        interference[1, shared] = peak_compression(s)
    return Interference(*interference.reshape(2, *x.shape))


def _fine(scene: Scene, phase: NDArray, *, exact: bool) -> tuple[ContactProblem, ContactLines]:
    """Problem and lines at mesh phases, with many segments if these are cells; the compliance is truncated.

    With ``exact`` segments are many in any case, and the compliance is whole. A line that touches as a whole has no
    short patches: coarse segments locate its load transfers to 1e-8.
    """

    def lines_of(segments: int, phase: NDArray) -> ContactLines:
        return scene_lines(replace(scene, resolution=Resolution(positions=len(phase), segments=segments)), phase)

    if exact:
        lines = lines_of(FINE_SEGMENTS, phase)
        return assemble(scene, lines), lines
    cells = lines_of(COARSE_SEGMENTS, phase[:1]).cells
    lines = lines_of(FINE_SEGMENTS if cells else COARSE_SEGMENTS, phase)
    nodes = round(math.sqrt(COARSE_SEGMENTS / FINE_SEGMENTS) * smooth_nodes(lines))
    return assemble(scene, lines, truncation=COARSE_TRUNCATION, nodes=nodes), lines


def _without(
    problem: ContactProblem, lines: ContactLines, pair: NDArray, guess: Guess, left_out: NDArray | bool = True
) -> NDArray:
    """``compression`` on the line of ``pair`` (position,), solved without this pair where it is ``left_out``."""
    others, line = problem.active.copy().reshape(problem.shape), (np.arange(len(pair)), pair)
    others[line] &= ~np.broadcast_to(left_out, len(pair))[:, None]
    rest = replace(problem, active=others.reshape(problem.active.shape))
    solve_roughly(rest, guess)
    if problem.cells is not None:
        # loads on cells may move a load transfer by a thousandth of the cycle, loads on patches do not
        remaining = replace(problem.cells.lines, length=np.where(others, problem.cells.lines.length, 0.0))
        next_round(replace(rest, cells=replace(problem.cells, lines=remaining)), guess, None)
    return compression(problem, lines, guess)[line]


def transfer_compression(s: NDArray, length: NDArray) -> NDArray:
    """Compression of a line that is zero at a load transfer, from those of its segments and their ``length``.

    It is the peak along the line if segments are cells, and otherwise the mean: the line then begins to touch over a
    short ramp.
    """
    if s.shape[-1] > 1:
        return peak_compression(s)
    whole = length.sum(axis=-1)
    return (s[..., 0] * length).sum(axis=-1) / np.where(whole > 0, whole, 1.0)


def peak_compression(s: NDArray) -> NDArray:
    """Greatest compression on each line, from values at its nodes, or at beginning, middle and end of its cells."""
    if s.shape[-1] == 1:
        return s[..., 0].max(axis=-1)
    begin, middle, end = np.moveaxis(s, -1, 0)
    linear, square = (end - begin) / 2, middle - (end + begin) / 2
    # vertex of the parabola through the three values, if it lies on the cell
    inside = 2 * square > np.abs(linear)
    vertex = middle + linear**2 / (4 * np.where(inside, square, 1.0))
    return np.maximum(s.max(axis=-1), np.where(inside, vertex, -np.inf)).max(axis=-1)


def _refined(scene: Scene, share: NDArray, x: NDArray, within: NDArray, *, exact: bool) -> Estimates:
    """Improve the load transfers at x (transfer,) by solutions ever closer to them.

    ``within`` (2, transfer) holds the lowest and the highest x at which a transfer is searched.
    """
    estimate, ramp = x.copy(), np.zeros(len(x))
    for reach in REFINING_DISTANCES:
        points = np.clip(estimate[:, None] + reach * np.array([-1.0, 0.0, 1.0]), *within[..., None])
        mean, peak = _interference_at(scene, points, share, exact=exact)
        zeros = [_zero(near, m, near[0] - reach, near[2] + reach) for near, m in zip(points, mean, strict=True)]
        estimate = np.array([old if zero is None else zero for old, zero in zip(estimate, zeros, strict=True)])
        with np.errstate(invalid="ignore", divide="ignore"):  # values may be infinite
            ramp = np.abs((peak - mean)[:, 1] * np.ptp(points, axis=1) / (mean[:, 2] - mean[:, 0]))
    return Estimates(estimate, np.where(RAMP_RATIO * ramp < RAMP_LIMIT, ramp, 0.0))


def _zero(x: NDArray, values: NDArray, low: float, high: float) -> float | None:
    """Zero in [low, high] of the polynomial through the finite ``values`` at x, closest to their change of sign.

    If there is no such zero, the middle of the two x between which the sign changes; None if it does not change.
    """
    index = np.flatnonzero((values[1:] > 0) != (values[:-1] > 0))
    near = float(x[index[0]] + x[index[0] + 1]) / 2 if index.size else None
    x, values = x[np.isfinite(values)], values[np.isfinite(values)]
    if len(x) > 1:
        middle, reach = (low + high) / 2, (high - low) / 2
        roots = np.roots(np.polyfit((x - middle) / reach, values, len(x) - 1))
        real = middle + reach * roots[np.abs(roots.imag) < 1e-9].real
        real = real[np.abs(real - middle) <= reach * (1 + 1e-9)]
        if real.size:
            target = x[np.abs(values).argmin()] if near is None else near
            return float(real[np.abs(real - target).argmin()])
    return near
