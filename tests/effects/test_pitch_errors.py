"""Pitch errors: what single teeth do to the transmission error."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gearbench.effects.hertz import Hertz
from gearbench.effects.pitch_errors import PitchErrors
from gearbench.geometry.action import contact_lines
from gearbench.geometry.pair import Member, Pair
from gearbench.scene import Load, Resolution, Scene
from gearbench.scene_file import parse_scene
from gearbench.simulation import simulate

HELICAL = Pair(
    normal_module=2.0, helix_angle=20.0, face_width=20.0, centre_distance=70.0,
    pinion=Member(teeth=25), wheel=Member(teeth=40),
)  # fmt: skip
SPUR = Pair(normal_module=2.0, face_width=20.0, centre_distance=66.0, pinion=Member(teeth=26), wheel=Member(teeth=40))


def scene(pair, *effects, positions=64):
    return Scene(
        pair=pair, load=Load(torque=100.0), effects=(Hertz(), *effects), resolution=Resolution(positions=positions)
    )


def ste(made):
    return simulate(made)["transmission_error"].values


@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
def test_teeth_that_are_all_behind_turn_the_gear_by_as_much(pair):
    errors = PitchErrors(pinion=(7.0,) * pair.pinion.teeth, wheel=(-2.0,) * pair.wheel.teeth)
    shift = ste(scene(pair, errors)) - ste(scene(pair))
    # an arc of the pitch circle is cos α_t of it on the base circle, along which δ is measured
    np.testing.assert_allclose(shift, 5.0 * math.cos(pair.gears[0].alpha_t), rtol=1e-9)


def test_a_tooth_that_is_behind_shows_where_it_carries_alone():
    errors = [0.0] * 26
    errors[3] = 2.0
    made = scene(SPUR, PitchErrors(pinion=tuple(errors), pinion_tooth=3), positions=200)
    result = simulate(made)
    shift = result["transmission_error"].values - ste(scene(SPUR, positions=200))
    carrying = (result["segment_length"] > 0).all("segment").sum("pair").values
    alone = carrying == 1
    assert 10 < alone.sum() < 150
    np.testing.assert_allclose(shift[alone], 2.0 * math.cos(SPUR.gears[0].alpha_t), rtol=1e-9)
    # where two pairs share the load, the mate takes more of it and the gear turns by less
    assert np.all(shift[~alone] < 2.0 * math.cos(SPUR.gears[0].alpha_t))
    assert np.all(shift[~alone] >= -1e-12)


@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
def test_each_cycle_begins_as_the_one_before_ends(pair):
    rng = np.random.default_rng(3)
    errors = PitchErrors(
        pinion=tuple(rng.uniform(-5, 5, pair.pinion.teeth)), wheel=tuple(rng.uniform(-5, 5, pair.wheel.teeth)),
        pinion_tooth=pair.pinion.teeth - 1, wheel_tooth=7,
    )  # fmt: skip
    following = replace(errors, pinion_tooth=0, wheel_tooth=8)
    end, start = (contact_lines(pair, [tau], 1) for tau in (1 - 1e-9, 0.0))
    before, after = errors.gap(end)[0, :, 0], following.gap(start)[0, :, 0]
    # pair k at the end of a cycle is pair k + 1 of the next
    np.testing.assert_array_equal(before[:-1], after[1:])


def test_the_pair_that_enters_is_that_of_the_teeth_named():
    pair = replace(SPUR, wheel=Member(teeth=39), centre_distance=65.0)
    pinion, wheel = tuple(float(n) for n in range(26)), tuple(100.0 * n for n in range(10)) + (0.0,) * 29
    lines = contact_lines(pair, [0.0], 1)
    zero = int(np.flatnonzero(lines.index == 0)[0])
    unit = 1e-3 * math.cos(pair.gears[0].alpha_t)
    for turn in (0, 5, 30):
        errors = PitchErrors(pinion=pinion, wheel=wheel, pinion_tooth=turn % 26, wheel_tooth=turn % 39)
        gap = errors.gap(lines)[0, :, 0] / unit
        np.testing.assert_allclose(gap[zero], pinion[turn % 26] + wheel[turn % 39], atol=1e-9)


FAULTS = {
    "nothing": ({}, "deviations are required"),
    "too few": ({"pinion": [1.0, 2.0]}, "one for each of the 25 teeth"),
    "no such tooth": ({"pinion": [0.0] * 25, "pinion_tooth": 25}, "pinion_tooth"),
    "in millimetres": ({"pinion": [2000.0] * 25}, "1000"),
}


@pytest.mark.parametrize(("table", "says"), FAULTS.values(), ids=FAULTS.keys())
def test_faults(table, says):
    tables = scene(HELICAL).to_mapping()
    tables["effects"]["pitch_errors"] = table
    with pytest.raises(ValueError, match=says):
        parse_scene(tables)
