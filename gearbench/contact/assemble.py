"""From a scene's effects to the contact problem: compliances and gaps are summed, then made dimensionless."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.gaps import (
    flank_separation,
    gap_and_variation,
    gap_effects,
    gap_kinks,
    gaps_along,
    sum_of_gaps,
    total_gap,
)
from gearbench.contact.phases import gauss_phases, mirrored_phases, uniform_phases
from gearbench.contact.pieces import rows_of_cells
from gearbench.contact.problem import (
    TRUNCATION,
    Along,
    ContactProblem,
    part_of,
    reduce_rank,
    stiffness_of_law,
    truncated_root,
    under,
)
from gearbench.contact.scaling import by_lever, even_deflection, scale_problem, typical_compression
from gearbench.contact.size import require_contact_memory
from gearbench.contact.smooth import Smooth, smooth_compliance
from gearbench.contact.solver import Guess, solve_roughly
from gearbench.effects.base import ComplianceEffect, Effect, GapEffect, LineLaw
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines, contact_lines
from gearbench.geometry.pair import Pair
from gearbench.geometry.separation import Separation
from gearbench.scene import Resolution, Scene
from gearbench.threads import single_threaded_blas

#: A gap that varies less than this along the contact lines is constant [mm].
LEAST_VARIATION = 1e-10
#: Phases, and nodes on their lines, at which the gap is looked at.
TRIAL_PHASES, TRIAL_SEGMENTS = 8, 12
#: Uniform phases of a coarse solution, segments on its lines, share of the nodes their compliance would have, and how
#: much of it is left out.
COARSE_PHASES, COARSE_SEGMENTS, COARSE_NODES, COARSE_TRUNCATION = 24, 12, 0.7, 1e-3
#: How far lines reach beyond the path of contact where the deflection is not known yet [base pitches].
_REACH = 0.3
#: Gauss points on a line for each panel that it has, at least: between kinks of the gap the load is smooth.
ON_PANEL = 5
#: Gauss points that a whole line has more for each kink of its deflections.
ON_BEND = 2
#: How much farther the lines of a solution reach than flanks as far apart as the gears deflect.
MARGIN = 1.3


def mesh_phases(scene: Scene) -> tuple[NDArray, NDArray]:
    """Mesh phases τ and weights (position,) that the scene's resolution asks for."""
    resolution = scene.one_load.resolution
    if resolution.accuracy is not None:
        raise InputError("resolution.accuracy", resolution.accuracy, "is for simulate and robust; here give segments")
    if resolution.positions is not None:
        return uniform_phases(resolution.positions)
    meshing, flanks = scene.pair.meshing, flank_separation(scene)
    kinks, face = gap_kinks(scene, flanks)
    changes = tuple(kinks) if flanks is not None else (meshing.path_start, meshing.path_end, *kinks)
    if flanks is not None and not meshing.overlap_ratio:
        # spur pairs take and leave their load, with a kink, where they are as far apart as the others are deflected
        changes += flanks.reach(greatest_deflection(scene, flanks))
    transitions = meshing.phases_at(changes, face)
    size = scene.resolution.panel_size
    assert size is not None
    return gauss_phases(transitions, size)


def scene_lines(scene: Scene, mesh_phase: NDArray) -> ContactLines:
    """Contact lines of the scene at the given phases.

    Raises
    ------
    MemoryBudgetError
        If they, or what is computed on them, need more memory than there may be.
    """
    require_contact_memory(scene, len(mesh_phase))
    flanks = flank_separation(scene)
    if flanks is None:
        return _lines(scene, mesh_phase)
    return _lines(scene, mesh_phase, flanks, _reached(scene, flanks))


def _lines(
    scene: Scene, mesh_phase: NDArray, flanks: Separation | None = None, span: tuple[float, float] | None = None
) -> ContactLines:
    """Contact lines over the path of contact, or with the separation of the ``flanks`` over ``span``."""
    pair, load = scene.pair, 0.0 if flanks is None else typical_load(scene)
    coast, segments = scene.load.coast, scene.resolution.segments
    kinks, face = gap_kinks(scene, flanks)
    # along the lines of helical pairs flanks that touch off the line of action are never equally far apart
    parting = flanks is not None and pair.meshing.overlap_ratio > 0
    if not parting:
        looked_at = _variation(pair, gap_effects(scene), coast, tuple(kinks), tuple(face), flanks, span)
        # Gauss points that resolve the gap of flanks that touch all along do not resolve the compliance of wide ones
        parting = looked_at[0] > LEAST_VARIATION or COARSE_SEGMENTS < segments < _nodes(pair, segments)
    lines = contact_lines(
        pair, mesh_phase, segments, kinks, face,
        parting=parting, coast=coast, separation=flanks, span=span,
    )  # fmt: skip
    return replace(lines, typical_load=load)


def conforming(scene: Scene) -> bool:
    """Whether the gap of the flanks is the same everywhere, so that all lines are loaded over their length."""
    if flank_separation(scene) is not None:
        return False
    kinks, face = gap_kinks(scene, None)
    variation = _variation(scene.pair, gap_effects(scene), scene.load.coast, tuple(kinks), tuple(face), None, None)
    return variation[1] <= LEAST_VARIATION


@lru_cache(maxsize=32)
def _variation(
    pair: Pair,
    effects: tuple[GapEffect, ...],
    coast: bool,
    kinks: tuple[float, ...],
    face_kinks: tuple[float, ...],
    flanks: Separation | None,
    span: tuple[float, float] | None,
) -> tuple[float, float]:
    """Maximum gap variation along and across sampled contact lines [mm]."""
    phase = mirrored_phases(pair, TRIAL_PHASES)
    lines = contact_lines(pair, phase, TRIAL_SEGMENTS, kinks, face_kinks, coast=coast, separation=flanks, span=span)
    gap = sum_of_gaps(effects, lines)[lines.active]
    return float(np.ptp(gap, axis=1).max(initial=0.0)), float(np.ptp(gap, axis=None)) if gap.size else 0.0


def greatest_deflection(scene: Scene, flanks: Separation) -> float:
    """Greatest approach of the gears along the line of action over a mesh cycle [mm], whatever the resolution.

    By the first look at it; lines that reach ``MARGIN`` times as far miss nothing. Gaps other than the separation count
    with their range, so that samples of random errors stay within it.
    """
    return _greatest_deflection(replace(scene, resolution=Resolution()), flanks)


@lru_cache(maxsize=16)
def _greatest_deflection(scene: Scene, flanks: Separation) -> float:
    if scene.pair.meshing.overlap_ratio:
        # amid the phases with fewest and with most pairs on the path
        most = scene.pair.meshing.transverse_contact_ratio % 1.0
        look = _look(scene, np.array([(1 + most) / 2, most / 2]), flanks, _widest_span(scene.pair))
    else:
        look = first_look(scene, COARSE_PHASES)
    deflection = float(look.problem.length_scale * look.guess.delta.max())
    others = [effect for effect in scene.flank_effects if effect.name != "off_line_contact"]
    if any(isinstance(effect, GapEffect) and not effect.modifications(scene.pair) for effect in others):
        gap = total_gap(scene, look.lines, others)[look.lines.active]
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
    flanks = flank_separation(scene)
    if flanks is None:
        span = None
    else:
        span = _reached(scene, flanks) if scene.pair.meshing.overlap_ratio else _widest_span(scene.pair)
    return _look(scene, mirrored_phases(scene.pair, count), flanks, span)


def _look(scene: Scene, phase: NDArray, flanks: Separation | None, span: tuple[float, float] | None) -> Look:
    scene = replace(scene, resolution=Resolution(positions=len(phase), segments=COARSE_SEGMENTS))
    lines = _lines(scene, phase, flanks, span)
    problem = assemble(scene, lines, truncation=COARSE_TRUNCATION, nodes=round(COARSE_NODES * smooth_nodes(lines)))
    guess = Guess.nothing(problem)
    solve_roughly(problem, guess)
    return Look(phase=phase, lines=lines, problem=problem, guess=guess, shares=np.ones(1))


def _widest_span(pair: Pair) -> tuple[float, float]:
    """Range of u [mm] that lines may reach while the deflection is unknown."""
    room = _REACH * pair.meshing.base_pitch
    return pair.meshing.path_start - room, pair.meshing.path_end + room


def _reached(scene: Scene, flanks: Separation) -> tuple[float, float]:
    """Range of u [mm] in which flanks may touch under the load of ``scene``."""
    # of flanks with material in excess, what they are pressed together counts
    return flanks.reach(flanks.least + MARGIN * (greatest_deflection(scene, flanks) - flanks.least))


def typical_load(scene: Scene) -> float:
    """Half of what a line carries on the mean [N/mm]: pairs touch at their edges as they take or leave their load."""
    meshing = scene.pair.meshing
    mean = scene.F_bn * math.cos(meshing.beta_b) / scene.pair.meshing.face_width
    return mean / (2 * max(meshing.transverse_contact_ratio, 1.0))


@single_threaded_blas()
def assemble(
    scene: Scene,
    lines: ContactLines,
    effects: Sequence[Effect] | None = None,
    *,
    truncation: float = TRUNCATION,
    nodes: int | None = None,
) -> ContactProblem:
    """Contact problem of ``scene`` on ``lines``: the sum over its effects, or over other ``effects`` where given.

    ``truncation``: how much of the smooth compliance may be left out, see ``truncated_root``; ``nodes`` on a line that
    it is computed at where segments are cells, by default ``smooth_nodes``.
    """
    acting = scene.acting_effects if effects is None else effects
    beside = {effect.name: effect for effect in acting}
    gaps = gaps_along(scene, lines, acting)
    gap, sigma = gap_and_variation(gaps)
    at = lines.smooth_lines(nodes or smooth_nodes(lines)) if lines.cells else lines
    adding = [effect for effect in acting if isinstance(effect, ComplianceEffect)]
    compliance, laws = smooth_compliance(adding, at, beside)
    if not lines.cells:
        return _problem(scene, lines, compliance, laws, gap, sigma, truncation)
    if not laws:
        # compliance alone determines the loads: it must be known on every segment
        compliance, laws = smooth_compliance(adding, lines, beside)
        return _problem(scene, lines, compliance, laws, gap, np.zeros(lines.shape), truncation)
    none = np.zeros(at.shape)
    smooth = _problem(scene, at, compliance, laws, none, none, truncation)
    assert lines.panel is not None
    own = replace(compliance, factor=np.zeros((*lines.shape, 0)), matrix=None)
    laws = [part for effect in own.laws if isinstance(part := effect.compliance(lines, beside), LineLaw)]
    problem = _problem(scene, lines, own, laws, gap, sigma, truncation, smooth.length_scale)
    factor, rows = smooth.factor.reshape(*at.shape, -1), rows_of_cells(at, lines)
    along = Along(
        scene=scene, effects=tuple(acting), lines=lines, gaps=gaps, smooth_lines=at, factor=factor, rows=rows,
        laws=own.laws, nodes=max(at.shape[2], ON_PANEL * (1 + int(lines.panel.max(initial=0)))),
        share=np.ones(len(gaps)),
    )  # fmt: skip
    # the load on a cell is spread: Ψ is its mean, by Simpson's rule
    factor = np.array([1, 4, 1]) / 6 @ rows @ factor
    return replace(
        problem,
        factor=np.ascontiguousarray(factor.reshape(*problem.gap.shape, -1)),
        block=np.repeat(smooth.block[:: at.shape[2]], lines.shape[2]),
        blocks=smooth.blocks,
        along=along,
    )


def smooth_nodes(lines: ContactLines) -> int:
    """Gauss points on a whole line that resolve its smooth compliance, and the load on it, as its segments do the gap.

    8 and one for every two modules of its width at 15 segments: on gears in use harmonics then miss by less than 0.2 of
    what they may (``tests/accuracy/test_resolution.py``). They converge exponentially: √2 as many for twice the cells.
    Where deflections have kinks pieces between them need ``ON_BEND`` more each.
    """
    return _nodes(lines.pair, lines.shape[2], len(lines.bends))


def _nodes(pair: Pair, segments: int, bends: int = 0) -> int:
    meshing = pair.meshing
    tan_b = math.tan(meshing.beta_b)
    path = meshing.path_end - meshing.path_start
    width = min(meshing.face_width, path / tan_b) if tan_b > 0 else meshing.face_width
    least = 8 + width / pair.normal_module / 2 + ON_BEND * bends
    return max(2, math.ceil(least * math.sqrt(segments / 15)))


def _problem(
    scene: Scene,
    lines: ContactLines,
    smooth: Smooth,
    laws: list[LineLaw],
    gap: NDArray,
    sigma: NDArray,
    truncation: float,
    unit: float | None = None,
) -> ContactProblem:
    """The problem with compliances at the nodes of ``lines``; ``unit`` of displacement [mm], where it is given."""
    factor, matrix = smooth.factor, smooth.matrix
    none = np.zeros(lines.shape)
    a, h = sum((law.a for law in laws), none), sum((law.h for law in laws), none)
    if unit is None and matrix is not None and not laws:
        unit = even_deflection(matrix, lines) * scene.F_bn
    elif unit is None:
        unit = typical_compression(a, h, scene)
    if lines.touch is not None:
        factor, matrix, a, h = by_lever(lines.touch.levers[0], factor, matrix, a, h)
    problem = scale_problem(lines, gap, factor, a, h, sigma, scene.F_bn, unit, coupled=matrix is not None)
    if matrix is not None:
        matrix = matrix * (problem.force / problem.length_scale)
        return replace(problem, factor=truncated_root(matrix, stiffness_of_law(problem), truncation))
    # a tooth of high order has more amplitudes than a contact line has segments
    return problem if factor.shape[-1] <= lines.shape[2] else reduce_rank(problem, truncation)
