"""Compliance of the flanks of a gear: its factors and those of teeth in a row."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

from fem_reference.refinement import Level, solved
from fem_reference.section import Body
from tests.support.gears import standard_gear


def test_factor_reproduces_the_compliance(spur, steel):
    found = solved(Level(body=Body(gear=spur), number=2, waves=4), steel, (4, 4))
    rng = np.random.default_rng(0)
    height, y = rng.uniform(0.8, 2.2, 30), rng.uniform(0, 4, 30)
    psi = found.factor(height, y)
    shapes = found.shapes(height, y)
    direct = shapes @ found.block(0) @ shapes.T
    # negative eigenvalues of the remainder are dropped: 1 % of the largest entry
    assert_allclose(psi @ psi.T, direct, atol=0.01 * direct.max())
    assert_allclose(found.deflection(height[:, None], y[:, None], height, y), psi @ psi.T, atol=1e-10 * direct.max())


def test_root_of_three_teeth_in_a_row(steel):
    """Tooth 2 sees tooth 1 as tooth 1 sees tooth 0."""
    body = Body(gear=standard_gear(24, 3.0), bore_radius=7.0, teeth=3)
    found = solved(Level(body=body, number=2, waves=3), steel, (3, 3))
    C, n, root = found.blocks, found.neighbours, found.root(3)
    assert root.shape[0] == 3
    product = np.einsum("iar,jbr->iajb", root, root)
    assert_allclose(product[2, :, 1], C[n + 1], atol=0.02 * np.abs(C[n]).max())
    assert_allclose(product[0, :, 1], C[n - 1], atol=0.02 * np.abs(C[n]).max())
