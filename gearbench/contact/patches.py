"""Contact solved once more on Gauss points of the loaded part of each contact line, between the ends of its patches.

On cells the end of a contact patch is known to second order in their length. The smooth deflection and the approach
found with them say where along each line flanks part: s(y) = δ − e(y) − ψ(y)·q changes its sign there. An error of
these positions changes loads, deflections and stiffness by its square only, and between them the integrands are smooth.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.gaps import total_gap
from gearbench.contact.pieces import rows_at
from gearbench.contact.problem import ContactProblem, ContactSolution, under
from gearbench.contact.scaling import scale_problem
from gearbench.contact.solver import Guess, law_forces, solve, solve_roughly
from gearbench.effects.base import LineLaw
from gearbench.geometry.action import SHORTEST, ContactLines
from gearbench.geometry.quadrature import gauss

#: How often the ends of patches are found: each time the error of what follows from them is squared.
ROUNDS = 2
#: Residual at which the solution on cells takes its last step. Their ends of patches are known to 1e-2 only, but of
#: the guess that it began with nothing must be seen after the last round (1e-12).
ON_CELLS = 1e-5


def solve_patches(problem: ContactProblem, guess: Guess | None = None) -> ContactSolution:
    """Solution of ``problem``, on the patches of contact where its segments are cells.

    Forces are those of the segments of ``problem``. ``guess`` as for ``solve``: it holds the solution on the patches.

    Raises
    ------
    ConvergenceError
        If a residual stays above 1e-9.
    """
    guess = guess or Guess.nothing(problem)
    if problem.along is None:
        return solve(problem, guess)
    coarse = solve_roughly(problem, guess, ON_CELLS)
    for _ in range(ROUNDS - 1):
        coarse = solve_roughly(on_patches(problem, guess)[0], guess)
    solution = solve(on_patches(problem, guess)[0], guess)
    own = _forces(problem, guess, solution)
    return replace(solution, coarse_approach=coarse[0], coarse_stiffness=coarse[1], force=own)


def _nodes(problem: ContactProblem, s: NDArray) -> tuple[NDArray, NDArray]:
    """``patch_nodes``; where a position has no patch, on the whole of the cell that is pressed most."""
    along = problem.along
    assert along is not None
    y, width = patch_nodes(along.lines, s, along.nodes)
    alone = np.flatnonzero(width.sum(axis=(1, 2)) == 0)
    if alone.size:
        # a patch within a single cell, that reaches neither its ends nor its middle
        by_cell = s.reshape(len(s), -1, 3).copy()
        there = np.repeat(along.lines.active, problem.shape[2], axis=1)[alone]
        by_cell[alone, np.where(there, by_cell[alone].max(axis=2), -np.inf).argmax(axis=1)] = 1.0
        y, width = patch_nodes(along.lines, by_cell.reshape(s.shape), along.nodes)
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
    from gearbench.contact._patch_kernels import compressions

    s = np.empty(along.gaps.shape)
    block, scale = np.ascontiguousarray(problem.block[:: problem.shape[2]]), problem.length_scale * along.share
    compressions(along.rows, along.factor, guess.q, block, guess.delta, along.gaps, scale, along.lines.active, s)
    return s


def patch_nodes(lines: ContactLines, s: NDArray, nodes: int) -> tuple[NDArray, NDArray]:
    """Nodes y and widths of ``nodes`` Gauss points on the patches of each line, (position, pair, node) [mm].

    ``s`` is the compression at the beginning, middle and end of each segment. Patches end where it changes its sign, or
    where the gap has a kink.
    """
    from gearbench.contact._patch_kernels import patch_nodes as fill

    assert lines.panel is not None
    half = lines.length * math.cos(lines.pair.meshing.beta_b) / 2
    y, width = np.empty((2, *lines.shape[:2], nodes))
    least = SHORTEST * lines.pair.meshing.face_width
    fill(s, lines.y, half, lines.panel, lines.active, least, *_gauss_rules(nodes), y, width)
    return y, width


@lru_cache(maxsize=16)
def _gauss_rules(most: int) -> tuple[NDArray, NDArray]:
    """Nodes and weights of the rules of 1 to ``most`` points, one a row."""
    nodes, weights = np.zeros((2, most + 1, most))
    for n in range(1, most + 1):
        nodes[n, :n], weights[n, :n] = gauss(n)
    return nodes, weights


def on_patches(problem: ContactProblem, guess: Guess) -> tuple[ContactProblem, ContactLines]:
    """``problem``, whose segments are cells, at nodes on the patches pressed together by ``guess``, and their lines."""
    along = problem.along
    assert along is not None
    nodes = along.lines.at(*_nodes(problem, _compression(problem, guess)))
    beside = {effect.name: effect for effect in along.effects}
    parts = [effect.compliance(nodes, beside) for effect in along.laws]
    none = np.zeros(nodes.shape)
    a = sum((part.a for part in parts if isinstance(part, LineLaw)), none)
    h = sum((part.h for part in parts if isinstance(part, LineLaw)), none)
    if nodes.touch is not None:
        w = nodes.touch.levers[0]
        a, h = (a + h * np.log(w)) / w**2, h / w**2
    rows = rows_at(along.smooth_lines, nodes.y)
    factor, gap = rows @ along.factor, total_gap(along.effects, nodes)
    if along.field is not None:
        gap = gap + (rows @ along.field[..., None])[..., 0]
    gap = np.where(nodes.active[..., None], gap, 0.0)
    new = scale_problem(nodes, gap, none[..., None], a, h, none, problem.force, problem.length_scale, coupled=False)
    new = under(new, along.share)
    block = np.repeat(problem.block[:: problem.shape[2]], nodes.shape[2])
    factor = np.ascontiguousarray(factor.reshape(*new.gap.shape, -1))
    return replace(new, factor=factor, block=block, blocks=problem.blocks), nodes


def _forces(problem: ContactProblem, guess: Guess, solution: ContactSolution) -> NDArray:
    """Forces on the cells of ``problem`` by the ``solution`` on its patches, that are in equilibrium too."""
    force = law_forces(problem, guess.delta, guess.q).reshape(problem.shape)
    own = solution.force.sum(axis=2)
    total = force.sum(axis=2)
    return force * np.where(total > 0, own / np.where(total > 0, total, 1.0), 0.0)[..., None]
