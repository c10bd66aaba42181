"""The whole chain once more in extended precision: geometry, teeth, contact law, gaps, contact, for one mesh phase.

Written from the equations in ``mpmath`` with ``DIGITS`` decimal digits. A scene's numbers are taken as they stand in
double precision.
"""

from __future__ import annotations

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import scene_lines
from gearbench.contact.problem import ContactProblem
from gearbench.scene import Scene
from tests.stability.extended.contact import Answer, contact, equal_approach
from tests.stability.extended.effects import gap, line_law
from tests.stability.extended.geometry import geometry, moved, segments_at
from tests.stability.extended.numbers import DIGITS
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
        cells = scene_lines(scene, np.array([tau])).cells
        # Ψ as the mean over a cell, by two Gauss points
        points = (-1 / mp.sqrt(3), 1 / mp.sqrt(3)) if cells else (mp.mpf(0),)
        psi = []
        for s in found:
            rows = [tooth_factor(scene, moved(scene, s, x)) for x in points]
            psi.append([root * mp.fsum(x) / len(rows) for x in zip(*rows, strict=True)])
        soft = [abs(gap(scene, moved(scene, s, 1)) - gap(scene, moved(scene, s, -1))) / 2 * cells for s in found]
        h = [F / s.length * h for s, (_, h) in zip(found, laws, strict=True)]
        a = [F / s.length * (a + h * mp.log(s.length / F)) for s, (a, h) in zip(found, laws, strict=True)]
        e = [gap(scene, s) for s in found]
        begin = ([float(p / float(F)) for p in start[0]], start[1])
        P, delta, k = contact([s.pair for s in found], psi, a, h, soft, e, begin)
        return Answer([F * p for p in P], delta, F * k)


def solve_problem(problem: ContactProblem, position: int, start: tuple[NDArray, float]) -> Answer:
    """Answer of one position of a dimensionless problem, its numbers taken as exact; ``start`` in its units."""
    with mp.workdps(DIGITS):
        active = np.flatnonzero(problem.active[position])
        psi = [[mp.mpf(x) for x in problem.factor[position, i]] for i in active]
        fields = problem.a, problem.h, problem.soft, problem.gap
        a, h, soft, e = ([mp.mpf(x) for x in v[position, active]] for v in fields)
        e = [gap + half for gap, half in zip(e, soft, strict=True)]  # in the middle of each cell
        block = [int(problem.block[i]) for i in active]
        if not (problem.a[position].any() or problem.h[position].any()):
            return equal_approach(psi, e, [i for i, p in enumerate(start[0]) if p > 0])
        P, delta, k = contact(block, psi, a, h, soft, e, ([float(p) for p in start[0]], start[1]))
        return Answer(P, delta, k)
