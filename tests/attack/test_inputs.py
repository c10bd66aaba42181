"""Attacked inputs through the command line: each ends as it must, see ``judge``."""

import pytest

from tests.attack.campaign import failures
from tests.support.campaign import many

KINDS = ("scene", "study", "rexs", "topography")


@pytest.mark.parametrize("kind", KINDS)
def test_attacked_inputs_end_in_a_result_or_in_one_line(kind):
    assert list(failures(kind, range(8))) == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_many_attacked_inputs(kind):
    count = many(300 if kind == "scene" else 100)
    assert list(failures(kind, range(1000, 1000 + count))) == []
