"""The list of selected designs as CSV and Markdown text."""

from __future__ import annotations

import csv
import io
import re
from typing import Any

from gearbench.optimisation.select import Selection


def csv_text(selection: Selection, top: int | None = None) -> str:
    """One line for each design, best first; numbers to full precision, the names of the quantities in the first line.

    Units are those of the stored optimisation: µm, %, mm, °, MPa, N.
    """
    table = selection.table(top)
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(map(_no_formula, table))
    writer.writerows([_no_formula(_plain(value)) for value in row] for row in zip(*table.values(), strict=True))
    return out.getvalue()


def markdown_text(selection: Selection, top: int | None = None) -> str:
    """Heading, conditions, and a table of the designs, best first."""
    designs, table = selection.designs, selection.table(top)
    lines = [f"# {markdown_name(designs.study.name) or 'study'}: selected designs", ""]
    lines += [f"- {condition}: {left} designs left" for condition, left in selection.steps]
    lines.append(f"- support of the teeth: {designs.support(selection.numbers[:top]) or '–'}")
    lines += ["", f"Ranked by {ranking_text(selection)}, each from its best to its worst on the front.", ""]
    heads = [heading(selection, name) for name in table]
    lines.append("| " + " | ".join(map(_cell, heads)) + " |")
    lines.append("|" + " ---: |" * len(heads))
    for row in zip(*table.values(), strict=True):
        lines.append("| " + " | ".join(_cell(shown(_plain(value))) for value in row) + " |")
    return "\n".join(lines) + "\n"


def ranking_text(selection: Selection) -> str:
    """The terms of the score with their weights."""
    text = " + ".join(name if w == 1 else f"{w:g} {name}" for name, w in selection.ranking.items())
    return text.replace("+ -", "− ")


def heading(selection: Selection, name: str) -> str:
    """Name of a column and its unit."""
    unit = selection.designs.unit(name) if name in selection.designs.names else ""
    return f"{name} [{unit}]" if unit else name


def shown(value: Any) -> str:
    """A value as people read it: five digits."""
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def markdown_name(text: str) -> str:
    """A name as Markdown shows it letter by letter."""
    return re.sub(r"([\\`*\[\]<>|])", r"\\\1", " ".join(text.split()))


def _no_formula(value: Any) -> Any:
    """Text that a spreadsheet would take for a formula behind an apostrophe; numbers as they are."""
    return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r")) else value


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
