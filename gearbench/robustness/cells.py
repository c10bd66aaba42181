"""Error of the cells of contact lines, averaged over a few samples that are solved on their patches of contact too.

All samples share the same cells along the contact lines, wherever the flanks of a sample part. The mean error of the
cells is removed from all samples (B3 of docs/algorithms.md). These few samples also show the error left in a mean.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import with_field
from gearbench.contact.batch import Batch, chunks, on_all_segments, solve_one_chunk
from gearbench.contact.patches import solve_roughly_on_patches
from gearbench.contact.problem import ContactProblem, part_of
from gearbench.contact.solver import Guess
from gearbench.geometry.action import ContactLines
from gearbench.results.cycle import MeshCycle, Phases
from gearbench.results.points import Columns
from gearbench.results.responses import response
from gearbench.scene import Scene

#: Number of samples that are solved on their patches.
CHECKED = 8
#: Number of times that the ends of their patches are computed. A third time would change the means of gears in use by
#: at most a fiftieth of the error that the correction leaves.
CHECKED_ROUNDS = 2
#: A warning names a mean if the cells leave an error above its standard error and above this share of the mean.
WORTH_SAYING = 0.01


@dataclass(frozen=True, kw_only=True, eq=False)
class Checked:
    """Approach [mm] and stiffness [N/mm] of the same samples on cells and on their patches, (2, sample, position)."""

    on_cells: NDArray
    on_patches: NDArray

    @property
    def cell_correction(self) -> NDArray:
        """Mean addend of the approach [mm] and mean factor of the stiffness, (2, position)."""
        addend, factor = self.on_patches[0] - self.on_cells[0], self.on_patches[1] / self.on_cells[1]
        return np.stack([addend.mean(axis=0), factor.mean(axis=0)])

    def errors(self, scene: Scene, phases: Phases, names: Sequence[str]) -> Mapping[str, float]:
        """Estimated error that cells leave in the mean of the responses ``names`` after the correction, in their units.

        It is √(d̄² + s²/n), if corrected cells minus patches has the mean d̄ and standard deviation s over n samples.
        """
        addend, factor = self.cell_correction
        corrected = self.on_cells[0] + addend, self.on_cells[1] * factor
        answers = MeshCycle.of(scene, phases, *corrected), MeshCycle.of(scene, phases, *self.on_patches)
        errors = {}
        for name in names:
            d = np.subtract(*(response(name).reduce(each) for each in answers))
            errors[name] = math.sqrt(d.mean() ** 2 + d.var(ddof=1) / len(d))
        return errors


def check_cells(
    batch: Batch, problem: ContactProblem, modes: Callable[[ContactLines], NDArray], amounts: NDArray
) -> Checked:
    """Solve samples with ``amounts`` (sample, mode) on cells and on their patches.

    ``batch`` was prepared for ``problem``, whose segments are cells, for samples of ``modes`` (position, pair,
    segment, mode) [mm].
    """
    cells, count, positions = problem.cells, len(amounts), len(problem.gap)
    assert cells is not None
    at_nodes = modes(cells.smooth_lines) / np.expand_dims(cells.smooth_lines.lever, -1)
    field = np.einsum("pkim,sm->spki", at_nodes, amounts).reshape(-1, *at_nodes.shape[1:-1])
    # the positions of all samples, one sample after the other, as a single problem
    tiled = with_field(part_of(problem, np.tile(np.arange(positions), count)), field)
    chunk = solve_one_chunk(batch, next(chunks(amounts)), segments=True)
    on_cells = np.stack([chunk.approach.T, chunk.stiffness.T])[:, :count]
    force = on_all_segments(batch, chunk.force[..., :count]).reshape(*problem.shape, count)
    guess = _guess(problem, on_cells[0], force)
    on_patches = np.stack(solve_roughly_on_patches(tiled, guess, CHECKED_ROUNDS)).reshape(2, count, positions)
    return Checked(on_cells=on_cells, on_patches=on_patches)


def _guess(problem: ContactProblem, approach: NDArray, force: NDArray) -> Guess:
    """Solutions of samples on the cells of ``problem``, as a guess for the positions of one sample after the other.

    ``approach`` (sample, position) is in mm, ``force`` (position, pair, segment, sample) dimensionless.
    """
    of_pairs = np.swapaxes(problem.factor.reshape(*problem.shape, -1), 2, 3) @ force
    in_block = (problem.block[:: problem.shape[2]] == np.arange(problem.blocks)[:, None]).astype(float)
    q = np.einsum("bk,pkrs->spbr", in_block, of_pairs)
    return Guess(q=q.reshape(approach.size, *q.shape[2:]), delta=approach.ravel() / problem.length_scale)


def cell_warning(variables: Columns) -> str | None:
    """Warning that names the means in which cells leave too large an error (``WORTH_SAYING``); None without one."""
    named = []
    for name in (each.removesuffix("_cell_error") for each in variables if each.endswith("_cell_error")):
        mean, cell_error, standard = (float(variables[name + end][1]) for end in ("", "_cell_error", "_standard_error"))
        if cell_error > max(standard, WORTH_SAYING * abs(mean)):
            named.append(f"{name} {100 * cell_error / abs(mean):.1f} %")
    if not named:
        return None
    return (
        f"too few segments change means more than the choice of samples: {', '.join(named)}; raise resolution.segments"
    )
