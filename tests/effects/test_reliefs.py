"""Micro-geometry as on a drawing: reliefs by their start, one end of the face, unsymmetrical crowning, curves."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.effects.base import GapEffect
from gearbench.effects.crowning import Crowning
from gearbench.effects.curves import FlankCurve
from gearbench.effects.end_relief import EndRelief
from gearbench.effects.helix_curve import HelixCurve
from gearbench.effects.helix_slope import HelixSlope
from gearbench.effects.profile_crowning import ProfileCrowning
from gearbench.effects.profile_curve import ProfileCurve
from gearbench.effects.profile_slope import ProfileSlope
from gearbench.effects.root_relief import RootRelief
from gearbench.effects.shape import slope
from gearbench.effects.tip_relief import TipRelief
from gearbench.errors import InputError
from gearbench.geometry.names import GEARS
from gearbench.geometry.profile import profile
from gearbench.scene_file import parse_scene
from gearbench.schema import read
from gearbench.simulation import simulate
from tests.effects.test_gaps import HELICAL, SPUR, B, at, gap, on
from tests.support.paths import ROOT
from tests.test_scene_economy import BASE

PAIRS = pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
KINDS = {"tip_relief": TipRelief, "root_relief": RootRelief}


def made(kind: type, **table: object) -> Any:
    """Make an effect from the keys of its table."""
    return read(kind, table)


def starts(pair, index: int, radius: float) -> dict[str, float]:
    """Start of a relief at a radius, in all the ways in which a drawing may give it."""
    g = pair.gears[index]
    roll = math.sqrt(radius**2 - g.base_radius**2)
    return {
        "start_diameter": 2 * radius,
        "start_roll_length": roll,
        "start_roll_angle": math.degrees(roll / g.base_radius),
    }


@PAIRS
@pytest.mark.parametrize("index", [0, 1])
@pytest.mark.parametrize("kind", KINDS)
def test_every_way_to_give_the_start_is_the_same_relief(pair, index, kind):
    g = pair.gears[index]
    edge = g.tip_radius if kind == "tip_relief" else pair.meshing.active_radii[index][0]
    start = edge - 0.9 if kind == "tip_relief" else edge + 0.7
    u = np.linspace(pair.meshing.path_start, pair.meshing.path_end, 41)
    lines = at(pair, u, np.full(41, 3.0))
    for along in ("radius", "roll"):
        tables = [{"length": abs(edge - start)}, *({k: v} for k, v in starts(pair, index, start).items())]
        effects = [made(KINDS[kind], **{GEARS[index]: {"amount": 7.0, "along": along, **table}}) for table in tables]
        gaps = [effect.gap(lines) for effect in effects]
        for other in gaps[1:]:
            assert_allclose(other, gaps[0], atol=1e-15)
        assert 1e3 * gaps[0].max() == pytest.approx(7.0, rel=1e-9 if kind == "root_relief" else 0.2)
        for effect in effects:
            assert effect.kinks(pair) == pytest.approx((on(pair, index, start),), rel=1e-12)


@pytest.mark.parametrize("index", [0, 1])
def test_linear_in_the_coordinate_it_is_given_in(index):
    g = HELICAL.gears[index]
    tip, start = (math.sqrt(r**2 - g.base_radius**2) for r in (g.tip_radius, g.tip_radius - 1.0))
    by_roll = made(TipRelief, **{GEARS[index]: {"amount": 8.0, "start_roll_length": start}})
    by_diameter = made(TipRelief, **{GEARS[index]: {"amount": 8.0, "start_diameter": 2 * g.tip_radius - 2.0}})
    middle_roll = math.hypot(g.base_radius, (tip + start) / 2)
    assert gap(by_roll, HELICAL, on(HELICAL, index, middle_roll), 1.0) == pytest.approx(4.0, rel=1e-9)
    assert gap(by_diameter, HELICAL, on(HELICAL, index, g.tip_radius - 0.5), 1.0) == pytest.approx(4.0, rel=1e-9)
    assert gap(by_diameter, HELICAL, on(HELICAL, index, middle_roll), 1.0) != pytest.approx(4.0, rel=1e-3)


def test_the_tables_of_both_gears_are_the_flat_keys():
    flat = made(TipRelief, amount=5.0, length=0.8, shape="parabolic")
    own = {"amount": 5.0, "length": 0.8, "shape": "parabolic"}
    tables = made(TipRelief, pinion=own, wheel=own)
    assert tables.modifications(SPUR) == flat.modifications(SPUR)
    assert made(TipRelief, wheel=own).modifications(SPUR) == replace(flat, gear="wheel").modifications(SPUR)
    assert tables.only_on(1) == made(TipRelief, wheel=own)
    assert made(TipRelief, wheel=own).only_on(0) is None


def test_a_circular_relief_is_an_arc_without_kink():
    """All points of the relief have the same distance from a centre on the flank's normal at the start."""
    effect = made(EndRelief, at_0={"amount": 900.0, "length": 3.0, "shape": "circular"})
    y = np.linspace(0.0, 3.0, 9)
    e = effect.gap(at(SPUR, np.full(9, SPUR.meshing.pitch_point), y)).ravel()
    R = (3.0**2 + 0.9**2) / (2 * 0.9)
    assert_allclose(np.hypot(3.0 - y, R - e), R, rtol=1e-13)
    assert gap(effect, SPUR, SPUR.meshing.pitch_point, B) == 0


@pytest.mark.parametrize("amount", [300.0, -300.0])
def test_circular_modifications_have_the_derivatives_they_say(amount):
    (m,) = made(TipRelief, pinion={"amount": amount, "length": 1.0, "shape": "circular"}).modifications(SPUR)
    assert m.arc > 0.5
    r_b = SPUR.gears[0].base_radius
    roll = np.linspace(*(math.sqrt(r**2 - r_b**2) for r in (SPUR.gears[0].tip_radius - 1, SPUR.gears[0].tip_radius)), 7)
    h = 1e-4
    e, de, dde = m.deviation(roll, r_b)
    (low, _, _), (high, _, _) = m.deviation(roll - h, r_b), m.deviation(roll + h, r_b)
    assert_allclose(de, (high - low) / (2 * h), rtol=1e-6, atol=1e-9)  # h² e‴
    assert_allclose(dde, (high - 2 * e + low) / h**2, rtol=1e-5)
    assert e[-1] == pytest.approx(1e-3 * amount, rel=1e-12)
    assert e[0] == pytest.approx(0, abs=1e-15)


@PAIRS
@pytest.mark.parametrize(
    "effect",
    [
        ProfileCrowning(pinion=6.0, wheel=-3.0),
        made(ProfileCurve, pinion={"polynomial": [1.0, -2.0, 5.0, 3.0]}, wheel={"polynomial": [0.0, 4.0]}),
        made(TipRelief, pinion={"amount": 8.0, "start_roll_angle": 25.0, "shape": "circular"}),
        made(RootRelief, wheel={"amount": 8.0, "length": 0.5, "along": "roll"}),
    ],
    ids=lambda e: e.name,
)
def test_modifications_of_the_profiles_are_the_gap(pair, effect):
    """Modifications are transverse, along the tangent at a roll length; times cos β_b they are normal to the flank."""
    cos_b = math.cos(pair.meshing.beta_b)
    u = np.linspace(pair.meshing.path_start, pair.meshing.path_end, 33)
    total = np.zeros(33)
    for index in (0, 1):
        own = tuple(m for m in effect.modifications(pair) if m.gear == index)
        rolls = u if index == 0 else pair.meshing.tangent_length - u
        for piece in profile(pair.gears[index], own).pieces:
            inside = (rolls > piece.low) & (rolls <= piece.high)
            total[inside] += piece.deviation(rolls[inside])[0]
    # the first point of the root side belongs to no piece's open interval
    assert_allclose(cos_b * total[1:-1], effect.gap(at(pair, u, np.full(33, 2.0)))[0, 0, 1:-1], atol=1e-15)
    assert np.abs(total).max() > 1e-3


def test_one_end_of_the_face():
    effect = made(EndRelief, at_b={"amount": 6.0, "length": 4.0})
    for y, expected in ((0.0, 0.0), (B - 4.0, 0.0), (B - 2.0, 3.0), (B, 6.0)):
        assert gap(effect, HELICAL, HELICAL.meshing.pitch_point, y) == pytest.approx(expected, abs=1e-12)
    assert effect.face_kinks(HELICAL) == (B - 4.0,)
    both = made(EndRelief, at_0={"amount": 5.0, "length": 2.0}, at_b={"amount": 5.0, "length": 2.0})
    assert both.face_kinks(SPUR) == made(EndRelief, amount=5.0, length=2.0).face_kinks(SPUR)


def test_unsymmetrical_crowning():
    effect = Crowning(amount=8.0, amount_at_0=3.0, highest=B / 3)
    for y, expected in ((0.0, 3.0), (B / 6, 0.75), (B / 3, 0.0), (2 * B / 3, 2.0), (B, 8.0)):
        assert gap(effect, SPUR, SPUR.meshing.pitch_point, y) == pytest.approx(expected, abs=1e-12)
    for highest, y, expected in ((0.0, B, 8.0), (0.0, 0.0, 0.0), (B, 0.0, 8.0), (B, B, 0.0)):
        assert gap(Crowning(amount=8.0, highest=highest), SPUR, SPUR.meshing.pitch_point, y) == expected


@PAIRS
def test_curves_are_the_modifications_they_can_describe(pair):
    u = np.linspace(pair.meshing.path_start, pair.meshing.path_end, 25)
    lines = at(pair, u, np.linspace(0, B, 25))
    low, high = pair.meshing.active_rolls[1]
    alike: list[tuple[GapEffect, GapEffect]] = [
        (made(ProfileCurve, wheel={"polynomial": [5.0]}), ProfileSlope(wheel=5.0)),
        (made(ProfileCurve, wheel={"at": [low, high], "deviation": [0.0, 5.0]}), ProfileSlope(wheel=5.0)),
        (made(HelixCurve, pinion={"polynomial": [5.0]}), HelixSlope(pinion=5.0)),
        (made(HelixCurve, wheel={"at": [0.0, 3.0, B], "deviation": [6.0, 0.0, 0.0]}),
         made(EndRelief, at_0={"amount": 6.0, "length": 3.0})),
    ]  # fmt: skip
    for curve, same in alike:
        assert_allclose(curve.gap(lines), same.gap(lines), atol=1e-16)
    assert made(HelixCurve, wheel={"at": [0.0, 3.0, B], "deviation": [6.0, 0.0, 0.0]}).face_kinks(pair) == (3.0,)
    barrel = made(ProfileCurve, pinion={"polynomial": [-4.0 * 6, 4.0 * 6]}).gap(lines)  # 6 (2t − 1)² − 6
    assert_allclose(barrel, ProfileCrowning(pinion=6.0).gap(lines) - 6e-3, atol=1e-16)


def test_beyond_its_points_a_curve_is_held():
    curve = FlankCurve(at=(1.0, 2.0), deviation=(3.0, 5.0))
    (shape,) = curve.shapes(0, slope(SPUR, 0))
    assert_allclose(shape.factors[0](np.array([0.0, 1.5, 9.0])), [3.0, 4.0, 5.0])


# -- drive and coast flanks -------------------------------------------------------------------------------------------
def tables(torque: float, effects: dict, **more) -> dict:
    return {
        **BASE, "load": {"torque": torque}, "resolution": {"positions": 8, "segments": 40},
        "effects": {"tooth_bending": {"basis": "paper"}, "hertz": {}, **effects}, **more,
    }  # fmt: skip


def same(one, two) -> None:
    for name in ("transmission_error", "mesh_stiffness"):
        assert_allclose(one[name].values, two[name].values, rtol=1e-9)
    assert_allclose(one["line_load"].values, two["line_load"].values, rtol=1e-7, atol=1e-7)


def test_unmodified_flanks_are_alike():
    same(simulate(parse_scene(tables(150.0, {}))), simulate(parse_scene(tables(-150.0, {}))))


MIRRORED = {
    "helix_slope": ({"pinion": 6.0}, {"helix_curve": {"pinion": {"polynomial": [-6.0]}}}),
    "flank_twist": ({"wheel": 6.0}, {"flank_twist": {"wheel": -6.0}}),
    "end_relief": ({"at_0": {"amount": 5.0, "length": 4.0}}, {"end_relief": {"at_b": {"amount": 5.0, "length": 4.0}}}),
    "crowning": ({"amount": 5.0, "highest": 4.0}, {"crowning": {"amount": 5.0, "highest": 20.0}}),
    "tip_relief": ({"amount": 9.0, "length": 0.8}, {"tip_relief": {"amount": 9.0, "length": 0.8}}),
    "misalignment": ({"deviation": 7.0}, {"misalignment": {"deviation": 7.0}}),
    "misalignment, inclined": ({"inclination": 7.0}, {"misalignment": {"inclination": -7.0}}),
}


@pytest.mark.parametrize("name", MIRRORED)
def test_the_coast_flank_is_that_of_the_mirror_image(name):
    """The mirror image in the plane of the axes changes the hand of the helix; turned end for end it is restored."""
    table, mirrored = MIRRORED[name]
    coast = simulate(parse_scene(tables(-150.0, {name.partition(",")[0]: table})))
    drive = simulate(parse_scene(tables(150.0, mirrored)))
    shift = coast["transmission_error"].values - drive["transmission_error"].values
    # gaps that differ by a constant differ in the mean of δ alone
    assert_allclose(shift, shift[0], atol=2e-9)
    assert_allclose(coast["mesh_stiffness"].values, drive["mesh_stiffness"].values, rtol=1e-8)
    assert_allclose(coast["face_position"].values, 24.0 - drive["face_position"].values, atol=1e-12)
    plain = simulate(parse_scene(tables(150.0, {})))
    assert np.ptp(coast["mesh_stiffness"].values - plain["mesh_stiffness"].values) > 0.1


def test_each_flank_has_its_own_micro_geometry():
    coast = {"tip_relief": {"amount": 12.0, "length": 0.5}}
    both = tables(150.0, {"tip_relief": {"amount": 4.0, "length": 0.9}}, coast=coast)
    same(
        simulate(parse_scene(both)),
        simulate(parse_scene(tables(150.0, {"tip_relief": {"amount": 4.0, "length": 0.9}}))),
    )
    both["load"] = {"torque": -150.0}
    same(simulate(parse_scene(both)), simulate(parse_scene(tables(-150.0, coast))))
    text = parse_scene(both).to_mapping()
    assert text["coast"] == coast
    assert parse_scene(text) == parse_scene(both)


def test_pitch_errors_of_the_coast_flanks_follow_the_order_of_the_teeth():
    """The sense of rotation stays: on the coast flanks the next pair enters at the other end of the path of contact."""
    errors = [0.0] * 24
    errors[5] = 9.0
    table = {"pitch_errors": {"pinion": errors, "pinion_tooth": 4}}
    drive = parse_scene(tables(150.0, table, resolution={"positions": 2}))
    coast = parse_scene(tables(-150.0, table, resolution={"positions": 2}))
    for made, k in ((drive, -1), (coast, 1)):
        found = simulate(made, outputs=["initial_gap"])
        shifted = found["pair_index"].values[(found["initial_gap"].values > 1).any(axis=(0, 2))]
        assert shifted.tolist() == [k]


BAD = {
    "no start": (
        {"tip_relief": {"pinion": {"amount": 5.0}}},
        "effects.tip_relief.pinion.length = missing: is required",
    ),
    "two starts": (
        {"tip_relief": {"pinion": {"amount": 5.0, "length": 1.0, "start_diameter": 70.0}}},
        "effects.tip_relief.pinion.start_diameter = 70: conflicts with length",
    ),
    "start beside the tooth": (
        {"tip_relief": {"wheel": {"amount": 5.0, "start_diameter": 20.0}}},
        "effects.tip_relief.wheel.start_diameter = 20: must lie on the tooth, at a diameter of",
    ),
    "roll below the base circle": (
        {"tip_relief": {"pinion": {"amount": 5.0, "length": 6.5, "along": "roll"}}},
        "effects.tip_relief.pinion.along = roll: begins below the base circle",
    ),
    "nothing": (
        {"tip_relief": {}},
        "effects.tip_relief.amount = missing: is required unless there is a table pinion or wheel",
    ),
    "ends meet": (
        {"end_relief": {"at_0": {"amount": 5.0, "length": 20.0}, "at_b": {"amount": 5.0, "length": 5.0}}},
        "effects.end_relief.at_0.length = 20: at_0 and at_b together must be at most the face width",
    ),
    "no curve": ({"profile_curve": {}}, "effects.profile_curve.pinion = missing: a curve is required"),
    "points fall": (
        {"helix_curve": {"pinion": {"at": [1.0, 0.0], "deviation": [0.0, 1.0]}}},
        "effects.helix_curve.pinion.at = [1.0, 0.0]: must increase",
    ),
    "points of another gear": (
        {"profile_curve": {"pinion": {"at": [0.0, 0.1], "deviation": [0.0, 1.0]}}},
        "effects.profile_curve.pinion.at = 0 to 0.1 mm: must cover at least half of the active profile",
    ),
}


@pytest.mark.parametrize(("effects", "message"), BAD.values(), ids=BAD.keys())
def test_bad_values_are_one_line(effects, message):
    with pytest.raises(InputError) as caught:
        parse_scene(tables(150.0, effects))
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("start", "message"),
    [
        ({"start_diameter": 150.0}, r"start_diameter = 150: .* a diameter of 195\.4 to 203\.777 mm$"),
        ({"start_roll_angle": 80.0}, r"start_roll_angle = 80: .* of 195\.4 to 203\.777 mm, not 319\.543 mm$"),
    ],
)
def test_a_start_beside_the_tooth_of_a_ring_is_told_in_diameters_above_0(start, message):
    ring = tomllib.loads((ROOT / "examples" / "ring.toml").read_text(encoding="utf-8"))
    ring["effects"]["tip_relief"] = {"wheel": {"amount": 5.0} | start}
    with pytest.raises(InputError, match=message):
        parse_scene(ring)


@pytest.mark.parametrize(
    ("coast", "message"),
    [
        ({"hertz": {}}, "coast.hertz = given: must be an effect of the flank's shape"),
        ({"misalignment": {"deviation": 1.0}}, "coast.misalignment = given: must be an effect of the flank's shape"),
        ({"tip_relief": {"amount": 1.0, "length": 50.0}}, "coast.tip_relief.length = 50: must be at most the tooth"),
        ({"no_such": {}}, "coast.no_such = unknown effect"),
    ],
)
def test_bad_coast_tables_are_one_line(coast, message):
    with pytest.raises(InputError) as caught:
        parse_scene(tables(150.0, {}, coast=coast))
    assert str(caught.value).startswith(message)


def test_roll_lengths_on_a_ring_are_above_0():
    """Points of a curve and the start of a relief have the same sign there; curves may also have that of ISO 21771."""
    ring = tomllib.loads((ROOT / "examples" / "ring.toml").read_text(encoding="utf-8"))
    pair = parse_scene(ring).pair
    u = np.linspace(pair.meshing.path_start, pair.meshing.path_end, 25)
    lines = at(pair, u, np.linspace(0, 25, 25))
    tip, root = (-roll for roll in pair.meshing.active_rolls[1][::-1])
    relieved = made(TipRelief, wheel={"amount": 8.0, "start_roll_length": tip + 1.0}).gap(lines)
    assert relieved.max() > 5e-3
    for points, deviation in (((tip, tip + 1.0, root), [8.0, 0.0, 0.0]), ((-root, -tip - 1.0, -tip), [0.0, 0.0, 8.0])):
        curve = made(ProfileCurve, wheel={"at": list(points), "deviation": deviation})
        assert_allclose(curve.gap(lines), relieved, atol=1e-12)
    ring["effects"]["profile_curve"] = {"wheel": {"at": [0.0, 1.0], "deviation": [8.0, 0.0]}}
    with pytest.raises(InputError, match=rf"wheel\.at = 0 to 1 mm: must cover .* of {tip:.5g} to {root:.5g} mm"):
        parse_scene(ring)
