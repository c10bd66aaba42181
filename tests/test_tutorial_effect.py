"""docs/tutorial_effect.md does what it says: its file is an effect, its test passes."""

from __future__ import annotations

import re
import sys
import types
from pathlib import Path

import numpy as np
import pytest

from gearbench.effects import registry
from gearbench.errors import InputError
from gearbench.scene_file import parse_scene
from gearbench.simulation import simulate

TEXT = (Path(__file__).parents[1] / "docs" / "tutorial_effect.md").read_text(encoding="utf-8")
EFFECT, TEST = re.findall(r"```python\n(.*?)```", TEXT, flags=re.DOTALL)
MODULE = "gearbench.effects.waviness"


@pytest.fixture(autouse=True)
def waviness(monkeypatch):
    """The module of the tutorial, entered in the registry."""
    module = types.ModuleType(MODULE)
    monkeypatch.setitem(sys.modules, MODULE, module)
    exec(compile(EFFECT, "waviness.py", "exec"), module.__dict__)
    monkeypatch.setitem(registry.EFFECTS, "waviness", (MODULE, "Waviness"))
    return module


def scene(**effects):
    pair = {
        "normal_module": 3.0, "face_width": 24.0, "centre_distance": 90.0,
        "pinion": {"teeth": 24}, "wheel": {"teeth": 36},
    }  # fmt: skip
    resolution = {"positions": 4, "segments": 40}
    return parse_scene({"pair": pair, "load": {"torque": 50.0}, "resolution": resolution, "effects": effects})


def test_the_effect_is_simulated_where_a_scene_names_it():
    plain = simulate(scene(tooth_bending={}, hertz={}))
    wavy = simulate(scene(tooth_bending={}, hertz={}, waviness={"amplitude": 0.5, "waves": 4}))
    assert np.all(wavy.transmission_error > plain.transmission_error)


def test_what_does_not_fit_is_refused():
    with pytest.raises(InputError, match=r"effects\.waviness\.waves = 40: must be at most 32"):
        scene(hertz={}, waviness={"amplitude": 0.5, "waves": 40})
    with pytest.raises(InputError, match="unknown key"):
        scene(hertz={}, waviness={"amplitude": 0.5, "wave": 4})


def test_its_test_passes():
    space: dict = {}
    exec(compile(TEST, "test_effects_waviness.py", "exec"), space)
    tests = [value for name, value in space.items() if name.startswith("test_")]
    assert tests
    for test in tests:
        test()
