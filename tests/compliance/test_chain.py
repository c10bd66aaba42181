"""Chains of blocks, and the common factor of coupled teeth, against dense linear algebra."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.compliance.chain import Chain, Sides, Sums


def joined(diagonal: list, coupling: list, beyond: list) -> Chain:
    """Chain of given blocks, each of them half of one matrix and half of another."""
    count, parts = len(diagonal), [diagonal, coupling, beyond]
    matrices, which = [], np.zeros((3, count, 2), dtype=int)
    rng = np.random.default_rng(5)
    for apart, blocks in enumerate(parts):
        for i, block in enumerate(blocks):
            other = rng.uniform(-1, 1, block.shape)
            if not apart:
                other += other.T
            which[apart, i] = len(matrices), len(matrices) + 1
            matrices += [2 * (block - other), 4 * other]
    sizes = np.array([len(block) for block in diagonal])
    return Chain(sizes=sizes, blocks=Sums(matrices=matrices, which=which, factors=np.full(which.shape, [0.5, 0.25])))


def random_blocks(sizes: list[int], seed: int = 0, shift: float = 1.0, further: bool = True) -> tuple[list, list, list]:
    """Of a symmetric chain: diagonally dominant, hence positive definite, for ``shift`` > 0.

    ``further``: each block is coupled to the next but one too.
    """
    rng = np.random.default_rng(seed)
    diagonal, coupling = [], []
    for n in sizes:
        A = rng.standard_normal((n, n))
        diagonal.append(A @ A.T / max(n, 1) + shift * 4 * max(sizes) * np.eye(n))
    for n, m in pairwise(sizes):
        coupling.append(rng.uniform(-1, 1, (n, m)))
    beyond = [
        rng.uniform(-1, 1, (n, m)) if further else np.zeros((n, m)) for n, m in zip(sizes, sizes[2:], strict=False)
    ]
    return diagonal, coupling, beyond


def chain(sizes: list[int], seed: int = 0, further: bool = True) -> Chain:
    return joined(*random_blocks(sizes, seed, further=further))


SIZES = [[1], [5], [3, 4], [4, 1, 3], [2, 7, 2, 5, 1], [3] * 9, [4, 0], [0, 4], [3, 0, 2], [0, 0, 2, 1], [0]]


@pytest.mark.parametrize("further", [True, False])
@pytest.mark.parametrize("sizes", SIZES, ids=str)
def test_matrix_has_its_blocks_where_they_belong(sizes, further):
    diagonal, coupling, beyond = random_blocks(sizes, further=further)
    found = joined(diagonal, coupling, beyond)
    K, ends = found.matrix(), np.cumsum([0, *sizes])
    assert K.shape == 2 * (found.size,) == 2 * (sum(sizes),)
    np.testing.assert_array_equal(K, K.T)
    for i in range(len(sizes)):
        rows = slice(ends[i], ends[i + 1])
        assert_allclose(K[rows, rows], diagonal[i], rtol=0, atol=1e-13 * max(sizes))
        assert not K[rows, ends[min(i + 3, len(sizes))] :].any()
        if i + 1 < len(sizes):
            assert_allclose(K[rows, ends[i + 1] : ends[i + 2]], coupling[i], rtol=0, atol=1e-14)
        if i + 2 < len(sizes):
            assert_allclose(K[rows, ends[i + 2] : ends[i + 3]], beyond[i], rtol=0, atol=1e-14)


@pytest.mark.parametrize("further", [True, False])
@pytest.mark.parametrize("columns", [0, 1, 6])
@pytest.mark.parametrize("sizes", [*SIZES, [90, 40, 130, 60, 90]], ids=str)
def test_compliance_is_that_of_the_dense_matrix(sizes, columns, further):
    found = chain(sizes, further=further)
    before = found.matrix()
    right = np.random.default_rng(1).standard_normal((found.size, columns))
    given = right.copy()
    # condition number below 10: rounding only
    exact = right.T @ np.linalg.solve(found.matrix(), right)
    assert_allclose(found.compliance(right), exact, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(right, given)
    np.testing.assert_array_equal(found.matrix(), before)


@pytest.mark.parametrize("widths", [[], [1], [2, 3], [4, 0, 1, 2, 3]], ids=str)
@pytest.mark.parametrize("sizes", [*SIZES, [90, 40, 130, 60, 90]], ids=str)
def test_compliance_in_groups_is_that_of_the_dense_matrix(sizes, widths):
    """Groups of columns that begin anywhere, in any order, or nowhere; no row of a group means zeros."""
    found, rng = chain(sizes), np.random.default_rng(3)
    ends, m = np.cumsum([0, *sizes]), sum(widths)
    right, starts = np.zeros((found.size, m)), np.cumsum([0, *widths])
    matrices, which = [np.zeros((0, 0))], np.zeros((len(sizes), len(widths), 2), dtype=int)
    factors = np.zeros(which.shape)
    for j, begin in enumerate(rng.integers(0, len(sizes) + 1, len(widths))):
        for i in range(begin, len(sizes), 1 + j % 2):
            matrices += list(rng.standard_normal((2, sizes[i], widths[j])))
            which[i, j], factors[i, j] = (len(matrices) - 2, len(matrices) - 1), (0.5, 2.0 * (i % 2))
            sums = factors[i, j, 0] * matrices[-2] + factors[i, j, 1] * matrices[-1]
            right[ends[i] : ends[i + 1], starts[j] : starts[j + 1]] = sums
    sides = Sides(widths=np.array(widths, dtype=int), blocks=Sums(matrices=matrices, which=which, factors=factors))
    exact = right.T @ np.linalg.solve(found.matrix(), right)
    assert_allclose(found.compliance(sides), exact, rtol=0, atol=1e-12)


@pytest.mark.parametrize("which", [0, 1, 2])
def test_indefinite_matrices_are_refused(which):
    """The block at fault may be any; also one that is definite by itself, but not with its neighbour."""
    diagonal, coupling, beyond = random_blocks([3, 2, 4])
    diagonal[which] = diagonal[which] - 2 * np.linalg.eigvalsh(diagonal[which])[0] * np.eye(len(diagonal[which]))
    with pytest.raises(np.linalg.LinAlgError):
        joined(diagonal, coupling, beyond).compliance(np.ones((9, 1)))
    strong = joined([np.eye(2), np.eye(2)], [1.1 * np.eye(2)], [])
    with pytest.raises(np.linalg.LinAlgError):
        strong.compliance(np.ones((4, 1)))
