"""Phasing of a planetary set: the stored Dataset, and what docs/results_planetary.md says of it."""

import re

import numpy as np
import pytest
import xarray as xr

from studies.s13_planetary_phasing import checks, scene
from studies.s13_planetary_phasing.data import ARRANGEMENTS, RESPONSES, answers
from studies.s13_planetary_phasing.findings import factor, value
from tests.support.paths import ROOT
from tests.support.stored import stored

#: Columns of the first table: response, sun.
SHOWN = (
    ("train_transmission_error", "floating"),
    ("train_transmission_error", "held"),
    ("sun_motion", "floating"),
    ("sun_force", "held"),
)


@pytest.fixture
def kept() -> xr.Dataset:
    return stored("s13_planetary_phasing")


def test_stored_sets_keep_their_limits(kept):
    found = checks(kept)
    assert len(found) == 14
    for text, holds in found:
        assert holds, text


def test_a_set_whose_harmonic_does_not_cancel_is_found(kept):
    worse = kept.copy(deep=True)
    at = {"arrangement": "sequential", "sun": "held", "statistic": "nominal"}
    worse["value"].loc[at | {"response": "train_transmission_error_amplitude_2"}] = 0.01
    assert [text for text, holds in checks(worse) if not holds] == [
        "sequential: orders [1, 2, 3, 5] of train_transmission_error cancel without errors"
    ]


def test_the_page_shows_the_stored_numbers(kept):
    """Rows of both tables: RMS values without errors and on average, K_γ on average and of 99 of 100."""
    page = (ROOT / "docs" / "results_planetary.md").read_text(encoding="utf-8")
    for arrangement in ARRANGEMENTS:
        *_, row = (line for line in page.split("## K_γ")[0].splitlines() if line.startswith(f"| {arrangement} |"))
        shown = [float(x) for x in re.findall(r"[\d.]+", row)]
        stored = [
            value(kept, arrangement, sun, f"{name}_rms", statistic)
            for name, sun in SHOWN
            for statistic in ("nominal", "mean", "q95")
        ]
        np.testing.assert_allclose(shown, stored, rtol=6e-3, atol=1e-9)  # three digits; 0 is rounding
    ripples = [value(kept, arrangement, "floating", "carrier_torque_rms") for arrangement in ARRANGEMENTS]
    np.testing.assert_allclose(ripples, [2.1, 1.0, 1.4], atol=0.05)
    for planets in (3, 4, 5):
        row = next(line for line in page.splitlines() if line.startswith(f"| {planets} |"))
        shown = [float(x) for cell in row.split("|")[2:4] for x in re.findall(r"[\d.]+", cell)]
        stored = [factor(kept, planets, support, each) for support in (0.0, 20.0) for each in ("mean", "q99")]
        np.testing.assert_allclose(shown, stored, atol=0.005001)


@pytest.mark.slow
def test_a_set_is_as_it_was_stored(kept):
    found = answers(scene(), RESPONSES, kept.attrs["samples"])
    at = {"arrangement": "in phase", "sun": "floating"}
    np.testing.assert_allclose(found, kept["value"].sel(at), rtol=1e-3, atol=1e-6)
