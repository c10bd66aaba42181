"""ISO 1328-1 (1995 and 2013) and ISO/TR 10064-3: worked values.

Class 6 values computed by hand from the formulas of either edition (unrounded, 3 decimals); the row of rounded single
pitch deviations is the first row of Table 1 of ISO 1328-1:1995, widely reprinted in gear handbooks.
"""

from dataclasses import astuple

import pytest
from numpy.testing import assert_allclose, assert_array_equal

from gearbench.tolerances import flank_tolerances, shaft_parallelism

# f_p, F_p, f_Hα, f_fα, F_α, f_Hβ, f_fβ, F_β
CASES = {
    ("2013", 3, 100, 30): (8.910, 28.001, 7.495, 9.405, 12.026, 9.075, 10.132, 13.602),
    ("1995", 3, 100, 30): (8.288, 26.740, 7.068, 8.596, 11.117, 8.507, 8.507, 11.935),
    ("2013", 2, 60, 20): (8.287, 25.145, 6.873, 8.627, 11.030, 8.418, 9.270, 12.522),
    ("1995", 2, 60, 20): (7.590, 26.042, 5.296, 6.380, 8.282, 7.516, 7.516, 10.548),
}


@pytest.mark.parametrize(("case", "expected"), CASES.items())
def test_class_6(case, expected):
    edition, m, d, b = case
    got = flank_tolerances(normal_module=m, reference_diameter=d, face_width=b, iso_class=6, edition=edition)
    assert_allclose(astuple(got), expected, rtol=0, atol=5.01e-4)  # printed to 3 decimals


def test_rounded_single_pitch_of_all_grades_1995():
    """m from 0.5 to 2, d from 5 to 20, grades 0 to 12."""
    printed = [0.8, 1.2, 1.7, 2.3, 3.3, 4.7, 6.5, 9.5, 13, 19, 26, 37, 53]
    got = [
        flank_tolerances(
            normal_module=1, reference_diameter=15, face_width=8, iso_class=grade, edition="1995", rounded=True
        ).single_pitch
        for grade in range(13)
    ]
    assert_array_equal(got, printed)


def test_rounded_cumulative_pitch_1995():
    """m from 2 to 3.5, d from 125 to 280, grades 4 to 8: 18, 25, 35, 50, 70 (Table 2 of the standard)."""
    size = {"normal_module": 3.0, "reference_diameter": 200.0, "face_width": 30.0}
    found = [flank_tolerances(**size, iso_class=n, edition="1995", rounded=True) for n in range(4, 9)]
    assert [each.cumulative_pitch for each in found] == [18, 25, 35, 50, 70]


def test_shaft_parallelism():
    """F_β = 12 µm over b = 20 mm, bearings 50 mm apart: f_Σδ = 50/20·12 = 30 µm, f_Σβ half of it."""
    assert astuple(shaft_parallelism(12.0, 20.0, 50.0)) == (30.0, 15.0)
    assert astuple(shaft_parallelism(12.0, 20.0)) == (12.0, 6.0)
