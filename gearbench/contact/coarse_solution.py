"""Coarse solutions of a scene: they tell how far its contact lines reach and are where ``transitions`` begins."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.gaps import flank_separation, total_gap
from gearbench.contact.lines import lines_within, smooth_nodes
from gearbench.contact.phases import mirrored_phases
from gearbench.contact.problem import ContactProblem, part_of, under_shares
from gearbench.contact.size import require_contact_memory
from gearbench.contact.solver import Guess, solve_roughly
from gearbench.effects.base import GapEffect
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.geometry.separation import farthest
from gearbench.scene import Resolution, Scene

#: Settings of a coarse solution: numbers of uniform phases and of segments on a line; nodes of the smooth compliance
#: (all but the contact law) as a share of the usual number; truncation of this compliance.
COARSE_PHASES, COARSE_SEGMENTS, COARSE_NODES, COARSE_TRUNCATION = 24, 12, 0.7, 1e-3
#: Factor on the segments of helical pairs, because the ends of their contact areas sweep over kinks of the gap.
HELICAL_SEGMENTS = 2
#: How far lines reach beyond the path of contact while the deflection is unknown, as a share of the distance up to
#: which the separation of the flanks is known.
_REACH = 2 / 3
#: Separation of the flanks up to which lines reach, divided by the greatest deflection.
MARGIN = 1.3


def scene_lines(scene: Scene, mesh_phase: NDArray) -> ContactLines:
    """Contact lines of the scene at the given phases.

    Raises
    ------
    MemoryBudgetError
        If the lines and the problem on them need more memory than the budget.
    """
    require_contact_memory(scene, len(mesh_phase))
    return lines_within(scene, mesh_phase, _contact_span(scene))


def greatest_deflection(scene: Scene) -> float:
    """Greatest approach of the gears along the line of action over a mesh cycle [mm]; the resolution does not matter.

    It is the approach of a coarse solution, plus the range of the gaps that are not part of the separation. Lines that
    reach where the separation is ``MARGIN`` times this deflection miss no contact, even in samples of random errors.
    """
    return _greatest_deflection(replace(scene, resolution=Resolution()))


@lru_cache(maxsize=16)
def _greatest_deflection(scene: Scene) -> float:
    if scene.pair.meshing.overlap_ratio:
        # the deflection of a helical pair varies little: two phases are enough, the middles of the ranges with the
        # fewest and with the most pairs on the path
        fraction = scene.pair.meshing.transverse_contact_ratio % 1.0
        coarse = _solve_coarsely(scene, np.array([(1 + fraction) / 2, fraction / 2]), _widest_span(scene.pair))
    else:
        coarse = coarse_solution(scene, COARSE_PHASES)
    deflection = float(coarse.problem.length_scale * coarse.guess.delta.max())
    others = [effect for effect in scene.flank_effects if effect.name != "off_line_contact"]
    if any(isinstance(effect, GapEffect) and not effect.modifications(scene.pair) for effect in others):
        gap = total_gap(others, coarse.lines)[coarse.lines.active]
        # excess material on all flanks makes the approach smaller, even negative
        deflection += float(np.ptp(gap) - min(gap.max(), 0.0))
    return deflection / math.cos(scene.pair.meshing.beta_b)


@dataclass(frozen=True, kw_only=True, eq=False)
class CoarseSolution:
    """A coarse solution at uniform phases over the mesh cycle; never changed.

    Parameters
    ----------
    phase
        Mesh phases τ, (phase,).
    lines, problem
        Contact lines and contact problem with few segments and a truncated compliance.
    guess
        Solution of the problem, accurate to 1e-6.
    shares
        Loads divided by that of the scene, (load,). The positions of lines, problem and guess are all phases under the
        first load, then all phases under the second, and so on.
    """

    phase: NDArray
    lines: ContactLines
    problem: ContactProblem
    guess: Guess
    shares: NDArray

    def under(self, shares: NDArray) -> CoarseSolution:
        """Coarse solution under the loads ``shares``, from this one under a single load.

        Amplitudes and approach, divided by the load, are almost linear in the reciprocal of the load, since it is that
        of the gaps. Each load starts from the straight line through the two loads before it.
        """
        count, loads = len(self.phase), len(shares)
        phases = np.tile(np.arange(count), loads)
        problem = under_shares(part_of(self.problem, phases), np.repeat(shares, count))
        guess = Guess(q=self.guess.q[phases], delta=self.guess.delta[phases])
        q, delta = (values.reshape(loads, count, *values.shape[1:]) for values in (guess.q, guess.delta))
        x = 1 / shares
        for i in range(loads):
            if i == 1:
                q[1], delta[1] = q[0], delta[0]
            elif i > 1:
                t = (x[i] - x[i - 1]) / (x[i - 1] - x[i - 2])
                for each in (q, delta):
                    each[i] = each[i - 1] + t * (each[i - 1] - each[i - 2])
            solve_roughly(part_of(problem, slice(i * count, (i + 1) * count)), Guess(q=q[i], delta=delta[i]))
        return replace(self, lines=self.lines.part(phases), problem=problem, guess=guess, shares=shares)


@lru_cache(maxsize=16)
def coarse_solution(scene: Scene, count: int) -> CoarseSolution:
    """Coarse solution of ``scene`` at ``count`` phases; the resolution of the scene does not matter.

    Off the line of action, lines of spur pairs reach ``_REACH`` beyond the path of contact under any load, so that
    their smooth compliance can be reused for other loads. Lines of helical pairs are only as long as needed, since
    longer lines would have longer cells.
    """
    wide = not scene.pair.meshing.overlap_ratio and flank_separation(scene) is not None
    span = _widest_span(scene.pair) if wide else _contact_span(scene)
    return _solve_coarsely(scene, mirrored_phases(scene.pair, count), span)


def _solve_coarsely(scene: Scene, phase: NDArray, span: tuple[float, float] | None) -> CoarseSolution:
    finer = HELICAL_SEGMENTS if scene.pair.meshing.overlap_ratio else 1
    scene = replace(scene, resolution=Resolution(positions=len(phase), segments=finer * COARSE_SEGMENTS))
    lines = lines_within(scene, phase, span)
    nodes = round(COARSE_NODES * smooth_nodes(lines) / math.sqrt(finer))
    problem = assemble(scene, lines, truncation=COARSE_TRUNCATION, nodes=nodes)
    guess = Guess.empty(problem)
    solve_roughly(problem, guess)
    return CoarseSolution(phase=phase, lines=lines, problem=problem, guess=guess, shares=np.ones(1))


def _widest_span(pair: Pair) -> tuple[float, float]:
    """Range of u [mm] that lines may reach while the deflection is unknown."""
    beyond = _REACH * farthest(pair)
    return pair.meshing.path_start - beyond, pair.meshing.path_end + beyond


def _contact_span(scene: Scene) -> tuple[float, float] | None:
    """Range of u [mm] in which flanks may touch under the load of ``scene``; None for the path of contact."""
    flanks = flank_separation(scene)
    if flanks is None:
        return None
    # the deflection is measured from the least separation, which is negative with excess material
    return flanks.reach(flanks.least + MARGIN * (greatest_deflection(scene) - flanks.least))
