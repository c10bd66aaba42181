"""Coarse solutions of a scene: how far its contact lines reach under load, and where births are looked for."""

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
from gearbench.contact.problem import ContactProblem, part_of, under
from gearbench.contact.size import require_contact_memory
from gearbench.contact.solver import Guess, solve_roughly
from gearbench.effects.base import GapEffect
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.scene import Resolution, Scene

#: Uniform phases of a coarse solution, segments on its lines, share of the nodes their compliance would have, and how
#: much of it is left out.
COARSE_PHASES, COARSE_SEGMENTS, COARSE_NODES, COARSE_TRUNCATION = 24, 12, 0.7, 1e-3
#: How far lines reach beyond the path of contact where the deflection is not known yet [base pitches].
_REACH = 0.3
#: How much farther the lines of a solution reach than flanks as far apart as the gears deflect.
MARGIN = 1.3


def scene_lines(scene: Scene, mesh_phase: NDArray) -> ContactLines:
    """Contact lines of the scene at the given phases.

    Raises
    ------
    MemoryBudgetError
        If they, or what is computed on them, need more memory than there may be.
    """
    require_contact_memory(scene, len(mesh_phase))
    return lines_within(scene, mesh_phase, _reached(scene))


def greatest_deflection(scene: Scene) -> float:
    """Greatest approach of the gears along the line of action over a mesh cycle [mm], whatever the resolution.

    By the first look at it; lines that reach ``MARGIN`` times as far miss nothing. Gaps other than the separation count
    with their range, so that samples of random errors stay within it.
    """
    return _greatest_deflection(replace(scene, resolution=Resolution()))


@lru_cache(maxsize=16)
def _greatest_deflection(scene: Scene) -> float:
    if scene.pair.meshing.overlap_ratio:
        # amid the phases with fewest and with most pairs on the path
        most = scene.pair.meshing.transverse_contact_ratio % 1.0
        look = _look(scene, np.array([(1 + most) / 2, most / 2]), _widest_span(scene.pair))
    else:
        look = first_look(scene, COARSE_PHASES)
    deflection = float(look.problem.length_scale * look.guess.delta.max())
    others = [effect for effect in scene.flank_effects if effect.name != "off_line_contact"]
    if any(isinstance(effect, GapEffect) and not effect.modifications(scene.pair) for effect in others):
        gap = total_gap(others, look.lines)[look.lines.active]
        # gears whose flanks all have material in excess approach by less, even by less than nothing
        deflection += float(np.ptp(gap) - min(gap.max(), 0.0))
    return deflection / math.cos(scene.pair.meshing.beta_b)


@dataclass(frozen=True, kw_only=True, eq=False)
class Look:
    """A coarse solution at uniform phases over the mesh cycle. Never changed.

    Parameters
    ----------
    phase
        Mesh phases τ, (position,).
    lines, problem
        Contact lines and problem, of few segments and functions.
    guess
        Its solution, good to 1e-6 of itself.
    shares
        Loads over that of the scene, (load,): lines, problem and guess are those under the first at all phases, then
        those under the next.
    """

    phase: NDArray
    lines: ContactLines
    problem: ContactProblem
    guess: Guess
    shares: NDArray

    def under(self, shares: NDArray) -> Look:
        """The same look, which has one load, under others."""
        count = len(self.phase)
        each = np.tile(np.arange(count), len(shares))
        problem = under(part_of(self.problem, each), np.repeat(shares, count))
        guess = Guess(q=self.guess.q[each], delta=self.guess.delta[each])
        solve_roughly(problem, guess)
        return replace(self, lines=self.lines.part(each), problem=problem, guess=guess, shares=shares)


@lru_cache(maxsize=16)
def first_look(scene: Scene, count: int) -> Look:
    """Coarse solution of ``scene``, whose resolution does not matter, at ``count`` phases.

    Off the line of action lines of spur pairs reach ``_REACH`` beyond the path of contact, whatever the load: their
    smooth compliance is that under other loads too. Longer lines of helical pairs would have longer cells.
    """
    wide = not scene.pair.meshing.overlap_ratio and flank_separation(scene) is not None
    span = _widest_span(scene.pair) if wide else _reached(scene)
    return _look(scene, mirrored_phases(scene.pair, count), span)


def _look(scene: Scene, phase: NDArray, span: tuple[float, float] | None) -> Look:
    scene = replace(scene, resolution=Resolution(positions=len(phase), segments=COARSE_SEGMENTS))
    lines = lines_within(scene, phase, span)
    problem = assemble(scene, lines, truncation=COARSE_TRUNCATION, nodes=round(COARSE_NODES * smooth_nodes(lines)))
    guess = Guess.nothing(problem)
    solve_roughly(problem, guess)
    return Look(phase=phase, lines=lines, problem=problem, guess=guess, shares=np.ones(1))


def _widest_span(pair: Pair) -> tuple[float, float]:
    """Range of u [mm] that lines may reach while the deflection is unknown."""
    room = _REACH * pair.meshing.base_pitch
    return pair.meshing.path_start - room, pair.meshing.path_end + room


def _reached(scene: Scene) -> tuple[float, float] | None:
    """Range of u [mm] in which flanks may touch under the load of ``scene``; None: the path of contact."""
    flanks = flank_separation(scene)
    if flanks is None:
        return None
    # of flanks with material in excess, what they are pressed together counts
    return flanks.reach(flanks.least + MARGIN * (greatest_deflection(scene) - flanks.least))
