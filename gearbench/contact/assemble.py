"""Assembly of the contact problem: compliances and gaps of a scene's effects are summed and made dimensionless.

The segments are Gauss points or cells, see ``problem``. With cells the smooth compliance comes from Gauss points on the
same lines: it is smooth there, and needs fewer points than the gap.

Off the line of action ("touch") the normal force has another lever arm about the pinion's axis than the base radius.
Their ratio is the lever w of a segment. Gaps are divided by levers, and moments replace forces (``by_lever``), so that
all segments still share one approach.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.gaps import gap_and_variation, gaps_along
from gearbench.contact.interpolation import interpolation_to_cells, values_at
from gearbench.contact.lines import points_ratio, smooth_nodes
from gearbench.contact.problem import (
    TRUNCATION,
    Cells,
    ContactProblem,
    reduce_rank,
    stiffness_of_law,
    truncated_root,
)
from gearbench.contact.scaling import by_lever, even_deflection, scale_problem, typical_compression
from gearbench.contact.smooth import SmoothCompliance, smooth_compliance
from gearbench.contact.solver import has_law
from gearbench.effects.base import Effect, LineLaw
from gearbench.geometry.action import ContactLines
from gearbench.scene import Scene
from gearbench.threads import single_threaded_blas

#: Minimum number of points on the contact patches of a line, per panel, for lines of up to 15 segments. A panel is a
#: piece of a line between kinks of the gap; the load is smooth on it.
NODES_PER_PANEL = 5


@single_threaded_blas()
def assemble(
    scene: Scene,
    lines: ContactLines,
    effects: Sequence[Effect] | None = None,
    *,
    truncation: float = TRUNCATION,
    nodes: int | None = None,
) -> ContactProblem:
    """Contact problem of ``scene`` on ``lines``.

    Parameters
    ----------
    scene, lines
        Load and pair, and the contact lines.
    effects
        Effects to sum; by default the acting effects of the scene.
    truncation
        Share of the smooth compliance (all but the contact law) that may be left out, see ``truncated_root``.
    nodes
        Number of Gauss points on a line at which the smooth compliance is computed, if the segments are cells (short
        pieces of a line that carry a load); by default ``smooth_nodes``.
    """
    acting = scene.acting_effects if effects is None else effects
    by_name = {effect.name: effect for effect in acting}
    gaps = gaps_along(acting, lines)
    gap, sigma = gap_and_variation(gaps)
    smooth_lines = lines.smooth_lines(nodes or smooth_nodes(lines)) if lines.cells else lines
    compliance, laws = smooth_compliance(smooth_lines, by_name)
    if not lines.cells:
        return _problem(scene, lines, compliance, laws, gap, sigma, truncation)
    if not laws:
        # without a law the compliance alone determines the loads, so it is needed on every segment
        compliance, laws = smooth_compliance(lines, by_name)
        return _problem(scene, lines, compliance, laws, gap, np.zeros(lines.shape), truncation)
    # the smooth compliance comes from the Gauss points, contact law and gap from the cells
    zeros = np.zeros(smooth_lines.shape)
    smooth = _problem(scene, smooth_lines, compliance, laws, zeros, zeros, truncation)
    assert lines.panel is not None
    without_smooth = replace(compliance, factor=np.zeros((*lines.shape, 0)), matrix=None)
    laws = [part for effect in compliance.laws if isinstance(part := effect.compliance(lines, by_name), LineLaw)]
    problem = _problem(scene, lines, without_smooth, laws, gap, sigma, truncation, smooth.length_scale)
    factor = smooth.factor.reshape(*smooth_lines.shape, -1)
    interpolation = interpolation_to_cells(smooth_lines, lines)
    # callers that pass ``nodes`` solve coarsely
    per_panel = NODES_PER_PANEL * (1.0 if nodes else max(1.0, points_ratio(lines.shape[2])))
    cells = Cells(
        effects=tuple(acting), lines=lines, gaps=gaps, smooth_lines=smooth_lines, factor=factor,
        interpolation=interpolation, laws=compliance.laws, share=np.ones(len(gaps)),
        nodes=max(smooth_lines.shape[2], round(per_panel * (1 + int(lines.panel.max(initial=0))))),
    )  # fmt: skip
    # the force of a cell is spread evenly over it, so its deflection is the mean over the cell
    factor = values_at(cells.means, factor, lines.active)
    return replace(
        problem,
        factor=factor.reshape(*problem.gap.shape, -1),
        # the cells of a line belong to the block of its Gauss points
        block=np.repeat(smooth.block[:: smooth_lines.shape[2]], lines.shape[2]),
        blocks=smooth.blocks,
        cells=cells,
    )


def with_gaps(problem: ContactProblem, effects: Sequence[Effect], lines: ContactLines) -> ContactProblem:
    """``problem``, which was assembled on ``lines``, with the gaps of other ``effects``; the compliance is the same."""
    cells = problem.cells and replace(problem.cells, effects=tuple(effects))
    return _replace_gaps(replace(problem, cells=cells), gaps_along(effects, lines))


def with_field(problem: ContactProblem, field: NDArray) -> ContactProblem:
    """``problem`` with a further gap ``field`` (position, pair, node) [mm], already divided by the levers of the nodes.

    The field is smooth along a line. Its nodes are those of ``Cells.smooth_lines`` or, if there are no cells, the
    segments themselves.
    """
    if problem.cells is None:
        return replace(problem, gap=problem.gap + field.reshape(problem.gap.shape) / problem.length_scale)
    cells = replace(problem.cells, field=field)
    on_lines = cells.interpolation.reshape(*field.shape[:2], -1, field.shape[2]) @ field[..., None]
    return _replace_gaps(replace(problem, cells=cells), cells.gaps + on_lines.reshape(cells.gaps.shape))


def _replace_gaps(problem: ContactProblem, gaps: NDArray) -> ContactProblem:
    """``problem`` with other ``gaps``, see ``gaps_along``."""
    gap, sigma = (x.reshape(problem.gap.shape) for x in gap_and_variation(gaps))
    sigma = sigma if has_law(problem) else np.zeros_like(sigma)  # without a law there is nothing to average
    # the problem holds the gap at the end that touches first
    gap, sigma = (np.ascontiguousarray(x / problem.length_scale) for x in (gap - sigma, sigma))
    cells = problem.cells and replace(problem.cells, gaps=gaps)
    return replace(problem, gap=gap, sigma=sigma, cells=cells)


def _problem(
    scene: Scene,
    lines: ContactLines,
    smooth: SmoothCompliance,
    laws: list[LineLaw],
    gap: NDArray,
    sigma: NDArray,
    truncation: float,
    unit: float | None = None,
) -> ContactProblem:
    """Dimensionless problem from compliances and ``gap`` [mm] at the nodes of ``lines``.

    ``sigma`` is half the variation of the gap along a cell [mm], ``unit`` the unit of displacement [mm]. By default the
    unit is a typical compression or, without a law, the mean deflection.
    """
    factor, matrix = smooth.factor, smooth.matrix
    law = LineLaw.total(laws, lines.shape)
    if unit is None and matrix is not None and not laws:
        unit = even_deflection(matrix, lines) * scene.F_bn
    elif unit is None:
        unit = typical_compression(law, scene)
    if lines.touch is not None:  # off the line of action
        factor, law = by_lever(lines.touch.levers[0], factor, law)
    problem = scale_problem(lines, gap, factor, law, sigma, scene.F_bn, unit, coupled=matrix is not None)
    if matrix is not None:
        # the factor of D H D is D times that of H, with D = diag(scale)
        scale = np.sqrt(problem.force / problem.length_scale) / np.broadcast_to(lines.lever, lines.shape)
        scale = scale.reshape(problem.gap.shape)
        factor = truncated_root(matrix, stiffness_of_law(problem) * scale**2, truncation)
        return replace(problem, factor=scale[..., None] * factor)
    # Ψ may have more columns than a line has segments, which then are not independent
    return problem if factor.shape[-1] <= lines.shape[2] else reduce_rank(problem, truncation)
