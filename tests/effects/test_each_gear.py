"""Crowning and end relief of each gear over its own face, beside those of the pair over the common face."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.base import GapEffect
from gearbench.errors import InputError
from gearbench.scene_file import parse_scene

GEARS = {"pinion": {"teeth": 24, "face_width": 26.0, "axial_offset": 2.0}, "wheel": {"teeth": 36, "axial_offset": -1.0}}


def scene(table: dict, name: str = "crowning", *, own: bool = True, torque: float = 150.0, **more):
    gears = GEARS if own else {name: {"teeth": gear["teeth"]} for name, gear in GEARS.items()}
    sizes = {"normal_module": 3.0, "helix_angle": 12.0, "face_width": 24.0, "centre_distance": 92.2}
    return parse_scene(
        {"pair": sizes | gears, "load": {"torque": torque}, "effects": {"hertz": {}, name: table}} | more
    )


def gap(of):
    """Gap [µm] of the micro-geometry of the loaded flank, and its lines."""
    lines = scene_lines(of, mesh_phases(of)[0])
    (effect,) = (effect for effect in of.flank_effects if isinstance(effect, GapEffect))
    return 1e3 * effect.gap(lines), lines


def test_crowning_of_each_gear_over_its_own_face():
    made = scene({"pinion": {"amount": 8.0}, "wheel": {"amount": 4.0, "amount_at_0": 6.0, "highest": 9.0}})
    found, lines = gap(made)
    # positions of the faces along the axis: pinion −11 … 15, wheel −13 … 11, common −11 … 11
    axis = lines.face - 11.0
    top = axis + 13.0 - 9.0
    wheel = np.where(top < 0, 6.0 * (top / 9.0) ** 2, 4.0 * (top / 15.0) ** 2)
    assert_allclose(found, 8.0 * ((axis - 2.0) / 13.0) ** 2 + wheel, atol=1e-10)
    assert made.pair.meshing.face_width == 22.0


def test_end_relief_of_each_gear_over_its_own_face():
    made = scene(
        {"pinion": {"amount": 8.0, "length": 5.0}, "wheel": {"at_b": {"amount": 4.0, "length": 3.0}}}, "end_relief"
    )
    found, lines = gap(made)
    axis = lines.face - 11.0
    pinion = 8.0 * np.clip((-6.0 - axis) / 5.0, 0, None) + 8.0 * np.clip((axis - 10.0) / 5.0, 0, None)
    assert_allclose(found, pinion + 4.0 * np.clip((axis - 8.0) / 3.0, 0, None), atol=1e-10)
    effect = made.effect("end_relief")
    assert isinstance(effect, GapEffect)
    assert_allclose(sorted(effect.face_kinks(made.pair)), [5.0, 19.0, 21.0])


@pytest.mark.parametrize(
    ("name", "table"),
    [("crowning", {"amount": 5.0, "highest": 9.0}), ("end_relief", {"at_b": {"amount": 5.0, "length": 4.0}})],
)
def test_gears_of_one_width_share_what_the_pair_has(name, table):
    whole, _ = gap(scene(table, name, own=False))
    for gear in GEARS:
        assert_allclose(gap(scene({gear: table}, name, own=False))[0], whole, atol=1e-12)
    twice, _ = gap(scene({"pinion": table, "wheel": table}, name, own=False))
    assert_allclose(twice, 2 * whole, atol=1e-12)


def test_coast_flanks_have_their_own_on_the_gears_as_they_are():
    """Under a negative torque y = b is the same end of each gear, where its coast flank is relieved."""
    table = {"pinion": {"at_b": {"amount": 9.0, "length": 6.0}}}
    drive, _ = gap(scene({"amount": 1.0, "length": 1.0}, "end_relief"))
    found, coast = gap(scene({"amount": 1.0, "length": 1.0}, "end_relief", torque=-150.0, coast={"end_relief": table}))
    # the pinion's end at 15, 4 mm beyond the common face that ends at 11
    assert_allclose(found, 9.0 * np.clip((coast.face - 11.0 - 9.0) / 6.0, 0, None), atol=1e-10)
    assert found.max() > 0.5
    assert drive.max() <= 1.0


FAULTS = {
    "neither": ("crowning", {}, "amount = missing: is required unless there is a table pinion or wheel"),
    "both": ("crowning", {"amount": 1.0, "wheel": {"amount": 2.0}}, "amount = 1: conflicts with the table wheel"),
    "a top of the whole": ("crowning", {"highest": 1.0, "wheel": {"amount": 2.0}}, "highest = 1: conflicts with"),
    "a top beside its face": (
        "crowning",
        {"wheel": {"amount": 2.0, "highest": 25.0}},
        "wheel.highest = 25: must be",
    ),
    "no amount": ("crowning", {"wheel": {"highest": 2.0}}, "wheel.amount = missing: is required"),
    "end and gear": (
        "end_relief",
        {"at_b": {"amount": 1.0, "length": 1.0}, "pinion": {"amount": 1.0, "length": 1.0}},
        "at_b = given: conflicts with the table pinion",
    ),
    "nothing of a gear": (
        "end_relief",
        {"pinion": {}},
        "pinion.amount = missing: is required unless there is a table at_0 or at_b",
    ),
    "too long": ("end_relief", {"pinion": {"amount": 1.0, "length": 14.0}}, "pinion.length = 14: must be at most half"),
}


@pytest.mark.parametrize(("name", "table", "says"), FAULTS.values(), ids=FAULTS.keys())
def test_faults_are_one_line(name, table, says):
    with pytest.raises(InputError) as fault:
        scene(table, name)
    assert str(fault.value).startswith(f"effects.{name}.{says}")
    assert "\n" not in str(fault.value)
