"""Attacked inputs through the command line: each ends as it must, see ``judge``."""

import pytest

from tests.attack.campaign import failures

KINDS = ("scene", "study", "rexs", "topography", "result")


@pytest.mark.parametrize("kind", KINDS)
def test_attacked_inputs_end_in_a_result_or_in_one_line(kind):
    assert list(failures(kind, range(300))) == []


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "count"), [(kind, 10_000 if kind == "scene" else 2000) for kind in KINDS])
def test_very_many_attacked_inputs(kind, count):
    assert list(failures(kind, range(1000, 1000 + count))) == []
