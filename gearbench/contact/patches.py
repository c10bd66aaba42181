"""Second solution of the contact, at points on the contact patches of the lines.

The first solution is on cells: segments over which the gap may vary. It gives the approach δ and the amplitudes q of
the smooth deflection. The compression s(y) = δ − e(y) − ψ(y)·q changes sign at the ends of the patches. An error ε of
these ends changes loads and deflections by O(ε²), but the stiffness by O(ε), because a point is stiff as soon as it
touches. The ends are therefore located again, from the compressions at the points of the patches and on the cells.
Between the ends the integrands are smooth, and sums over the points of ``patch_rules`` converge fast.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.gaps import total_gap
from gearbench.contact.interpolation import interpolation_matrix, values_at
from gearbench.contact.problem import ContactProblem, ContactSolution, under_shares
from gearbench.contact.scaling import by_lever, scale_problem
from gearbench.contact.solver import (
    ROUGH,
    ConvergenceError,
    Guess,
    law_forces,
    smooth_deflections,
    solve,
    solve_roughly,
)
from gearbench.effects.base import LineLaw
from gearbench.geometry.action import NEGLIGIBLE_WIDTH, ContactLines
from gearbench.geometry.quadrature import gauss

#: Number of times that the ends of patches are computed; each time squares the error of loads and deflections.
ROUNDS = 3
#: Once the residual on cells is below this, Newton's method takes one more step and ends. The residual is then far
#: below the error of the patch ends found on cells, so that the initial guess changes the result of the last round by
#: less than 1e-12.
ON_CELLS = 1e-5
#: The same for the rounds on patches before the last. Patch ends found on cells leave more than 1e-4 of the loads open,
#: however exactly the first round is solved. The second gives the stiffness of the error estimate too.
BEFORE_LAST = (1e-2, 1e-4)
#: Number of points on a line, besides those of patches, at which the compression is computed for the next round.
PROBES = 4


class Patches(NamedTuple):
    """``problem`` at points on the patches and its contact ``lines``, made from the problem ``on_cells``.

    Each line ends with probes, which carry no load.
    """

    problem: ContactProblem
    lines: ContactLines
    on_cells: ContactProblem


def solve_patches(problem: ContactProblem, guess: Guess | None = None) -> ContactSolution:
    """Solve ``problem``; if its segments are cells, solve it again on the contact patches.

    Forces are reported for the segments of ``problem``. ``guess`` is used as in ``solve`` and holds the solution on the
    patches afterwards.

    Raises
    ------
    ConvergenceError
        If a residual stays above 1e-9.
    """
    guess = guess or Guess.empty(problem)
    if problem.cells is None:
        return solve(problem, guess)
    found = first_round(problem, guess)
    for tolerance in BEFORE_LAST:
        found = next_round(problem, guess, found.patches, tolerance)
    return last_round(problem, guess, found)[0]


class Round(NamedTuple):
    """A solution: approach δ_n and ∂F_bn/∂δ_n (position,) [mm; N/mm], and its ``patches``, None if it is on cells."""

    approach: NDArray
    stiffness: NDArray
    patches: Patches | None


def first_round(problem: ContactProblem, guess: Guess, tolerance: float = ON_CELLS) -> Round:
    """Rough solution of ``problem`` on cells to a ``tolerance``, accurate enough to find the ends of patches."""
    return Round(*solve_roughly(problem, guess, tolerance), None)


def next_round(problem: ContactProblem, guess: Guess, previous: Patches | None, tolerance: float = ROUGH) -> Round:
    """Rough solution of ``problem`` to a ``tolerance`` on new patches, which follow from the solution in ``guess``.

    That solution is on the ``previous`` patches; None: on cells. Afterwards ``guess`` holds the new one.
    """
    patches = on_patches(problem, guess, previous)
    return Round(*solve_roughly(patches.problem, guess, tolerance), patches)


def last_round(problem: ContactProblem, guess: Guess, before: Round) -> tuple[ContactSolution, Round]:
    """Checked solution of ``problem`` on the patches of the round ``before``, with the forces of its cells.

    Raises
    ------
    ConvergenceError
        If a residual stays above 1e-9.
    """
    patches = on_patches(problem, guess, before.patches)
    solution = solve(patches.problem, guess)
    # approach and stiffness of the round before, for the error estimate
    coarse = {"coarse_approach": before.approach, "coarse_stiffness": before.stiffness}
    cells = {"force": forces_on_cells(problem, guess, solution.force)}
    return replace(solution, **coarse, **cells), Round(solution.approach, solution.stiffness, patches)


def solve_roughly_on_patches(problem: ContactProblem, guess: Guess, rounds: int = ROUNDS) -> tuple[NDArray, NDArray]:
    """Approach δ_n [mm] and ∂F_bn/∂δ_n [N/mm] on the contact patches, as ``solve_roughly``.

    ``guess`` holds the solution of ``problem`` on cells; afterwards it holds the solution on the patches, whose ends
    are computed ``rounds`` times.

    Raises
    ------
    ConvergenceError
        If they are not finite.
    """
    found = next_round(problem, guess, None)
    for _ in range(rounds - 1):
        found = next_round(problem, guess, found.patches)
    if not np.isfinite([found.approach, found.stiffness]).all():
        raise ConvergenceError("contact not solved on its patches")
    return found.approach, found.stiffness


def _nodes(problem: ContactProblem, guess: Guess, previous: Patches | None) -> tuple[NDArray, NDArray]:
    """``patch_nodes``; a position without a patch gets its nodes on the cell with the greatest compression."""
    s, known = _compression(problem, guess), None
    if previous is not None:
        y, s_at_y = previous.lines.y, _at_points(previous.problem, guess)
        order = y.argsort(axis=-1)
        known = np.take_along_axis(y, order, axis=-1), np.take_along_axis(s_at_y, order, axis=-1)
    cells = problem.cells
    assert cells is not None
    y, width = patch_nodes(cells.lines, s, cells.nodes, known)
    without_patch = np.flatnonzero(width.sum(axis=(1, 2)) == 0)
    if without_patch.size:
        # the patch lies within a single cell and reaches neither its ends nor its middle: the cell becomes the patch
        by_cell = s.reshape(len(s), -1, 3).copy()
        exists = np.repeat(cells.lines.active, problem.shape[2], axis=1)[without_patch]
        by_cell[without_patch, np.where(exists, by_cell[without_patch].max(axis=2), -np.inf).argmax(axis=1)] = 1.0
        # This is rare: at all positions, the ends of this round follow from the compressions on cells alone.
        y, width = patch_nodes(cells.lines, by_cell.reshape(s.shape), cells.nodes)
    return y, width


def compression(problem: ContactProblem, lines: ContactLines, guess: Guess) -> NDArray:
    """Compression s under the solution ``guess`` [``length_scale``], (position, pair, segment, 1 or 3).

    The last axis holds the node of a segment, or beginning, middle and end of a cell. s is −1 if there is no line.
    """
    if problem.cells is not None:
        return _compression(problem, guess)
    return np.where(lines.active[..., None], _at_points(problem, guess), -1.0)[..., None]


def _at_points(problem: ContactProblem, guess: Guess) -> NDArray:
    """Compression at the points of ``problem`` [``length_scale``], (position, pair, point)."""
    return (guess.delta[:, None] - problem.gap - smooth_deflections(problem, guess.q)).reshape(problem.shape)


def _compression(problem: ContactProblem, guess: Guess) -> NDArray:
    """``compression`` of cells."""
    cells = problem.cells
    assert cells is not None
    from gearbench.contact._patch_kernels import compressions

    s = np.empty(cells.gaps.shape)
    block, scale = np.ascontiguousarray(problem.block[:: problem.shape[2]]), problem.length_scale * cells.share
    compressions(
        cells.interpolation, cells.factor, guess.q, block, guess.delta, cells.gaps, scale, cells.lines.active, s
    )
    return s


def patch_nodes(
    lines: ContactLines, s: NDArray, nodes: int, known: tuple[NDArray, NDArray] | None = None
) -> tuple[NDArray, NDArray]:
    """Positions y and widths [mm] of ``nodes`` points on the patches of a line, followed by ``PROBES`` probes.

    Both are (position, pair, node and probe). Probes are ends of patches, and places where the flanks nearly touch
    (maxima of s below zero); their widths are zero. ``s`` (position, pair, segment, 3) is the compression at the
    beginning, middle and end of each cell, ``known`` holds y and s at further points, each (position, pair, point).
    Patches end where the cubic through the closest points changes sign or the gap has a kink.
    """
    from gearbench.contact._patch_kernels import patch_nodes as fill

    assert lines.panel is not None
    half = lines.length * math.cos(lines.pair.meshing.beta_b) / 2
    y, width = np.empty((2, *lines.shape[:2], nodes + PROBES))
    least = NEGLIGIBLE_WIDTH * lines.pair.meshing.face_width
    none = np.empty((*lines.shape[:2], 0))
    known_y, known_s = (none, none) if known is None else known
    fill(s, lines.y, half, lines.panel, lines.active, known_y, known_s, least, *patch_rules(nodes), y, width)
    return y, width


@lru_cache(maxsize=16)
def patch_rules(most: int) -> tuple[NDArray, NDArray]:
    """Nodes and weights on [−1, 1] of the rules with 1 to ``most`` points, (4, ``most`` + 1, ``most``) each.

    Row n of a table holds the rule of n points. The four tables are for patches without free ends, with a free end at
    1, at −1, and at both. A free end lies inside a panel: s is zero there, and the slope of the law rises like
    1/ln(1/s). A cubic x(t) maps Gauss points t to the nodes x. At free ends x'(t) = 0, which makes the integrand
    smoother (Davis and Rabinowitz, Methods of Numerical Integration, 1984, 2.12). At other ends x'(t) = 1, because the
    law of edges and corners varies quickly near them.
    """
    nodes, weights = np.zeros((2, 4, most + 1, most))
    for n in range(1, most + 1):
        t, w = gauss(n)
        x, slope = (5 * t + t**2 - t**3 - 1) / 4, (1 + t) * (5 - 3 * t) / 4
        nodes[:, n, :n] = t, -x[::-1], x, t * (3 - t**2) / 2
        weights[:, n, :n] = w, w * slope[::-1], w * slope, 1.5 * w * (1 - t**2)
    return nodes, weights


def on_patches(problem: ContactProblem, guess: Guess, previous: Patches | None = None) -> Patches:
    """Problem at points on the patches of the solution ``guess``, and its contact lines.

    With the ``previous`` patches, compressions at their points locate the ends more exactly than those on the cells.
    They are returned if they are of this problem and no point has moved, as on flanks that touch along all their lines.
    """
    cells = problem.cells
    assert cells is not None
    nodes = cells.lines.at(*_nodes(problem, guess, previous))
    if previous is not None and previous.on_cells is problem and _equal(nodes, previous.lines):
        return previous
    by_name = {effect.name: effect for effect in cells.effects}
    parts = [effect.compliance(nodes, by_name) for effect in cells.laws]
    zeros = np.zeros(nodes.shape)
    law = LineLaw.total([part for part in parts if isinstance(part, LineLaw)], nodes.shape)
    if nodes.touch is not None:
        # only the law: the smooth compliance in ``cells.factor`` is already divided by the levers
        _, law = by_lever(nodes.touch.levers[0], zeros[..., None], law)
    rows = interpolation_matrix(cells.smooth_lines, nodes.y)
    factor, gap = values_at(rows, cells.factor, cells.lines.active), total_gap(cells.effects, nodes)
    if cells.field is not None:
        gap = gap + (rows @ cells.field[..., None])[..., 0]
    gap = np.where(cells.lines.active[..., None], gap, 0.0)
    # no smooth compliance yet (``factor`` below replaces the zeros), and no variation of the gap within a point
    new = scale_problem(nodes, gap, zeros[..., None], law, zeros, problem.force, problem.length_scale, coupled=False)
    new = under_shares(new, cells.share)
    block = np.repeat(problem.block[:: problem.shape[2]], nodes.shape[2])
    factor = factor.reshape(*new.gap.shape, -1)
    return Patches(replace(new, factor=factor, block=block, blocks=problem.blocks), nodes, problem)


def _equal(nodes: ContactLines, others: ContactLines) -> bool:
    """Whether nodes of the same lines have the same positions and widths."""
    return np.array_equal(nodes.y, others.y) and np.array_equal(nodes.length, others.length)


def forces_on_cells(problem: ContactProblem, guess: Guess, exact: NDArray | None = None) -> NDArray:
    """Forces on the cells of ``problem`` [N] under the solution ``guess``, (position, pair, segment).

    They are scaled so that lines carry the loads of the forces ``exact`` (position, pair, point), if given.
    """
    force = problem.force * law_forces(problem, guess.delta, guess.q).reshape(problem.shape)
    if exact is None:
        return force
    exact, total = exact.sum(axis=2), force.sum(axis=2)
    return force * np.where(total > 0, exact / np.where(total > 0, total, 1.0), 0.0)[..., None]
