"""Input classes as tables of keys: names, defaults, units, limits; objects there and back; faults as one line."""

from dataclasses import MISSING, field
from typing import Annotated

import pytest
from pydantic import Field
from pydantic.dataclasses import dataclass

from docs.keys import limits
from gearbench import InputError, Material, Member, Pair, TipRelief
from gearbench.scene_file import scene_key
from gearbench.schema import STRICT, check, given, keys, parts, read, read_toml


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Spring:
    """A spring.

    Its ends are free.

    Parameters
    ----------
    stiffness, damping
        Along its axis
        [N/mm].
    turns
        Number of turns.

    Raises
    ------
    InputError
        If it has more than 9 turns.
    """

    stiffness: Annotated[float, Field(gt=0.0, le=10.0)]
    damping: float = 0.0
    turns: tuple[int, ...] = field(default_factory=lambda: (1, 2))
    material: Material = Material()

    def __post_init__(self) -> None:
        if max(self.turns) > 9:
            raise InputError("turns", self.turns, "at most 9")


def test_keys_have_names_defaults_units_and_meanings():
    found = keys(Spring)
    assert list(found) == ["stiffness", "damping", "turns", "material"]
    assert [key.default for key in found.values()] == [MISSING, 0.0, (1, 2), Material()]
    assert [key.unit for key in found.values()] == ["N/mm", "N/mm", "", ""]
    assert found["stiffness"].meaning == "Along its axis [N/mm]."
    assert [key.table for key in found.values()] == [None, None, None, Material]
    assert parts(Spring)[0] == "A spring.\n\nIts ends are free."


def test_limits_are_words():
    found = limits(Spring)
    assert found["stiffness"] == "above 0 to 10"
    assert limits(TipRelief)["shape"] == '`"linear"`, `"parabolic"`, `"circular"`'
    assert limits(Member)["teeth"] == "whole"  # a limit that only catches slips is left out


def test_what_is_given_is_read_again():
    spring = Spring(stiffness=2.0, turns=(3,), material=Material(poisson_ratio=0.25))
    assert given(spring) == {"stiffness": 2.0, "turns": [3], "material": {"poisson_ratio": 0.25}}
    assert read(Spring, given(spring)) == spring
    assert read(Spring, spring) is spring
    assert given(Spring(stiffness=2.0)) == {"stiffness": 2.0}


FAULTS = {
    "at.stiffness = missing: is required": {"damping": 1.0},
    "at.stifness = unknown key: did you mean stiffness? allowed: stiffness, damping, turns, material": {
        "stifness": 1.0,
        "damping": "x",
    },
    "at.material.nu = unknown key: allowed: youngs_modulus, poisson_ratio, density, thermal_expansion": {
        "stiffness": 1.0,
        "material": {"nu": 0.3},
    },
    "at.stiffness = 11.0: must be at most 10 N/mm": {"stiffness": 11.0},
    "at.turns.1 = 'b': must be a whole number": {"stiffness": 1.0, "turns": [1, "b"]},
    "at.turns = (10,): at most 9": {"stiffness": 1.0, "turns": [10]},
    "at = 3: must be a table: [at]": 3,
}


@pytest.mark.parametrize("line", FAULTS)
def test_a_fault_is_one_line(line):
    with pytest.raises(InputError) as caught:
        read(Spring, FAULTS[line], "at")
    assert str(caught.value) == line
    with pytest.raises(InputError) as caught:
        check(Spring, FAULTS[line], "at", ())
    assert str(caught.value) == line


def test_keys_that_come_later_are_excused_and_nothing_else():
    check(Spring, {}, "at", ["stiffness"])
    check(Spring, {"stiffness": 1.0, "turns": [10]}, "at", ["turns"])
    sizes = {"normal_module": 2.0, "face_width": 20.0, "centre_distance": 60.0}
    check(Pair, sizes, "pair", ["pinion.teeth", "wheel.teeth"])
    with pytest.raises(InputError, match=r"pair\.wheel = missing"):
        check(Pair, sizes, "pair", ["pinion.teeth"])
    with pytest.raises(InputError, match=r"at\.damping = 'x'"):
        check(Spring, {"damping": "x"}, "at", ["stiffness", "damping"])


def test_keys_of_a_scene_are_found_by_their_path():
    teeth = scene_key("pair.pinion.teeth")
    assert teeth is not None
    assert (teeth.name, teeth.default) == ("teeth", MISSING)
    assert scene_key("pair.pinion") is scene_key("effects.noise.level") is scene_key("pair") is None
    with pytest.raises(InputError, match="must be a key of a scene: teeth, addendum"):
        scene_key("pair.pinion.tooth")
    assert teeth.fault(17) is None
    assert teeth.fault(2) is None  # outside its limits makes no gear, and is no mistake
    assert teeth.fault("17") == "must be a whole number"


@pytest.mark.parametrize("text", ["x = " + "[" * 20_000 + "]" * 20_000, "x = 1" + "0" * 20_000, "x = y"])
def test_what_is_no_toml_is_one_line(tmp_path, text):
    path = tmp_path / "hostile.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=rf"^{path}: not TOML: [^\n]+$"):
        read_toml(path)
