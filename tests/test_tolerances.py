import math
from dataclasses import astuple, fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from gearbench.geometry.material import Material
from gearbench.geometry.pair import Member, Pair
from gearbench.tolerances import (
    FlankTolerances,
    ToleranceError,
    flank_tolerances,
    gear_tolerances,
    round_tolerance,
    shaft_parallelism,
)

SMALL = {"normal_module": 1.5, "reference_diameter": 38.0, "face_width": 8.0, "iso_class": 6}
EDITIONS = ("1995", "2013")


@pytest.mark.parametrize("edition", EDITIONS)
def test_class_step_is_root_two(edition):
    classes = range(1, 12)
    table = np.array([astuple(flank_tolerances(**{**SMALL, "iso_class": c}, edition=edition)) for c in classes])
    assert_allclose(table[1:] / table[:-1], math.sqrt(2), rtol=1e-14)  # rounding of the power only


@pytest.mark.parametrize("edition", EDITIONS)
@given(
    m=st.floats(0.5, 70), d=st.floats(5, 10000), b=st.floats(4, 1000), grow=st.floats(1, 2), name=st.sampled_from("mdb")
)
def test_larger_gears_never_get_smaller_tolerances(edition, m, d, b, grow, name):
    def at(**size):
        size = {"m": min(size["m"], 70), "d": min(size["d"], 10000), "b": min(size["b"], 1000)}
        return astuple(
            flank_tolerances(
                normal_module=size["m"],
                reference_diameter=size["d"],
                face_width=size["b"],
                iso_class=5,
                edition=edition,
            )
        )

    size = {"m": m, "d": d, "b": b}
    small, large = at(**size), at(**{**size, name: size[name] * grow})
    assert all(s <= g for s, g in zip(small, large, strict=True))


def test_1995_is_constant_on_an_interval_closed_above():
    def at(m, d, b):
        return astuple(
            flank_tolerances(normal_module=m, reference_diameter=d, face_width=b, iso_class=5, edition="1995")
        )

    assert at(0.5, 5, 4) == at(2, 20, 10)
    assert at(math.nextafter(2, 3), 20, 10)[1] > at(2, 20, 10)[1]
    assert at(2, math.nextafter(20, 30), 10)[1] > at(2, 20, 10)[1]
    assert at(2, 20, math.nextafter(10, 30))[6] > at(2, 20, 10)[6]


def test_totals_of_2013_are_taken_from_unrounded_terms():
    """f_Hα = 5.7→5.5, f_fα = 6.4→6.5: total √(f_Hα² + f_fα²) of the unrounded ones, then rounded itself."""
    raw, rounded = (flank_tolerances(**SMALL, rounded=r) for r in (False, True))
    assert raw.profile_total == pytest.approx(math.hypot(raw.profile_slope, raw.profile_form), rel=1e-14)
    assert astuple(rounded) == tuple(round_tolerance(v) for v in astuple(raw))


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (4.96, 5.0),
        (5.2, 5.0),
        (5.25, 5.5),
        (9.76, 10.0),
        (10.5, 11.0),
    ],
)
def test_rounding(value, expected):
    assert round_tolerance(value) == expected


def test_of_a_gear():
    member = Member(teeth=23)
    pair = Pair(
        normal_module=1.5, pressure_angle=20.0, helix_angle=20.0, face_width=8.0, centre_distance=37.0,
        pinion=member, wheel=member, material=Material(),
    )  # fmt: skip
    gear = pair.gears[0]
    size = {"normal_module": 1.5, "face_width": 8.0, "reference_diameter": 23 * 1.5 / math.cos(math.radians(20))}
    got, expected = gear_tolerances(gear, 6), flank_tolerances(**size, iso_class=6)
    assert_allclose(astuple(got), astuple(expected), rtol=1e-14)  # only the diameter is computed twice
    assert {f.name for f in fields(FlankTolerances)} >= {"profile_slope", "profile_form", "helix_slope", "helix_form"}


@pytest.mark.parametrize(
    ("edition", "change", "allowed"),
    [
        ("2013", {"normal_module": 70.1}, "0.5 to 70 mm"),
        ("1995", {"reference_diameter": 10001.0}, "5 to 10000 mm"),
        ("2013", {"reference_diameter": 15001.0}, "5 to 15000 mm"),
        ("1995", {"face_width": 1001.0}, "4 to 1000 mm"),
        ("2013", {"teeth": 4}, "5 to 1000"),
        ("2013", {"helix_angle": -46.0}, "0 to 45°"),
        ("1995", {"iso_class": 13}, "0 to 12"),
        ("2013", {"iso_class": 0}, "1 to 11"),
        ("2013", {"iso_class": 5.5}, "whole number"),
        ("2013", {"face_width": math.nan}, "4 to 1200 mm"),
    ],
)
def test_out_of_scope_is_refused_in_one_line(edition, change, allowed):
    with pytest.raises(ToleranceError, match=allowed) as caught:
        flank_tolerances(**{**SMALL, **change}, edition=edition)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(next(iter(change)))
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize("edition", EDITIONS)
def test_scope_ends_are_inside(edition):
    ends = {"1995": (10000, 1000, 0, 12), "2013": (15000, 1200, 1, 11)}[edition]
    for d, b, c in ((5, 4, ends[2]), (ends[0], ends[1], ends[3])):
        flank_tolerances(
            normal_module=0.5 if d == 5 else 70, reference_diameter=d, face_width=b, iso_class=c, edition=edition,
            teeth=5 if d == 5 else 1000, helix_angle=45,
        )  # fmt: skip


def test_unknown_edition_and_bad_parallelism():
    with pytest.raises(ToleranceError, match="1995, 2013"):
        flank_tolerances(**SMALL, edition="2012")
    with pytest.raises(ToleranceError, match="bearing_distance"):
        shaft_parallelism(12.0, 20.0, 0.0)
