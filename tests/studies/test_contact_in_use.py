"""Gears in use against contact finite elements of finite width: the stored curves, and the fast teeth as they are."""

import numpy as np
import pytest

from fem_reference.contact.cycle import halfway
from gearbench.results.netcdf import open_result, save
from studies.s09_contact_in_use import checks
from studies.s09_contact_in_use.data import collected, curve, residual, scenes, with_models
from studies.s09_contact_in_use.findings import names
from tests.support.stored import stored


@pytest.fixture
def kept():
    return stored("s09_contact_in_use")


def test_stored_curves_keep_their_limits(kept):
    """All but the error bar of drawn_11, which was measured before meshes were refined for it."""
    failed = [text for text, holds in checks(kept) if not holds]
    assert [text.split(" (")[0] for text in failed] == ["drawn_11: error bar of contact finite elements 1.26 %"]


def test_the_page_says_what_the_stored_curves_show(kept):
    """Greatest residuals, and the pairs on which the fast teeth are nearer with contact on the line."""
    off = {model: residual(kept).sel(model=model).values for model in kept["model"].values}
    assert round(float(off["fast_off_line"].max()), 2) == 0.68
    nearer = [name for name, a, b in zip(names(kept), off["fast"], off["fast_off_line"], strict=True) if a < b]
    assert nearer == ["fzg_c", "drawn_4"]
    assert len(names(kept)) == 22


def test_measured_pairs_are_those_of_the_study(kept):
    texts = {scene.name: scene.to_toml() for scene in scenes()}
    found = dict(zip(names(kept), kept["scene"].values, strict=True))
    assert len(texts) == 24
    assert {name: texts[name] for name in found} == {name: str(text) for name, text in found.items()}


@pytest.mark.parametrize("name", ["hcr_spur", "nasa_28"])
def test_relieved_spur_pairs_miss_nothing_at_kinks(kept, name):
    """Fast teeth as they are today: where a relief begins they miss no more than elsewhere (0.2 µm before)."""
    row = names(kept).index(name)
    here = kept.isel(design=row)
    scene = next(scene for scene in scenes() if scene.name == name)
    found = curve(scene, "fast_off_line", halfway(here, scene.pair)).transmission_error
    off = (found - here.transmission_error.values) / float(here.transmission_error.mean())
    assert np.sqrt((off**2).mean()) < 0.005
    assert np.ptp(off) < 0.006


@pytest.mark.slow
def test_rows_that_were_kept_are_joined(kept, tmp_path):
    """In the order of the study, with the models as they are today."""
    row = kept.isel(design=[names(kept).index("spur")])
    save(row.isel(design=0), tmp_path / "00.nc")
    found = collected([with_models(open_result(tmp_path / "00.nc"))])
    assert names(found) == ["spur"]
    np.testing.assert_allclose(residual(found), residual(collected([row.isel(design=0)])), rtol=0.05)
