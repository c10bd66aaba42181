"""A gear body between two meshes: teeth loaded on one flank move the other flanks of all teeth."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.flank import Flank
from fem_reference.section import Body
from gearbench.compliance.gear_body import ToothedRing
from gearbench.compliance.solid_tooth import SolidTooth
from gearbench.geometry.material import Material
from tests.support.gears import standard_gear
from tests.support.strips import Strip, solve_strip

#: Root circle over bore: less, and far teeth hardly feel each other.
HOLLOW = 2.5


def ring(gear, **tooth):
    body = ToothedRing(tooth=SolidTooth(gear=gear, E=206e3, nu=0.3, **tooth), bore_radius=gear.root_radius / HOLLOW)
    return body, replace(body, both_flanks=True)


@pytest.mark.parametrize("helix", [0.0, 20.0])
def test_the_left_flanks_are_the_right_ones_of_the_gear_turned_over(helix):
    """Without a web to one side: flanks among themselves as before, the other order of teeth, and Maxwell's rule."""
    one, both = ring(standard_gear(17, 10.0, helix=helix), order=(5, 4, 5))
    alone, found = one.blocks(8), both.blocks(8)
    n = alone.shape[1]
    assert_allclose(found[:, :n, :n], alone, atol=1e-12 * np.abs(alone).max())
    assert_allclose(found[:, n:, n:], alone[::-1], atol=1e-12 * np.abs(alone).max())
    assert_allclose(found[:, n:, :n], np.swapaxes(found[::-1, :n, n:], 1, 2), atol=1e-12 * np.abs(alone).max())
    assert np.abs(found[:, n:, :n]).max() > 0.1 * np.abs(alone).max()
    # a body stores no negative energy under any loads on both flanks of all its teeth
    waves = np.fft.fft(np.roll(found, -8, axis=0), axis=0)
    assert all(np.linalg.eigvalsh((w + w.conj().T) / 2)[0] > -1e-12 * np.abs(waves).max() for w in waves)


@pytest.mark.slow
@pytest.mark.parametrize(("teeth", "radius", "to"), [(17, 8.5, 8.2), (43, 21.5, 21.9)])
def test_other_teeth_move_as_in_plane_finite_elements(teeth, radius, to):
    """Both flanks of all other teeth under a load on the right flank of one."""
    gear = standard_gear(teeth, 100.0)
    solution = solve_strip(
        Body(gear=gear, bore_radius=gear.root_radius / HOLLOW, teeth=teeth),
        Material(youngs_modulus=206.0), Strip(radius=radius, half_width=0.02),
    )  # fmt: skip
    _, body = ring(gear, order=(10, 14, 6), measured_at="mid", heights=9)
    p, q = body.tooth.flank_order

    def even(R):
        shapes = body.tooth.flank.shapes(R - gear.root_radius, 50.0).reshape(p, q)
        return shapes[:, 0] * math.sqrt(gear.face_width)

    blocks = body.blocks(teeth // 2).reshape(-1, 2, p, q, 2, p, q)[:, :, :, 0, 0, :, 0]
    wanted = []
    for d in range(-(teeth // 2), teeth // 2 + 1):
        c, s = math.cos(2 * math.pi * d / teeth), math.sin(2 * math.pi * d / teeth)
        turn = np.array([[c, s], [-s, c]])  # clockwise
        at, normal = (each(np.array([to]), np.zeros(1))[0, :2] for each in (Flank(gear).position, Flank(gear).normal))
        sides = [turn @ (side * each) for side in (np.array([1, 1]), np.array([-1, 1])) for each in (at, normal)]
        wanted.append([solution.at(x[None], n[None]) for x, n in (sides[:2], sides[2:])])
    found = np.einsum("dsab,a,b->ds", blocks, even(to), even(radius))
    others = np.arange(teeth) != teeth // 2
    wanted = np.array(wanted)
    assert_allclose(found[others], wanted[others], rtol=0.02)  # the gear is 100 modules wide, not endless
