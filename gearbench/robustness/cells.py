"""Error of a mean over samples by the cells of contact lines: a few samples are solved once more on their patches.

Where flanks may part, all samples share the same cells along the contact lines, each corrected by what the cells miss
at the mean errors (B3 of docs/algorithms.md). What this leaves, the responses of the first samples show, against those
on the patches of contact of each, where a single scene is solved.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import with_gaps
from gearbench.contact.patches import solve_patches
from gearbench.contact.problem import part_of
from gearbench.effects.base import Effects, GapEffect
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.geometry.action import ContactLines
from gearbench.results.cycle import MeshCycle
from gearbench.results.points import Columns
from gearbench.results.responses import response
from gearbench.robustness.montecarlo import Responses, RobustProblem

#: Samples that are solved once more.
CHECKED = 4
#: Share of the mean from which an error of it beyond its standard error is warned of.
WORTH_SAYING = 0.01


@dataclass(frozen=True, eq=False)
class _DrawnErrors(GapEffect):
    """The errors of the sample that each position is of; ``amounts`` (position, mode) are those of their expansion."""

    errors: ManufacturingErrors
    by_name: Effects
    amounts: NDArray

    name = ManufacturingErrors.name

    def gap(self, lines: ContactLines) -> NDArray:
        """Initial gap e, (position, pair, segment) [mm]."""
        modes = self.errors.expansion(lines, self.by_name).modes
        return self.errors.gap(lines) + (modes @ self.amounts[:, None, :, None])[..., 0]


def cell_errors(
    problem: RobustProblem, errors: NDArray, responses: Responses, names: Sequence[str]
) -> Mapping[str, float]:
    """Estimated error of the mean of each response ``names`` by the cells, in its unit; nothing where there are none.

    √(d̄² + s²/n), where the first n ``responses``, to ``errors`` (sample, error) [µm], deviate by d̄ on the mean, and
    scatter by s about it, from those on their patches.
    """
    count = min(CHECKED, len(responses))
    if problem.at_mean.along is None or count < 2:
        return {}
    if problem.errors.centre_distance is None:
        answers = _on_patches(problem, errors[:count])
    else:
        distance = errors[:count, problem.names.index("centre_distance")].tolist()
        each = zip(distance, errors[:count, None], strict=True)
        answers = np.concatenate([_on_patches(problem.at_distance(at), one) for at, one in each], axis=1)
    cycles, found = MeshCycle.of(problem.scene, problem.phases, *answers), {}
    for name in names:
        d = responses[name][:count] - response(name).reduce(cycles)
        found[name] = math.sqrt(d.mean() ** 2 + d.var(ddof=1) / count)
    return found


def _on_patches(problem: RobustProblem, errors: NDArray) -> NDArray:
    """Approach [mm] and stiffness [N/mm] of samples with these ``errors`` (sample, error), (2, sample, position)."""
    positions, by_name = len(problem.phases.phase), {effect.name: effect for effect in problem.scene.flank_effects}
    tiled = part_of(problem.at_mean, np.tile(np.arange(positions), len(errors)))
    assert tiled.along is not None
    amounts = np.repeat(problem.expansion.amounts(errors), positions, axis=0)
    drawn = _DrawnErrors(problem.errors, by_name, amounts)
    effects = tuple(drawn if effect.name == drawn.name else effect for effect in tiled.along.effects)
    solution = solve_patches(with_gaps(tiled, effects, tiled.along.lines))
    return np.stack([solution.approach, solution.stiffness]).reshape(2, len(errors), -1)


def cell_warning(variables: Columns) -> str | None:
    """A line where the cells may leave more of a mean than its standard error and ``WORTH_SAYING``, else None."""
    loud = []
    for name in (each.removesuffix("_cell_error") for each in variables if each.endswith("_cell_error")):
        mean, left, standard = (float(variables[name + end][1]) for end in ("", "_cell_error", "_standard_error"))
        if left > max(standard, WORTH_SAYING * abs(mean)):
            loud.append(f"{name} {100 * left / abs(mean):.1f} %")
    if not loud:
        return None
    return f"segments may leave more of a mean than samples do: {', '.join(loud)}; more resolution.segments leave less"
