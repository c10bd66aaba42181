"""Table 2 and the fronts off the line: the stored Dataset, its limits, and what docs/results_contact.md says of it."""

import numpy as np
import pytest

from studies.s06_paper_fronts.search import study as plate_study
from studies.s12_fronts_off_line.data import NAMES, judged, scene
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
