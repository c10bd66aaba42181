"""Two gears on soft bearings with backlash, of the test of ross-rotordynamics 2.3.0 (``test_mesh_with_backlash``).

z 20/20, m 10 mm, 6.57 kg each, square-wave stiffness, an error of 20 µm once a tooth, T = 300 + 100 sin Ωt on both: far
from loss of contact. The program prints means over the run: 71.5276 µm of transmission error, of which 64.9788 µm are
play, half the backlash of 50 µm and what the bearings open, and 3191.996 N.

What the bearings open differs by a factor of two, and the test says so. There the gears moved apart by Δ lengthen the
way of the drive flank by Δ sin α twice, once in its transmission error and once in the half of the backlash that it is
compared with (Yi and others 2019). The involutes themselves part by Δ sin α: ``MeshFrame`` and the mesh force have it
once.
"""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.dynamics import waves
from gearbench.dynamics.balance import Excitation, solve
from gearbench.dynamics.modes import modes
from gearbench.geometry.pair import Pair
from gearbench.schema import read
from gearbench.system.frame import MeshFrame
from gearbench.system.mechanics import Mechanics

#: µm, N: what the program prints, and half of the backlash of the gears where they stand.
ERROR, PLAY, FORCE, HALF = 71.52756, 64.97876, 3191.99621, 50.0
#: N/mm, mean of the square wave; its swing; share of two pairs of teeth; N/mm and N·s/mm of a bearing.
STIFFNESS, SWING, TWO_PAIRS, SUPPORT, SUPPORT_DAMPING = 5.17925e5, 0.275, 0.5525, 1e5, 0.51264
ALPHA, BASE_RADIUS, MASS, ORDERS = np.radians(20.0), 100.0 * np.cos(np.radians(20.0)), 6.57e-3, 60
TORQUE, SHAKING = 300e3, 100e3


@cache
def answer(openings):
    """Orders of compression [mm] and force [N] of the mesh, and the row of its motion; sin α counted so often."""
    a = np.array([[-openings * np.sin(ALPHA), -np.cos(ALPHA), -BASE_RADIUS] * 2])
    a[0, 3:5] *= -1
    # rings of that mass in the pitch circle
    J = MASS / 8 * (2 * 200.0**2 - 4 * MASS / (np.pi * 30.0 * 7.85e-9))
    damping = 2 * 0.07 * np.sqrt(STIFFNESS * J / (2 * BASE_RADIUS**2))
    system = Mechanics(
        mass=np.diag([MASS, MASS, J] * 2),
        stiffness=np.diag([SUPPORT, SUPPORT, 0.0] * 2),
        damping=(np.vstack([np.eye(6)[[0, 1, 3, 4]], a]), np.array([SUPPORT_DAMPING] * 4 + [damping])),
        mesh=a,
        rotation=a,
        bearing=np.zeros((0, 3, 6)),
        bearing_names=(),
    )
    few = STIFFNESS / (1 + SWING * (2 * TWO_PAIRS - 1))
    n = np.arange(1, 2 * ORDERS + 1)
    wave = np.sin(np.pi * n * TWO_PAIRS) / (np.pi * n)
    stiffness = np.concatenate([[STIFFNESS], 2 * SWING * few * wave])
    F, soft, stiff = TORQUE / BASE_RADIUS, few * (1 - SWING), few * (1 + SWING)
    error = np.concatenate([[F / soft], F * (1 / stiff - 1 / soft) * wave[:ORDERS]]).astype(complex)
    error[0] += F * (1 / stiff - 1 / soft) * TWO_PAIRS
    error[1] += 0.020 / 2j
    drive = Excitation(stiffness=stiffness[None, None], motion=error[None], force=F * np.eye(1, ORDERS + 1))
    omega, mesh = 2 * np.pi * 20 * 1000 / 60 * np.arange(ORDERS + 1), np.array([0])
    h = modes(system, np.array([[STIFFNESS]]), 0.0).mesh_receptance(omega[None], mesh)
    x, f = (orders[0, 0] for orders in solve(drive, h, np.array([[STIFFNESS]])))
    return x, f, a[0]


def play(a):
    """Half of the backlash where the gears stand under the mean force [µm]."""
    apart = 2 * TORQUE / BASE_RADIUS * abs(a[0]) / SUPPORT
    return HALF + 1e3 * np.sin(ALPHA) * apart


def test_contact_is_kept():
    """The linear response is theirs, the torque's own slow swing (once a revolution) included."""
    f = waves.curve(answer(2)[1], 2048)
    assert f.min() > SHAKING / BASE_RADIUS


def test_published_means_with_their_opening():
    x, f, a = answer(2)
    assert_allclose(f[0].real, FORCE, rtol=1e-3)
    assert_allclose(play(a), PLAY, rtol=2e-3)
    assert_allclose(play(a) + 1e3 * x[0].real, ERROR, rtol=5e-3)
    # what is left: their damper acts with the square root of the stiffness of the moment
    assert_allclose(1e3 * x[0].real, ERROR - PLAY, rtol=0.04)


def test_difference_is_the_opening_counted_twice():
    x, f, a = answer(1)
    assert_allclose(f[0].real, FORCE, rtol=1e-3)
    assert_allclose(PLAY - play(a), play(a) - HALF, rtol=0.01)
    assert_allclose(play(a) + 1e3 * x[0].real, ERROR - (play(a) - HALF), rtol=5e-3)


@pytest.mark.parametrize("apart", [0.1, -0.1])
def test_involutes_part_once(apart):
    """Work of the mesh force on gears moved apart, and the flanks of the involutes at the longer centre distance."""
    table = {"normal_module": 10.0, "face_width": 30.0, "centre_distance": 200.0}
    pair = read(Pair, table | {"pinion": {"teeth": 20}, "wheel": {"teeth": 20}})
    frame = MeshFrame(pair=pair, across=(1.0, 0.0), turn=1, hand=1, middle=(0.0, 0.0))
    way = apart * frame.wrench(1, pair.meshing.pitch_point)[0]
    assert_allclose(way, apart * np.sin(ALPHA), rtol=1e-12)
    # backlash of involutes along the line of action, 2 r_b (inv α′ − inv α) on either side
    inv = lambda angle: np.tan(angle) - angle  # noqa: E731
    wider = np.arccos(2 * BASE_RADIUS / (200.0 + apart))
    assert_allclose(2 * BASE_RADIUS * (inv(wider) - inv(ALPHA)), way, rtol=2e-3)
