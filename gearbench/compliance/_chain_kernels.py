"""Compiled elimination of a chain of blocks for ``chain.Chain``, with SciPy's BLAS and LAPACK routines.

Three blocks at a time and their rows of the right-hand sides stay in the processor's cache; Python's lock is released.
Arrays are in row-major order, so LAPACK sees them transposed.
"""

from __future__ import annotations

import numpy as np

from gearbench.compiled import FUSED, caller, entry, part
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
    TRMM,
    TRTRI,
    UPPER,
)

#: Numbers in the order in which they are stored for BLAS: dimensions, leading dimensions.
_ROWS, _COLUMNS, _INNER, _LEADING, _LEADING_SQUARE, _INFO = range(6)

_call = caller()


@part()
def _factor(at, size, blas):
    """Replace the lower half of the matrix at ``at`` by L; False if it is not positive definite."""
    numbers, routines, letters, _ = blas
    numbers[_ROWS], numbers[_INFO] = size, 0
    n = np.int64(numbers.ctypes.data)
    _call(routines[POTRF], (letters + UPPER, n + 4 * _ROWS, at, n + 4 * _LEADING, n + 4 * _INFO))
    return numbers[_INFO] == 0


@part()
def _multiply_by_inverse(factor, right, size, columns, blas):
    """Replace B, ``columns`` wide, by L⁻¹ B and L by L⁻¹."""
    numbers, routines, letters, factors = blas
    numbers[_ROWS], numbers[_COLUMNS] = columns, size
    n = np.int64(numbers.ctypes.data)
    rows, leading = n + 4 * _ROWS, n + 4 * _LEADING
    _call(routines[TRTRI], (letters + UPPER, letters + NO, n + 4 * _COLUMNS, factor, leading, n + 4 * _INFO))
    sides = (letters + RIGHT, letters + UPPER, letters + NO, letters + NO)
    _call(routines[TRMM], (*sides, rows, n + 4 * _COLUMNS, factors + 8 * ONE, factor, leading, right, leading))


@part()
def _solve(factor, right, size, columns, blas):
    """Replace B, ``columns`` wide, by L⁻¹ B; L is lost.

    Halves are inverted, because products take two thirds of the time of solving at this block size.
    """
    half, line = size // 2, 8 * blas[0][_LEADING]
    if half:
        _multiply_by_inverse(factor, right, half, columns, blas)
        below = factor + half * line
        _subtract(right + half * line, below, right, size - half, columns, half, NO, blas)
    _multiply_by_inverse(factor + half * (line + 8), right + half * line, size - half, columns, blas)


@part()
def _subtract(into, left, right, rows, columns, inner, transposed, blas):
    """Replace C (rows, columns) by C − AᵀB, or by C − A B if ``transposed`` is the letter for no."""
    numbers, routines, letters, factors = blas
    numbers[_ROWS], numbers[_COLUMNS], numbers[_INNER] = columns, rows, inner
    n = np.int64(numbers.ctypes.data)
    leading, less, one = n + 4 * _LEADING, factors + 8 * LESS, factors + 8 * ONE
    sizes = (letters + NO, letters + transposed, n + 4 * _ROWS, n + 4 * _COLUMNS, n + 4 * _INNER)
    _call(routines[GEMM], (*sizes, less, right, leading, left, leading, one, into, leading))


@part()
def _add_square(into, factor, rows, inner, blas):
    """Replace the lower half of C, the compliance, by C + AᵀA."""
    numbers, routines, letters, factors = blas
    numbers[_ROWS], numbers[_INNER] = rows, inner
    n = np.int64(numbers.ctypes.data)
    leading, one = n + 4 * _LEADING, factors + 8 * ONE
    sizes = (letters + UPPER, letters + NO, n + 4 * _ROWS, n + 4 * _INNER)
    _call(routines[SYRK], (*sizes, one, factor, leading, one, into, n + 4 * _LEADING_SQUARE))


@part(FUSED)
def _sum_of_two(into, column, values, rows, columns, offset, factor):
    """Write the weighted sum of two matrices into ``into``, from a column on."""
    a, b = factor[0], factor[1]
    for r in range(rows):
        line = into[r, column : column + columns]
        first = values[offset[0] + r * columns : offset[0] + (r + 1) * columns]
        if b == 0.0:
            for c in range(columns):
                line[c] = a * first[c]
        else:
            second = values[offset[1] + r * columns : offset[1] + (r + 1) * columns]
            for c in range(columns):
                line[c] = a * first[c] + b * second[c]


@part(FUSED)
def _assemble(rows, i, chain, sides):
    """Assemble the rows of block i: itself, the next two blocks, the right-hand sides."""
    sizes, values, offset, factor = chain
    begun, starts, side_offset, side_factor = sides
    band = rows.shape[1] - starts[-1]
    column = band - sizes[i] - sizes[i + 1] - sizes[i + 2]
    for r in range(sizes[i]):
        side = rows[r, band : band + starts[begun[i]]]
        for c in range(len(side)):
            side[c] = 0.0
    for distance in range(3):
        if sizes[i + distance]:
            _sum_of_two(rows, column, values, sizes[i], sizes[i + distance], offset[distance, i], factor[distance, i])
            column += sizes[i + distance]
    for g in range(begun[i]):
        if side_factor[i, g, 0] != 0.0 or side_factor[i, g, 1] != 0.0:
            wide = starts[g + 1] - starts[g]
            _sum_of_two(rows, band + starts[g], values, sizes[i], wide, side_offset[i, g], side_factor[i, g])


@part()
def _eliminate(own, next1, next2, compliance, sizes, i, wide, blas):
    """Eliminate block i, given addresses of the right-hand sides of three blocks and of the compliance."""
    n, n1, n2 = sizes[i], sizes[i + 1], sizes[i + 2]
    own1, own2 = own - 8 * (n1 + n2), own - 8 * n2
    if not _factor(own1 - 8 * n, n, blas):
        return False
    if n1 + n2 + wide:
        _solve(own1 - 8 * n, own1, n, n1 + n2 + wide, blas)
    if n1:
        _subtract(next1 - 8 * (n1 + n2 + sizes[i + 3]), own1, own1, n1, n1 + n2, n, TRANSPOSED, blas)
    if n2:
        _subtract(next2 - 8 * (n2 + sizes[i + 3] + sizes[i + 4]), own2, own2, n2, n2, n, TRANSPOSED, blas)
    if n1 and wide:
        _subtract(next1, own1, own, n1, wide, n, TRANSPOSED, blas)
    if n2 and wide:
        _subtract(next2, own2, own, n2, wide, n, TRANSPOSED, blas)
    if wide:
        _add_square(compliance, own, wide, n, blas)
    return True


@part()
def _both_halves(result, lower, columns):
    """The symmetric matrix of a lower half, with rows and columns moved to ``columns``."""
    for i in range(len(columns)):
        for j in range(i + 1):
            result[columns[i], columns[j]] = lower[i, j]
            result[columns[j], columns[i]] = lower[i, j]


@entry(FUSED)
def chain_compliance(result, held, lower, columns, chain, sides, numbers, routines):
    """Fill ``result`` with BᵀK⁻¹B; return False if K is not positive definite.

    Parameters
    ----------
    result, lower, held
        Memory for (m, m), twice, and for the rows of three blocks, (3, largest block, three largest blocks + m).
    columns
        Columns of B, ordered by the block at which they begin, (m,).
    chain
        Sizes of the blocks, then four zeros, (count + 4,); entries of all matrices, flat; for each block
        (i, i + apart), places in these entries at which the two matrices begin whose weighted sum it is, and the
        weights, (3, count, 2).
    sides
        Number of groups of columns that begin at a block or above it, (count,); numbers of their first columns, and
        the number of all columns, (groups + 1,); places and weights, as for ``chain``, of the blocks of B,
        (count, groups, 2).
    numbers, routines
        Memory for the arguments of BLAS, six integers of 32 bits; ``gearbench.compliance.lapack.addresses``.
    """
    sizes, begun, starts = chain[0], sides[0], sides[1]
    count, (_, most, line) = len(begun), held.shape
    band, m = line - starts[-1], len(columns)
    lower[:] = 0.0
    numbers[_LEADING], numbers[_LEADING_SQUARE] = line, max(m, 1)
    blas = (numbers, routines, np.int64(LETTERS.ctypes.data), np.int64(FACTORS.ctypes.data))
    memory, corner = np.int64(held.ctypes.data) + 8 * band, np.int64(lower.ctypes.data)
    for i in range(-2, count):
        if i + 2 < count:
            rows = held[(i + 2) % 3]
            _assemble(rows, i + 2, chain, sides)
        if i >= 0 and sizes[i]:
            step = 8 * most * line
            own, next1, next2 = memory + i % 3 * step, memory + (i + 1) % 3 * step, memory + (i + 2) % 3 * step
            if not _eliminate(own, next1, next2, corner, sizes, i, starts[begun[i]], blas):
                return False
    _both_halves(result, lower, columns)
    return True
