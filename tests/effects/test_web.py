"""Rim, web and hub of a scene: what is refused, and which way round an offset web stands."""

from __future__ import annotations

from dataclasses import replace

import pytest
from numpy.testing import assert_allclose

from gearbench import simulate
from gearbench.effects.gear_body import GearBody
from gearbench.effects.hertz import Hertz
from gearbench.effects.teeth import web_of
from gearbench.effects.tooth_bending import ToothBending
from gearbench.errors import InputError
from gearbench.geometry.pair import Member, Pair
from gearbench.geometry.web import make_web
from gearbench.results.warnings import warnings
from gearbench.scene import Load, Resolution, Scene
from tests.support.gears import standard_gear, swapped

PINION = Member(teeth=20, bore_diameter=16.0)
WHEEL = Member(teeth=40, bore_diameter=20.0, rim_thickness=5.0, web_thickness=4.0, hub_diameter=34.0)


def webbed(offset: float = 0.0, torque: float = 60.0, helix: float = 15.0, **wheel) -> Scene:
    return Scene(
        pair=Pair(
            normal_module=2.0,
            helix_angle=helix,
            face_width=14.0,
            centre_distance=60.0 if helix == 0 else 62.2,
            pinion=PINION,
            wheel=replace(WHEEL, **{"web_offset": offset, **wheel}),
        ),
        load=Load(torque=torque),
        effects=(ToothBending(model="solid", order=(4, 5, 6)), GearBody(), Hertz()),
        resolution=Resolution(positions=4, segments=12),
    )


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"bore_diameter": None}, "rim_thickness.*needs bore_diameter"),
        ({"web_thickness": None}, "needs web_thickness"),
        ({"rim_thickness": None}, "web_thickness.*needs rim_thickness"),
    ],
)
def test_keys_that_need_each_other(keys, message):
    with pytest.raises(ValueError, match=message):
        replace(WHEEL, **keys)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"hub_diameter": 10.0}, r"pair\.wheel\.hub_diameter = 10: must be at least bore_diameter, 20 mm"),
        ({"rim_thickness": 30.0}, r"pair\.wheel\.rim_thickness = 30: must be .* between root circle and hub_diameter"),
        ({"web_thickness": 15.0}, r"pair\.wheel\.web_thickness = 15: must be .* face width, 14 mm"),
        ({"web_offset": -6.0}, r"pair\.wheel\.web_offset = -6: must be at most 5 mm either way"),
    ],
)
def test_parts_that_do_not_fit(keys, message):
    with pytest.raises(ValueError, match=message):
        webbed(**keys)


def test_the_closed_form_knows_no_webs():
    scene = webbed(helix=0.0)
    with pytest.raises(ValueError, match="does not support webs"):
        replace(scene, effects=(ToothBending(), GearBody(model="sainsot_velex"), Hertz()))


def test_an_offset_web_keeps_its_end_of_the_face():
    """The driven gear, and the coast flanks, are seen in a mirror."""
    pair = webbed(3.0).pair
    on_wheel = [web_of(pair, 1, coast) for coast in (False, True)]
    assert on_wheel[1] is not None
    assert on_wheel[0] == on_wheel[1].mirrored(14.0)
    assert (on_wheel[1].start, on_wheel[1].stop) == (8.0, 12.0)
    driving = web_of(swapped(pair), 0, False)
    assert driving == on_wheel[1]
    assert web_of(pair, 0, False) is None
    with pytest.raises(InputError, match="hub_diameter"):
        make_web(standard_gear(20), 8.0, 2.0, 0.5, 0.0, 6.0)


def test_coast_flanks_are_drive_flanks_of_the_mirrored_web():
    """With the torque the other way round, contact lines run across the face as on drive flanks seen in a mirror."""
    drive, coast = simulate(webbed(3.0)), simulate(webbed(-3.0, torque=-60.0))
    assert_allclose(coast.transmission_error, drive.transmission_error, rtol=1e-9)
    other = simulate(webbed(-3.0))
    assert abs(float(other.transmission_error.mean() / drive.transmission_error.mean()) - 1) > 1e-3


def test_gears_beyond_those_held_against_finite_elements_are_warned_of():
    def of_bodies(scene):
        return tuple(line for line in warnings(scene) if "line of action" not in line)

    assert of_bodies(webbed()) == ()
    assert of_bodies(webbed(rim_thickness=2.0)) == (
        "rim of the wheel 1 m_n thick: teeth on a ring were compared with finite elements from 1.5",
    )
    wide = replace(webbed(), pair=replace(webbed().pair, face_width=54.0))
    assert [line[:29] for line in of_bodies(wide)] == ["face of the pinion 27 m_n wid", "face of the wheel 27 m_n wide"]
    # plates on a ring are not those teeth
    assert of_bodies(replace(webbed(rim_thickness=2.0), effects=(ToothBending(), GearBody(), Hertz()))) == ()
