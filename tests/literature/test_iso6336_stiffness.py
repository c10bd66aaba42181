"""ISO 6336-1 single stiffness, method B; first case: ISO/TR 6336-30, example 1. Values to the digits given."""

import math

import pytest

from gearbench.geometry.pair import Member, Pair
from tests.support.iso6336 import norm_stiffness

EXAMPLE_1 = Pair(
    normal_module=8.0, helix_angle=15.8, face_width=100.0, centre_distance=500.0,
    pinion=Member(teeth=17, profile_shift=0.145, dedendum=1.4), wheel=Member(teeth=103, dedendum=1.4),
)  # fmt: skip
HELICAL = Pair(
    normal_module=2.0, helix_angle=20.0, face_width=20.0, centre_distance=65 / math.cos(math.radians(20)) + 1e-9,
    pinion=Member(teeth=25, profile_shift=0.0, dedendum=1.3), wheel=Member(teeth=40, profile_shift=0.0, dedendum=1.3),
)  # fmt: skip
SPUR = Pair(normal_module=2.0, face_width=20.0, centre_distance=60.0, pinion=Member(teeth=17), wheel=Member(teeth=43))


def test_profile_shift_of_example_1_follows_from_its_centre_distance():
    assert EXAMPLE_1.profile_shifts[1] == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize(
    ("pair", "theoretical", "single", "mesh", "digits"),
    [
        (EXAMPLE_1, 17.85584, 12.37047, 17.46, 4e-4),
        (HELICAL, 17.27, 12.33, 17.21, 4e-4),
        (SPUR, 16.032, 12.505, 18.330, 3e-5),
    ],
    ids=["ISO/TR 6336-30 example 1", "helical 25/40", "spur 17/43"],
)
def test_stiffness(pair, theoretical, single, mesh, digits):
    # the printed cases have rounded x_2 = 0 (example 1) and four digits (helical)
    stiffness = norm_stiffness(pair)
    assert stiffness.theoretical == pytest.approx(theoretical, rel=digits)
    assert stiffness.single == pytest.approx(single, rel=digits)
    # ε_α of example 1 is that of its tip circles, which are printed rounded
    assert stiffness.mesh == pytest.approx(mesh, rel=max(digits, 3e-3 if pair is EXAMPLE_1 else 6e-4))


@pytest.mark.parametrize(("pair", "epsilon"), [(HELICAL, 1.527), (SPUR, 1.6211)])
def test_contact_ratios_of_the_same_cases(pair, epsilon):
    assert pair.meshing.transverse_contact_ratio == pytest.approx(epsilon, abs=6e-4 if pair is HELICAL else 5e-5)
