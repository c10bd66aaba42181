"""docs/stability.md lists the cases there are, with the digits asserted of them, and claims no fewer than measured."""

from __future__ import annotations

import re

from tests.stability.catalogue import CASES
from tests.stability.problems import PROBLEMS
from tests.stability.report import HEAD, TARGET

ROW = re.compile(
    r"^\| (?P<name>[^|]+) \| (?P<why>[^|]+) \|(?P<numbers>[^|]+\|[^|]+\|[^|]+)\|(?P<loss>[^|]+)\|(?P<asserted>[^|]+)\|"
)


def test_the_page_is_up_to_date_in_all_but_the_last_digit():
    page = TARGET.read_text(encoding="utf-8")
    assert page.startswith(HEAD), "run: python -m tests.stability.report"
    rows = [m for m in map(ROW.match, page.splitlines()) if m and m["name"] != "case" and "---" not in m["name"]]
    cases = [*CASES.values(), *PROBLEMS.values()]
    assert [m["name"] for m in rows] == [c.name for c in cases], "run: python -m tests.stability.report"
    for m, case in zip(rows, cases, strict=True):
        assert m["why"] == case.why
        assert float(m["asserted"]) == case.digits
        assert min(float(x) for x in m["numbers"].split("|")) >= case.digits
        assert float(m["loss"]) < 16
