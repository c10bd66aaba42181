"""Tables in HTML for notebooks, in the style the notebook gives its own."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

#: One row: a heading and its cells.
Row = tuple[str, Sequence[object]]


def html_table(title: str, heads: Sequence[str], rows: Sequence[Row]) -> str:
    """A table with a caption, column heads and rows; numbers with five digits, None as a dash."""
    head = "".join(f"<th>{escape(name)}</th>" for name in ("", *heads)) if heads else ""
    lines = [f"<table><caption>{escape(title)}</caption>", f"<thead><tr>{head}</tr></thead>" if head else "", "<tbody>"]
    for name, cells in rows:
        lines.append(f"<tr><th>{escape(name)}</th>{''.join(f'<td>{escape(shown(cell))}</td>' for cell in cells)}</tr>")
    return "".join((*lines, "</tbody></table>"))


def shown(value: object) -> str:
    """Text of a cell."""
    if value is None:
        return "–"
    return f"{value:.5g}" if isinstance(value, float) else str(value)
