"""Both flanks of all teeth of a gear by finite elements, against their symmetries and the elastic ring."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.refinement import Level, solved
from fem_reference.section import Body
from gearbench.compliance.flank import flank_polynomials
from gearbench.compliance.gear_body import ToothedRing
from gearbench.compliance.solid_tooth import SolidTooth
from gearbench.geometry.material import Material
from tests.support.gears import standard_gear

STEEL, ORDER, Z = Material(youngs_modulus=206.0), (4, 5), 17


@pytest.mark.parametrize("helix", [0.0, 20.0])
def test_left_flanks_move_right_ones_as_on_the_elastic_ring(helix):
    gear = standard_gear(Z, 10.0, helix=helix)
    body = Body(gear=gear, bore_radius=gear.root_radius / 2.5)
    level = Level(body=body, number=3, waves=ORDER[1])
    right, left = (solved(level, STEEL, ORDER, Z // 2, across=across).blocks for across in (False, True))
    # turning the gear over exchanges the flanks and the order of the teeth; with Maxwell's rule, blocks are symmetric
    assert_allclose(left, np.swapaxes(left, 1, 2), atol=1e-10 * np.abs(left).max())
    tooth = SolidTooth(gear=gear, E=206e3, nu=0.3)
    ring = replace(ToothedRing(tooth=tooth, bore_radius=body.bore_radius or 0.0), both_flanks=True).blocks(Z // 2)
    R, y = np.full(2, gear.pitch_radius), np.array([3.0, 6.0])
    mine, other = flank_polynomials(gear, ORDER, R, y), tooth.flank.shapes(R - gear.root_radius, y)
    n = other.shape[1]
    apart = np.abs(np.arange(Z) - Z // 2) > 2
    for found, exact in ((right, ring[:, :n, :n]), (left, ring[:, :n, n:])):
        moved, wanted = mine @ found @ mine.T, other @ exact @ other.T
        assert_allclose(moved[apart], wanted[apart], rtol=0.01)
