"""The stored errors over all gears in use: what docs/results_teeth.md says stands on them."""

from __future__ import annotations

import tomllib
from itertools import islice

import numpy as np
import pytest

from gearbench.scene_file import parse_scene
from studies.s05_tooth_models.data import ERRORS
from studies.s05_tooth_models.pairs import draw, in_use
from studies.s11_gears_in_use import checks, figures
from studies.s11_gears_in_use.data import DRAWN, MODELS
from studies.s11_gears_in_use.findings import BEST, LIMITS, drawn_later
from tests.support.stored import stored


@pytest.fixture
def kept():
    return stored("s11_gears_in_use")


def test_the_stored_pairs_are_those_that_are_drawn(kept):
    start = 0
    for seed, pairs in DRAWN.items():
        for i, each in enumerate(islice(draw(in_use, seed), pairs)):
            if i in (0, 1, 77, pairs - 1):
                assert parse_scene(tomllib.loads(str(kept["scene"].values[start + i]))) == each
        assert (kept["seed"].values[start : start + pairs] == seed).all()
        start += pairs
    assert list(kept["tooth_model"].values) == list(MODELS)
    assert kept.sizes["design"] == start == 230
    assert np.isfinite(kept["reference_error"]).all()


@pytest.mark.parametrize("part", ["mean", "peak_to_peak"])
def test_errors_are_those_of_the_page(kept, part):
    first = kept.isel(design=kept["seed"].values == 2017)
    for name in ERRORS:
        if part in name:
            assert abs(first.sel(tooth_model=BEST)[name].values).max() < {"mean": 0.6, "peak_to_peak": 2.9}[part]


@pytest.mark.parametrize(("part", "most"), [("mean", 0.6), ("peak_to_peak", 2.2)])
def test_errors_on_pairs_drawn_later(kept, part, most):
    later = drawn_later(kept).sel(tooth_model=BEST)
    error = np.max([abs(later[name].values) for name in ERRORS if part in name], axis=0)
    assert len(error) == 30
    assert error.max() < most


def test_shapes_agree(kept):
    mac = kept.sel(tooth_model=BEST)["mac"].values
    assert np.mean(mac >= LIMITS["mac"]) > 0.97
    assert mac.min() > 0.94
    assert np.count_nonzero(drawn_later(kept).sel(tooth_model=BEST)["mac"].values >= LIMITS["mac"]) == 28


def test_findings_and_figures_come_from_the_stored_pairs(kept, tmp_path):
    found = checks(kept)
    assert ["of 230 pairs" in text for text, _ in found] == [True] * 5 + [False] * 5
    assert ["of 30 pairs" in text for text, _ in found] == [False] * 5 + [True] * 5
    assert len(checks(kept.isel(design=slice(0, 1)))) == 5
    figures(kept, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"errors_in_use.png", "helix_angle.png"}
