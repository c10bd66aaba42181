"""Helpers for the files of studies: tables in reports, and stored Datasets of parts that take long."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from gearbench.lazy import xr
from gearbench.results.netcdf import open_result, save


def verdicts(checks: Iterable[tuple[str, bool]]) -> list[str]:
    """One line per check of a study."""
    return [f"- {'holds' if holds else 'FAILS'}: {text}" for text, holds in checks]


def table(heads: Sequence[str], rows: Iterable[Iterable[str]], texts: int | None = None) -> list[str]:
    """Lines of a Markdown table; columns after the first ``texts`` are right-aligned, by default none."""
    left = len(heads) if texts is None else texts
    rule = "|" + "---|" * left + "---:|" * (len(heads) - left)
    return [f"| {' | '.join(heads)} |", rule, *(f"| {' | '.join(row)} |" for row in rows)]


def kept(path: Path | None, compute: Callable[[], xr.Dataset]) -> xr.Dataset:
    """Return the result of ``compute``: read from ``path`` if it is there, else computed and saved there."""
    if path is None:
        return compute()
    if not path.exists():
        save(compute(), path)
    return open_result(path)
