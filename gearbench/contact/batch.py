"""Many gap vectors against one compliance: the contact problem of every sample, in milliseconds.

The gap of a sample is linear in its errors, e = e₀ + Σ_m ε_m e_m, and the compliance is the same for all samples. So
everything that does not depend on the sample is made once: the factor of each position, truncated to few columns;
the solution at the mean errors and its derivative with respect to each error, from which each sample starts (B1 of
docs/theory.md), with what these missed at the positions before; and where segments move each other through many
amplitudes, the linear problem at the mean errors, which is the preconditioner of every sample (B2). The rest is done by
compiled kernels, chunk by chunk of samples, on as many threads as asked for. A sample's answer depends neither on the
chunk it is in nor on the number of threads. It is good to 1e-5: constants below.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.budget import require
from gearbench.contact.law import kernel_coefficients
from gearbench.contact.problem import ContactProblem, reduce_rank
from gearbench.contact.reference import Reference, linearised
from gearbench.contact.solver import MAX_STEPS, ConvergenceError, Guess, scratch, solve_roughly

#: Newton steps after which a sample is handed to the solver with line search.
NEWTON_LIMIT = 25
#: How far the first guess of a position is extrapolated from the two before, in distances between them, at most.
EXTRAPOLATED = 1.0
#: Amplitudes of a coupled problem from which conjugate gradients are faster than eliminating them.
COUPLED_RANK = 12


@dataclass(frozen=True, kw_only=True)
class Precision:
    """Where computing a sample ends.

    Parameters
    ----------
    truncation
        How much of the smooth compliance is left out, see ``truncated_root``.
    newton
        Residual at which a sample takes its last Newton step, which squares it; the stiffness is that before it.
    coupled, stiffness
        Of conjugate gradients: sum of the residual forces at which they have converged, and their precision for the
        stiffness, which is good to its square.
    """

    truncation: float
    newton: float
    coupled: float
    stiffness: float


#: Answers of single problems to 1e-9, and to 1e-5.
ROUNDING = Precision(truncation=0.0, newton=1e-10, coupled=1e-11, stiffness=3e-6)
SCATTER = Precision(truncation=1e-5, newton=1e-6, coupled=1e-7, stiffness=3e-4)


@dataclass(frozen=True, kw_only=True)
class Batch:
    """A contact problem prepared for many gap vectors. Arrays start with the position; absent segments are left out.

    Parameters
    ----------
    problem
        The problem at the mean errors, its factor truncated.
    count, blocks, firsts
        Number of segments and of loaded blocks (position,), first segment of each block (position, block + 1).
    gap, modes
        e at the mean errors, (position, n), and the gap of each error, (position, error, n).
    factor, product
        Ψ (position, n, rank) and the products of its columns, lower triangle row by row (position, rank(rank+1)/2, n).
    laws
        a, h, ln-coefficient κ, the compression where the tangent takes over, and soft, (position, 5, n).
    start, guess
        (q, δ) at the mean errors, (position, block·rank + 1), and their derivatives, (position, error, block·rank + 1).
    precision
        Where computing a sample ends.
    reference
        In place of ``product``, ``start`` and ``guess`` where segments move each other through many amplitudes.
    """

    problem: ContactProblem
    count: NDArray
    blocks: NDArray
    firsts: NDArray
    gap: NDArray
    modes: NDArray
    factor: NDArray
    product: NDArray
    laws: NDArray
    start: NDArray
    guess: NDArray
    precision: Precision
    reference: Reference | None = None

    @property
    def rank(self) -> int:
        """Columns of the factor of a block."""
        return self.factor.shape[2]

    @cached_property
    def ranks(self) -> NDArray:
        """Columns that each block uses, (position, block): short contact lines have few; the others are zero."""
        used = np.zeros((len(self.count), self.firsts.shape[1] - 1), dtype=np.int64)
        for t, blocks in enumerate(self.blocks):
            for k in range(blocks):
                own = self.factor[t, self.firsts[t, k] : self.firsts[t, k + 1]]
                used[t, k] = np.flatnonzero(own.any(axis=0)).max(initial=-1) + 1
        return used

    @cached_property
    def ahead(self) -> NDArray:
        """Weights of what the first guess missed at the position before and at the one before that, (position, 2).

        As on a straight line through both, where all have the same segments.
        """
        same = (self.problem.active[1:] == self.problem.active[:-1]).all(axis=1)
        weights = np.zeros((len(self.count), 2))
        weights[1:, 0] = same
        if self.problem.along is not None:
            step = np.diff(self.problem.along.lines.mesh_phase)
            further = np.minimum(step[1:] / step[:-1], EXTRAPOLATED) * (same[1:] & same[:-1])
            weights[2:] += further[:, None] * np.array([1.0, -1.0])
        return weights

    @cached_property
    def single_arrays(self) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray]:
        """a, h, soft, active and block of the segments, (position, n), as the solver of single positions takes them."""
        segment = np.arange(self.gap.shape[1])
        active = segment < self.count[:, None]
        last = np.arange(self.firsts.shape[1] - 1) >= self.blocks[:, None] - 1
        ends = np.where(last, segment.size, self.firsts[:, 1:])
        block = np.sum(segment[:, None] >= ends[:, None, :], axis=2)
        a, h, soft = (np.ascontiguousarray(self.laws[:, i]) for i in (0, 1, 4))
        return a, h, soft, active, block


@dataclass(frozen=True, kw_only=True)
class BatchSolution:
    """Answers of a run of samples, (position, sample).

    Parameters
    ----------
    approach
        δ_n [mm].
    stiffness
        ∂F_bn/∂δ_n [N/mm].
    rescued
        How many of the contact problems needed the solver with line search.
    """

    approach: NDArray
    stiffness: NDArray
    rescued: int


def prepare(problem: ContactProblem, modes: NDArray, precision: Precision = ROUNDING) -> Batch:
    """Prepare ``problem`` for gaps e + Σ ε_m ``modes``[..., m], (position, segment, error) [mm].

    Raises
    ------
    MemoryBudgetError
        If that needs more memory than there may be.
    """
    problem = reduce_rank(problem, precision.truncation)
    order, count, blocks, firsts = _order(problem)
    _require_memory(problem, int(count.max()), modes.shape[2])

    def pick(values: NDArray) -> NDArray:
        """Existing segments first, absent ones behind them, cut to the most there are."""
        index = order.reshape(order.shape + (1,) * (values.ndim - 2))
        return np.ascontiguousarray(np.take_along_axis(values, index, 1)[:, : count.max()])

    factor, a, h = pick(problem.factor), pick(problem.a), pick(problem.h)
    batch = Batch(
        problem=problem,
        count=count,
        blocks=blocks,
        firsts=firsts,
        gap=pick(problem.gap),
        modes=np.ascontiguousarray(np.swapaxes(pick(modes / problem.length_scale), 1, 2)),
        factor=factor,
        product=np.empty(0),
        laws=kernel_coefficients(a, h, pick(problem.soft)),
        start=np.empty(0),
        guess=np.empty(0),
        precision=precision,
    )
    if problem.blocks == 1 and batch.rank >= COUPLED_RANK:
        return replace(batch, reference=_reference(batch))
    start, guess = _first_guess(batch)
    return replace(batch, product=_products(factor), start=start, guess=guess)


def _require_memory(problem: ContactProblem, segments: int, errors: int) -> None:
    """Refuse what needs more memory than there may be: products of columns, or of coupled problems their matrices."""
    positions, _, rank = problem.factor.shape
    coupled = problem.blocks == 1 and rank >= COUPLED_RANK
    own = 2 * rank * rank if coupled else segments * rank * (rank + 1) / 2 + errors * problem.blocks * rank
    need = 8.0 * positions * (own + segments * (4 * rank + 4 * errors))
    size = f"{positions} positions × {segments} segments × {errors} errors"
    require(need, "resolution", size, "fewer segments or positions would fit")


def _reference(batch: Batch) -> Reference:
    """The linear problem at the mean errors, (q, δ) of which the solver of single positions finds."""
    a, h, soft, active, _ = batch.single_arrays
    guess = Guess.nothing(batch.problem)
    solve_roughly(batch.problem, guess)
    q, delta = guess.q[:, 0], guess.delta
    factor = np.where(active[..., None], batch.factor, 0.0)
    return linearised(factor, active, batch.gap, (a, h, soft), q, delta)


def _products(factor: NDArray) -> NDArray:
    """Products of the columns of Ψ (position, n, rank), lower triangle row by row, (position, rank(rank+1)/2, n)."""
    rows = np.ascontiguousarray(np.swapaxes(factor, 1, 2))
    positions, rank, n = rows.shape
    result = np.empty((positions, rank * (rank + 1) // 2, n))
    for c in range(rank):
        start = c * (c + 1) // 2
        np.multiply(rows[:, c, None], rows[:, : c + 1], out=result[:, start : start + c + 1])
    return result


def _order(problem: ContactProblem) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Order that puts the existing segments first, how many there are, and the blocks they form."""
    positions = problem.active.shape[0]
    order = np.argsort(~problem.active, axis=1, kind="stable")
    count = problem.active.sum(axis=1)
    per_block = np.zeros((positions, problem.blocks), dtype=np.int64)
    for k in range(problem.blocks):
        per_block[:, k] = problem.active[:, problem.block == k].sum(axis=1)
    blocks = (per_block > 0).sum(axis=1)
    firsts = np.zeros((positions, problem.blocks + 1), dtype=np.int64)
    for t in range(positions):
        firsts[t, 1 : blocks[t] + 1] = np.cumsum(per_block[t][per_block[t] > 0])
    return order, count, blocks, firsts


def _first_guess(batch: Batch) -> tuple[NDArray, NDArray]:
    """(q, δ) of each position at the mean errors and their derivatives with respect to the errors."""
    from gearbench.contact._kernels import first_guess

    positions, errors, _ = batch.modes.shape
    most = int(batch.blocks.max()) * batch.rank
    start, guess = np.zeros((positions, most + 1)), np.zeros((positions, errors, most + 1))
    a, h, soft, active, block = batch.single_arrays
    work, hess = scratch(int(batch.blocks.max()), batch.rank)
    force = np.zeros_like(batch.gap)
    first_guess(
        batch.gap, a, h, soft, active, batch.factor, block, batch.blocks, batch.modes, force, work, hess, MAX_STEPS,
        start, guess,
    )  # fmt: skip
    return start, guess


def solve_batch(batch: Batch, draws: NDArray) -> BatchSolution:
    """Solve every position for the errors ``draws`` − mean, (sample, error), on this thread."""
    parts = [solve_one_chunk(batch, chunk) for chunk in chunks(draws)]
    count = len(draws)
    return BatchSolution(
        approach=np.concatenate([part.approach for part in parts], axis=1)[:, :count],
        stiffness=np.concatenate([part.stiffness for part in parts], axis=1)[:, :count],
        rescued=sum(part.rescued for part in parts),
    )


def chunks(draws: NDArray) -> Iterator[NDArray]:
    """``draws`` (sample, error) in chunks of the lanes of the kernel, the last one filled up by its last sample."""
    from gearbench.contact._lane_kernels import LANES

    for i in range(0, len(draws), LANES):
        chunk = draws[i : i + LANES]
        yield np.concatenate([chunk, np.repeat(chunk[-1:], LANES - len(chunk), axis=0)])


def solve_one_chunk(batch: Batch, draws: NDArray) -> BatchSolution:
    """Solve every position for one full chunk of errors, (lanes, error), on this thread."""
    shape = (len(batch.count), len(draws))
    delta, stiffness, done = np.empty(shape), np.empty(shape), np.empty(shape)
    lanes = np.ascontiguousarray(draws.T)
    with np.errstate(all="ignore"):
        _run(batch, lanes, delta, stiffness, done)
    good = (done == 1.0) & np.isfinite(delta) & np.isfinite(stiffness)
    missed = np.argwhere(~good)
    for t, j in missed:
        delta[t, j], stiffness[t, j] = _rescue(batch, int(t), lanes[:, j])
    p = batch.problem
    return BatchSolution(
        approach=p.length_scale * delta, stiffness=p.force / p.length_scale * stiffness, rescued=len(missed)
    )


def _run(batch: Batch, lanes: NDArray, delta: NDArray, stiffness: NDArray, done: NDArray) -> None:
    """Fill δ, ∂F/∂δ and whether they converged, (position, lane), by the kernel of the batch."""
    from gearbench.contact._batch_kernels import solve_chunk
    from gearbench.contact._coupled_kernels import solve_coupled_chunk

    b, r = batch, batch.reference
    if r is None:
        solve_chunk(
            b.firsts, b.blocks, b.ranks, b.ahead, b.gap, b.modes, lanes, b.factor, b.product, b.laws, b.start, b.guess,
            b.precision.newton, NEWTON_LIMIT, delta, stiffness, done,
        )  # fmt: skip
    else:
        solve_coupled_chunk(
            b.count, b.ahead, b.gap, b.modes, lanes, b.laws, r.response, r.single_response, r.rise, r.flexibility,
            r.weight, r.start, b.precision.coupled, b.precision.stiffness, NEWTON_LIMIT, delta, stiffness, done,
        )  # fmt: skip


def _rescue(batch: Batch, t: int, draw: NDArray) -> tuple[float, float]:
    """One position of one sample by the solver with line search.

    Raises
    ------
    ConvergenceError
        If that does not solve it either.
    """
    from gearbench.contact._kernels import solve_position

    a, h, soft, active, block = batch.single_arrays
    work, hess = scratch(int(batch.blocks.max()), batch.rank)
    gap = np.array(batch.gap)
    gap[t] += draw @ batch.modes[t]
    least = gap[t, active[t]].min()
    gap[t] -= least
    force = np.zeros_like(gap)
    delta, stiffness, steps = solve_position(
        t, gap, a, h, soft, active, batch.factor, block, force, work, hess, MAX_STEPS
    )
    if steps >= MAX_STEPS:
        raise ConvergenceError(f"contact not solved: position {t}, {steps} Newton steps")
    return delta + least, stiffness


def on_threads(
    work: Callable[[NDArray], BatchSolution], items: Iterable[NDArray], threads: int
) -> Iterator[BatchSolution]:
    """``work`` on each item in order, on ``threads`` threads; the kernels run outside Python's lock."""
    if threads == 1:
        yield from map(work, items)
        return
    with ThreadPoolExecutor(threads) as pool:
        yield from pool.map(work, items)
