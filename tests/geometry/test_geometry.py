"""Geometry: closed forms, brute force for the fillet, round trips, invariants."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from pydantic import ValidationError

from gearbench.contact.phases import gauss_phases
from gearbench.errors import InputError
from gearbench.geometry.action import contact_lines
from gearbench.geometry.gear import Gear
from gearbench.geometry.involute import inv, inverse_involute
from gearbench.geometry.pair import Member, Pair
from gearbench.geometry.rack import full_fillet_radius
from gearbench.library.garambois2017 import case, table_2
from tests.support.gears import swapped


def gear(teeth=20, x=0.0, helix=0.0, fillet=0.38, addendum=1.0, dedendum=1.25, alpha=20.0) -> Gear:
    return Gear(
        teeth=teeth, normal_module=2.0, pressure_angle=alpha, helix_angle=helix, face_width=20.0,
        profile_shift=x, addendum=addendum, dedendum=dedendum, fillet_radius=fillet,
    )  # fmt: skip


@given(st.floats(1e-6, 1.5))
def test_involute_function_and_its_inverse(angle):
    # inv α ~ α³/3 keeps a relative precision of ε/α²
    assert inverse_involute(inv(angle)) == pytest.approx(angle, rel=1e-14 + 1e-16 / angle**2)


def test_involute_values_of_the_tables():
    assert inv(math.radians(20)) == pytest.approx(0.0149044, abs=5e-8)
    assert inv(math.radians(25)) == pytest.approx(0.0299753, abs=5e-8)
    assert inverse_involute(0.0) == 0.0
    with pytest.raises(ValueError, match="must not be negative"):
        inverse_involute(-1e-9)


def test_thickness_of_a_standard_gear():
    g = gear(teeth=30)
    assert g.transverse_thickness(g.pitch_radius) == pytest.approx(math.pi, rel=1e-13)
    # ISO 21771: s_b = r_b (s/r + 2 inv α)
    s_b = g.base_radius * 2 * (math.pi / 60 + inv(math.radians(20)))
    assert g.transverse_thickness(g.base_radius, fillet=False) == pytest.approx(s_b, rel=1e-13)
    shifted = gear(teeth=30, x=0.4)
    assert shifted.transverse_thickness(30.0) - math.pi == pytest.approx(
        2 * 2 * 0.4 * math.tan(math.radians(20)), rel=1e-12
    )


def test_normal_thickness_of_a_helical_gear_at_the_pitch_circle():
    g = gear(teeth=30, helix=25.0, x=0.2)
    expected = 2.0 * (math.pi / 2 + 2 * 0.2 * math.tan(math.radians(20)))
    assert g.normal_thickness(g.pitch_radius) == pytest.approx(expected, rel=1e-13)


FILLETS = [
    {"teeth": 30}, {"teeth": 17}, {"teeth": 10}, {"teeth": 6, "addendum": 0.6}, {"teeth": 5, "x": 0.3, "addendum": 0.7},
    {"teeth": 12, "x": -0.3, "addendum": 0.9}, {"teeth": 25, "x": 0.8}, {"teeth": 40, "x": -0.9, "helix": 25.0},
    {"teeth": 17, "helix": 45.0}, {"teeth": 11, "helix": 15.0}, {"teeth": 20, "fillet": 0.0},
    {"teeth": 9, "fillet": 0.0},
    {"teeth": 20, "fillet": full_fillet_radius(math.radians(20), 1.25)},
    {"teeth": 71, "helix": 25.648, "dedendum": 1.62, "addendum": 1.13, "fillet": 0.27}, {"teeth": 30, "alpha": 14.5},
]  # fmt: skip


def cut_by_rack(g: Gear, radius: np.ndarray) -> np.ndarray:
    """Half angle of the tooth that remains at each radius after the rack has rolled past, by brute force.

    The point (R, ψ) of the gear, with the pitch point at angle ψ_s from the middle of the space, is inside the rack if
    it lies inside the rack's transverse section; the space's half angle is the largest ψ_s that is.
    """
    m, beta = g.normal_module, g.beta
    d_tip, rho, alpha = g.dedendum * m, g.fillet_radius * m, g.alpha_n
    xc, dc = g.fillet.rack.corner

    def half_width(depth: np.ndarray) -> np.ndarray:
        """Transverse half width of the rack tooth at a depth below the datum line; negative below its tip."""
        straight = math.pi * m / 4 - depth * math.tan(alpha)
        round_ = xc + np.sqrt(np.maximum(rho**2 - (depth - dc) ** 2, 0.0))
        width = np.where(depth < g.fillet.rack.flank_depth, straight, round_)
        return np.where(depth <= d_tip, width, -np.inf) / math.cos(beta)

    r, shift = g.pitch_radius, g.profile_shift * m
    turn = np.linspace(-1.2, 1.2, 40_001)  # rotation of the gear past the rack
    left = np.empty_like(radius)
    for i, R in enumerate(radius):
        # rack tooth centred at s = r·turn when the gear has turned by it: which angles of the circle R are cut?
        low, high = 0.0, math.pi / g.teeth * 1.5
        for _ in range(24):
            psi = (low + high) / 2
            phi = psi - turn
            x, y = R * np.sin(phi), R * np.cos(phi)
            cut = np.any(np.abs(x + r * turn) < half_width(shift - (y - r)))
            low, high = (psi, high) if cut else (low, psi)
        left[i] = math.pi / g.teeth - low
    return left


@pytest.mark.parametrize(
    "options", [pytest.param(each, marks=[pytest.mark.slow] * (i % 3 > 0)) for i, each in enumerate(FILLETS)], ids=str
)
def test_section_against_a_rack_that_rolls_past(options):
    g = gear(**options)
    edge = 1e-3 * g.tooth_height
    radius = np.linspace(g.root_radius + edge, g.tip_radius, 9)
    # rack positions 6e-5 rad apart; the envelope is quadratic in their distance, but at a cusp linear
    assert_allclose(g.half_angle(radius) * radius, cut_by_rack(g, radius) * radius, atol=2e-4 * g.normal_module)


@pytest.mark.parametrize("options", FILLETS, ids=str)
def test_fillet_meets_root_circle_and_involute(options):
    g = gear(**options)
    radius = np.linspace(g.root_radius, g.tip_radius, 4001)
    psi = g.half_angle(radius)
    assert np.all(np.isfinite(psi))
    assert np.all(psi > 0)
    # ψ(R) has an infinite slope there: √(10⁻¹⁶) of R matters
    assert g.root_half_angle == pytest.approx(psi[0], rel=1e-6)
    form = g.form_radius
    gap = float(g.half_angle(form * (1 - 1e-13)) - g.involute_half_angle(form))
    assert abs(gap) < 1e-9
    if not g.is_undercut and g.fillet_radius > 0:
        step = 1e-6 * g.normal_module
        below, above = ((g.half_angle(form + s) - g.half_angle(form + s - step)) / step for s in (-step, 2 * step))
        assert below == pytest.approx(float(above), abs=2e-4)
    inside = radius[radius < form]
    if len(inside):
        assert_allclose(g.fillet.radius(g.fillet.parameter(inside)), inside, rtol=1e-13)


def test_undercut_begins_at_the_book_s_number_of_teeth():
    """Textbook: z_min = 2 (h_f* − ρ*(1 − sin α) − x) / sin² α."""
    depth = 1.25 - 0.38 * (1 - math.sin(math.radians(20)))
    limit = 2 * depth / math.sin(math.radians(20)) ** 2
    assert not gear(teeth=math.ceil(limit)).is_undercut
    assert gear(teeth=math.floor(limit)).is_undercut
    assert not gear(teeth=12, x=depth - 6 * math.sin(math.radians(20)) ** 2 + 1e-9).is_undercut
    assert gear(teeth=12, x=depth - 6 * math.sin(math.radians(20)) ** 2 - 1e-3, addendum=0.8).is_undercut


@pytest.mark.parametrize(
    ("options", "key"),
    [({"addendum": 2.0}, "addendum"), ({"dedendum": 2.2}, "dedendum"), ({"fillet": 0.6}, "fillet_radius"),
     ({"teeth": 5, "dedendum": 2.0, "fillet": 0.0, "x": -1.0}, "dedendum"),
     ({"teeth": 6, "addendum": 0.01, "x": -0.4}, "addendum")],
)  # fmt: skip
def test_gears_that_cannot_be_made_are_refused(options, key):
    with pytest.raises(InputError) as caught:
        gear(**options)
    assert caught.value.key == key


# -- pairs ------------------------------------------------------------------------------------------------------------


def test_profile_shifts_of_table_2_follow_from_the_centre_distance():
    for row in table_2():
        assert row.scene().pair.profile_shifts[0] == pytest.approx(row.profile_shift, abs=0.0011)


@given(
    teeth=st.tuples(st.integers(15, 60), st.integers(15, 60)), beta=st.floats(0, 30),
    x=st.tuples(st.floats(0, 0.5), st.floats(0, 0.5)), play=st.floats(0, 0.1),
)  # fmt: skip
@settings(max_examples=60, deadline=None)
def test_centre_distance_profile_shift_and_backlash_go_round(teeth, beta, x, play):
    m = 2.0
    a = m / math.cos(math.radians(beta)) * sum(teeth) / 2 + m * sum(x) * 0.95 + play
    try:
        first = Pair(
            normal_module=m, helix_angle=beta, face_width=20.0, centre_distance=a,
            pinion=Member(teeth=teeth[0], profile_shift=x[0]), wheel=Member(teeth=teeth[1], profile_shift=x[1]),
        )  # fmt: skip
    except ValidationError:
        assume(False)
    assume(first.actual_backlash >= -1e-9 * m)  # an overlap within the rounding of data has no backlash to give
    again = replace(first, backlash=max(0.0, first.actual_backlash), wheel=replace(first.wheel, profile_shift=None))
    assert again.generating_shifts == pytest.approx(x, abs=1e-10)
    # teeth are thinned, the tip circle is that of the distance without backlash
    assert again.profile_shifts == pytest.approx(replace(again, backlash=None).profile_shifts, abs=1e-12)
    assert again.actual_backlash == pytest.approx(first.actual_backlash, abs=1e-10)
    # j_wt by its definition: working pitch minus both thicknesses at the working pitch circles
    g1, g2 = first.gears
    r_w1 = a * teeth[0] / sum(teeth)
    thickness = float(g1.transverse_thickness(r_w1, fillet=False) + g2.transverse_thickness(a - r_w1, fillet=False))
    assert 2 * math.pi * r_w1 / teeth[0] - thickness == pytest.approx(first.actual_backlash, abs=1e-10)


@pytest.mark.parametrize("m", [1.0, 4.5])
def test_overlap_of_data_rounded_to_four_decimals_is_allowed(m):
    """The published data of FZG type C (a′ 91.5, m_n 4.5, x 0.1817 and 0.1715) overlap by 6·10⁻⁵ mm."""

    def fzg(shift):
        pinion, wheel = Member(teeth=16, profile_shift=0.1817), Member(teeth=24, profile_shift=shift)
        size = {"normal_module": m, "face_width": 14.0, "centre_distance": 91.5 * m / 4.5}
        return Pair(pinion=pinion, wheel=wheel, **size)

    overlap = -fzg(0.1715).actual_backlash
    assert overlap == pytest.approx(6e-5 * m / 4.5, rel=0.1)
    per_shift = 4 * (91.5 * m / 4.5) * math.tan(math.radians(20)) / 40  # dj/dx
    allowed = (1e-4 + 1e-4 * m - overlap) / per_shift
    assert fzg(0.1715 + 0.99 * allowed).actual_backlash < 0
    with pytest.raises(ValidationError, match="teeth overlap"):
        fzg(0.1715 + 1.01 * allowed)


def test_contact_ratio_of_standard_gears_in_closed_form():
    """ε_α = [√(r_a1² − r_b1²) + √(r_a2² − r_b2²) − a sin α] / p_b; z 17/43: 1.6211."""
    pair = Pair(
        normal_module=1.0, face_width=10.0, centre_distance=30.0, pinion=Member(teeth=17), wheel=Member(teeth=43)
    )
    alpha = math.radians(20)
    parts = [math.sqrt((z / 2 + 1) ** 2 - (z / 2 * math.cos(alpha)) ** 2) for z in (17, 43)]
    expected = (sum(parts) - 30 * math.sin(alpha)) / (math.pi * math.cos(alpha))
    assert expected == pytest.approx(1.6211, abs=5e-5)
    assert pair.meshing.transverse_contact_ratio == pytest.approx(expected, rel=1e-12)
    assert pair.meshing.overlap_ratio == 0.0


def test_specific_sliding_is_zero_at_the_pitch_point_and_exchanges_with_the_gears():
    pair = case(1).pair
    (a1, e1), (a2, e2) = pair.meshing.specific_sliding
    assert a1 < 0 < e1
    assert e2 < 0 < a2
    # ζ₂ = ζ₁ / (ζ₁ − 1) at the same place
    assert a2 == pytest.approx(a1 / (a1 - 1), rel=1e-12)
    assert e2 == pytest.approx(e1 / (e1 - 1), rel=1e-12)
    sliding = swapped(pair).meshing.specific_sliding
    assert sliding[0] == pytest.approx((e2, a2), rel=1e-12)
    # linear path coordinates: sliding vanishes at u = r_b1 tan α_wt
    u, t = pair.meshing.pitch_point, pair.meshing.tangent_length
    assert 1 - (t - u) / u * 33 / 75 == pytest.approx(0.0, abs=1e-12)


def test_interference_with_the_fillet_shortens_the_path():
    pair = Pair(
        normal_module=1.0, face_width=10.0, centre_distance=25.0, pinion=Member(teeth=10), wheel=Member(teeth=40)
    )
    assert pair.gears[0].is_undercut
    assert pair.meshing.has_interference == (True, False)
    form = pair.gears[0].form_radius
    assert pair.meshing.path_start == pytest.approx(math.sqrt(form**2 - pair.gears[0].base_radius ** 2), rel=1e-12)
    assert case(1).pair.meshing.has_interference == (False, False)


# -- contact lines ----------------------------------------------------------------------------------------------------

PAIRS = {"spur": case(1).pair, "helical": case(2).pair, **{r.gear: r.scene().pair for r in table_2()[1:8]}}


@pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS.keys())
def test_mean_length_of_the_contact_lines(pair):
    """∫₀¹ Σ ℓ dτ = ε_α b / cos β_b is exact with Gauss panels, since lengths are linear between transitions."""
    phase, weight = gauss_phases(pair.meshing.transition_phases, 2)
    lines = contact_lines(pair, phase, 7)
    mean = weight @ lines.length.sum(axis=(1, 2))
    exact = pair.meshing.transverse_contact_ratio * pair.face_width / math.cos(pair.meshing.beta_b)
    assert mean == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS.keys())
def test_lines_stay_in_their_rectangle_and_go_on_in_the_next_period(pair):
    lines = contact_lines(pair, np.linspace(0, 1, 23), 9)
    assert np.all((lines.u >= pair.meshing.path_start) & (lines.u <= pair.meshing.path_end))
    assert np.all((lines.y >= 0) & (lines.y <= pair.face_width))
    assert_allclose(lines.length[-1, :-1], lines.length[0, 1:], atol=1e-9)
    for gear_, radius in zip(pair.gears, lines.radii, strict=True):
        assert np.all(radius <= gear_.tip_radius * (1 + 1e-12))
        assert np.all(radius >= gear_.form_radius * (1 - 1e-12))


def test_lines_of_many_panels_are_cut_at_all_of_them():
    """A line of 15 segments has an end of a segment at each of ten kinks, as many as a measured grid may have."""
    pair = case(1).pair
    kinks = np.linspace(0, pair.face_width, 12)[1:-1]
    lines = contact_lines(pair, [0.4], 15, (), kinks, cells=True)
    ends = lines.moved(1).y[lines.active]
    assert np.abs(ends[..., None] - kinks).min(axis=1).max() < 1e-12 * pair.face_width


def test_a_panel_that_a_line_crosses_in_no_time_has_its_share():
    """On an almost spur pair, a line crosses the panel between two close kinks within an instant of the mesh cycle."""
    pair = replace(case(1).pair, helix_angle=0.001)
    meshing = pair.meshing
    u = meshing.path_start + 0.3001 * meshing.base_pitch
    kinks = (u - 5e-4, u + 2.5e-3)
    lines = contact_lines(pair, [0.3001], 12, kinks, cells=True)
    (first,) = np.flatnonzero(lines.index == 0)
    assert_allclose(lines.length[0, first], meshing.face_width / math.cos(meshing.beta_b) / 12)
    assert np.all((lines.u[0, first] > kinks[0]) & (lines.u[0, first] < kinks[1]))


def test_tooth_that_undercut_cuts_off_is_refused():
    """Three teeth without profile shift keep a thin neck; with a negative shift undercut cuts them off."""
    assert 0 < gear(teeth=3).neck < gear(teeth=4).neck
    with pytest.raises(InputError, match="cuts the tooth off"):
        gear(teeth=3, x=-0.2)


@pytest.mark.parametrize("kind", [np.int64, np.uint8])
def test_counts_of_teeth_may_come_from_arrays(kind):
    member = Member(teeth=kind(23))
    assert member == Member(teeth=23)
    assert type(member.teeth) is int
