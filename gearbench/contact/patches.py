"""Contact solved once more on Gauss points of the loaded part of each contact line, between the ends of its patches.

On cells the end of a contact patch is known to second order in their length. The smooth deflection and the approach
found with them say where along each line flanks part: s(y) = δ − e(y) − ψ(y)·q changes its sign there. An error of
these positions changes loads, deflections and stiffness by its square only, and between them the integrands are smooth.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import scale_problem, total_gap
from gearbench.contact.problem import ContactProblem, ContactSolution
from gearbench.contact.solver import Guess, law_forces, solve, solve_roughly
from gearbench.effects.base import LineLaw
from gearbench.geometry.action import SHORTEST, ContactLines
from gearbench.geometry.quadrature import gauss, interpolation

#: Gauss points on a line for each panel that it has, at least: between kinks of the gap the load is smooth.
ON_PANEL = 5
#: How often the ends of patches are found: each time the error of what follows from them is squared.
ROUNDS = 2
#: Residual at which the solution on cells takes its last step. Their ends of patches are known to 1e-2 only, but of
#: the guess that it began with nothing must be seen after the last round (1e-12).
ON_CELLS = 1e-5


def solve_patches(problem: ContactProblem, guess: Guess | None = None) -> ContactSolution:
    """Solution of ``problem``, on the patches of contact where its segments are cells.

    Forces are those of the segments of ``problem``. ``guess`` as for ``solve``.

    Raises
    ------
    ConvergenceError
        If a residual stays above 1e-9.
    """
    guess = guess or Guess.nothing(problem)
    if problem.along is None:
        return solve(problem, guess)
    coarse = solve_roughly(problem, guess, ON_CELLS)
    last = Guess(q=guess.q.copy(), delta=guess.delta.copy())

    def on_patches() -> ContactProblem:
        return _on_nodes(problem, *_nodes(problem, _compression(problem, last)))

    for _ in range(ROUNDS - 1):
        coarse = solve_roughly(on_patches(), last)
    solution = solve(on_patches(), last)
    return replace(
        solution, coarse_approach=coarse[0], coarse_stiffness=coarse[1], force=_forces(problem, last, solution)
    )


def _nodes(problem: ContactProblem, s: NDArray) -> tuple[NDArray, NDArray]:
    """``patch_nodes``; where a position has no patch, on the whole of the cell that is pressed most."""
    along = problem.along
    assert along is not None
    assert along.lines.panel is not None
    nodes = max(along.factor.shape[2], ON_PANEL * (1 + int(along.lines.panel.max(initial=0))))
    y, width = patch_nodes(along.lines, s, nodes)
    alone = np.flatnonzero(width.sum(axis=(1, 2)) == 0)
    if alone.size:
        # a patch within a single cell, that reaches neither its ends nor its middle
        by_cell = s.reshape(len(s), -1, 3).copy()
        there = np.repeat(along.lines.active, problem.shape[2], axis=1)[alone]
        by_cell[alone, np.where(there, by_cell[alone].max(axis=2), -np.inf).argmax(axis=1)] = 1.0
        y, width = patch_nodes(along.lines, by_cell.reshape(s.shape), nodes)
    return y, width


def compression(problem: ContactProblem, lines: ContactLines, guess: Guess) -> NDArray:
    """s at nodes, or at beginning, middle and end of each cell [``length_scale``], (position, pair, segment, 1 or 3).

    Of the solution ``guess``; −1 where there is no line.
    """
    if problem.along is not None:
        return _compression(problem, guess)
    amplitudes = guess.q[:, problem.block[:: problem.shape[2]]]
    factor = problem.factor.reshape(*problem.shape, -1)
    s = guess.delta[:, None, None] - problem.gap.reshape(problem.shape) - (factor @ amplitudes[..., None])[..., 0]
    return np.where(lines.active[..., None], s, -1.0)[..., None]


def _compression(problem: ContactProblem, guess: Guess) -> NDArray:
    """s at the beginning, middle and end of each segment [``length_scale``]; −1 where there is no line."""
    along = problem.along
    assert along is not None
    amplitudes = guess.q[:, problem.block[:: problem.shape[2]]]
    smooth = (along.rows @ (along.factor @ amplitudes[..., None])[:, :, None])[..., 0]
    s = guess.delta[:, None, None, None] - along.gaps / problem.length_scale - smooth
    return np.where(along.lines.active[..., None, None], s, -1.0)


def patch_nodes(lines: ContactLines, s: NDArray, nodes: int) -> tuple[NDArray, NDArray]:
    """Nodes y and widths of ``nodes`` Gauss points on the patches of each line, (position, pair, node) [mm].

    ``s`` is the compression at the beginning, middle and end of each segment. Patches end where it changes its sign, or
    where the gap has a kink.
    """
    positions, pairs, segments = lines.shape
    assert lines.panel is not None
    half = (lines.length * math.cos(lines.pair.meshing.beta_b) / 2)[..., None]
    low, high = _loaded_part(s)
    low, high = (lines.y[..., None] + half * t for t in (low, high))
    loaded = (high - low > SHORTEST * lines.pair.meshing.face_width).reshape(-1, 2 * segments)
    low, high = low.reshape(loaded.shape), high.reshape(loaded.shape)
    panel = np.repeat(lines.panel, 2, axis=2).reshape(loaded.shape)
    joint = loaded[:, 1:] & loaded[:, :-1] & (panel[:, 1:] == panel[:, :-1])
    joint &= low[:, 1:] - high[:, :-1] <= SHORTEST * lines.pair.meshing.face_width
    none = np.zeros((len(loaded), 1), dtype=bool)
    first, last = loaded & ~np.hstack([none, joint]), loaded & ~np.hstack([joint, none])
    line, begin, end = np.nonzero(first)[0], low[first], high[last]
    count = _counts(line, end - begin, nodes)
    y, width = np.zeros((2, len(loaded) * nodes))
    # places of the nodes of a patch: behind those of the patches before it on the same line
    before = np.cumsum(count) - count
    start = line * nodes + before - before[np.searchsorted(line, line)]
    for n in np.unique(count):
        t, w = gauss(int(n))
        these = count == n
        at, reach = start[these, None] + np.arange(n), (end - begin)[these, None] / 2
        y[at], width[at] = begin[these, None] + reach * (1 + t), reach * w
    return y.reshape(positions, pairs, nodes), width.reshape(positions, pairs, nodes)


def _loaded_part(s: NDArray) -> tuple[NDArray, NDArray]:
    """Where each half of a cell is loaded, from −1 at its beginning to 1 at its end, (…, half); empty where low = high.

    s (…, 3) is taken to be the parabola through its values.
    """
    begin, middle, end = np.moveaxis(s, -1, 0)
    linear, square = (end - begin) / 2, (end + begin) / 2 - middle
    root = np.sqrt(np.maximum(linear**2 - 4 * square * middle, 0.0))
    big = -(linear + np.where(linear < 0, -root, root)) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        roots = np.stack([big / square, middle / big])
    lows, highs = [], []
    for a, b, left, right in ((-1.0, 0.0, begin, middle), (0.0, 1.0, middle, end)):
        off = np.where(np.isfinite(roots), np.abs(roots - (a + b) / 2), np.inf)
        at = np.clip(np.take_along_axis(roots, off.argmin(axis=0)[None], axis=0)[0], a, b)
        at = np.where(np.isfinite(at), at, (a + b) / 2)
        lows.append(np.where(left > 0, a, np.where(right > 0, at, b)))
        highs.append(np.where(right > 0, b, np.where(left > 0, at, b)))
    return np.stack(lows, axis=-1), np.stack(highs, axis=-1)


def _counts(line: NDArray, width: NDArray, nodes: int) -> NDArray:
    """Nodes of each patch: those of its line shared in proportion to the roots of the widths."""
    root = np.sqrt(width)
    whole = np.bincount(line, root)[line]
    on_line = np.bincount(line)[line]
    least = np.minimum(2, nodes // on_line)
    count = least + np.floor((nodes - least * on_line) * root / whole + 1e-9).astype(int)
    # what is left over goes to the widest
    left = nodes - np.bincount(line, count).astype(int)
    order = np.lexsort((-width, line))
    rank = np.arange(len(line)) - np.searchsorted(line, line)
    count[order] += rank < left[line]
    return count


def _on_nodes(problem: ContactProblem, y: NDArray, width: NDArray) -> ContactProblem:
    """``problem`` at other nodes of its lines, at y with widths (position, pair, node) [mm]."""
    along = problem.along
    assert along is not None
    lines, nodes = along.lines, along.lines.at(y, width)
    beside = {effect.name: effect for effect in along.effects}
    parts = [effect.compliance(nodes, beside) for effect in along.laws]
    none = np.zeros(nodes.shape)
    a = sum((part.a for part in parts if isinstance(part, LineLaw)), none)
    h = sum((part.h for part in parts if isinstance(part, LineLaw)), none)
    if nodes.touch is not None:
        w = nodes.touch.levers[0]
        a, h = (a + h * np.log(w)) / w**2, h / w**2
    low, high = lines.ends
    t = (2 * nodes.y - low - high) / np.where(high > low, high - low, 1.0)
    factor = interpolation(along.factor.shape[2], t) @ along.factor
    gap = np.where(nodes.active[..., None], total_gap(along.scene, nodes, along.effects), 0.0)
    new = scale_problem(nodes, gap, none[..., None], a, h, none, problem.force, problem.length_scale, coupled=False)
    block = np.repeat(problem.block[:: problem.shape[2]], nodes.shape[2])
    factor = np.ascontiguousarray(factor.reshape(*new.gap.shape, -1))
    return replace(new, factor=factor, block=block, blocks=problem.blocks)


def _forces(problem: ContactProblem, guess: Guess, solution: ContactSolution) -> NDArray:
    """Forces on the cells of ``problem`` by the ``solution`` on its patches, that are in equilibrium too."""
    force = law_forces(problem, guess.delta, guess.q).reshape(problem.shape)
    own = solution.force.sum(axis=2)
    total = force.sum(axis=2)
    return force * np.where(total > 0, own / np.where(total > 0, total, 1.0), 0.0)[..., None]
