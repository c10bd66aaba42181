"""The first pair of the README, and two undercut gears, against finite elements of whole gears."""

from __future__ import annotations

import tomllib

import pytest

from gearbench.scene_file import parse_scene
from gearbench.validation.comparison import compare
from gearbench.validation.judge import JUDGED
from tests.support.paths import ROOT

README = ROOT / "README.md"


@pytest.mark.slow
def test_first_pair_of_the_readme_validates_within_two_percent():
    first = README.read_text(encoding="utf-8").split("```toml\n")[1].split("```")[0]
    found = compare(parse_scene(tomllib.loads(first)), 0.01)
    # asked for: 2 %; seen: mean STE −0.39, peak-to-peak STE 0.79, mean k 0.32, peak-to-peak k 0.90 %
    for name in JUDGED:
        assert abs(float(found[name])) < 1.5, name
    assert float(found["mac_worst"].min()) > 0.995


@pytest.mark.slow
def test_two_undercut_gears_validate_within_one_percent():
    """11/15 teeth without profile shift; 6 × 7 functions were 1.1 % off in the means, 1.6 % from peak to peak."""
    pair = {"normal_module": 2.0, "face_width": 20.0, "centre_distance": 26.0}
    members = {
        name: {"teeth": teeth, "profile_shift": 0.0, "bore_diameter": 0.4 * teeth}
        for name, teeth in (("pinion", 11), ("wheel", 15))
    }
    effects = {"tooth_bending": {"model": "solid"}, "gear_body": {}, "hertz": {}}
    found = compare(parse_scene({"pair": pair | members, "load": {"torque": 13.0}, "effects": effects}), 0.005)
    for name in JUDGED:
        assert abs(float(found[name])) < (0.5 if "mean" in name else 1.0), name
