"""Table 2 and the fronts off the line: the stored Dataset, its limits, and what docs/results_contact.md says of it."""

import numpy as np
import pytest

from studies.s06_paper_fronts.search import TOOLS
from studies.s06_paper_fronts.search import study as plate_study
from studies.s12_fronts_off_line.data import NAMES, judged, scene
from studies.s12_fronts_off_line.findings import change, measures
from tests.support.stored import stored


@pytest.fixture
def kept():
    return stored("s12_fronts_off_line")


def test_rows_are_as_they_were_stored(kept):
    """Two of them, as the models are today: a short path, two pairs and more."""
    for name in ("1", "7"):
        number = list(kept["row"].values).index(name)
        found = judged(scene(number), plate_study(1).robustness)
        stored = np.array([kept[f"row_{each}"].values[number] for each in NAMES])
        np.testing.assert_allclose(found, stored, rtol=1e-3)


def test_the_page_says_what_the_stored_gears_show(kept):
    """Of contact ratios below 1.25 the fluctuation of the stiffness grows by a third and more, m_ste falls."""
    low = kept["row_contact_ratio"].values < 1.25
    assert low.sum() == 4
    for model, least, most in (("plate", 33, 75), ("solid", 66, 121)):
        m_k = change(kept, "row", "m_k", model)
        assert (round(m_k[low].min()), round(m_k[low].max())) == (least, most)
        assert np.abs(m_k[~low]).max() < 18
        assert change(kept, "row", "m_ste", model).max() < 2
    remain = [[measures(kept, "design", tool, "plate")[key] for tool in TOOLS] for key in _COUNTS]
    assert remain == [[67, 65, 64], [12, 40, 37]]
    ranks = [measures(kept, "design", tool, "plate")["rank correlation of m_k"] for tool in TOOLS]
    np.testing.assert_allclose(ranks, [0.065, 0.784, 0.824], atol=0.001)


_COUNTS = ("not dominated on the line", "of these, not dominated off the line")
