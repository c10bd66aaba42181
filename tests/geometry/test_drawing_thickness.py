"""Tooth thickness as on a drawing: sizes, deviations, the backlash that follows."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.errors import InputError
from gearbench.geometry.pair import Member, Pair
from gearbench.geometry.section import TransverseSection
from gearbench.geometry.thickness import Thickness, over_balls, span
from gearbench.schema import make
from tests.support.gears import standard_gear

PAIR = Pair(normal_module=3.0, face_width=24.0, centre_distance=92.4, pinion=Member(teeth=24), wheel=Member(teeth=37))
HELICAL = replace(PAIR, helix_angle=18.0, centre_distance=97.0)
BOTH = pytest.mark.parametrize("pair", [PAIR, HELICAL], ids=["spur", "helical"])


def with_thickness(pair: Pair, pinion: Thickness | None, wheel: Thickness | None = None) -> Pair:
    return replace(pair, pinion=replace(pair.pinion, thickness=pinion), wheel=replace(pair.wheel, thickness=wheel))


# -- sizes ------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("teeth", [24, 25])
def test_a_ball_between_two_spur_flanks_touches_both(teeth):
    """Centred on the line of the space, its distance from the involute beside it is its radius, by brute force."""
    gear, D = standard_gear(teeth, normal_module=2.0, profile_shift=0.2), 3.6
    M = over_balls(gear, 0.2, D)
    radius = (M - D) / 2 / (1.0 if teeth % 2 == 0 else math.cos(math.pi / 2 / teeth))
    R = np.linspace(gear.form_radius, gear.tip_radius, 200_001)
    # the space's centre line on +y, its left flank at half of the space's angle
    beside = math.pi / teeth - gear.involute_half_angle(R)
    distance = np.hypot(R * np.sin(beside), R * np.cos(beside) - radius)
    assert distance.min() == pytest.approx(D / 2, abs=1e-8)
    assert gear.form_radius < R[distance.argmin()] < gear.tip_radius


@pytest.mark.parametrize("helix", [0.0, 18.0])
@pytest.mark.parametrize("teeth", [24, 25])
@pytest.mark.parametrize(
    "thickness",
    [
        Thickness(span=23.5, span_teeth=3),
        Thickness(over_balls=80.0, measuring_diameter=5.0),
        Thickness(over_pins=81.0, measuring_diameter=5.25),
    ],
    ids=["span", "balls", "pins"],
)
def test_the_shift_of_a_size_gives_that_size(thickness, teeth, helix):
    section = TransverseSection(teeth=teeth, normal_module=3.0, pressure_angle=20.0, helix_angle=helix)
    for deviation in (0.0, -80.0):
        x = thickness.shift(section, math.nan, deviation)
        if thickness.span is not None:
            found, size = span(section, x, thickness.span_teeth), thickness.span
        else:
            pins = thickness.over_pins is not None
            size = thickness.over_pins if pins else thickness.over_balls
            found = over_balls(section, x, thickness.measuring_diameter, pins=pins)
        assert found == pytest.approx(size + 1e-3 * deviation, abs=1e-10)


@BOTH
def test_span_is_a_sum_of_base_pitches_and_a_base_thickness(pair):
    """W_k = (k − 1) p_bn + s_bn: what a caliper holds is normal to the flanks."""
    gear = pair.gears[0]
    p_bn = gear.base_pitch * math.cos(gear.beta_b)
    s_bt = 2 * gear.base_radius * float(gear.involute_half_angle(gear.base_radius))
    for k in (2, 3, 4):
        expected = (k - 1) * p_bn + s_bt * math.cos(gear.beta_b)
        assert span(gear, gear.profile_shift, k) == pytest.approx(expected, abs=1e-12)


@BOTH
def test_deviations_thin_the_tooth_and_leave_the_tip(pair):
    thin = with_thickness(pair, Thickness(upper=-60.0, lower=-100.0))
    before, after = pair.gears[0], thin.gears[0]
    assert after.tip_radius == pytest.approx(before.tip_radius, abs=1e-12)
    assert float(before.normal_thickness(before.pitch_radius)) - float(
        after.normal_thickness(after.pitch_radius)
    ) == pytest.approx(0.080, abs=1e-12)
    # the rack cuts as much deeper as makes it so thin
    assert before.root_radius - after.root_radius == pytest.approx(0.040 / math.tan(math.radians(20.0)), abs=1e-12)
    assert thin.profile_shifts == pair.profile_shifts


@BOTH
def test_backlash_is_the_space_less_the_tooth(pair):
    """j_wt = p_wt − s_wt1 − s_wt2 at the working pitch circles, from the thicknesses of the gears themselves."""
    thin = with_thickness(pair, Thickness(upper=-60.0, lower=-100.0), Thickness(upper=-20.0, lower=-50.0))
    meshing = thin.meshing
    radii = [gear.base_radius / math.cos(meshing.alpha_wt) for gear in thin.gears]
    taken = sum(float(g.transverse_thickness(r)) for g, r in zip(thin.gears, radii, strict=True))
    assert thin.actual_backlash == pytest.approx(2 * math.pi * radii[0] / 24 - taken, abs=1e-12)
    assert thin.actual_backlash > 0.1


@BOTH
def test_limits_of_backlash_are_those_of_the_limits(pair):
    upper, lower = (-60.0, -20.0), (-100.0, -50.0)
    thin = with_thickness(pair, Thickness(upper=upper[0], lower=lower[0]), Thickness(upper=upper[1], lower=lower[1]))
    toleranced = replace(thin, centre_distance_upper=27.0, centre_distance_lower=-31.0)
    x = pair.profile_shifts
    ends = []
    for distance, deviations in ((-0.031, upper), (0.027, lower)):
        fixed = replace(
            pair,
            centre_distance=pair.centre_distance + distance,
            pinion=replace(
                pair.pinion, profile_shift=x[0], thickness=Thickness(upper=deviations[0], lower=deviations[0])
            ),
            wheel=replace(
                pair.wheel, profile_shift=x[1], thickness=Thickness(upper=deviations[1], lower=deviations[1])
            ),
        )
        ends.append(fixed.actual_backlash)
    assert_allclose(toleranced.backlash_limits, ends, rtol=0, atol=1e-12)
    assert ends[0] < toleranced.actual_backlash < ends[1]
    middle = pair.centre_distance - 0.002
    assert toleranced.meshing.centre_distance == pytest.approx(middle, abs=1e-12)


# -- faults -----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("table", "key"),
    [
        ({"span": 23.0}, "span_teeth"),
        ({"span": 23.0, "span_teeth": 3, "over_balls": 80.0}, "over_balls"),
        ({"over_balls": 80.0}, "measuring_diameter"),
        ({"span_teeth": 3}, "span_teeth"),
        ({"span": 23.0, "span_teeth": 3, "measuring_diameter": 5.0}, "measuring_diameter"),
        ({"upper": -80.0, "lower": -50.0}, "lower"),
        ({"upper": 6000.0}, "upper"),
    ],
)
def test_what_a_drawing_does_not_say(table, key):
    with pytest.raises(InputError) as caught:
        make(Thickness, **table)
    assert caught.value.key == key


def test_sizes_that_no_tooth_has():
    with pytest.raises(InputError, match=r"pinion\.thickness\.over_balls = 30"):
        make(
            Pair,
            normal_module=3.0,
            face_width=24.0,
            centre_distance=92.4,
            pinion=Member(teeth=24, thickness=Thickness(over_balls=30.0, measuring_diameter=5.0)),
            wheel=Member(teeth=37),
        )


def test_backlash_twice():
    given = {"normal_module": 3.0, "face_width": 24.0, "centre_distance": 92.4, "backlash": 0.1}
    with pytest.raises(InputError, match=r"backlash = 0\.1: follows from the tooth thickness"):
        make(Pair, **given, pinion=Member(teeth=24, thickness=Thickness(lower=-10.0)), wheel=Member(teeth=37))
