"""Faces, tools, materials and temperatures as on a drawing, in the geometry and in the solution."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.contact.coarse_solution import scene_lines
from gearbench.effects.curves import FlankCurve
from gearbench.effects.end_relief import EndRelief
from gearbench.effects.gear_body import GearBody
from gearbench.effects.helix_curve import HelixCurve
from gearbench.effects.helix_slope import HelixSlope
from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.errors import InputError
from gearbench.geometry.action import contact_lines
from gearbench.geometry.gear import Gear
from gearbench.geometry.material import Material
from gearbench.geometry.pair import Member, Pair
from gearbench.geometry.temperature import Temperatures
from gearbench.scene import Load, Resolution, Scene
from gearbench.scene_file import parse_scene
from gearbench.schema import changed
from gearbench.simulation import simulate
from tests.support.gears import standard_gear

PAIR = Pair(
    normal_module=3.0,
    helix_angle=12.0,
    face_width=24.0,
    centre_distance=92.2,
    pinion=Member(teeth=24, bore_diameter=20.0),
    wheel=Member(teeth=36, bore_diameter=30.0),
)
STEEL, BRONZE = Material(), Material(youngs_modulus=105.0, poisson_ratio=0.34, thermal_expansion=18.0)


def scene(pair: Pair = PAIR, torque: float = 150.0, *effects) -> Scene:
    solid = ToothBending(model="solid", order=(3, 4, 6))
    return Scene(
        pair=pair,
        load=Load(torque=torque),
        effects=(solid, GearBody(), Hertz(), *effects),
        resolution=Resolution(positions=4, segments=9),
    )


def members(pair: Pair = PAIR, pinion=None, wheel=None, **changes) -> Pair:
    both = {"pinion": replace(pair.pinion, **(pinion or {})), "wheel": replace(pair.wheel, **(wheel or {}))}
    return replace(pair, **both, **changes)


# -- faces ------------------------------------------------------------------------------------------------------------
def test_teeth_touch_where_both_gears_have_them():
    pair = members(pinion={"face_width": 30.0, "axial_offset": 5.0}, wheel={"axial_offset": -1.0})
    # pinion −10 … 20, wheel −13 … 11
    assert pair.meshing.face_width == pytest.approx(21.0)
    assert_allclose(pair.overhangs, [(0.0, 9.0), (3.0, 0.0)], atol=1e-12)
    assert [gear.face_width for gear in pair.gears] == [30.0, 24.0]
    lines = contact_lines(pair, np.linspace(0, 1, 7), 8)
    assert lines.y[lines.length > 0].min() > 0
    assert lines.y[lines.length > 0].max() < 21.0
    assert_allclose(lines.gear_face(1) - lines.gear_face(0), 3.0)


def test_the_coast_flanks_see_the_faces_in_the_mirror():
    ahead = members(pinion={"face_width": 30.0, "axial_offset": 2.0}, wheel={"axial_offset": -1.0})
    behind = members(pinion={"face_width": 30.0, "axial_offset": -2.0}, wheel={"axial_offset": 1.0})
    drive, coast = simulate(scene(ahead)), simulate(scene(behind, -150.0))
    assert_allclose(coast.transmission_error, drive.transmission_error, rtol=1e-10)


@pytest.mark.slow
def test_a_tooth_wider_than_its_mate_is_that_of_finite_elements():
    """Loaded on the common face, solid teeth on their body agree within 1.5 % with finite elements (0.5 %)."""
    pair = members(replace(PAIR, face_width=18.0), pinion={"face_width": 27.0, "axial_offset": 3.0})
    fast = replace(scene(pair), effects=(ToothBending(model="solid"), GearBody(), Hertz()))
    meshed = replace(fast, effects=(ToothBending(model="finite_elements", accuracy=0.005), GearBody(), Hertz()))
    one, two = simulate(fast), simulate(meshed)
    assert_allclose(one.transmission_error, two.transmission_error, rtol=0.015)
    narrow = simulate(replace(fast, pair=replace(PAIR, face_width=18.0)))
    assert float((narrow.transmission_error / two.transmission_error).min()) > 1.02


def test_micro_geometry_of_a_gear_runs_over_its_own_face():
    pair = members(pinion={"face_width": 30.0}, wheel={"axial_offset": 2.0})
    lines = scene_lines(scene(pair), np.array([0.3]))
    y = lines.y
    slope = HelixSlope(pinion=6.0, wheel=4.0).gap(lines)
    assert_allclose(slope, 1e-3 * (6.0 * (y + pair.overhangs[0][0]) / 30.0 + 4.0 * y / 24.0), atol=1e-15)
    points = HelixCurve(pinion=FlankCurve(at=(0.0, 10.0, 30.0), deviation=(0.0, 0.0, 8.0)))
    assert_allclose(points.gap(lines), 8e-3 * np.maximum(y + pair.overhangs[0][0] - 10.0, 0.0) / 20.0, atol=1e-15)
    assert points.face_kinks(pair) == pytest.approx((10.0 - pair.overhangs[0][0],))
    # of the pair: over the common face
    ends = EndRelief(amount=5.0, length=2.0).face_kinks(pair)
    assert_allclose(ends, [2.0, pair.meshing.face_width - 2.0])


# -- tool -------------------------------------------------------------------------------------------------------------
def cut_by_rack(gear: Gear, radius: np.ndarray) -> np.ndarray:
    """Half angles at ``radius`` of the tooth that the rounding of the rack leaves, by brute force.

    The rounding is a row of points that rolls past the gear in small steps; each cuts what lies beyond it.
    """
    m, alpha, beta = gear.normal_module, gear.alpha_n, gear.beta
    rho, h = gear.fillet_radius * m, gear.dedendum * m
    flat = math.pi * m / 4 - h * math.tan(alpha) - (rho * (1 - math.sin(alpha)) - gear.protuberance) / math.cos(alpha)
    theta = np.linspace(0.0, math.pi / 2 - alpha / 4, 800)
    xi = (flat + rho * np.sin(theta)) / math.cos(beta)
    eta = gear.profile_shift * m - (h - rho) - rho * np.cos(theta)
    left = np.full(radius.shape, np.inf)
    for s in np.linspace(-5 * m, 1.2 * m, 8000):
        x, y = xi - s, gear.pitch_radius + eta
        R = np.hypot(x, y)
        psi = math.pi / gear.teeth - (np.arctan2(x, y) + s / gear.pitch_radius)
        rising = np.argsort(R)
        cut = np.interp(radius, R[rising], psi[rising], left=np.inf, right=np.inf)
        left = np.minimum(left, cut)
    return left


@pytest.mark.parametrize(("teeth", "helix", "depth"), [(24, 0.0, 0.04), (17, 15.0, 0.08), (60, 0.0, 0.03)])
def test_the_fillet_of_a_protuberance_is_what_the_tool_leaves(teeth, helix, depth):
    gear = replace(
        standard_gear(teeth, normal_module=2.0, helix=helix, dedendum=1.4, fillet_radius=0.3), protuberance=depth
    )
    plain = replace(gear, protuberance=0.0)
    assert gear.root_radius == plain.root_radius
    assert gear.form_radius > plain.form_radius
    radius = np.linspace(gear.root_radius + 0.05, gear.form_radius + 0.1, 60)
    cut, fillet = cut_by_rack(gear, radius), radius < gear.form_radius
    assert_allclose(gear.half_angle(radius)[fillet], cut[fillet], atol=3e-6)
    assert np.all(cut[~fillet] > gear.half_angle(radius)[~fillet])
    # below the flank that is ground the fillet is deeper by almost s_pr
    below = plain.half_angle(radius[fillet]) - gear.half_angle(radius[fillet])
    assert 0.8 * depth < below.max() * gear.base_radius * math.cos(gear.beta_b) < 1.2 * depth
    # flank and fillet meet
    at = gear.form_radius
    assert float(gear.half_angle(at - 1e-9)) == pytest.approx(float(gear.half_angle(at)), abs=1e-7)


def test_stock_that_takes_all_of_the_protuberance_is_no_protuberance():
    ground = members(pinion={"protuberance": 0.1, "grinding_stock": 0.1})
    assert ground.gears == PAIR.gears


def test_contact_modulus_is_that_of_both():
    pair = members(wheel={"material": BRONZE})
    expected = 1 / ((1 - 0.3**2) / 210e3 + (1 - 0.34**2) / 105e3)
    assert pair.contact_modulus == pytest.approx(expected, rel=1e-14)
    assert PAIR.contact_modulus == pytest.approx(210e3 / 0.91 / 2, rel=1e-14)


# -- temperature ------------------------------------------------------------------------------------------------------
def test_all_at_one_temperature_is_as_at_twenty_degrees():
    warm = replace(PAIR, temperature=Temperatures(pinion=80.0, wheel=80.0, housing=80.0))
    assert warm.meshing.centre_distance == pytest.approx(PAIR.centre_distance, rel=1e-15)
    assert warm.strains[0] == pytest.approx(11.5e-6 * 60)
    assert scene(warm).flank_effects == scene(PAIR).flank_effects


def test_a_housing_of_aluminium_moves_the_axes_apart():
    warm = replace(PAIR, temperature=Temperatures(pinion=80.0, wheel=80.0, housing=60.0, housing_expansion=23.0))
    expected = 92.2 * (1 + 23e-6 * 40) / (1 + 11.5e-6 * 60)
    assert warm.meshing.centre_distance == pytest.approx(expected, rel=1e-14)
    grown = 92.2 * (1 + 23e-6 * 40 - 11.5e-6 * 60) - 92.2
    assert warm.actual_backlash == pytest.approx(2 * grown * math.tan(PAIR.meshing.alpha_wt), rel=0.01)
    assert warm.profile_shifts == PAIR.profile_shifts


def test_a_hot_pinion_has_the_greater_base_pitch():
    """From one tooth pair to the next the gap falls by the difference of the base pitches, normal to the flank."""
    hot = replace(PAIR, backlash=0.2, temperature=Temperatures(pinion=100.0, wheel=60.0))
    (effect,) = scene(hot).flank_effects[3:]
    lines = contact_lines(hot, [0.4], 9)
    gap = effect.gap(lines)[0]
    touching = np.flatnonzero(lines.active[0])
    assert np.ptp(gap[touching], axis=1) == pytest.approx(0.0, abs=1e-12)
    step = np.diff(gap[touching, 0])
    pitches = PAIR.meshing.base_pitch * (11.5e-6 * 80 - 11.5e-6 * 40)
    assert_allclose(step, -pitches * math.cos(PAIR.meshing.beta_b), rtol=1e-9)


def test_gears_too_hot_for_their_housing_are_refused():
    with pytest.raises(InputError, match="teeth overlap"):
        changed(PAIR, temperature=Temperatures(pinion=100.0, wheel=100.0))


# -- files and faults -------------------------------------------------------------------------------------------------
TABLE = {
    "normal_module": 3.0, "face_width": 24.0, "centre_distance": 92.4, "centre_distance_upper": 20.0,
    "temperature": {"pinion": 90.0, "housing_expansion": 23.0},
    "pinion": {
        "teeth": 24, "face_width": 30.0, "axial_offset": -1.5, "protuberance": 0.12, "grinding_stock": 0.1,
        "material": {"youngs_modulus": 205.0}, "thickness": {"upper": -40.0, "lower": -70.0},
    },
    "wheel": {"teeth": 37, "thickness": {"span": 32.3, "span_teeth": 4, "lower": -30.0}},
}  # fmt: skip


def test_a_scene_with_all_of_it_is_read_as_it_was_written():
    read = parse_scene({"pair": TABLE, "load": {"torque": 100.0}, "effects": {"hertz": {}}})
    assert parse_scene(tomllib.loads(read.to_toml())) == read
    assert read.to_mapping()["pair"] == TABLE


FAULTS = {
    "pair.pinion.grinding_stock": {"pinion": {"grinding_stock": 0.2}},
    "pair.pinion.face_width": {"pinion": {"face_width": 5000.0}},
    "pair.face_width": {"pinion": {"face_width": 20.0}, "wheel": {"face_width": 21.0}},
    "pair.centre_distance_lower": {"centre_distance_lower": 30.0},
    "pair.temperature.wheel": {"temperature": {"wheel": 900.0}},
    "pair.pinion.thickness.lower": {"pinion": {"thickness": {"lower": 5.0}}},
}


@pytest.mark.parametrize("key", FAULTS)
def test_faults_are_named(key):
    changes = FAULTS[key]
    pair = {k: v for k, v in TABLE.items() if k not in ("temperature", "centre_distance_upper")}
    pair |= {"pinion": {"teeth": 24}, "wheel": {"teeth": 36}, "centre_distance": 92.4}
    for name, value in changes.items():
        pair[name] = {**pair[name], **value} if isinstance(pair.get(name), dict) else value
    with pytest.raises(InputError) as caught:
        parse_scene({"pair": pair, "load": {"torque": 100.0}, "effects": {"hertz": {}}})
    assert caught.value.key == key
    assert "\n" not in str(caught.value)
