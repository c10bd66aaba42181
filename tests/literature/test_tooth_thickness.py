"""Span and dimension over pins, against published worked examples.

Sources: *Elements of Metric Gear Technology*, Stock Drive Products, section 10, tables 10-8 and 10-9 (the same numbers
in KHK's *Gear Technical Reference*): W_k to four decimals. AGMA's reference value for 127 teeth of diametral pitch 12
over pins, as quoted in the tests of github.com/bfoster59/MOP, in inches to six decimals.
"""

from __future__ import annotations

import math

import pytest

from gearbench.geometry.section import TransverseSection
from gearbench.geometry.thickness import over_balls, span

INCH = 25.4


@pytest.mark.parametrize(("helix", "x", "k", "expected"), [(0.0, 0.4, 4, 32.8266), (25.0, 0.4, 5, 42.0085)])
def test_span(helix, x, k, expected):
    gear = TransverseSection(teeth=24, normal_module=3.0, pressure_angle=20.0, helix_angle=helix)
    assert span(gear, x, k) == pytest.approx(expected, abs=5e-5)


def test_dimension_over_pins_of_a_helical_gear_with_an_odd_number_of_teeth():
    """Normal tooth thickness 0.1309 in, pins 0.144 in, helix angle 10.5°."""
    gear = TransverseSection(teeth=127, normal_module=INCH / 12, pressure_angle=20.0, helix_angle=10.5)
    x = (0.1309 * INCH / gear.normal_module - math.pi / 2) / (2 * math.tan(gear.alpha_n))
    assert over_balls(gear, x, 0.144 * INCH, pins=True) / INCH == pytest.approx(10.967749, abs=1.5e-6)
