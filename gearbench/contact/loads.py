"""One contact problem under many loads: the compliance is made once, each solution starts from those before it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace
from itertools import pairwise

import numpy as np

from gearbench.contact.patches import solve_patches
from gearbench.contact.problem import ContactProblem, ContactSolution, part_of
from gearbench.contact.solver import Guess

#: Positions that a thread takes at least: fewer are not worth handing over.
LEAST_POSITIONS = 8
#: Solutions that the next one is extrapolated from: more gain nothing where segments lose contact.
KNOWN = 4


def under(problem: ContactProblem, force: float) -> ContactProblem:
    """``problem`` under another normal force F_bn [N].

    With the unit of displacement proportional to the force, only the gaps and the law's level change: for f = F′/F,
    e′ = e/f, σ′ = σ/f and g′(P) = g(fP)/f, i.e. a′ = a − h ln f.
    """
    f = force / problem.force
    return replace(
        problem,
        gap=problem.gap / f,
        soft=problem.soft / f,
        a=problem.a - problem.h * math.log(f),
        force=force,
        length_scale=problem.length_scale * f,
    )


def solve_loads(problem: ContactProblem, forces: Sequence[float], threads: int = 1) -> Iterator[ContactSolution]:
    """Solutions of ``problem`` under each of the normal ``forces`` [N], quickest where these are in order.

    The amplitudes and the approach hardly depend on the load in these units; they are extrapolated in ln F, which the
    law's level is linear in. The solutions do not depend on where they start from, beyond rounding.

    Raises
    ------
    ConvergenceError
        As ``solve``.
    """
    parts = [part_of(problem, s) for s in _slices(len(problem.gap), threads)]
    chains = [_Chain(part) for part in parts]
    if len(chains) == 1:
        yield from map(chains[0].solve, forces)
        return
    with ThreadPoolExecutor(len(parts)) as pool:
        for force in forces:
            yield _join(list(pool.map(lambda chain, force=force: chain.solve(force), chains)))


class _Chain:
    """Solutions of a few positions under one load after the other."""

    def __init__(self, problem: ContactProblem) -> None:
        self._problem = problem
        self._known: list[tuple[float, Guess]] = []

    def solve(self, force: float) -> ContactSolution:
        x = math.log(force / self._problem.force)
        guess = self._extrapolated(x)
        solution = solve_patches(under(self._problem, force), guess)
        self._known = [*self._known, (x, guess)][-KNOWN:]
        return solution

    def _extrapolated(self, x: float) -> Guess:
        """The polynomial through the last solutions (Lagrange), at x = ln F."""
        known = [(at, guess) for i, (at, guess) in enumerate(self._known) if at not in [y for y, _ in self._known[:i]]]
        if not known:
            return Guess.nothing(self._problem)
        nodes = np.array([at for at, _ in known])
        weight = [np.prod([(x - z) / (y - z) for z in nodes if z != y]) for y in nodes]
        return Guess(
            q=sum((w * guess.q for w, (_, guess) in zip(weight, known, strict=True)), np.zeros(1)),
            delta=sum((w * guess.delta for w, (_, guess) in zip(weight, known, strict=True)), np.zeros(1)),
        )


def _slices(positions: int, threads: int) -> list[slice]:
    count = max(1, min(threads, positions // LEAST_POSITIONS))
    edges = np.linspace(0, positions, count + 1).astype(int)
    return [slice(a, b) for a, b in pairwise(edges)]


def _join(parts: Sequence[ContactSolution]) -> ContactSolution:
    """Solutions of consecutive positions as one."""
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS}
    return ContactSolution(**arrays, polished=sum(part.polished for part in parts))


def stacked(solutions: Sequence[ContactSolution]) -> ContactSolution:
    """Solutions under several loads as one, its arrays (load, position, …)."""
    arrays = {name: np.stack([getattr(each, name) for each in solutions]) for name in _ARRAYS}
    return ContactSolution(**arrays, polished=sum(each.polished for each in solutions))


_ARRAYS = tuple(field.name for field in fields(ContactSolution) if field.name != "polished")
