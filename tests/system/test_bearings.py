"""Bearings against the closed forms of their norm, and forces that are the derivative of an energy."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.system.bearing import Bearing, LoadDeflection
from gearbench.system.rolling import (
    LAMINAE,
    LINE_CONTACT,
    POISSON_RATIO,
    YOUNGS_MODULUS,
    Rolling,
    hertz_point_stiffness,
)
from gearbench.system.schema import Shaft, ShaftSection

BALL = Rolling(kind="deep_groove_ball", elements=9, element_diameter=7.938, pitch_diameter=38.5)
ANGULAR = Rolling(
    kind="angular_contact_ball", elements=14, element_diameter=10.0, pitch_diameter=60.0, contact_angle=30.0
)
ROLLER = Rolling(kind="cylindrical_roller", elements=13, element_diameter=8.0, pitch_diameter=40.0, roller_length=9.0)
TAPER = Rolling(
    kind="tapered_roller",
    elements=16,
    element_diameter=7.0,
    pitch_diameter=45.0,
    roller_length=11.0,
    contact_angle=15.0,
)


@pytest.mark.parametrize("bearing", [BALL, ANGULAR, ROLLER, TAPER])
def test_stiffness_is_the_derivative_of_the_force(bearing):
    q, h = np.array([0.012, 0.004, 0.006, 2e-4, -1e-4]), 1e-7
    numeric = np.array([(bearing.force(q + h * e)[0] - bearing.force(q - h * e)[0]) / (2 * h) for e in np.eye(5)]).T
    _, K = bearing.force(q)
    assert_allclose(K, K.T, rtol=1e-10, atol=1e-10 * np.abs(K).max())
    assert_allclose(K, numeric, rtol=1e-5, atol=1e-7 * np.abs(K).max())


def test_axial_load_of_angular_contact_bearing():
    """All balls alike: F_a = Z Q sin α with cos α/cos α_0 = A/(A + δ) (ISO/TS 16281, Harris §7)."""
    A, Z = (0.52 + 0.53 - 1) * 10.0, 14
    u = 0.03
    length = math.hypot(A * math.cos(math.radians(30)), A * math.sin(math.radians(30)) + u)
    sine = (A * math.sin(math.radians(30)) + u) / length
    expected = Z * ANGULAR.point_stiffness * (length - A) ** 1.5 * sine
    assert_allclose(ANGULAR.force(np.array([0, 0, u, 0, 0]))[0], [0, 0, expected, 0, 0], rtol=1e-10, atol=1e-6)


def test_radial_load_of_ball_bearing_is_stribecks():
    """Without clearance F_r = Z Q_max / 4.37 for many balls (Stribeck 4.37 for point contact)."""
    many = Rolling(kind="deep_groove_ball", elements=300, element_diameter=8.0, pitch_diameter=1000.0)
    u = 1e-4  # small against the groove, so that contact angles stay zero
    F = many.force(np.array([u, 0, 0, 0, 0]))[0][0]
    assert_allclose(300 * many.point_stiffness * u**1.5 / F, 4.37, rtol=2e-3)


def test_radial_load_of_roller_bearing():
    """Sum over rollers and laminae with the norm's profile, written out."""
    u, Z, L, D = 0.02, 13, 9.0, 8.0
    x = L * ((np.arange(LAMINAE) + 0.5) / LAMINAE - 0.5)
    profile = 2 * 0.00035 * D * np.log(1 / (1 - (2 * x / L) ** 2))
    angle = 2 * np.pi * np.arange(Z) / Z
    deep = np.maximum(u * np.cos(angle)[:, None] - profile, 0)
    Q = LINE_CONTACT * L ** (8 / 9) / LAMINAE * (deep ** (10 / 9)).sum(axis=1)
    assert_allclose(ROLLER.force(np.array([u, 0, 0, 0, 0]))[0][0], (Q * np.cos(angle)).sum(), rtol=1e-12)


def test_hertz_of_a_ball_between_planes():
    """Curvature alike in both directions: Q = (4/3) E* √R δ^1.5, 1/E* = 2(1−ν²)/E for two bodies alike."""
    # a groove that is almost flat: its curvature is 1e-3 of the ball's
    R = 5.0
    expected = 4 / 3 * YOUNGS_MODULUS / (2 * (1 - POISSON_RATIO**2)) * math.sqrt(R)
    assert_allclose(hertz_point_stiffness(2 * R, 0.0, 500.0), expected, rtol=1e-3)


def test_catalogue_finds_the_balls_of_known_bearings():
    """6205: 9 balls of 7.94 mm; 6305: 7 of 11.51 mm; 6308: 8 of 15.08 mm."""
    for bore, outside, capacity, balls in ((25.0, 52.0, 7.8, 9), (25.0, 62.0, 11.4, 7), (40.0, 90.0, 25.0, 8)):
        known = Rolling(kind="deep_groove_ball", bore=bore, outside=outside, static_capacity=capacity)
        assert balls == known.Z


def test_curve_is_linear_between_its_points_and_beyond():
    bearing = Bearing(position=0.0, radial_curve=LoadDeflection(deflection=(10.0, 20.0), load=(100.0, 400.0)))
    for micrometres, load in ((5.0, 50.0), (15.0, 250.0), (30.0, 700.0)):
        F, K = bearing.force(micrometres / 1e3 * np.array([0.6, 0.8, 0, 0, 0]))
        assert_allclose(F[:2], load * np.array([0.6, 0.8]), rtol=1e-12)
        e = np.array([0.6, 0.8])
        slope = 10e3 if micrometres < 10 else 30e3
        assert_allclose(K[:2, :2] @ e, slope * e, rtol=1e-12)


@pytest.mark.parametrize(
    ("table", "match"),
    [
        ({}, "give one of rolling, matrix"),
        ({"radial_stiffness": 1.0, "rolling": BALL}, "give one of rolling, matrix"),
        ({"radial_stiffness": 1.0, "radial_curve": LoadDeflection(deflection=(1.0,), load=(1.0,))}, "conflicts"),
        ({"matrix": ((1.0, 0.0), (0.0, 1.0))}, "5 × 5"),
        ({"matrix": tuple(map(tuple, -np.eye(5)))}, "no negative eigenvalue"),
    ],
)
def test_bearings_that_say_too_much_or_too_little(table, match):
    with pytest.raises(Exception, match=match):
        Bearing(position=0.0, **table)


def test_no_bearing_has_more_balls_than_can_be_counted():
    with pytest.raises(Exception, match=r"at most .* 500 balls"):
        Rolling(kind="deep_groove_ball", bore=30.0, outside=72.0, static_capacity=1.7e308)
    capacity = 1e-3 * 500 * 13.5 * 12.6**2 * math.cos(math.radians(40.0))
    most = Rolling(kind="angular_contact_ball", bore=30.0, outside=72.0, static_capacity=capacity)
    assert most.Z == 500


#: Designation: bore, outside; balls, their diameter, pitch diameter. All but 6309 and 6310 have the numbers of balls of
#: a public list of fault frequencies and, to 4 %, its ratios of both diameters, but for 6210 (14 %). The diameters of
#: 6203 and 6205 are those of the rig of Case Western Reserve University, where 6205 has a pitch diameter of 39.04 mm.
CATALOGUE = {
    "6203": (17, 40, 8, 6.747, 28.5),
    "6204": (20, 47, 8, 7.938, 33.5),
    "6205": (25, 52, 9, 7.938, 38.5),
    "6206": (30, 62, 9, 9.525, 46.0),
    "6207": (35, 72, 9, 11.112, 53.5),
    "6208": (40, 80, 9, 12.0, 60.0),
    "6210": (50, 90, 10, 12.7, 70.0),
    "6306": (30, 72, 8, 12.303, 51.0),
    "6308": (40, 90, 8, 15.081, 65.0),
    "6309": (45, 100, 8, 17.462, 72.5),
    "6310": (50, 110, 8, 19.05, 80.0),
}


@pytest.mark.parametrize("name", CATALOGUE)
def test_balls_by_the_catalogue(name):
    """Number within one ball, radial stiffness within 5 % of the bearing with its inner dimensions."""
    d, D, Z, ball, pitch = CATALOGUE[name]
    estimate = Rolling(kind="deep_groove_ball", bore=d, outside=D)
    known = Rolling(kind="deep_groove_ball", elements=Z, element_diameter=ball, pitch_diameter=pitch)
    assert abs(estimate.Z - Z) <= 1
    stiffness = [np.mean([b.force(np.array([0.02 * np.cos(t), 0.02 * np.sin(t), 0, 0, 0]))[1].diagonal()[:2].sum() for t in np.linspace(0, 0.3, 5)]) for b in (estimate, known)]  # fmt: skip  # noqa: E501
    assert_allclose(stiffness[0], stiffness[1], rtol=0.05)


@pytest.mark.parametrize("diameter", [5e-324, 0.0, 9e-4])
def test_no_shaft_is_thinner_than_a_micrometre(diameter):
    with pytest.raises(Exception, match=r"greater than or equal to 0\.001"):
        ShaftSection(length=30.0, diameter=diameter)


@pytest.mark.parametrize("thin", [{"diameter": 0.045}, {"diameter": 30.0, "end_diameter": 0.39}])
def test_no_shaft_is_a_wire(thin):
    """One of 45 µm under 200 N·m took a minute to have no equilibrium."""
    sections = (ShaftSection(length=60.0, diameter=30.0), ShaftSection(length=60.0, **thin))
    with pytest.raises(Exception, match=r"sections.1.*at least 0\.4 mm, 1/300"):
        Shaft(name="s", sections=sections)
    Shaft(name="s", sections=(sections[0], ShaftSection(length=60.0, diameter=0.4)))
