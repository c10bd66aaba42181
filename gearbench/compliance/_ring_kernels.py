"""Compiled kernels for ``ring`` and, in ``gear_body``, for a tooth on it; they call SciPy's BLAS and LAPACK routines.

Harmonics and waves are processed one at a time, so that their data stay in the processor's cache. Python's lock is
released. Arrays are in row-major order, so LAPACK sees them transposed.
"""

from __future__ import annotations

import math

import numpy as np

from gearbench.compiled import FUSED, SUMS, caller, entry, part
from gearbench.compliance.lapack import (
    FACTORS,
    GEMM,
    LESS,
    LETTERS,
    NO,
    ONE,
    POTRF,
    RIGHT,
    SYRK,
    TRANSPOSED,
    TRSM,
    UPPER,
    ZERO,
)

_call = caller()


@part()
def _factor(A, size, leading, blas):
    """Replace the lower half of A by its Cholesky factor L; False if A is not positive definite."""
    routines, letters, _, numbers = blas
    numbers[0], numbers[1], numbers[2] = size, leading, 0
    n = np.int64(numbers.ctypes.data)
    _call(routines[POTRF], (letters + UPPER, n, A, n + 4, n + 8))
    return numbers[2] == 0


@part()
def _solve(L, leading, B, rows, columns, blas):
    """Replace B (rows, columns) by L⁻¹ B."""
    routines, letters, factors, numbers = blas
    numbers[0], numbers[1], numbers[2] = columns, rows, leading
    n = np.int64(numbers.ctypes.data)
    sides = (letters + RIGHT, letters + UPPER, letters + NO, letters + NO)
    _call(routines[TRSM], (*sides, n, n + 4, factors + 8 * ONE, L, n + 8, B, n))


@part()
def _multiply(A, B, rows, columns, C, blas):
    """Set C = AᵀB for A and B (rows, columns)."""
    routines, letters, factors, numbers = blas
    numbers[0], numbers[1] = columns, rows
    n = np.int64(numbers.ctypes.data)
    sizes = (letters + NO, letters + TRANSPOSED, n, n, n + 4)
    _call(routines[GEMM], (*sizes, factors + 8 * ONE, B, n, A, n, factors + 8 * ZERO, C, n))


@part()
def _square(A, shape, transposed, factor, C, blas):
    """Add ``factor`` · AᵀA, or AAᵀ if ``transposed``, to the lower half of C; A is (rows, columns)."""
    routines, letters, factors, numbers = blas
    rows, columns = shape
    size = rows if transposed else columns
    numbers[0], numbers[1], numbers[2] = size, rows + columns - size, columns
    n = np.int64(numbers.ctypes.data)
    kind = letters + (TRANSPOSED if transposed else NO)
    _call(routines[SYRK], (letters + UPPER, kind, n, n + 4, factors + 8 * factor, A, n + 8, factors + 8 * ONE, C, n))


@part(SUMS)
def _assembled(along, across, K):
    """Set K (p, n, p, n) = Σ_i along (p, p, i) · across (i, n, n), the sum over the eight integrals."""
    p, n = along.shape[0], across.shape[1]
    for k in range(p):
        for l in range(p):
            f = along[k, l]
            for a in range(n):
                for b in range(n):
                    K[k, a, l, b] = (
                        (f[0] * across[0, a, b] + f[1] * across[1, a, b])
                        + (f[2] * across[2, a, b] + f[3] * across[3, a, b])
                    ) + (
                        (f[4] * across[4, a, b] + f[5] * across[5, a, b])
                        + (f[6] * across[6, a, b] + f[7] * across[7, a, b])
                    )


@entry(SUMS)
def assemble(along, across, K):
    """Set K (harmonic, p, n, p, n) from ``along`` (harmonic, p, p, 8) and ``across`` (harmonic, 8, n, n)."""
    for k in range(len(K)):
        _assembled(along[k], across[k], K[k])


@entry(SUMS)
def condense(along, across, edge, compliance, routines):
    """Set ``compliance`` to ĉ (harmonic, n, n) (R3); return False if a matrix is not positive definite.

    Only the last function along R moves the rim; its value there is ``edge``.
    """
    p, n = along.shape[1], across.shape[2]
    K, half, numbers = np.empty((p, n, p, n)), np.empty((n, n)), np.empty(3, dtype=np.int32)
    blas = (routines, np.int64(LETTERS.ctypes.data), np.int64(FACTORS.ctypes.data), numbers)
    at, size = np.int64(K.ctypes.data), p * n
    for k in range(len(compliance)):
        _assembled(along[k], across[k], K)
        if not _factor(at, size, size, blas):
            return False
        # last block of L, for the functions that move the rim: L Lᵀ = K_oo − K_oi K_ii⁻¹ K_io
        half[:] = 0.0
        for i in range(n):
            half[i, i] = edge
        _solve(at + 8 * (size - n) * (size + 1), size, np.int64(half.ctypes.data), n, n, blas)
        c = compliance[k]
        c[:] = 0.0
        _square(np.int64(half.ctypes.data), (n, n), False, ONE, np.int64(c.ctypes.data), blas)
        for i in range(n):
            for j in range(i):
                c[j, i] = c[i, j]
    return True


@part(FUSED)
def _lend(P, low, softness):
    """Replace P (n, low) by P L⁻ᵀ, with L Lᵀ = ``softness`` · 1 − P[low].

    P are columns of B, and B + P Pᵀ is then B_σ of ``gear_body._SprungTooth``.
    """
    count = len(low)
    L = np.empty((count, count))
    for i in range(count):
        for j in range(i + 1):
            value = (softness if i == j else 0.0) - P[low[i], j]
            for k in range(j):
                value -= L[i, k] * L[j, k]
            L[i, j] = math.sqrt(value) if i == j else value / L[j, j]
    for r in range(len(P)):
        for j in range(count):
            value = P[r, j]
            for k in range(j):
                value -= P[r, k] * L[j, k]
            P[r, j] = value / L[j, j]


@entry(FUSED)
def join(every, taken, tooth, same, other, routines):
    """Add Φ (S + B⁻¹)⁻¹ Φᵀ of real waves to ``same`` and ``other`` (m, flank, flank).

    Compiled form of ``gear_body._SprungTooth.join``; returns False if a matrix is not positive definite.

    Parameters
    ----------
    every, taken
        Independent entries of the matrices of all waves, (m, …), and the indices of those that make up B, (n, n).
    tooth
        S_σ⁻¹ (n, n); S_σ⁻¹ Φᵀ (n, flank), first phase before second; number of functions of the first phase;
        Φ S_σ⁻¹ Φᵀ; indices of the motions on springs; and 1/σ.
    """
    yields, moved, first, alone, low, softness = tooth
    n, flank = moved.shape
    second = n - first
    B, P, Z = np.empty((n, n)), np.empty((n, len(low))), np.empty((n + second, flank))
    equal, between, numbers = np.empty((flank, flank)), np.empty((flank, flank)), np.empty(3, dtype=np.int32)
    blas = (routines, np.int64(LETTERS.ctypes.data), np.int64(FACTORS.ctypes.data), numbers)
    at, halves = np.int64(B.ctypes.data), np.int64(Z.ctypes.data)
    last = halves + 8 * n * flank
    for k in range(len(every)):
        for i in range(n):
            for j in range(i + 1):
                B[i, j] = every[k, taken[i, j]] + yields[i, j]
            for j in range(len(low)):
                P[i, j] = every[k, taken[i, low[j]]]
        _lend(P, low, softness)
        _square(np.int64(P.ctypes.data), P.shape, True, ONE, at, blas)
        Z[:first], Z[first:n], Z[n:] = moved[:first], 0.0, moved[first:]
        if not _factor(at, n, n, blas):
            return False
        _solve(at, n, halves, n, flank, blas)
        _solve(at + 8 * first * (n + 1), n, last, second, flank, blas)
        equal[:] = alone
        _square(halves, Z.shape, False, LESS, np.int64(equal.ctypes.data), blas)
        _multiply(last, halves + 8 * first * flank, second, flank, np.int64(between.ctypes.data), blas)
        for i in range(flank):
            for j in range(flank):
                same[k, i, j] += equal[max(i, j), min(i, j)]
                other[k, i, j] += between[i, j] - between[j, i]
    return True
