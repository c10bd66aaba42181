"""The tooth whose root moves holds the tooth whose root is held."""

import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.compliance import solid_tooth
from gearbench.compliance.solid_tooth import SolidTooth
from tests.support.gears import standard_gear


@pytest.mark.parametrize("helix", [0.0, 20.0])
@pytest.mark.parametrize("order", [(4, 5, 5), (3, 4, 9)])
def test_one_system_answers_for_the_held_and_the_moving_root(helix, order):
    gear = standard_gear(25, 12.0, normal_module=2.0, helix=helix, profile_shift=0.1)
    held, rooted = (SolidTooth(gear=gear, E=210e3, nu=0.3, order=order, rooted=x).matrix for x in (False, True))
    # the same functions, zero at the root, stand in both systems
    assert_allclose(rooted, held, rtol=0, atol=1e-12 * np.abs(held).max())


@pytest.mark.parametrize("rooted", [False, True])
@pytest.mark.parametrize("helix", [0.0, 20.0])
def test_memory_is_known_before_it_is_spent(monkeypatch, helix, rooted):
    gear = standard_gear(25, 40.0, normal_module=2.0, helix=helix, profile_shift=0.1)
    known = []
    monkeypatch.setattr(solid_tooth, "require", lambda need, *_: known.append(need))
    for order in [(3, 3, 12), (9, 10, 12)]:  # the first loads code and keeps integrals
        tooth = SolidTooth(gear=gear, E=210e3, nu=0.3, order=order, rooted=rooted)
        tracemalloc.start()
        assert tooth.matrix.size
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peak <= known[-1] <= 1.6 * peak
