"""The whole chain once more in extended precision: geometry, teeth, contact law, gaps, contact, for one mesh phase.

Written from the equations in ``mpmath`` with ``DIGITS`` decimal digits. A scene's numbers are taken as they stand in
double precision.
"""

from __future__ import annotations

import operator
from itertools import accumulate
from types import SimpleNamespace as Namespace

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.lines import smooth_nodes
from gearbench.contact.problem import ContactProblem
from gearbench.geometry.action import ContactLines
from gearbench.scene import Scene
from tests.stability.extended.contact import Answer, contact, equal_approach
from tests.stability.extended.effects import gap, line_law
from tests.stability.extended.geometry import geometry, moved, segments_at
from tests.stability.extended.numbers import DIGITS, Number
from tests.stability.extended.teeth import tooth_factor


def solve_scene(scene: Scene, tau: float, start: tuple[NDArray, float]) -> Answer:
    """Answer of ``scene`` at phase ``tau``; ``start``: forces [N] of the existing segments and δ_n [mm]."""
    with mp.workdps(DIGITS):
        G = geometry(scene.pair)
        found = segments_at(scene, tau)
        F = 1000 * mp.mpf(scene.load.torque) / G.gears[0].r_b / mp.cos(G.beta_b)
        if len(found) != len(start[0]):
            raise LookupError(f"{len(found)} segments, not {len(start[0])}")
        laws = [line_law(scene, s) for s in found]
        # unit of force F, of displacement 1 mm: P' = P/F, ψ' = ψ √F, g = P'(a' − h' ln P')
        root = mp.sqrt(F)  # of the force, since forces are in units of F
        lines = scene_lines(scene, np.array([tau]))
        cells = lines.cells
        psi = [[root * x for x in row] for row in (_means(scene, found, lines) if cells else _at(scene, found))]
        soft = [abs(gap(scene, moved(scene, s, 1)) - gap(scene, moved(scene, s, -1))) / 2 * cells for s in found]
        h = [F / s.length * h for s, (_, h) in zip(found, laws, strict=True)]
        a = [F / s.length * (a + h * mp.log(s.length / F)) for s, (a, h) in zip(found, laws, strict=True)]
        e = [gap(scene, s) for s in found]
        begin = ([float(p / float(F)) for p in start[0]], start[1])
        P, delta, k = contact([s.pair for s in found], psi, a, h, soft, e, begin)
        return Answer([F * p for p in P], delta, F * k)


def _at(scene: Scene, segments: list[Namespace]) -> list[list[Number]]:
    return [tooth_factor(scene, s) for s in segments]


def _means(scene: Scene, segments: list[Namespace], lines: ContactLines) -> list[list[Number]]:
    """Ψ as the mean over each cell, by Simpson's rule from the Gauss points of its whole line."""
    count, means = smooth_nodes(lines), []
    t, _ = np.polynomial.legendre.leggauss(count)
    for k in dict.fromkeys(s.pair for s in segments):
        cells = [s for s in segments if s.pair == k]
        low, high = cells[0].y - cells[0].half, cells[-1].y + cells[-1].half
        middle, reach = (low + high) / 2, (high - low) / 2
        nodes = [middle + reach * mp.mpf(x) for x in t]
        first = cells[0]
        values = [tooth_factor(scene, moved(scene, first, (y - first.y) / first.half)) for y in nodes]
        own = [1 / mp.fprod(x - n for n in nodes if n is not x) for x in nodes]
        for s in cells:
            weight = [mp.mpf(0)] * count
            for y, share in ((s.y - s.half, 1), (s.y, 4), (s.y + s.half, 1)):
                # Lagrange's functions: products over the nodes before and after each, since y may be a node
                gaps = [y - n for n in nodes]
                before = list(accumulate(gaps[:-1], operator.mul, initial=mp.mpf(share) / 6))
                after = list(accumulate(gaps[:0:-1], operator.mul, initial=mp.mpf(1)))[::-1]
                weight = [w + b * o * a for w, b, o, a in zip(weight, before, own, after, strict=True)]
            means.append([mp.fdot(weight, column) for column in zip(*values, strict=True)])
    return means


def solve_problem(problem: ContactProblem, position: int, start: tuple[NDArray, float]) -> Answer:
    """Answer of one position of a dimensionless problem, its numbers taken as exact; ``start`` in its units."""
    with mp.workdps(DIGITS):
        active = np.flatnonzero(problem.active[position])
        psi = [[mp.mpf(x) for x in problem.factor[position, i]] for i in active]
        fields = problem.a, problem.h, problem.sigma, problem.gap
        a, h, soft, e = ([mp.mpf(x) for x in v[position, active]] for v in fields)
        e = [gap + half for gap, half in zip(e, soft, strict=True)]  # in the middle of each cell
        block = [int(problem.block[i]) for i in active]
        if not (problem.a[position].any() or problem.h[position].any()):
            return equal_approach(psi, e, [i for i, p in enumerate(start[0]) if p > 0])
        P, delta, k = contact(block, psi, a, h, soft, e, ([float(p) for p in start[0]], start[1]))
        return Answer(P, delta, k)
