"""Random internal pairs against finite elements: the stored errors, the page and the table, and some pairs again."""

import csv
import tomllib
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from gearbench.scene import Load, Resolution
from gearbench.scene_file import parse_scene
from gearbench.simulation import simulate
from studies.s05_tooth_models.data import ERRORS
from studies.s05_tooth_models.pairs import draw
from studies.s14_internal_pairs import checks, figures
from studies.s14_internal_pairs.data import PAIRS, SEED, pair_errors, scene
from studies.s14_internal_pairs.findings import TABLE, limit
from studies.s14_internal_pairs.pairs import RIMS, SUPPORTS, internal, support_of
from tests.support.campaign import many
from tests.support.paths import ROOT
from tests.support.stored import stored


@pytest.fixture
def kept():
    return stored("s14_internal_pairs")


def test_pairs_are_drawn_from_the_whole_range():
    drawn = list(islice(draw(internal, SEED), PAIRS))
    assert {support_of(each) for each in drawn} == set(SUPPORTS)
    assert 0.3 < np.mean([each.pair.helix_angle > 0 for each in drawn]) < 0.7


def test_the_stored_pairs_are_those_that_are_drawn(kept):
    drawn = list(islice(draw(internal, SEED), PAIRS))
    assert [parse_scene(tomllib.loads(str(text))) for text in kept["scene"].values] == drawn
    assert RIMS[0] - 0.01 < kept["rim"].min() < 1.4
    assert 5.5 < kept["rim"].max() < RIMS[1] + 0.01


def test_errors_are_within_the_limits_and_in_the_table(kept, tmp_path):
    for text, holds in checks(kept):
        assert holds, text
    figures(kept, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {TABLE, "internal_pairs.png"}
    folders = tmp_path, ROOT / "docs" / "data"
    written, page = (list(csv.reader((folder / TABLE).read_text(encoding="utf-8").splitlines())) for folder in folders)
    assert written == page


def test_close_flanks_are_followed_as_far_as_they_touch():
    """39 teeth in 53: they touch half a base pitch beyond the path, where the default phases must know of it."""
    close = scene(8)
    held = replace(close.pair, wheel=replace(close.pair.wheel, support=None))
    close = replace(close, pair=held, load=Load(torque=100.0))
    found, dense = simulate(close), simulate(replace(close, resolution=Resolution(positions=600)))
    assert float(found["transmission_error_mean"]) == pytest.approx(float(dense["transmission_error_mean"]), rel=1e-4)
    for name in ("transmission_error_peak_to_peak", "mesh_stiffness_peak_to_peak"):
        assert float(found[name]) == pytest.approx(float(dense[name]), rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(min(many(10), PAIRS)))
def test_solid_teeth_of_an_internal_pair_are_those_of_finite_elements(number):
    """The first ten pairs, as the program is today; CAMPAIGN=6 runs all."""
    found = pair_errors(scene(number))
    for name in ERRORS:
        assert abs(float(found[name])) < limit(name), name
