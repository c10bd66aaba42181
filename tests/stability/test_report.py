"""docs/stability.md lists the cases there are, with the digits asserted of them, and claims no fewer than measured."""

from __future__ import annotations

import re

from tests.stability.catalogue import CASES
from tests.stability.models import BODIES, SOLIDS
from tests.stability.problems import PROBLEMS
from tests.stability.report import BODY, HEAD, SOLID, TARGET

#: Digits and then, in the tables of contact, steps.
FIELDS = r"^\| (?P<name>[^|]+) \| (?P<why>[^|]+) \|(?P<numbers>%s)\|(?P<loss>[^|]+)\|(?P<asserted>[^|]+)\|%s$"


def rows(page: str, numbers: int, rest: str = "") -> list[re.Match[str]]:
    """Rows of tables with so many columns of digits."""
    pattern = re.compile(FIELDS % (r"\|".join([r"[ .\d]+"] * numbers), rest))
    return [m for m in map(pattern.match, page.splitlines()) if m]


def check(found: list[re.Match[str]], cases: list) -> None:
    assert [m["name"] for m in found] == [c.name for c in cases], "run: python -m tests.stability.report"
    for m, case in zip(found, cases, strict=True):
        assert m["why"] == case.why
        assert float(m["asserted"]) == case.digits
        assert min(float(x) for x in m["numbers"].split("|")) >= case.digits
        assert float(m["loss"]) < 16


def test_the_page_is_up_to_date_in_all_but_the_last_digit():
    page = TARGET.read_text(encoding="utf-8")
    assert page.startswith(HEAD), "run: python -m tests.stability.report"
    assert SOLID in page, "run: python -m tests.stability.report"
    assert BODY in page, "run: python -m tests.stability.report"
    contact, models = page.split(SOLID)
    solids, bodies = models.split(BODY)
    check(rows(contact, 3, r" \d+ \|"), [*CASES.values(), *PROBLEMS.values()])
    check(rows(solids, 4), list(SOLIDS.values()))
    check(rows(bodies, 1), list(BODIES.values()))
