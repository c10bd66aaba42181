"""Tables of the reports that studies write."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def verdicts(checks: Iterable[tuple[str, bool]]) -> list[str]:
    """A line for each check of a study."""
    return [f"- {'holds' if holds else 'FAILS'}: {text}" for text, holds in checks]


def table(heads: Sequence[str], rows: Iterable[Iterable[str]], texts: int | None = None) -> list[str]:
    """Lines of a Markdown table; all columns but the first ``texts`` are aligned to the right, none by default."""
    left = len(heads) if texts is None else texts
    rule = "|" + "---|" * left + "---:|" * (len(heads) - left)
    return [f"| {' | '.join(heads)} |", rule, *(f"| {' | '.join(row)} |" for row in rows)]
