"""Effects that add gap: closed-form values on the flank, sign, linearity, additivity, kinks."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray
from pydantic import ValidationError

from gearbench.effects.base import GapEffect
from gearbench.effects.crowning import Crowning
from gearbench.effects.end_relief import EndRelief
from gearbench.effects.flank_twist import FlankTwist
from gearbench.effects.helix_slope import HelixSlope
from gearbench.effects.hertz import Hertz
from gearbench.effects.misalignment import Misalignment
from gearbench.effects.profile_crowning import ProfileCrowning
from gearbench.effects.profile_slope import ProfileSlope
from gearbench.effects.root_relief import RootRelief
from gearbench.effects.tip_relief import TipRelief
from gearbench.geometry.action import ContactLines, contact_lines
from gearbench.geometry.pair import Member, Pair
from gearbench.scene import Load, Resolution, Scene
from gearbench.solution import solve_scene

SPUR = Pair(normal_module=3.0, face_width=24.0, centre_distance=90.4, pinion=Member(teeth=24), wheel=Member(teeth=36))
HELICAL = replace(SPUR, helix_angle=18.0, centre_distance=94.9)
PAIRS = pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
B = SPUR.face_width


def at(pair: Pair, u: list[float] | NDArray, y: list[float] | NDArray) -> ContactLines:
    """Contact line through the points (u, y) of the plane of action."""
    u, y = (np.asarray(x, dtype=float)[None, None] for x in (u, y))
    one = np.ones((1, 1))
    return ContactLines(pair=pair, mesh_phase=np.zeros(1), index=np.zeros(1, int), u=u, y=y, length=one)


def gap(effect: GapEffect, pair: Pair, u: float, y: float) -> float:
    """Gap [µm] at one point."""
    return 1e3 * float(effect.gap(at(pair, [u], [y]))[0, 0, 0])


def on(pair: Pair, gear: int, radius: float) -> float:
    """Position u at which ``gear`` touches at ``radius``, by Pythagoras."""
    g = pair.gears[gear]
    roll = math.sqrt(radius**2 - g.base_radius**2)
    return roll if gear == 0 else pair.meshing.tangent_length - roll


# -- values -----------------------------------------------------------------------------------------------------------
@PAIRS
@pytest.mark.parametrize(("y", "expected"), [(0, 8.0), (B, 8.0), (B / 2, 0.0), (B / 4, 2.0), (0.75 * B, 2.0)])
def test_crowning(pair, y, expected):
    for u in (pair.meshing.path_start, pair.meshing.path_end):
        assert gap(Crowning(amount=8.0), pair, u, y) == pytest.approx(expected, abs=1e-12)


@PAIRS
@pytest.mark.parametrize("gear", ["pinion", "wheel"])
@pytest.mark.parametrize(("shape", "half"), [("linear", 3.0), ("parabolic", 1.5)])
def test_tip_relief(pair, gear, shape, half):
    effect = TipRelief(amount=6.0, length=1.2, shape=shape, gear=gear)
    i = ("pinion", "wheel").index(gear)
    tip = pair.gears[i].tip_radius
    for below, expected in ((0.0, 6.0), (0.6, half), (1.2, 0.0), (2.0, 0.0)):
        assert gap(effect, pair, on(pair, i, tip - below), 5.0) == pytest.approx(expected, abs=1e-9)


@PAIRS
@pytest.mark.parametrize("gear", ["pinion", "wheel"])
@pytest.mark.parametrize(("shape", "half"), [("linear", 3.0), ("parabolic", 1.5)])
def test_root_relief(pair, gear, shape, half):
    effect = RootRelief(amount=6.0, length=1.2, shape=shape, gear=gear)
    i = ("pinion", "wheel").index(gear)
    u_root = (pair.meshing.path_start, pair.meshing.path_end)[i]
    start = math.hypot(pair.gears[i].base_radius, u_root if i == 0 else pair.meshing.tangent_length - u_root)
    for above, expected in ((0.0, 6.0), (0.6, half), (1.2, 0.0), (2.0, 0.0)):
        assert gap(effect, pair, on(pair, i, start + above), 5.0) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(("shape", "half"), [("linear", 4.0), ("parabolic", 2.0)])
def test_end_relief(shape, half):
    effect = EndRelief(amount=8.0, length=3.0, shape=shape)
    for y, expected in ((0.0, 8.0), (1.5, half), (3.0, 0.0), (12.0, 0.0)):
        for place in (y, B - y):
            assert gap(effect, SPUR, SPUR.meshing.pitch_point, place) == pytest.approx(expected, abs=1e-12)


@PAIRS
def test_profile_slope_is_full_at_each_tip(pair):
    u_a, u_e = pair.meshing.path_start, pair.meshing.path_end
    for u, pinion, wheel in ((u_a, 0.0, 7.0), (u_e, 7.0, 0.0), (0.25 * u_a + 0.75 * u_e, 5.25, 1.75)):
        assert gap(ProfileSlope(pinion=7.0), pair, u, 0.0) == pytest.approx(pinion, abs=1e-12)
        assert gap(ProfileSlope(wheel=7.0), pair, u, 0.0) == pytest.approx(wheel, abs=1e-12)


@PAIRS
def test_profile_crowning_is_full_at_both_ends_of_the_active_profile(pair):
    u_a, u_e = pair.meshing.path_start, pair.meshing.path_end
    for t, share in ((0.0, 1.0), (0.5, 0.0), (1.0, 1.0), (0.75, 0.25), (0.25, 0.25)):
        u = u_a + t * (u_e - u_a)
        for amounts in ({"pinion": 6.0}, {"wheel": 6.0}):
            assert gap(ProfileCrowning(**amounts), pair, u, 3.0) == pytest.approx(6 * share, abs=1e-12)


@PAIRS
@pytest.mark.parametrize("name", ["pinion", "wheel"])
def test_flank_twist_is_a_profile_slope_that_changes_over_the_face(pair, name):
    """S_α of ISO 21771-1: slope of the transverse profile at y = b minus the slope at y = 0."""
    ends = pair.meshing.active_radii[("pinion", "wheel").index(name)]
    root, tip = (on(pair, ("pinion", "wheel").index(name), r) for r in ends)
    twist = FlankTwist(**{name: 8.0})

    def slope(y: float) -> float:
        return gap(twist, pair, tip, y) - gap(twist, pair, root, y)

    assert slope(B) - slope(0.0) == pytest.approx(8.0, rel=1e-12)
    assert slope(0.75 * B) == pytest.approx(2.0, rel=1e-12)
    assert gap(twist, pair, tip, B) == pytest.approx(2.0, rel=1e-12)
    assert gap(twist, pair, (root + tip) / 2, 0.3 * B) == pytest.approx(0.0, abs=1e-12)


def test_profile_slope_is_linear_in_roll_angle():
    """In a profile inspection chart the deviation is linear over the roll angle tan α_R of the gear."""
    r_b = HELICAL.gears[1].base_radius
    radii = np.linspace(*HELICAL.meshing.active_radii[1], 7)
    roll = np.sqrt(radii**2 / r_b**2 - 1)
    found = [gap(ProfileSlope(wheel=5.0), HELICAL, on(HELICAL, 1, r), 1.0) for r in radii]
    assert_allclose(found, 5 * (roll - roll[0]) / (roll[-1] - roll[0]), atol=1e-9)


@PAIRS
def test_helix_slope(pair):
    for effect in (HelixSlope(pinion=9.0), HelixSlope(wheel=9.0)):
        for y, expected in ((0.0, 0.0), (B / 3, 3.0), (B, 9.0)):
            assert gap(effect, pair, pair.meshing.pitch_point, y) == pytest.approx(expected, abs=1e-12)


@PAIRS
@pytest.mark.parametrize("amounts", [(3.0, 0.0), (0.0, 4.0), (3.0, 4.0)])
def test_misalignment_is_the_displacement_along_the_common_normal(pair, amounts):
    """Vector solution: n points from T1 to T2 of the base circles; the wheel moves away (x) and backwards (−y)."""
    r1, r2 = (g.base_radius for g in pair.gears)
    alpha = math.acos((r1 + r2) / pair.centre_distance)
    e = np.array([math.cos(alpha), math.sin(alpha)])
    n = np.array([pair.centre_distance, 0.0]) - r2 * e - r1 * e
    n /= np.linalg.norm(n)
    inclination, deviation = amounts
    effect = Misalignment(inclination=inclination, deviation=deviation)
    expected = n @ [inclination, -deviation] * math.cos(pair.meshing.beta_b)
    for y, share in ((0.0, 0.0), (B / 2, 0.5), (B, 1.0)):
        assert gap(effect, pair, pair.meshing.pitch_point, y) == pytest.approx(share * expected, rel=1e-12)


# -- what holds for all of them ---------------------------------------------------------------------------------------
def every(x: float) -> list[GapEffect]:
    return [
        Crowning(amount=x),
        TipRelief(amount=x, length=0.7),
        TipRelief(amount=x, length=0.7, shape="parabolic", gear="wheel"),
        RootRelief(amount=x, length=0.7),
        EndRelief(amount=x, length=2.0),
        ProfileSlope(pinion=x, wheel=0.5 * x),
        ProfileCrowning(pinion=x, wheel=0.5 * x),
        HelixSlope(pinion=x, wheel=0.5 * x),
        Misalignment(inclination=x, deviation=0.5 * x),
    ]


ALL = range(len(every(0.0)))


def lines(pair: Pair) -> ContactLines:
    return contact_lines(pair, np.linspace(0, 0.97, 13), 21)


@PAIRS
@pytest.mark.parametrize("i", ALL)
def test_positive_is_missing_material_and_the_gap_is_linear(pair, i):
    one, three, minus = (every(x)[i].gap(lines(pair)) for x in (2.0, 6.0, -2.0))
    assert one.shape == lines(pair).shape
    assert np.all(one >= 0)
    assert one.max() > 1e-4
    assert_allclose(three, 3 * one, rtol=1e-15, atol=1e-20)
    assert_array_equal(minus, -one)


def scene(*effects: GapEffect, **resolution: int) -> Scene:
    law = Hertz(law="yang_sun")
    return Scene(pair=HELICAL, load=Load(torque=80.0), effects=(*effects, law), resolution=Resolution(**resolution))


@pytest.mark.parametrize(
    "effect", [*every(0.0), *(k(amount=4.0, length=0.0) for k in (TipRelief, RootRelief, EndRelief))]
)
def test_an_amount_or_length_of_zero_is_the_absence_of_the_effect(effect):
    """Results agree to the last bit, also with the default phases."""
    without, with_it = solve_scene(scene()), solve_scene(scene(effect))
    assert_array_equal(with_it.weight, without.weight)
    for name in ("approach", "stiffness", "force"):
        assert_array_equal(getattr(with_it.solution, name), getattr(without.solution, name))


@PAIRS
@pytest.mark.parametrize("kind", [TipRelief, RootRelief])
@pytest.mark.parametrize("gear", ["pinion", "wheel"])
def test_kinks_are_where_the_slope_of_the_gap_jumps(pair, kind, gear):
    effect = kind(amount=10.0, length=0.8, gear=gear)
    (kink,) = effect.kinks(pair)
    assert pair.meshing.path_start < kink < pair.meshing.path_end
    u = kink + 1e-3 * np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    left, *_, right = np.diff(effect.gap(at(pair, u, np.full(5, 1.0))).ravel())
    assert abs(right - left) > 1e-6  # 10 µm over some mm: 3e-6 per step
    elsewhere = np.linspace(pair.meshing.path_start, pair.meshing.path_end, 400)
    elsewhere = elsewhere[np.abs(elsewhere - kink) > 0.05]
    steps = 1e-3 * np.array([-1.0, 0.0, 1.0])
    bend = [np.diff(effect.gap(at(pair, np.clip(v + steps, 0, None), np.ones(3))).ravel(), 2)[0] for v in elsewhere]
    assert np.abs(bend).max() < 2e-8


@pytest.mark.parametrize(
    ("effect", "key"),
    [
        (TipRelief(amount=5.0, length=7.0), "effects.tip_relief.length"),
        (RootRelief(amount=5.0, length=6.0), "effects.root_relief.length"),
        (EndRelief(amount=5.0, length=12.5), "effects.end_relief.length"),
    ],
)
def test_a_relief_that_does_not_fit_the_tooth_is_refused(effect, key):
    with pytest.raises(ValidationError, match=key):
        scene(effect)
