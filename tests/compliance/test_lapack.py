"""Factors and solutions in place, by SciPy's LAPACK without Python's lock, against dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.compliance.lapack import cholesky, solve_lower


def positive(n: int, dtype: type) -> np.ndarray:
    """Random Hermitian matrix with eigenvalues above 1."""
    rng = np.random.default_rng(n)
    A = rng.standard_normal((n, n)).astype(dtype)
    if dtype is complex:
        A += 1j * rng.standard_normal((n, n))
    return A @ A.conj().T / n + np.eye(n)


@pytest.mark.parametrize("dtype", [float, complex])
@pytest.mark.parametrize("n", [1, 2, 7, 90])
def test_cholesky_is_the_lower_factor_in_place(n, dtype):
    A = positive(n, dtype)
    given = A.copy()
    found = cholesky(given)
    assert found is given
    L = np.tril(found)
    assert_allclose(L @ L.conj().T, A, rtol=0, atol=1e-13 * n)
    np.testing.assert_array_equal(np.triu(found, 1), np.triu(A, 1))


@pytest.mark.parametrize("dtype", [float, complex])
@pytest.mark.parametrize(("n", "columns"), [(1, 1), (2, 5), (7, 1), (90, 40), (3, 0)])
def test_solution_by_the_lower_half_alone(n, columns, dtype):
    L = cholesky(positive(n, dtype))
    right = np.arange(n * columns).reshape(n, columns).astype(dtype) / max(n * columns, 1)
    given = right.copy()
    found = solve_lower(L, given)
    assert found is given
    assert_allclose(np.tril(L) @ found, right, rtol=0, atol=1e-13)


def test_matrices_that_are_not_positive_are_refused():
    with pytest.raises(np.linalg.LinAlgError):
        cholesky(np.array([[1.0, 2.0], [2.0, 1.0]]))
