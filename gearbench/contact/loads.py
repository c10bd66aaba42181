"""One contact problem under many loads: the compliance is made once, each solution starts from those before it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gearbench.contact import problem as single
from gearbench.contact.patches import ON_CELLS, ROUNDS, from_cells
from gearbench.contact.problem import ContactProblem, ContactSolution, part_of
from gearbench.contact.solver import Guess, from_smallest, has_law, newton, proven, responses, solve, solve_roughly

#: Positions that a thread takes at least: fewer are not worth handing over.
LEAST_POSITIONS = 8
#: Solutions that the next one is extrapolated from: more gain nothing where segments lose contact.
KNOWN = 4
#: Positions under all their loads that are solved together, and bytes that their factors may take: where it is more, or
#: lines are solved on their patches, the time is not that of many small steps.
TOGETHER, LARGEST = 320, 4e6


def under(problem: ContactProblem, force: float) -> ContactProblem:
    """``problem`` under another normal force F_bn [N], with the unit of displacement proportional to it."""
    f = force / problem.force
    loaded = single.under(problem, np.full(len(problem.gap), f))
    return replace(loaded, force=force, length_scale=problem.length_scale * f, along=problem.along)


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
    positions, size = len(problem.gap), max(problem.factor.nbytes, 1)
    together = 1 if problem.along else max(1, min(TOGETHER // positions, int(LARGEST / size)))
    groups = [forces[i : i + together] for i in range(0, len(forces), together)]
    if len(chains) == 1:
        for some in groups:
            yield from chains[0].solve(some)
        return
    with ThreadPoolExecutor(len(parts)) as pool:
        for some in groups:
            found = list(pool.map(lambda chain, some=some: chain.solve(some), chains))
            yield from map(_join, zip(*found, strict=True))


class _Chain:
    """Solutions of a few positions under one load after the other."""

    def __init__(self, problem: ContactProblem) -> None:
        self._problem = problem
        self._known: list[tuple[float, Guess]] = []
        self._ahead: list[list[tuple[float, Guess]]] = [[] for _ in range(ROUNDS)]
        self._responses = responses(problem)

    def solve(self, forces: Sequence[float]) -> list[ContactSolution]:
        """Solutions under the next ``forces``."""
        share = np.array(forces) / self._problem.force
        if not has_law(self._problem):
            return [solve(under(self._problem, force)) for force in forces]
        if self._problem.along is None:
            return _each_load(self._on_segments(share), share)
        return [solution for f in share for solution in _each_load(self._on_patches(float(f)), np.array([f]))]

    def _on_segments(self, share: NDArray) -> ContactSolution:
        """One solution under all loads, one after the other, in the units of the whole load."""
        count = len(self._problem.gap)
        all_of_them = part_of(self._problem, np.tile(np.arange(count), len(share)))
        least, p = from_smallest(single.under(all_of_them, np.repeat(share, count)))
        found = []
        for i, x in enumerate(np.log(share)):
            here, guess = slice(i * count, (i + 1) * count), self._extrapolated(x, self._known)
            guess.delta[:] -= least[here]
            force, delta, stiffness, steps = newton(part_of(p, here), guess=guess, response=self._responses)
            guess.delta[:] = delta + least[here]
            self._remember(x, guess, self._known)
            found.append((force, delta, stiffness, steps))
        force, delta, stiffness, steps = (np.concatenate(each) for each in zip(*found, strict=True))
        return proven(p, least, force, delta, stiffness, steps)

    def _on_patches(self, share: float) -> ContactSolution:
        """Solution under one load, in the units of the whole load."""
        x, each = math.log(share), np.full(len(self._problem.gap), share)
        loaded = single.under(self._problem, each)
        guess = self._extrapolated(x, self._known)
        coarse = solve_roughly(loaded, guess, ON_CELLS, self._responses)
        self._remember(x, guess, self._known)
        ahead = [self._extrapolated(x, known) if known else None for known in self._ahead]
        solution, changes = from_cells(loaded, guess, coarse, ahead)
        for known, change in zip(self._ahead, changes, strict=True):
            self._remember(x, change, known)
        return solution

    @staticmethod
    def _remember(x: float, guess: Guess, known: list[tuple[float, Guess]]) -> None:
        known.append((x, guess))
        del known[:-KNOWN]

    def _extrapolated(self, x: float, before: list[tuple[float, Guess]]) -> Guess:
        """The polynomial through the last solutions (Lagrange), at x = ln F."""
        known = [(at, guess) for i, (at, guess) in enumerate(before) if at not in [y for y, _ in before[:i]]]
        if not known:
            return Guess.nothing(self._problem)
        nodes = [at for at, _ in known]
        weight = [math.prod((x - z) / (y - z) for z in nodes if z != y) for y in nodes]
        return Guess(
            q=sum((w * guess.q for w, (_, guess) in zip(weight, known, strict=True)), np.zeros(1)),
            delta=sum((w * guess.delta for w, (_, guess) in zip(weight, known, strict=True)), np.zeros(1)),
        )


def _slices(positions: int, threads: int) -> list[slice]:
    count = max(1, min(threads, positions // LEAST_POSITIONS))
    edges = np.linspace(0, positions, count + 1).astype(int)
    return [slice(a, b) for a, b in pairwise(edges)]


def _each_load(solution: ContactSolution, share: NDArray) -> list[ContactSolution]:
    """Solutions under each load, of one of all of them in the units of the whole load."""
    return parted(solution, share, [len(solution.approach) // len(share)] * len(share))


def parted(
    solution: ContactSolution, shares: Sequence[float] | NDArray, counts: Sequence[int]
) -> list[ContactSolution]:
    """One solution, in the units of a whole load, as those under ``shares`` of it, ``counts`` positions each."""
    found, ends = [], np.cumsum(counts)
    for share, first, last in zip(shares, ends - counts, ends, strict=True):
        own = {name: getattr(solution, name)[first:last] for name in _ARRAYS}
        own |= {name: own[name] * share for name in _PROPORTIONAL}
        found.append(ContactSolution(**own, polished=0 if found else solution.polished))
    return found


def _join(parts: Sequence[ContactSolution]) -> ContactSolution:
    """Solutions of consecutive positions as one."""
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS}
    return ContactSolution(**arrays, polished=sum(part.polished for part in parts))


def stacked(solutions: Sequence[ContactSolution]) -> ContactSolution:
    """Solutions under several loads as one, its arrays (load, position, …)."""
    arrays = {name: np.stack([getattr(each, name) for each in solutions]) for name in _ARRAYS}
    return ContactSolution(**arrays, polished=sum(each.polished for each in solutions))


_ARRAYS = tuple(field.name for field in fields(ContactSolution) if field.name != "polished")
#: Those in units that are proportional to the load.
_PROPORTIONAL = {"force", "approach", "coarse_approach"}
