"""docs/tutorial_effect.md does what it says: its file is an effect, its line enters it, its test passes."""

from __future__ import annotations

import re
import subprocess
import sys

import numpy as np
import pytest

import gearbench.effects
from gearbench.effects import registry
from gearbench.errors import InputError
from gearbench.scene_file import parse_scene
from gearbench.simulation import simulate
from tests.pages import ROOT, blocks, follow

PAGE = "tutorial_effect.md"
EFFECT, TEST = (block.text for block in blocks(PAGE, "python"))
LINE = re.search(r'^\+ +"(\w+)": \("([\w.]+)", "(\w+)"\),$', blocks(PAGE, "diff")[0].text, flags=re.MULTILINE)
assert LINE is not None
NAME, MODULE, CLASS = LINE.groups()


@pytest.fixture(autouse=True)
def waviness(monkeypatch, tmp_path):
    """The file of the tutorial in a folder of the package, its line in the registry."""
    (tmp_path / "effects").mkdir()
    (tmp_path / "effects" / f"{MODULE.rsplit('.', 1)[1]}.py").write_text(EFFECT, encoding="utf-8")
    monkeypatch.setattr(gearbench.effects, "__path__", [*gearbench.effects.__path__, str(tmp_path / "effects")])
    monkeypatch.setitem(registry.EFFECTS, NAME, (MODULE, CLASS))
    yield
    sys.modules.pop(MODULE, None)
    vars(gearbench.effects).pop(NAME, None)


def scene(**effects):
    pair = {
        "normal_module": 3.0, "face_width": 24.0, "centre_distance": 90.0,
        "pinion": {"teeth": 24}, "wheel": {"teeth": 36},
    }  # fmt: skip
    resolution = {"positions": 4, "segments": 40}
    return parse_scene({"pair": pair, "load": {"torque": 50.0}, "resolution": resolution, "effects": effects})


def test_the_effect_is_simulated_where_a_scene_names_it():
    plain = simulate(scene(tooth_bending={}, hertz={}))
    assert MODULE not in sys.modules
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


def test_the_commands_of_the_page_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    done = list(follow(PAGE, programs=False))
    assert [block.language for block in done].count("sh") == 1
    assert (tmp_path / "wavy.nc").exists()


def test_files_of_the_page_pass_the_checks_of_the_house(tmp_path):
    (tmp_path / "waviness.py").write_text(EFFECT, encoding="utf-8")
    options = ["--config", str(ROOT / "pyproject.toml"), "--no-cache"]
    for command in (["check"], ["format", "--check"]):
        done = subprocess.run(
            [sys.executable, "-m", "ruff", *command, *options, tmp_path], capture_output=True, text=True
        )
        assert done.returncode == 0, done.stdout
