"""Contact of many samples of random errors, in milliseconds each: their gaps differ, their compliance is the same.

The gap of a sample is linear in its errors, e = e₀ + Σ_m ε_m e_m. Everything that does not depend on the sample is
computed once, in ``prepare``:

- the factor Ψ of the smooth compliance at each position, truncated to few columns;
- the solution at the mean errors and its derivatives by the errors, which give the first guess of each sample (B1 of
  docs/algorithms.md); its differences from the solution at the previous two positions correct it;
- if segments deflect each other through many amplitudes, the linear problem at the mean errors, which preconditions
  every sample (B2).

Where flanks may part, segments are cells, of which a sample may load only a part. Their discretisation error is
estimated on a few samples and removed from all of them (B3). Compiled kernels solve the samples in chunks, on several
threads. The result of a sample depends neither on its chunk nor on the number of threads, and is accurate to 1e-5 with
the tolerances ``SCATTER``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from gearbench.budget import batch_memory, require
from gearbench.contact.law import kernel_coefficients, steepening
from gearbench.contact.patches import ON_CELLS, compression, solve_roughly_on_patches
from gearbench.contact.problem import ContactProblem, reduce_rank
from gearbench.contact.reference import Reference, linearised, normal_matrix
from gearbench.contact.solver import MAX_STEPS, ConvergenceError, Guess, forces_and_slopes, solve_roughly
from gearbench.geometry.action import ContactLines

if TYPE_CHECKING:
    from gearbench.contact._kernels import Arrays
    from gearbench.contact._lane_kernels import Gaps, LaneResults

S = TypeVar("S")
T = TypeVar("T")

#: Newton steps after which a sample goes to the solver with line search.
NEWTON_LIMIT = 25
#: Maximum distance over which the error of the first guess is extrapolated from the previous two positions, divided by
#: the distance between them.
EXTRAPOLATED = 1.0
#: Number of amplitudes of a coupled problem from which conjugate gradients are faster than elimination.
COUPLED_RANK = 12


@dataclass(frozen=True, kw_only=True)
class Precision:
    """Tolerances of the solution of samples.

    Parameters
    ----------
    truncation
        Share of the smooth compliance that is left out, see ``truncated_root``.
    newton
        Residual at which a sample takes its last Newton step. This step leaves a few percent of the residual. The
        stiffness is computed before this step.
    coupled, stiffness
        For coupled problems: sum of the residual forces at which Newton's method ends, and relative error at which the
        conjugate gradients for the stiffness end. The relative error of the stiffness is the square of the latter.
    """

    truncation: float
    newton: float
    coupled: float
    stiffness: float


#: Tolerances with which samples agree with problems solved one by one to 1e-9, and to 1e-5.
ROUNDING = Precision(truncation=0.0, newton=3e-12, coupled=1e-11, stiffness=3e-6)
SCATTER = Precision(truncation=1e-5, newton=1e-6, coupled=1e-7, stiffness=3e-4)


@dataclass(frozen=True, kw_only=True)
class Batch:
    """A contact problem prepared for many gap vectors.

    Arrays start with the position. n is the greatest number of existing segments at a position; absent ones come last.

    Parameters
    ----------
    problem
        The problem at the mean errors, with truncated factor.
    count, blocks, firsts
        Number of existing segments and of existing blocks (position,), and first segment of each block (position,
        block + 1).
    gap, modes
        Gap at the mean errors (position, n) and gap mode of each error (position, error, n), both averaged over each
        segment.
    tilt, tilts
        Half the increase along each cell, of gap minus deflection at the mean errors (``tilt``, (position, n)) and of
        the gap mode of each error (``tilts``, (position, error, n)). If segments are points, ``tilts`` is empty.
    factor, product
        Ψ (position, n, rank), and the products of each two of its columns, the lower triangle row by row, (position,
        rank(rank+1)/2, n).
    laws
        a, h, κ = a/h + ln h, the compression from which the tangent continues the law, and 1/h, (position, 5, n).
    start, guess
        (q, δ) at the mean errors, (position, block·rank + 1), and their derivatives, (position, error, block·rank + 1).
    cell_correction
        Correction of the discretisation error of cells (2, position): addend of δ_n [mm], and factor of ∂F/∂δ_n.
    precision
        Tolerances.
    reference
        Linear problem at the mean errors; replaces ``product``, ``start`` and ``guess`` if segments deflect each other
        through many amplitudes.
    """

    problem: ContactProblem
    count: NDArray
    blocks: NDArray
    firsts: NDArray
    gap: NDArray
    tilt: NDArray
    modes: NDArray
    tilts: NDArray
    factor: NDArray
    laws: NDArray
    cell_correction: NDArray
    precision: Precision
    product: NDArray | None = None
    start: NDArray | None = None
    guess: NDArray | None = None
    reference: Reference | None = None

    @property
    def rank(self) -> int:
        """Number of columns of the factor of a block."""
        return self.factor.shape[2]

    @cached_property
    def ranks(self) -> NDArray:
        """Number of nonzero columns of each block (position, block); short contact lines have few."""
        used = ((self.factor != 0) * np.arange(1, self.rank + 1)).max(axis=2, initial=0)
        segment, first, end = np.arange(used.shape[1]), self.firsts[:, :-1, None], self.firsts[:, 1:, None]
        return np.where((first <= segment) & (segment < end), used[:, None], 0).max(axis=2, initial=0)

    @cached_property
    def extrapolation(self) -> NDArray:
        """Weights (position, 2) of the errors of the first guess at the previous position and at the one before it.

        They extrapolate the error of the guess on a straight line, or as a constant where mesh phases are unknown
        because segments are points. They are 0 unless these positions have the same segments.
        """
        same = (self.problem.active[1:] == self.problem.active[:-1]).all(axis=1)
        weights = np.zeros((len(self.count), 2))
        weights[1:, 0] = same
        if self.problem.cells is not None:
            step = np.diff(self.problem.cells.lines.mesh_phase)
            second = np.minimum(step[1:] / step[:-1], EXTRAPOLATED) * (same[1:] & same[:-1])
            weights[2:] += second[:, None] * np.array([1.0, -1.0])
        return weights

    @cached_property
    def gaps(self) -> Gaps:
        """Arrays that both compiled solvers need."""
        from gearbench.contact._lane_kernels import Gaps

        return Gaps(self.count, self.extrapolation, self.gap, self.tilt, self.modes, self.tilts, self.laws)

    def arrays(self, draw: NDArray, t: slice = slice(None)) -> Arrays:
        """Arrays for the solver of single problems, at the positions ``t``, of the sample ``draw`` (errors − means)."""
        from gearbench.contact._kernels import Arrays

        segment = np.arange(self.gap.shape[1])
        # absent segments, which come last, belong to the last existing block
        last = np.arange(self.firsts.shape[1] - 1) >= self.blocks[t, None] - 1
        ends = np.where(last, segment.size, self.firsts[t, 1:])
        block = np.sum(segment[:, None] >= ends[:, None, :], axis=2)
        sigma = np.abs(self.tilt[t] + draw[: self.tilts.shape[1]] @ self.tilts[t])
        a, h = np.ascontiguousarray(self.laws[t, 0]), np.ascontiguousarray(self.laws[t, 1])
        gap = self.gap[t] + draw @ self.modes[t] - sigma
        return Arrays(gap, a, h, sigma, segment < self.count[t, None], self.factor[t], block)


@dataclass(frozen=True, kw_only=True)
class BatchSolution:
    """Results of a chunk of samples, (position, sample).

    Parameters
    ----------
    approach
        δ_n [mm].
    stiffness
        ∂F_bn/∂δ_n [N/mm].
    rescued
        Number of contact problems that needed the solver with line search.
    force, slope
        Dimensionless P and dP/ds of the existing segments, (position, n, sample); without positions unless requested.
    """

    approach: NDArray
    stiffness: NDArray
    rescued: int
    force: NDArray
    slope: NDArray


@dataclass(frozen=True, kw_only=True)
class GapModes:
    """Gap modes e_m of random errors: a sample with the errors ε has the gap e₀ + Σ_m ε_m e_m.

    Parameters
    ----------
    modes
        Mean over each segment, (position, segment, mode) [mm].
    tilts
        Half the increase of the modes along each cell, (position, segment, mode); none if segments are points.
    """

    modes: NDArray
    tilts: NDArray

    @classmethod
    def on(cls, lines: ContactLines, modes: Callable[[ContactLines], NDArray]) -> GapModes:
        """Gap modes from a function that gives ``modes`` (position, pair, segment, mode) [mm] at the nodes of lines.

        The values are divided by the lever arms of the nodes.
        """

        def flat(each: ContactLines) -> NDArray:
            values = modes(each) / np.expand_dims(each.lever, -1)
            return values.reshape(lines.shape[0], -1, values.shape[-1])

        middle = flat(lines)
        if not lines.cells:
            return cls(modes=middle, tilts=middle[..., :0])
        begin, end = flat(lines.moved(-1)), flat(lines.moved(1))
        return cls(modes=(begin + 4 * middle + end) / 6, tilts=(end - begin) / 2)


def prepare(problem: ContactProblem, gaps: GapModes, precision: Precision = ROUNDING, *, at_mean: bool = True) -> Batch:
    """Prepare ``problem`` for samples of ``gaps``.

    If segments are cells and ``at_mean``, the problem at the mean errors is also solved on its contact patches. The
    difference is the discretisation error of the cells, which is removed from all samples (B3 of docs/algorithms.md).

    Raises
    ------
    MemoryBudgetError
        If this needs more memory than the budget.
    ConvergenceError
        If the problem at the mean errors is not solved.
    """
    problem, tilt, on_patches = _at_mean_errors(problem, at_mean=at_mean)
    problem = reduce_rank(problem, precision.truncation)
    block_order, count, blocks, firsts = _order(problem)
    _require_memory(problem, int(count.max()), gaps.modes.shape[2] + gaps.tilts.shape[2])

    pick = existing_first(problem)
    modes, tilts = (
        np.ascontiguousarray(np.swapaxes(pick(each / problem.length_scale), 1, 2)) for each in (gaps.modes, gaps.tilts)
    )
    guess = Guess.empty(problem)
    approach, _ = solve_roughly(problem, guess)
    batch = Batch(
        problem=problem,
        count=count,
        blocks=blocks,
        firsts=firsts,
        gap=pick(problem.gap + problem.sigma),
        tilt=pick(tilt),
        modes=modes,
        tilts=tilts,
        factor=np.where(pick(problem.active)[..., None], pick(problem.factor), 0.0),
        laws=kernel_coefficients(pick(problem.a), pick(problem.h)),
        cell_correction=np.stack([np.zeros(len(count)), np.ones(len(count))]),
        precision=precision,
    )
    q = np.take_along_axis(guess.q, block_order[..., None], 1)[:, : blocks.max()]
    batch, stiffness = _linearised(batch, np.column_stack([q.reshape(len(q), -1), guess.delta]))
    if on_patches is None:
        return batch
    stiffness *= problem.force / problem.length_scale
    patch_approach, patch_stiffness = on_patches
    return replace(batch, cell_correction=np.stack([patch_approach - approach, patch_stiffness / stiffness]))


def _at_mean_errors(
    problem: ContactProblem, *, at_mean: bool
) -> tuple[ContactProblem, NDArray, tuple[NDArray, NDArray] | None]:
    """Problem with the mean gap of each cell, ``Batch.tilt``, and approach and stiffness on the contact patches.

    Approach and stiffness are None if segments are points, or not ``at_mean``.
    """
    cells = problem.cells
    if cells is None:
        return problem, np.zeros(problem.gap.shape), None
    guess = Guess.empty(problem)
    solve_roughly(problem, guess, ON_CELLS)
    s = compression(problem, cells.lines, guess)
    on_patches = solve_roughly_on_patches(problem, guess) if at_mean else None
    tilt = np.where(problem.active, ((s[..., 0] - s[..., 2]) / 2).reshape(problem.gap.shape), 0.0)
    mean = cells.gaps @ np.array([1, 4, 1]) / 6 / (problem.length_scale * cells.share[:, None, None])
    gap, sigma = mean.reshape(problem.gap.shape), np.abs(tilt)
    return replace(problem, gap=gap - sigma, sigma=sigma), tilt, on_patches


def _linearised(batch: Batch, start: NDArray) -> tuple[Batch, NDArray]:
    """Add to ``batch`` the start of its samples: the problem linearised about the solution ``start`` for mean errors.

    Also return ∂F/∂δ of this solution, (position,), from the same slopes as the stiffness of samples.
    """
    arrays = batch.arrays(np.zeros(batch.modes.shape[1]))
    C = _motion_matrix(arrays, int(batch.blocks.max()))
    z = (C @ start[..., None])[..., 0]
    P, W = _law(arrays, z)
    if batch.problem.blocks == 1 and batch.rank >= COUPLED_RANK:
        reference = linearised(C, batch.count, z, P, W)
        return replace(batch, reference=reference), 1 / reference.flexibility
    unit = np.zeros((len(C), C.shape[2], 1))
    unit[:, -1] = 1.0
    right = np.concatenate([np.swapaxes(C, 1, 2) @ (W[..., None] * np.swapaxes(batch.modes, 1, 2)), unit], axis=2)
    # derivatives of (q, δ) by the errors, and in the last row by the load
    derivatives = np.ascontiguousarray(np.swapaxes(np.linalg.solve(normal_matrix(C, W), right), 1, 2))
    guess = np.ascontiguousarray(derivatives[:, :-1])
    return replace(batch, product=_products(batch.factor), start=start, guess=guess), 1 / derivatives[:, -1, -1]


def _motion_matrix(arrays: Arrays, blocks: int) -> NDArray:
    """C (position, segment, block·rank + 1), which gives the motions of segments z = C (q, δ)."""
    in_block = arrays.block[..., None] == np.arange(blocks)
    factor = (in_block[..., None] * arrays.factor[:, :, None]).reshape(*arrays.gap.shape, -1)
    return np.concatenate([-factor, arrays.active[..., None]], axis=2)


def _law(arrays: Arrays, z: NDArray) -> tuple[NDArray, NDArray]:
    """Forces, and slopes for the stiffness, of segments that move by z, (position, segment); 0 for absent ones."""
    s = z - arrays.gap
    P, W = forces_and_slopes(arrays, s)
    cells = (arrays.h > 0) & (P > 0) & (arrays.sigma > 0)
    W[cells] *= steepening(s[cells] / (2 * arrays.sigma[cells]), arrays.h[cells], W[cells])
    return P, W


def _require_memory(problem: ContactProblem, segments: int, modes: int) -> None:
    """Raise ``MemoryBudgetError`` if the batch needs more memory than the budget."""
    positions, _, rank = problem.factor.shape
    linearised = problem.blocks == 1 and rank >= COUPLED_RANK
    need = positions * batch_memory(segments, modes, rank, problem.blocks, linearised=linearised)
    size = f"{positions} positions × {segments} segments × {modes} modes of gaps"
    require(need, "resolution", size, "fewer segments or positions would fit")


def _products(factor: NDArray) -> NDArray:
    """Products of the columns of Ψ (position, n, rank), lower triangle row by row, (position, rank(rank+1)/2, n)."""
    rows = np.ascontiguousarray(np.swapaxes(factor, 1, 2))
    positions, rank, n = rows.shape
    result = np.empty((positions, rank * (rank + 1) // 2, n))
    for c in range(rank):
        start = c * (c + 1) // 2
        np.multiply(rows[:, c, None], rows[:, : c + 1], out=result[:, start : start + c + 1])
    return result


def existing_first(problem: ContactProblem) -> Callable[[NDArray], NDArray]:
    """Function that puts existing segments of values (position, segment, …) first, in as few columns as possible."""
    order, columns = np.argsort(~problem.active, axis=1, kind="stable"), problem.active.sum(axis=1).max()

    def pick(values: NDArray) -> NDArray:
        index = order.reshape(*order.shape, *[1] * (values.ndim - 2))
        return np.ascontiguousarray(np.take_along_axis(values, index, 1)[:, :columns])

    return pick


def on_all_segments(batch: Batch, values: NDArray) -> NDArray:
    """Values of existing segments (position, n, …) on all segments of the problem, (position, segment, …); else 0."""
    problem = batch.problem
    result = np.zeros((*problem.gap.shape, *values.shape[2:]))
    result[problem.active] = values[np.arange(values.shape[1]) < batch.count[:, None]]
    return result


def _order(problem: ContactProblem) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Order that puts existing blocks first (position, block); then ``Batch.count``, ``blocks`` and ``firsts``."""
    positions = problem.active.shape[0]
    count = problem.active.sum(axis=1)
    per_block = np.zeros((positions, problem.blocks), dtype=np.int64)
    for k in range(problem.blocks):
        per_block[:, k] = problem.active[:, problem.block == k].sum(axis=1)
    blocks = (per_block > 0).sum(axis=1)
    firsts = np.zeros((positions, problem.blocks + 1), dtype=np.int64)
    for t in range(positions):
        firsts[t, 1 : blocks[t] + 1] = np.cumsum(per_block[t][per_block[t] > 0])
    return np.argsort(per_block == 0, axis=1, kind="stable"), count, blocks, firsts


def chunks(draws: NDArray) -> Iterator[NDArray]:
    """Split ``draws`` (sample, error) into chunks of ``LANES`` samples.

    The last chunk may be shorter; its last sample is repeated up to a multiple of ``VECTOR`` lanes.
    """
    from gearbench.contact._lane_kernels import LANES, VECTOR

    for i in range(0, len(draws), LANES):
        chunk = draws[i : i + LANES]
        yield np.concatenate([chunk, np.repeat(chunk[-1:], -len(chunk) % VECTOR, axis=0)])


def solve_one_chunk(
    batch: Batch, draws: NDArray, load: NDArray | None = None, *, segments: bool = False
) -> BatchSolution:
    """Solve every position for one of the ``chunks`` of samples on this thread; each sample is a lane of the kernels.

    Parameters
    ----------
    batch, draws
        The prepared problem, and the errors of the samples minus their means (lane, error).
    load
        Load divided by the load of the problem (position, lane), by default 1. The ``Batch.cell_correction`` of load 1
        serves for all loads.
    segments
        Whether to return forces and slopes of the segments too.
    """
    from gearbench.contact._lane_kernels import LaneResults

    shape = (len(batch.count), len(draws))
    load = np.ones(shape) if load is None else np.ascontiguousarray(load)
    delta, stiffness, done = np.empty(shape), np.empty(shape), np.empty(shape)
    force, slope = np.zeros((2, shape[0] if segments else 0, batch.gap.shape[1], shape[1]))
    lanes = np.ascontiguousarray(draws.T)
    with np.errstate(all="ignore"):
        _run(batch, lanes, load, LaneResults(delta, stiffness, done, force, slope))
    converged = (done == 1.0) & np.isfinite(delta) & np.isfinite(stiffness)
    unsolved = np.argwhere(~converged)
    for t, j in unsolved:
        delta[t, j], stiffness[t, j], *segment_values = _solve_with_line_search(
            batch, int(t), lanes[:, j], float(load[t, j])
        )
        if segments:
            force[t, :, j], slope[t, :, j] = segment_values
    p = batch.problem
    return BatchSolution(
        approach=p.length_scale * delta + batch.cell_correction[0][:, None],
        stiffness=p.force / p.length_scale * stiffness * batch.cell_correction[1][:, None],
        rescued=len(unsolved),
        force=force,
        slope=slope,
    )


def _run(batch: Batch, lanes: NDArray, load: NDArray, results: LaneResults) -> None:
    """Fill ``results`` with the compiled solver that suits the batch."""
    from gearbench.contact._batch_kernels import Blocks, solve_chunk
    from gearbench.contact._coupled_kernels import solve_coupled_chunk
    from gearbench.contact._lane_kernels import Lanes

    b, lane_state = batch, Lanes.of(batch.gap.shape[1], load)
    if b.reference is not None:
        accuracy = b.precision.coupled, b.precision.stiffness
        solve_coupled_chunk(b.gaps, b.reference, lanes, lane_state, accuracy, NEWTON_LIMIT, results)
        return
    assert b.product is not None
    assert b.start is not None
    assert b.guess is not None
    blocks = Blocks(b.firsts, b.blocks, b.ranks, b.factor, b.product, b.start, b.guess)
    solve_chunk(b.gaps, blocks, lanes, lane_state, b.precision.newton, NEWTON_LIMIT, results)


def _solve_with_line_search(batch: Batch, t: int, draw: NDArray, load: float) -> tuple[float, float, NDArray, NDArray]:
    """δ, ∂F/∂δ, forces and slopes of one position of one sample, by the solver with line search.

    The solver works in units of the load of the sample (see ``problem.under_shares``).

    Raises
    ------
    ConvergenceError
        If this solver fails too.
    """
    from gearbench.contact._kernels import Work, solve_positions

    arrays = batch.arrays(draw, slice(t, t + 1))
    scaled = {"gap": arrays.gap / load, "sigma": arrays.sigma / load, "a": arrays.a - arrays.h * np.log(load)}
    arrays = arrays._replace(**scaled)
    blocks, rank, n = int(batch.blocks.max()), batch.rank, arrays.gap.shape[1]
    least = arrays.gap[arrays.active].min()
    shifted, q, force = arrays._replace(gap=arrays.gap - least), np.zeros((1, blocks, rank)), np.zeros((1, n))
    delta, steps = np.full(1, -np.inf), np.zeros(1, dtype=np.int64)
    solve_positions(shifted, Work.of(blocks, rank, n), q, delta, 0.0, MAX_STEPS, force, np.empty(1), steps)
    if steps[0] >= MAX_STEPS:
        raise ConvergenceError(f"contact not solved: position {t}, {steps[0]} Newton steps")
    C = _motion_matrix(shifted, blocks)
    W = _law(shifted, (C @ np.append(q, delta)[:, None])[..., 0])[1]
    stiffness = 1 / float(np.linalg.inv(normal_matrix(C, W)[0])[-1, -1])
    return float(load * (delta[0] + least)), stiffness, load * force[0], W[0]


def on_threads(work: Callable[[S], T], items: Iterable[S], threads: int) -> Iterator[T]:
    """Results of ``work`` on the items, in order, from ``threads`` threads; kernels release the interpreter lock."""
    if threads == 1:
        yield from map(work, items)
        return
    with ThreadPoolExecutor(threads) as pool:
        yield from pool.map(work, items)
