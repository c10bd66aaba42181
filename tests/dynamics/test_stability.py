"""Stability: the compiled period map against its twin, what the small-gain theorem proves, slow speeds."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

from gearbench.dynamics._kernels import monodromy
from gearbench.dynamics.analysis import response
from gearbench.dynamics.modes import modes
from gearbench.dynamics.stability import free_motion, is_proven_stable, multipliers
from tests.support.systems import spur_scene, wheels

ONE = np.array([0])


def test_period_map_against_its_twin():
    """Product of matrix exponentials of free motion and of kicks; at the second speed the faster modes stand still."""
    rng = np.random.default_rng(2)
    size, steps, zeta = 4, 24, 0.03
    r, a, dt = np.array([1e3, 3e3, 5e3, 9e3]), rng.normal(size=(2, size)), np.array([1e-4, 2e-4])
    kick, counts = 2e6 * rng.normal(size=(1, steps, 2, 2)), np.array([4, 2])
    found = monodromy(free_motion(r, zeta, dt[:, None]), free_motion(r, zeta, dt[:, None] / 2), a, kick, dt, r, counts)
    for s, n in enumerate(counts):
        free = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(r[:n] ** 2), -np.diag(2 * zeta * r[:n])]])
        half, T = expm(free * dt[s] / 2), np.eye(2 * n)
        for step in range(steps):
            push = np.eye(2 * n)
            push[n:, :n] = -dt[s] * a[:, :n].T @ kick[0, step] @ a[:, :n]
            T = half @ push @ half @ T
        scale = np.concatenate([np.ones(n), r[:n]])
        here = np.concatenate([np.arange(n), size + np.arange(n)])
        assert_allclose(found[s][np.ix_(here, here)], T * scale / scale[:, None], rtol=1e-9, atol=1e-9)
        assert np.count_nonzero(found[s]) == (2 * n) ** 2


@pytest.mark.parametrize("zeta", [0.02, 0.1])
def test_proof_reaches_as_far_as_its_theorem(zeta):
    """Two wheels: the largest gain is k̃/(2ζ√(1−ζ²)k̄); a hundredth below the limit is proven, above it is not."""
    m, k = 1e-3, 4e5
    system, t = modes(wheels(m), np.array([[k]]), zeta), 2 * np.pi * np.arange(256) / 256
    limit = 0.9 * 2 * zeta * np.sqrt(1 - zeta**2)
    for share, proven in ((0.99, True), (1.01, False)):
        assert is_proven_stable(system, ONE, k * (1 + share * limit * np.cos(t))[:, None, None]) is proven


def test_nothing_that_grows_is_proven():
    """Random stiffness of several orders at every speed: where a multiplier exceeds 1 there is no proof."""
    rng, t = np.random.default_rng(5), 2 * np.pi * (np.arange(256) + 0.5) / 256
    grown = 0
    for _ in range(20):
        system = modes(wheels(1e-3), np.array([[4e5]]), rng.uniform(0.005, 0.03))
        waves = [rng.uniform(0, 0.08) * np.cos(n * t + rng.uniform(0, 6)) for n in (1, 2, 3)]
        k = 4e5 * (1 + sum(waves))[:, None, None]
        size = multipliers(system, ONE, system.frequency[-1] * np.linspace(0.3, 2.2, 150), k[None]).max()
        grown += size > 1
        assert not (size > 1 and is_proven_stable(system, ONE, k))
    assert grown > 3


def test_slow_speeds_are_stable():
    """A mode a hundred times above the mesh frequency is met by no order that is resolved."""
    data = response(spur_scene({}), speed=[300.0, 500.0], harmonics=10)
    assert data["contact_kept"].all()
    assert "instability" not in data.attrs["notes"]
