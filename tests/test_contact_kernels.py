"""Compiled parts of the contact solver against their readable twins."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.contact import _kernels
from gearbench.contact.law import compression, inverse

FORCES = np.concatenate([[0.0], 10.0 ** np.linspace(-12, 2, 60)])


@pytest.mark.parametrize("soft", [0.0, 0.4, 30.0])
@pytest.mark.parametrize("h", [0.0, 0.03, 2.0])
@pytest.mark.parametrize("stiff", [0.4, 3.0])
def test_the_law_and_its_inverse_are_those_of_the_readable_twins(h, soft, stiff):
    a = np.full(FORCES.shape, stiff + 8 * h)
    found = [_kernels.compression(p, stiff + 8 * h, h, soft) for p in FORCES]
    s = compression(FORCES, a, np.full(FORCES.shape, h), soft)
    assert_allclose(found, s, rtol=1e-14, atol=1e-300)
    back = np.array([_kernels.cell_law(x, stiff + 8 * h, h, soft) for x in s]).T
    # the force is as well determined as the digits of s − soft allow
    assert_allclose(back[0], FORCES, rtol=1e-12, atol=1e-14 * soft)
    for own, twin in zip(back, inverse(s, a, np.full(FORCES.shape, h), soft), strict=True):
        assert_allclose(own, twin, rtol=1e-12, atol=1e-14 * (1 + soft))


@pytest.mark.parametrize("blocks", [1, 3])
def test_complementarity_is_that_of_the_equations(blocks):
    rng = np.random.default_rng(1)
    positions, n, rank = 4, 12, 5
    P = np.maximum(rng.normal(size=(positions, n)), 0.0)
    gap, a, h, soft = (rng.uniform(0.1, 1.0, (positions, n)) for _ in range(4))
    a = a + 6 * h
    factor, active = rng.normal(size=(positions, n, rank)), rng.uniform(size=(positions, n)) > 0.2
    block, delta = np.repeat(np.arange(blocks), n // blocks), rng.uniform(size=positions)
    P, factor = np.where(active, P, 0.0), np.where(active[..., None], factor, 0.0)
    same = block[:, None] == block
    apart = np.einsum("pij,pj->pi", factor @ np.swapaxes(factor, 1, 2) * same, P) + gap - delta[:, None]
    apart += compression(P, a, h, soft)
    found = np.empty(positions)
    _kernels.complementarity(P, delta, gap, a, h, soft, active, factor, block, blocks, found)
    expected = np.abs(np.where(active, np.minimum(P, apart), 0.0)).max(axis=1)
    assert_allclose(found, expected, rtol=1e-13)
    P[2, np.flatnonzero(active[2])[0]] = np.nan
    _kernels.complementarity(P, delta, gap, a, h, soft, active, factor, block, blocks, found)
    assert np.isnan(found[2])
    assert np.isfinite(found[[0, 1, 3]]).all()
