"""Natural frequencies of planetary sets against Lin and Parker 1999, and Cooley and Parker 2012."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.dynamics.planetary_modes import RigidMember, planetary_modes
from gearbench.errors import InputError

#: Of each number of planets: rotational modes, translational modes, planet modes [Hz]. Three values of the row of four
#: planets are printed otherwise, 1536.6, 727.0 and 1091.0: two computations of the model have those below.
LIN_PARKER = {
    3: ((0, 1475.7, 1930.3, 2658.3, 7462.8, 11775.3), (743.2, 1102.4, 1896.0, 2276.4, 6986.3, 9647.9), ()),
    4: (
        (0, 1536.5, 1970.6, 2625.7, 7773.6, 13071.1),
        (727.3, 1091.2, 1892.8, 2342.5, 7189.9, 10437.6),
        (1808.2, 5963.8, 6981.7),
    ),
    5: (
        (0, 1567.4, 2006.1, 2614.8, 8065.4, 14253.1),
        (710.0, 1072.0, 1888.1, 2425.3, 7382.4, 11172.3),
        (1808.2, 5963.8, 6981.7),
    ),
}


def lin_parker(angles):
    members = {
        "sun": RigidMember(mass=0.4, inertia=0.39, support=1e8),
        "ring": RigidMember(mass=2.35, inertia=3.0, support=1e8, torsion=1e9),
        "carrier": RigidMember(mass=5.43, inertia=6.29, support=1e8),
        "planet": RigidMember(mass=0.66, inertia=0.61, support=1e8),
    }
    alpha = math.radians(24.6)
    return planetary_modes(**members, angles=angles, mesh_stiffness=(5e8, 5e8), pressure_angles=(alpha, alpha))


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_lin_and_parker(planets):
    found = lin_parker(2 * np.pi * np.arange(planets) / planets)
    rotational, translational, of_planets = LIN_PARKER[planets]
    # printed to 0.1 Hz
    assert_allclose(found.of("rotational"), rotational, atol=0.06)
    assert_allclose(found.of("translational"), np.repeat(translational, 2), atol=0.06)
    assert_allclose(found.of("planet"), np.repeat(of_planets, planets - 3), atol=0.06)
    assert found.of("mixed").size == 0


def test_turning_the_set_changes_nothing_and_uneven_planets_mix():
    angles = 2 * np.pi * np.arange(4) / 4
    assert_allclose(lin_parker(angles + 0.7).frequency, lin_parker(angles).frequency, rtol=1e-9, atol=1e-3)
    assert lin_parker([0.0, 2.0, 4.0, 5.0]).of("mixed").size > 0


def test_cooley_and_parker():
    members = {
        "sun": RigidMember(mass=3.0, inertia=1.75, support=20e6, torsion=20e6),
        "ring": RigidMember(mass=7.64, inertia=8.09, support=100e6, torsion=100e6),
        "carrier": RigidMember(mass=12.0, inertia=6.80, support=50e6, torsion=100e6),
        "planet": RigidMember(mass=1.86, inertia=1.25, support=10e6),
    }
    alpha = math.radians(20.0)
    angles = 2 * np.pi * np.arange(4) / 4
    found = planetary_modes(**members, angles=angles, mesh_stiffness=(1e8, 1e8), pressure_angles=(alpha, alpha))
    unit = math.sqrt(10e6 / 1.86) / (2 * math.pi)
    assert_allclose(found.of("rotational") / unit, [0.9077, 1.046, 1.317, 2.013, 5.809, 8.383], rtol=6e-4)
    assert_allclose(
        found.of("translational") / unit, np.repeat([0.7199, 1.001, 1.317, 1.481, 5.153, 6.488], 2), rtol=6e-4
    )
    assert_allclose(found.of("planet") / unit, [0.9617, 4.320, 5.672], rtol=6e-4)


def test_faults_are_one_line():
    with pytest.raises(InputError, match="greater than 0"):
        RigidMember(mass=0.0, inertia=1.0)
