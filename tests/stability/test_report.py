"""docs/data/stability.csv lists the cases there are with the digits asserted of them; the page quotes its extremes."""

from __future__ import annotations

import csv

import pytest

from tests.stability.catalogue import CASES
from tests.stability.models import BODIES, SOLIDS
from tests.stability.problems import PROBLEMS
from tests.stability.report import COLUMNS, DIGITS, TARGET
from tests.support.paths import ROOT

KINDS = {"scene": CASES, "contact problem": PROBLEMS, "solid tooth": SOLIDS, "gear body": BODIES}


@pytest.fixture(scope="module")
def table() -> list[dict[str, str]]:
    with TARGET.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_the_table_has_every_case_and_claims_no_more_than_it_measured(table):
    assert tuple(table[0]) == COLUMNS
    for kind, cases in KINDS.items():
        rows = [row for row in table if row["kind"] == kind]
        assert [row["case"] for row in rows] == [case.name for case in cases.values()], (
            "python -m tests.stability.report"
        )
        for row, case in zip(rows, cases.values(), strict=True):
            assert row["why_it_is_hard"] == case.why
            assert float(row["asserted_digits"]) == case.digits
            assert min(float(row[name]) for name in DIGITS if row[name]) >= case.digits


def test_the_page_quotes_the_fewest_digits_of_each_kind(table):
    page = (ROOT / "docs" / "stability.md").read_text(encoding="utf-8")
    for kind in KINDS:
        rows = [row for row in table if row["kind"] == kind]
        fewest = [min((float(row[name]) for row in rows if row[name]), default=None) for name in DIGITS]
        cells = " | ".join("–" if value is None else f"{value:.1f}" for value in fewest)
        assert f"| {kind} | {len(rows)} | {cells} |" in page
