"""Common parts of the compiled solvers for many samples, ``_batch_kernels`` and ``_coupled_kernels``.

Each lane holds one error sample and does not depend on the others. The lane is the last axis of arrays, so that loops
over lanes become vector instructions. ``batch`` prepares the arrays and calls the solvers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.compiled import FUSED, part
from gearbench.contact._law_kernels import LEAST, level_start, log_law, logarithm
from gearbench.contact.law import STEEPEST, TAIL

#: Maximum number of lanes. Their number is a multiple of ``VECTOR``, so that no loop ends with single numbers.
LANES, VECTOR = 128, 16
#: Smallest σ, half the variation of the compression along a cell; Gauss points have this σ, so nothing divides by zero.
POINT = 1e-30


class Gaps(NamedTuple):
    """Gaps and contact laws of a ``Batch``: fields of the same names; ``existing`` is ``Batch.count``."""

    existing: NDArray
    extrapolation: NDArray
    gap: NDArray
    tilt: NDArray
    modes: NDArray
    tilts: NDArray
    laws: NDArray


class LaneResults(NamedTuple):
    """Results of a chunk of samples, which the solvers fill in.

    δ and ∂F/∂δ are (position, lane), and so is ``done``, which is 1 where the lane converged.
    ``force`` and ``slope`` of the segments (position, segment, lane) are filled unless they have no positions.
    """

    delta: NDArray
    stiffness: NDArray
    done: NDArray
    force: NDArray
    slope: NDArray


class Lanes(NamedTuple):
    """State of the samples at one position: arrays of the segments, (segment, lane), and numbers of the lanes, (lane,).

    ``s``, ``p`` and ``w`` are compression, force and slope dp/ds. ``sigma`` holds σ, half the variation of s along a
    cell, and 1/2σ, (2, segment, lane). Gaps and δ are counted from the smallest gap, ``least``. ``load`` is the
    prescribed ΣP, (position, lane). ``total`` is ΣP − load in ``_batch_kernels``, and in ``_coupled_kernels`` Σ|R_i|
    with the residual R of (B2) of docs/algorithms.md. ``slope`` holds ΣdP/ds, which a Newton step replaces by ∂F/∂δ;
    ``step`` is the step of δ; ``done`` is 1 where the lane converged. ``level`` is scratch of the law, (3, lane).
    """

    gap: NDArray
    sigma: NDArray
    s: NDArray
    p: NDArray
    w: NDArray
    level: NDArray
    least: NDArray
    total: NDArray
    slope: NDArray
    residual: NDArray
    done: NDArray
    step: NDArray
    load: NDArray

    @classmethod
    def of(cls, segments: int, load: NDArray) -> Lanes:
        """Empty lanes for a number of segments; the unit of ``load`` (position, lane) is the load of the problem."""
        number = load.shape[1]
        gap, s, p, w, sigma, inverse = np.empty((6, segments, number))
        least, total, slope, residual, done, step = np.empty((6, number))
        sigma, level = np.stack([sigma, inverse]), np.empty((3, number))
        return cls(gap, sigma, s, p, w, level, least, total, slope, residual, done, step, load)


@part(FUSED)
def add_combination(start, stop, coefficient, column, rows, out, r):
    """out[r] += Σ_i coefficient[i, column] · rows[i] over start ≤ i < stop, four rows at a time."""
    number = out.shape[1]
    i = start
    while i + 4 <= stop:
        a, b = coefficient[i, column], coefficient[i + 1, column]
        c, d = coefficient[i + 2, column], coefficient[i + 3, column]
        for j in range(number):
            out[r, j] += (a * rows[i, j] + b * rows[i + 1, j]) + (c * rows[i + 2, j] + d * rows[i + 3, j])
        i += 4
    while i < stop:
        a = coefficient[i, column]
        for j in range(number):
            out[r, j] += a * rows[i, j]
        i += 1


@part(FUSED)
def first_guess(start, guess, draws, weights, guess_errors, q):
    """First guess of the unknowns q (n, lanes): start + guess · draws, plus the weighted errors of earlier guesses.

    ``guess_errors`` (2, n, lanes) holds the errors that start + guess · draws had at the previous position (row 0) and
    at the one before it (row 1). Row 0 moves to row 1 and becomes −(start + guess · draws) of this position;
    ``note_guess_errors`` adds the solution to it.
    """
    number = q.shape[1]
    for r in range(q.shape[0]):
        for j in range(number):
            q[r, j] = start[r]
        add_combination(0, draws.shape[0], guess, r, draws, q, r)
        for j in range(number):
            correction = weights[0] * guess_errors[0, r, j] + weights[1] * guess_errors[1, r, j]
            guess_errors[1, r, j] = guess_errors[0, r, j]
            guess_errors[0, r, j] = -q[r, j]
            q[r, j] += correction


@part(FUSED)
def note_guess_errors(unknowns, done, guess_errors):
    """Add the solution (n, lanes) to ``guess_errors``, which holds minus its first guess; 0 for unsolved lanes."""
    number = done.size
    for i in range(unknowns.shape[0]):
        for j in range(number):
            guess_errors[i, j] = guess_errors[i, j] + unknowns[i, j] if done[j] == 1.0 else 0.0


@part(FUSED)
def save_lanes(unknowns, delta, stiffness, done, saved):
    """Copy unknowns (n, lanes), δ, ∂F/∂δ and ``done`` of all lanes into ``saved`` (n + 3, lanes)."""
    number = done.size
    n = unknowns.shape[0]
    for i in range(n):
        for j in range(number):
            saved[i, j] = unknowns[i, j]
    for j in range(number):
        saved[n, j], saved[n + 1, j], saved[n + 2, j] = delta[j], stiffness[j], done[j]


@part(FUSED)
def restore_converged(unknowns, delta, stiffness, done, saved):
    """Restore converged lanes from ``saved``, so that their results do not depend on other lanes."""
    number = done.size
    n = unknowns.shape[0]
    for j in range(number):
        if saved[n + 2, j] == 1.0:
            delta[j], stiffness[j], done[j] = saved[n, j], saved[n + 1, j], 1.0
            for i in range(n):
                unknowns[i, j] = saved[i, j]


@part(FUSED)
def keep_forces(t, n, lanes, results):
    """Copy forces and slopes of the segments at position t into ``results``."""
    number = lanes.done.size
    for i in range(n):
        for j in range(number):
            results.force[t, i, j], results.slope[t, i, j] = lanes.p[i, j], lanes.w[i, j]


@part(FUSED)
def fill_gaps(t, gaps, draws, lanes):
    """Fill ``sigma`` and the gaps of the samples at position t, counted from the smallest gap of the sample.

    The gap of a cell is that of the end which touches first.
    """
    number = lanes.done.size
    gap, sigma, least = lanes.gap, lanes.sigma, lanes.least
    for i in range(gaps.existing[t]):
        for j in range(number):
            gap[i, j], sigma[0, i, j] = gaps.gap[t, i], gaps.tilt[t, i]
        add_combination(0, draws.shape[0], gaps.modes[t], i, draws, gap, i)
        add_combination(0, gaps.tilts.shape[1], gaps.tilts[t], i, draws, sigma[0], i)
        for j in range(number):
            sigma[0, i, j] = max(abs(sigma[0, i, j]), POINT)
            sigma[1, i, j] = 0.5 / sigma[0, i, j]
            gap[i, j] -= sigma[0, i, j]
            least[j] = gap[i, j] if i == 0 else min(least[j], gap[i, j])
    for i in range(gaps.existing[t]):
        for j in range(number):
            gap[i, j] -= least[j]


@part(FUSED)
def apply_laws(n, laws, lanes):
    """Fill forces p and slopes w of the first n segments, compressed by s; ``laws`` has the rows of ``Batch.laws``."""
    number = lanes.done.size
    s, sigma, p, w, level = lanes.s, lanes.sigma, lanes.p, lanes.w, lanes.level
    for i in range(n):
        h, kappa, edge, per_h = laws[1, i], laws[2, i], laws[3, i], laws[4, i]
        if h == 0.0:
            per_a = 1.0 / laws[0, i]
            for j in range(number):
                p[i, j] = max(s[i, j] - sigma[0, i, j], sigma[0, i, j]) * per_a
                w[i, j] = per_a
        else:
            for j in range(number):
                x = max(s[i, j] - sigma[0, i, j], sigma[0, i, j])
                level[0, j] = x
                level[1, j], level[2, j] = level_start(max(min(x, edge), LEAST), kappa)
            for j in range(number):
                p[i, j], w[i, j], _ = log_law(level[0, j], level[1, j], level[2, j], edge, kappa, h, per_h, False)
        # only the part t of a cell is loaded
        for j in range(number):
            t = min(max(s[i, j] * sigma[1, i, j], 0.0), 1.0)
            w[i, j] = 2.0 * p[i, j] * t * sigma[1, i, j] if t < 1.0 else w[i, j]
            p[i, j] *= t * t


@part(FUSED)
def steepen(n, laws, lanes):
    """Multiply the slopes w of cells by the factor of ``law.steepening``, which gives the slopes for the stiffness."""
    number = lanes.done.size
    s, sigma, w = lanes.s, lanes.sigma, lanes.w
    for i in range(n):
        h = laws[1, i]
        if h > 0.0:
            for j in range(number):
                t, hw = max(s[i, j] * sigma[1, i, j], LEAST), h * w[i, j]
                r = 1.0 / max(2.0 * t - 1.0, 1.0)
                square = r * r
                whole = 1.0 + hw * square * (1.0 / 6.0 + TAIL * square * square * square)
                level = max(t - hw, hw)  # h w (L − 1) of a partly loaded cell, with L of ``gearbench.contact.law``
                part = max(level - hw * logarithm(2.0 * t), STEEPEST * level)
                w[i, j] *= (level if t < 1.0 else 1.0) / (part if t < 1.0 else whole)
