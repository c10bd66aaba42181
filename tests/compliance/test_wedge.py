"""Wedge under load near its edge: closed forms, limits, and a strip that is Hertz's far inside."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.compliance.edge import edge_distance, edge_softening, held_by_polynomials, tip_angle
from gearbench.compliance.local import flank_functions
from gearbench.compliance.wedge import softness, spread, strip_at_edge, strip_softening
from tests.support.gears import standard_gear

C1 = (1 - 0.3**2) / (math.pi * 210e3)


def test_half_space_is_a_wedge_without_edge() -> None:
    """2α = π: nothing is added."""
    assert softness(math.pi) == pytest.approx(0.0, abs=1e-14)
    assert_allclose(spread(math.pi, np.array([0.3, 3.0])), 0.0, atol=1e-12)


def test_softness_is_that_of_a_wedge_loaded_at_its_edge() -> None:
    """Flamant's wedge: along its bisector 1/(α + ½ sin 2α), across it 1/(α − ½ sin 2α), against 2/π (Johnson §5.1)."""
    for degrees in (60, 90, 120, 150):
        alpha = math.radians(degrees) / 2
        along, across = (1 / (alpha + sign * math.sin(2 * alpha) / 2) for sign in (1, -1))
        total = math.sin(alpha) ** 2 * along + math.cos(alpha) ** 2 * across
        assert softness(2 * alpha) == pytest.approx(total * math.pi / 2 - 1, rel=1e-12)


def test_spread_of_a_crack_in_closed_form() -> None:
    """2α = 2π: m = 2 coth 2πη, and ∫ (cos ηx − 1)(coth 2πη − coth πη)/η dη = ln cosh(x/4)."""
    x = np.array([0.1, 1.0, 4.0, 8.0])
    assert_allclose(spread(2 * math.pi, x), 2 * np.log(np.cosh(x / 4)), rtol=1e-6)


def test_spread_falls_like_the_softness_far_from_the_load() -> None:
    """W → −2B ln max(r, r₀): the far edge sees a load at r₀ as one at the edge."""
    for degrees in (100, 120, 140):
        angle = math.radians(degrees)
        near, far = spread(angle, np.array([9.0, 12.0]))
        assert far - near == pytest.approx(-3.0 * softness(angle), rel=1e-3)


def test_strip_far_from_the_edge_is_hertzs() -> None:
    """Approach of a Hertzian strip, 4 (ln 2 + ½), and W = −2B ln|σ| of the wedge; elements of 1/24 of the strip."""
    hertz = 4 * (math.log(2) + 0.5)
    assert strip_at_edge(math.pi - 1e-9, -5.0) == pytest.approx(hertz, abs=2e-2)
    angle = math.radians(120)
    assert strip_at_edge(angle, -10.0) - hertz == pytest.approx(-2 * softness(angle) * math.log(10), abs=2e-2)


@pytest.mark.parametrize("offset", [0.0, 0.5, 1.0, 2.0, 6.0, 24.0])
def test_strip_at_an_edge_ends_where_the_pressure_does(offset: float) -> None:
    """Room for a strip half as long again changes nothing: none is cut off where elements end."""
    angle = math.radians(120)
    assert strip_at_edge(angle, offset) == pytest.approx(strip_at_edge(angle, offset, 3.15), abs=0.03)


@pytest.mark.parametrize("degrees", [100.0, 120.0, 135.0])
def test_softening_is_smooth_where_its_parts_join(degrees: float) -> None:
    """Table and both asymptotes: values agree at the joints, and the slope is that of the values."""
    angle = math.radians(degrees)
    for joint in (-12.0, 24.0):
        values, slopes = strip_softening(angle, joint * np.array([1 - 1e-6, 1 + 1e-6]))
        assert values[0] == pytest.approx(values[1], abs=1e-4)
        assert slopes[0] == pytest.approx(slopes[1], rel=1e-4)
    offset = np.linspace(-11, 23, 100)
    h = 1e-5
    up, down = (strip_softening(angle, offset + d)[0] for d in (h, -h))
    assert_allclose(strip_softening(angle, offset)[1], (up - down) / (2 * h), rtol=1e-3, atol=1e-4)
    assert np.all(np.diff(strip_softening(angle, offset)[0]) > 0)


def test_flank_far_from_its_edge_is_left_alone() -> None:
    """What the polynomials of the tooth already hold is not added again: 0.04 c₁ is 0.2 % of a contact law."""
    gear = standard_gear(25, 20.0, normal_module=2.0)
    low, high = (math.sqrt(r**2 - gear.base_radius**2) for r in (gear.form_radius, gear.tip_radius))
    roll = np.linspace(low, high, 200)
    far = edge_distance(gear, roll) > 0.4
    none = np.zeros_like(roll)
    a, h = edge_softening(gear, C1, C1, 5, roll, none, none + 5.0, 100.0)
    added = (a - h * math.log(100.0)) / C1
    assert np.abs(added[far]).max() < 0.05
    assert added[-1] > 2.0
    # without the part that the tooth holds it would be counted nearly whole
    phi = flank_functions(5, np.hypot(gear.base_radius, roll), gear.form_radius, gear.tip_radius)
    held = np.einsum("na,ab,nb->n", phi, held_by_polynomials(gear, 5), phi)
    assert np.abs(held[far]).max() > 0.5


def test_value_and_slope_of_the_law_are_exact_at_the_typical_load() -> None:
    """q (a − h ln q) touches the compression that another typical load gives: the same at both, to second order."""
    gear = standard_gear(25, 20.0, normal_module=2.0)
    high = math.sqrt(gear.tip_radius**2 - gear.base_radius**2)
    roll, tilt, rho = np.full(4, high), np.array([0.0, 0.005, 0.02, 0.05]), np.full(4, 5.0)

    def compression(q: float, typical: float) -> np.ndarray:
        a, h = edge_softening(gear, C1, C1, 5, roll, tilt, rho, typical)
        return q * (a - h * math.log(q))

    q, dq = 80.0, 0.08
    exact = [compression(x, x) for x in (q - dq, q + dq)]
    fitted = [compression(x, q) for x in (q - dq, q + dq)]
    assert_allclose(fitted[1] - fitted[0], exact[1] - exact[0], rtol=2e-3)
    # a load off by a factor of two costs at most 3 % of the softening
    assert_allclose(compression(40.0, q), compression(40.0, 40.0), rtol=0.03)


def test_angle_of_a_tip() -> None:
    """Flank and land of a sharp tip enclose 90° and the pressure angle at the tip."""
    gear = standard_gear(25, 20.0, normal_module=2.0)
    assert math.degrees(tip_angle(gear)) == pytest.approx(119.531, abs=1e-3)
