"""Keys of the pair, loads and coast flanks that are not given are not there; what says nothing changes nothing."""

from __future__ import annotations

from copy import deepcopy
from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr

from gearbench.geometry.pair import Member, Pair
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene
from gearbench.schema import keys
from gearbench.simulation import simulate
from tests.test_scene_economy import BASE as SIZES

BASE: dict[str, Any] = SIZES | {
    "effects": {"tooth_bending": {"basis": "paper"}, "hertz": {}, "tip_relief": {"amount": 6.0, "length": 0.9}},
    "resolution": {"positions": 6, "segments": 7},
}
WEB = {"rim_thickness": 8.0, "web_thickness": 6.0, "web_offset": 2.0, "hub_diameter": 40.0}
#: Keys by where they stand: a value that matters, and one that says what holds anyway (absent: there is none).
PAIR: dict[str, tuple[Any, Any]] = {
    "centre_distance_upper": (40.0, 0.0),
    "centre_distance_lower": (20.0, 0.0),
    "temperature": ({"pinion": 30.0, "housing": 80.0}, {"pinion": 20.0, "wheel": 20.0, "housing": 20.0}),
    "material": ({"youngs_modulus": 120.0}, {"youngs_modulus": 210.0}),
}
GEAR: dict[str, tuple[Any, Any]] = {
    "face_width": (20.0, 24.0),
    "axial_offset": (3.0, 0.0),
    "thickness": ({"upper": -50.0, "lower": -150.0}, {"upper": 0.0, "lower": 0.0}),
    "material": ({"youngs_modulus": 120.0}, {"youngs_modulus": 210.0}),
    "tip_rounding": (0.6, None),
    "tip_chamfer": (0.4, None),
    "protuberance": (0.12, None),
    "web_offset": (2.0, 0.0),
}
CASES = [("pair", key) for key in PAIR] + [("pinion", key) for key in GEAR]


def given(table: str, key: str, value: Any) -> Scene:
    """The scene with one more key."""
    tables = deepcopy(BASE)
    (tables["pair"] if table == "pair" else tables["pair"][table])[key] = value
    if key == "centre_distance_lower" and value:
        tables["pair"]["centre_distance_upper"] = 40.0
    if key == "web_offset" and value:
        tables["pair"][table] |= WEB
        tables["effects"]["gear_body"] = {}
    return parse_scene(tables)


@cache
def plain(body: bool = False) -> xr.Dataset:
    tables = deepcopy(BASE)
    if body:
        tables["effects"]["gear_body"] = {}
    return simulate(parse_scene(tables))


def same(one: xr.Dataset, other: xr.Dataset) -> bool:
    return one.drop_attrs().identical(other.drop_attrs())


@pytest.mark.parametrize(("table", "key"), CASES)
def test_a_key_matters_or_says_what_holds_anyway(table, key):
    matters, neutral = (PAIR if table == "pair" else GEAR)[key]
    changed = simulate(given(table, key, matters), outputs=("transmission_error", "line_load", "initial_gap"))
    reference = plain(key == "web_offset")
    assert changed["transmission_error"].shape != reference["transmission_error"].shape or not np.array_equal(
        changed["transmission_error"], reference["transmission_error"]
    )
    if neutral is not None:
        assert same(simulate(given(table, key, neutral)), plain())


def test_every_key_beside_size_and_teeth_is_looked_at():
    sizes = {"normal_module", "pressure_angle", "helix_angle", "face_width", "centre_distance", "pinion", "wheel"}
    assert set(keys(Pair)) - sizes - {"backlash"} == set(PAIR)  # the contact under load does not see backlash
    tooth = {
        "teeth",
        "addendum",
        "dedendum",
        "tip_diameter",
        "profile_shift",
        "fillet_radius",
        "root_diameter",
        "bore_diameter",
        "outer_diameter",
        "support",
        "cutter",
        "blank",
    }
    assert set(keys(Member)) - tooth == set(GEAR) | set(WEB) | {"grinding_stock"}


def test_what_is_not_given_is_neither_in_the_scene_nor_in_the_result():
    text = parse_scene(BASE).to_toml()
    names = {*PAIR, *(set(GEAR) - {"face_width"}), *WEB, "loads", "coast", "operation", "system"}
    assert not [name for name in names if name in text]
    mentioned = " ".join(map(str, (*plain().variables, *plain().attrs)))
    assert not [name for name in names if name in mentioned]


def test_one_of_several_loads_is_that_load():
    tables = deepcopy(BASE)
    torque = tables.pop("load")["torque"]
    one = simulate(parse_scene(tables | {"loads": [{"torque": torque, "weight": 3.0}]})).isel(torque=0)
    for name in ("transmission_error", "mesh_stiffness", "line_load"):
        np.testing.assert_allclose(one[name], plain()[name], rtol=1e-9)


def test_coast_flanks_are_not_looked_at_under_a_positive_torque():
    coast = parse_scene(BASE | {"coast": {"tip_relief": {"amount": 30.0, "length": 1.5}}})
    assert same(simulate(coast), plain())
    backwards = BASE | {"load": {"torque": -150.0}}
    alike = parse_scene(backwards | {"coast": {"tip_relief": {"amount": 6.0, "length": 0.9}}})
    assert same(simulate(alike), simulate(parse_scene(backwards)))
