"""Chains of blocks, and the common factor of coupled teeth, against dense linear algebra."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.compliance.chain import Chain


def chain(sizes: list[int], seed: int = 0, shift: float = 1.0, further: bool = True) -> Chain:
    """Random symmetric chain: diagonally dominant, hence positive definite, for ``shift`` > 0.

    ``further``: each block is coupled to the next but one too.
    """
    rng = np.random.default_rng(seed)
    diagonal, coupling = [], []
    for n in sizes:
        A = rng.standard_normal((n, n))
        diagonal.append(A @ A.T / max(n, 1) + shift * 4 * max(sizes) * np.eye(n))
    for n, m in pairwise(sizes):
        coupling.append(rng.uniform(-1, 1, (n, m)))
    beyond = [rng.uniform(-1, 1, (n, m)) for n, m in zip(sizes, sizes[2:], strict=False)] if further else []
    return Chain(diagonal=diagonal, coupling=coupling, beyond=beyond)


SIZES = [[1], [5], [3, 4], [4, 1, 3], [2, 7, 2, 5, 1], [3] * 9, [4, 0], [0, 4], [3, 0, 2], [0, 0, 2, 1], [0]]


@pytest.mark.parametrize("further", [True, False])
@pytest.mark.parametrize("sizes", SIZES, ids=str)
def test_matrix_has_its_blocks_where_they_belong(sizes, further):
    found = chain(sizes, further=further)
    K, ends = found.matrix(), np.cumsum([0, *sizes])
    assert K.shape == 2 * (found.size,) == 2 * (sum(sizes),)
    np.testing.assert_array_equal(K, K.T)
    for i in range(len(sizes)):
        rows = slice(ends[i], ends[i + 1])
        np.testing.assert_array_equal(K[rows, rows], found.diagonal[i])
        assert not K[rows, ends[min(i + 3, len(sizes))] :].any()
        if i + 1 < len(sizes):
            np.testing.assert_array_equal(K[rows, ends[i + 1] : ends[i + 2]], found.coupling[i])
        if i + 2 < len(sizes):
            expected = found.beyond[i] if further else 0.0
            np.testing.assert_array_equal(K[rows, ends[i + 2] : ends[i + 3]], expected)


@pytest.mark.parametrize("further", [True, False])
@pytest.mark.parametrize("columns", [0, 1, 6])
@pytest.mark.parametrize("sizes", [*SIZES, [90, 40, 130, 60, 90]], ids=str)
def test_compliance_is_that_of_the_dense_matrix(sizes, columns, further):
    """Also of columns that begin anywhere, in any order, or nowhere."""
    found = chain(sizes, further=further)
    before = found.matrix()
    right = np.random.default_rng(1).standard_normal((found.size, columns))
    for column, begin in enumerate(np.random.default_rng(2).integers(0, found.size + 1, columns)):
        right[:begin, column] = 0.0
    given = right.copy()
    # condition number below 10: rounding only
    exact = right.T @ np.linalg.solve(found.matrix(), right)
    assert_allclose(found.compliance(right), exact, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(right, given)
    np.testing.assert_array_equal(found.matrix(), before)


def test_condition_does_not_depend_on_the_units_of_the_unknowns():
    found = chain([2, 3, 4])
    scale = np.geomspace(1e-6, 1e6, found.size)
    parts = np.split(scale, np.cumsum([2, 3]))
    other = Chain(
        diagonal=[A * s[:, None] * s for A, s in zip(found.diagonal, parts, strict=True)],
        coupling=[E * parts[i][:, None] * parts[i + 1] for i, E in enumerate(found.coupling)],
        beyond=[F * parts[i][:, None] * parts[i + 2] for i, F in enumerate(found.beyond)],
    )
    assert other.condition == pytest.approx(found.condition, rel=1e-9)
    K = found.matrix()
    unit = K / np.sqrt(np.outer(np.diag(K), np.diag(K)))
    value = np.linalg.eigvalsh(unit)
    assert found.condition == pytest.approx(value[-1] / value[0], rel=1e-12)


@pytest.mark.parametrize("which", [0, 1, 2])
def test_indefinite_matrices_are_refused(which):
    """The block at fault may be any; also one that is definite by itself, but not with its neighbour."""
    found = chain([3, 2, 4])
    diagonal = list(found.diagonal)
    diagonal[which] = diagonal[which] - 2 * np.linalg.eigvalsh(diagonal[which])[0] * np.eye(len(diagonal[which]))
    with pytest.raises(np.linalg.LinAlgError):
        replace(found, diagonal=diagonal).compliance(np.ones((9, 1)))
    strong = Chain(diagonal=[np.eye(2), np.eye(2)], coupling=[1.1 * np.eye(2)])
    with pytest.raises(np.linalg.LinAlgError):
        strong.compliance(np.ones((4, 1)))
