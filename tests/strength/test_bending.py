"""ISO 6336-3 root stress: the critical section on the generated fillet, its limits, and the norm's factors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from pydantic import ValidationError

from gearbench.errors import InputError
from gearbench.geometry.pair import Member, Pair
from gearbench.library.garambois2017 import case
from gearbench.strength.bending import RootBending
from gearbench.strength.section import VirtualTooth
from tests.support.gears import standard_gear


def tooth(
    teeth: int,
    shift: float = 0.0,
    fillet: float = 0.38,
    helix: float = 0.0,
    alpha: float = 20.0,
    dedendum: float = 1.25,
) -> VirtualTooth:
    rack = {"fillet_radius": fillet, "dedendum": dedendum, "pressure_angle": alpha}
    return VirtualTooth(gear=standard_gear(teeth, 20.0, normal_module=2.0, helix=helix, profile_shift=shift, **rack))


def equal(teeth: int, helix: float = 0.0, width: float = 20.0, **member: float) -> Pair:
    """Two equal gears without profile shift, module 2."""
    gear = Member(teeth=teeth, **member)
    a = 2.0 * teeth / math.cos(math.radians(helix))
    return Pair(normal_module=2.0, helix_angle=helix, face_width=width, centre_distance=a, pinion=gear, wheel=gear)


TEETH = [
    (17, 0.0, 0.38, 0.0, 20.0),
    (12, 0.4, 0.25, 0.0, 20.0),
    (25, -0.3, 0.3, 25.0, 20.0),
    (90, 0.2, 0.2, 15.0, 25.0),
]


@pytest.mark.parametrize("sizes", TEETH)
def test_section_obeys_the_closed_form_of_the_norm(sizes):
    t = tooth(*sizes)
    g, m = t.gear, t.gear.normal_module
    alpha, h_f, rho, x, z_n = g.alpha_n, g.dedendum, g.fillet_radius, g.profile_shift, t.teeth
    E = math.pi / 4 - h_f * math.tan(alpha) - (1 - math.sin(alpha)) * rho / math.cos(alpha)
    G = rho - h_f + x
    H = 2 / z_n * (math.pi / 2 - E) - math.pi / 3
    theta = math.pi / 6
    for _ in range(200):
        theta = 2 * G / z_n * math.tan(theta) - H
    s_Fn = z_n * math.sin(math.pi / 3 - theta) + math.sqrt(3) * (G / math.cos(theta) - rho)
    rho_F = rho + 2 * G**2 / (math.cos(theta) * (z_n * math.cos(theta) ** 2 - 2 * G))
    # the same envelope by other formulas: rounding only
    assert t.section.chord / m == pytest.approx(s_Fn, rel=1e-10)
    assert t.section.radius / m == pytest.approx(rho_F, rel=1e-10)
    radius = 0.5 * (g.tip_radius - g.pitch_radius) + t.pitch_radius
    alpha_e = math.acos(t.base_radius / radius)
    inv = [math.tan(a) - a for a in (alpha, alpha_e)]
    gamma = (math.pi / 2 + 2 * x * math.tan(alpha)) / z_n + inv[0] - inv[1]
    h_F = (math.cos(gamma) - math.sin(gamma) * math.tan(alpha_e - gamma)) * radius / m
    h_F -= 0.5 * (z_n * math.cos(math.pi / 3 - theta) + (G / math.cos(theta) - rho))
    assert t.lever(radius)[0] / m == pytest.approx(h_F, rel=1e-9)
    assert t.lever(radius)[1] == pytest.approx(alpha_e - gamma, abs=1e-12)


@pytest.mark.parametrize("sizes", TEETH)
def test_tangent_and_curvature_are_those_of_the_generated_fillet(sizes):
    t = tooth(*sizes)
    fillet = t.fillet
    phi = fillet.parameter(math.hypot(t.section.chord / 2, t.section.height))
    step = 1e-4 * np.array([-1.0, 0.0, 1.0])
    R, psi = fillet.radius(phi + step), fillet.half_angle(phi + step)
    x, y = R * np.sin(psi), R * np.cos(psi)
    d1, d2 = (np.array([x[2] - x[0], y[2] - y[0]]) / 2e-4, np.array([np.diff(x, 2)[0], np.diff(y, 2)[0]]) / 1e-8)
    # central differences: 1e-8 of truncation, and 1e-8 of rounding in the second derivative
    assert math.atan2(abs(d1[0]), abs(d1[1])) == pytest.approx(math.radians(30.0), abs=1e-6)
    curvature = abs(d1[0] * d2[1] - d1[1] * d2[0]) / np.hypot(*d1) ** 3
    assert 1 / curvature == pytest.approx(t.section.radius, rel=1e-5)


def test_tooth_of_a_rack_has_the_closed_form_section():
    # on a rack the fillet is the rack's own arc: 30° to the centre line is 60° round it from the root line
    t = tooth(10**7)
    m, alpha = t.gear.normal_module, t.gear.alpha_n
    rho, h_f = 0.38, 1.25
    centre = math.pi / 4 - h_f * math.tan(alpha) - rho * (1 - math.sin(alpha)) / math.cos(alpha)
    chord = math.pi - 2 * (centre + rho * math.sin(math.pi / 3))
    # 1/z of the rack limit, and rounding of a radius of 1e7 modules
    assert t.section.chord / m == pytest.approx(chord, abs=2e-6)
    assert t.section.radius / m == pytest.approx(rho, abs=2e-6)
    h_F, load_angle = t.lever(t.tip_radius)
    half_tip = math.pi / 4 - math.tan(alpha)
    arm = 1.0 - half_tip * math.tan(alpha) + (h_f - rho) + rho * math.cos(math.pi / 3)
    assert h_F / m == pytest.approx(arm, abs=2e-6)
    assert load_angle == pytest.approx(alpha, abs=1e-6)


def test_fillet_steeper_than_30_degrees_everywhere_is_judged_at_its_end():
    t = tooth(200, fillet=0.1, alpha=35.0, dedendum=1.0)
    fillet = t.fillet
    psi, R = float(fillet.half_angle(fillet.phi_end)), float(fillet.radius(fillet.phi_end))
    assert t.section.chord == pytest.approx(2 * R * math.sin(psi), rel=1e-12)


def test_load_radius_is_the_outer_point_of_single_contact():
    pair = case(1).pair
    for member, gear in enumerate(pair.gears):
        bending = RootBending(pair=pair, gear=member)
        # one base pitch before the other end of the path of contact
        u = (
            pair.meshing.path_start + pair.meshing.base_pitch
            if member == 0
            else pair.meshing.path_end - pair.meshing.base_pitch
        )
        roll = u if member == 0 else pair.meshing.tangent_length - u
        assert bending.load_radius == pytest.approx(math.hypot(gear.base_radius, roll), rel=1e-12)


def test_contact_ratio_below_one_loads_the_tip():
    pair = equal(17, helix=25.0, width=60.0, addendum=0.5)
    bending = RootBending(pair=pair, gear=0)
    assert bending.virtual_contact_ratio < 1
    assert bending.load_radius == pytest.approx(bending.tooth.tip_radius, rel=1e-12)


def test_load_distribution_factor_is_continuous_where_the_norm_is():
    spur, full = equal(30), equal(30, helix=15.0, width=60.0)
    assert RootBending(pair=spur, gear=0).load_distribution_factor == 1.0
    assert full.meshing.overlap_ratio > 1
    factor = RootBending(pair=full, gear=0)
    assert factor.load_distribution_factor == pytest.approx(factor.virtual_contact_ratio**-0.5)
    unit = full.face_width / full.meshing.overlap_ratio
    nearly = RootBending(pair=replace(full, face_width=unit * (1 - 1e-9)), gear=0)
    assert nearly.load_distribution_factor == pytest.approx(factor.load_distribution_factor, rel=1e-8)
    barely = RootBending(pair=replace(full, face_width=unit * 0.06), gear=0)
    # √(1 − ε_β + ε_β/ε_αn) leaves 1 with the slope −(1 − 1/ε_αn)/2
    slope = -(1 - 1 / barely.virtual_contact_ratio) / 2
    assert barely.load_distribution_factor == pytest.approx(1 + slope * 0.06, abs=1e-3)


def test_high_contact_ratio_spur_gears_share_the_load():
    pair = equal(60, addendum=1.35, dedendum=1.5, fillet_radius=0.2)
    bending = RootBending(pair=pair, gear=0)
    assert bending.virtual_contact_ratio > 2
    assert bending.load_distribution_factor == 0.7
    low = replace(pair, pinion=replace(pair.pinion, addendum=1.0), wheel=replace(pair.wheel, addendum=1.0))
    assert bending.stress(100.0) < RootBending(pair=low, gear=0).stress(100.0)


def test_high_contact_ratio_with_little_overlap_halves_what_the_overlap_leaves():
    pair = equal(60, helix=5.0, addendum=1.35, dedendum=1.5, fillet_radius=0.2)
    bending = RootBending(pair=pair, gear=0)
    eps, overlap = bending.virtual_contact_ratio, pair.meshing.overlap_ratio
    assert eps > 2
    assert 0 < overlap < 1
    assert bending.load_distribution_factor == pytest.approx(math.sqrt((1 - overlap) / 2 + overlap / eps))


def test_helix_factor_stops_at_30_degrees_and_full_overlap():
    factor = {beta: RootBending(pair=equal(30, helix=beta, width=60.0), gear=0).helix_factor for beta in (30.0, 40.0)}
    assert factor[40.0] == factor[30.0] == pytest.approx((1 - 30 / 120) / math.cos(math.radians(30)) ** 3)


def test_load_below_the_critical_section_bends_nothing():
    # stub teeth of 37°: the force meets the centre line below the section
    gear = Member(teeth=60, addendum=0.05, dedendum=0.5)
    a = 60 / math.cos(math.radians(17.0))
    pair = Pair(
        normal_module=1.0, pressure_angle=37.0, helix_angle=17.0, face_width=30.0, centre_distance=a,
        pinion=gear, wheel=gear,
    )  # fmt: skip
    bending = RootBending(pair=pair, gear=0)
    assert bending.tooth.lever(bending.load_radius)[0] < 0
    assert 0 < bending.form_factor < 0.01
    assert 0 < bending.stress(1.0) < math.inf


def test_rim_factor_follows_the_norm():
    pair = equal(40)
    gear = pair.gears[0]
    height = gear.tooth_height

    def factor(rim: float) -> float:
        bore = 2 * (gear.root_radius - rim * height)
        return RootBending(pair=replace(pair, pinion=replace(pair.pinion, bore_diameter=bore)), gear=0).rim_factor

    assert factor(1.3) == 1.0
    assert factor(1.0) == pytest.approx(1.6 * math.log(2.242))
    assert factor(0.6) == pytest.approx(1.6 * math.log(2.242 / 0.6))
    # the norm's fit meets 1 at 1.2 tooth heights to two digits
    assert factor(1.2 - 1e-9) == pytest.approx(1.0, abs=2e-3)
    # of a rim on a web, however small the bore
    rimmed = replace(pair.pinion, bore_diameter=0.4 * gear.root_radius, rim_thickness=0.6 * height, web_thickness=1.0)
    assert RootBending(pair=replace(pair, pinion=rimmed), gear=0).rim_factor == pytest.approx(factor(0.6))


@settings(max_examples=300, deadline=None)
@given(
    z=st.tuples(st.integers(5, 150), st.integers(5, 150)),
    helix=st.floats(0, 45),
    alpha=st.floats(10, 35),
    spread=st.floats(0.99, 1.06),
    addendum=st.floats(0.2, 1.6),
    dedendum=st.floats(0.6, 1.9),
    width=st.floats(2, 60),
)
def test_any_pair_that_can_mesh_has_a_finite_stress(z, helix, alpha, spread, addendum, dedendum, width):
    a = spread * sum(z) / math.cos(math.radians(helix)) / 2
    try:
        pair = Pair(
            normal_module=1.0, pressure_angle=alpha, helix_angle=helix, face_width=width, centre_distance=a,
            pinion=Member(teeth=z[0], addendum=addendum, dedendum=dedendum),
            wheel=Member(teeth=z[1], addendum=addendum, dedendum=dedendum),
        )  # fmt: skip
    except (ValidationError, InputError):
        return
    for member in (0, 1):
        bending = RootBending(pair=pair, gear=member)
        stress = bending.stress(10.0)
        assert math.isfinite(stress)
        assert stress > 0
        assert 0 < bending.tooth.section.chord < 2 * math.pi
        assert_allclose(bending.stress(20.0), 2 * stress, rtol=1e-12)
