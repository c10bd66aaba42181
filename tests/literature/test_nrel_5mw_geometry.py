"""Geometry of the high-speed stage of the NREL 5 MW turbine, a commercial program's report of 2017, to its digits.

Given there: m_n 14, z 24/95, α 20°, β 10°, a 861, b 360, x 0.4800/0.6691, tip shortening 0.938 mm, rack 1.25/0.38/1.0.
"""

import math

import numpy as np
import pytest

from gearbench.geometry.action import contact_lines
from gearbench.geometry.pair import Member, Pair
from gearbench.strength.bending import RootBending


def pair(shift: float = 0.6691, shortening: float = 0.938) -> Pair:
    tip = 1 - shortening / 14
    pinion = Member(teeth=24, profile_shift=0.48, addendum=tip)
    wheel = Member(teeth=95, profile_shift=shift, addendum=tip)
    whole = {"normal_module": 14.0, "helix_angle": 10.0, "face_width": 360.0, "centre_distance": 861.0}
    return Pair(pinion=pinion, wheel=wheel, **whole)


def shortest_line(of: Pair) -> float:
    """Least total length of the contact lines, just beside the transitions [mm]."""
    phase = np.concatenate([np.array(of.meshing.transition_phases) + side for side in (-1e-9, 1e-9)]) % 1
    return float(contact_lines(of, phase, 4).length.sum(axis=(1, 2)).min())


def test_diameters_and_angles_to_the_printed_digits():
    m, gears = pair().meshing, pair().gears
    half = 0.5e-3  # of the last printed digit
    for found, printed in (
        ([2 * g.tip_radius for g in gears], (380.747, 1395.376)),
        ([2 * ends[0] for ends in m.active_radii], (330.798, 1348.584)),
        ([2 * g.form_radius for g in gears], (328.991, 1341.487)),
        ([math.degrees(math.tan(math.acos(g.base_radius / g.tip_radius))) for g in gears],
         (36.931, 26.465)),
        ([math.degrees(m.alpha_wt), math.degrees(m.beta_b)], (22.856, 9.391)),
        ([m.transverse_contact_ratio, m.overlap_ratio], (1.463, 1.421)),
        ([m.specific_sliding[0][0], m.specific_sliding[1][1]], (-0.765, -0.765)),
    ):  # fmt: skip
        assert found == pytest.approx(printed, abs=half)


def test_shortest_contact_line_within_the_rounding_of_the_data():
    """Printed 483.685 mm, found with the rounded data 483.687: the half digits of x_2 and of the shortening hold it."""
    assert shortest_line(pair()) == pytest.approx(483.685, abs=3e-3)
    around = [shortest_line(pair(0.6691 + i * 5e-5, 0.938 + j * 5e-4)) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    assert min(around) < 483.685 < max(around)


def test_tip_diameters_in_place_of_addenda_are_the_same_gears():
    by_diameter = [
        Member(teeth=z, profile_shift=x, tip_diameter=2 * gear.tip_radius)
        for z, x, gear in zip((24, 95), (0.48, 0.6691), pair().gears, strict=True)
    ]
    whole = {"normal_module": 14.0, "helix_angle": 10.0, "face_width": 360.0, "centre_distance": 861.0}
    same = Pair(pinion=by_diameter[0], wheel=by_diameter[1], **whole)
    assert [g.addendum for g in same.gears] == pytest.approx([g.addendum for g in pair().gears], rel=1e-12)
    assert same.meshing.transverse_contact_ratio == pytest.approx(pair().meshing.transverse_contact_ratio, rel=1e-12)


def test_root_stress_factors_of_iso_6336_3_of_2006():
    """Y_F, Y_S, s_Fn, ρ_F and σ_F0 as printed; the edition of 2006 has no f_ε, and Y_β without cos³β.

    The program takes the lever from the root of the generating shift x_E: h_F is 0.03 mm longer.
    """
    bending = [RootBending(pair=pair(), gear=index) for index in (0, 1)]
    lever = [b.tooth.lever(b.load_radius)[0] for b in bending]
    of_2006 = [b.stress(40953.0) / b.load_distribution_factor * math.cos(math.radians(10.0)) ** 3 for b in bending]
    for found, printed, half in (
        ([b.form_factor / b.load_distribution_factor for b in bending], (1.18, 1.24), 5e-3),
        ([b.stress_correction for b in bending], (2.28, 2.35), 7e-3),
        ([b.tooth.section.chord for b in bending], (31.18, 32.75), 5e-3),
        ([b.tooth.section.radius for b in bending], (5.95, 5.39), 5e-3),
        (lever, (14.06, 16.11), 0.03),
        (of_2006, (117.92, 127.69), 0.12),
    ):
        assert found == pytest.approx(printed, abs=half)
