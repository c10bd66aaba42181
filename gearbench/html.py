"""Building blocks of HTML for offline reports and notebook tables."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable, Mapping, Sequence
from html import escape

from gearbench.lazy import Figure


def head(title: str) -> str:
    """Beginning of a page up to its styles; the page loads nothing and runs no scripts."""
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<title>{escape(title)}</title>"""


def table(names: Iterable[str], rows: Iterable[Sequence[str]]) -> str:
    """HTML table; the cells are HTML too."""
    top = "".join(f'<th scope="col">{cell}</th>' for cell in names)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"


def notebook_table(title: str, heads: Sequence[str], rows: Mapping[str, Iterable[object]]) -> str:
    """Table for notebooks: caption, column heads, and rows of cells by name; numbers have five digits."""
    head = "".join(f"<th>{escape(name)}</th>" for name in ("", *heads)) if heads else ""
    lines = [f"<table><caption>{escape(title)}</caption>", f"<thead><tr>{head}</tr></thead>" if head else "", "<tbody>"]
    for name, cells in rows.items():
        lines.append(f"<tr><th>{escape(name)}</th>{''.join(f'<td>{escape(_shown(cell))}</td>' for cell in cells)}</tr>")
    return "".join((*lines, "</tbody></table>"))


def _shown(value: object) -> str:
    if value is None:
        return "–"
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def picture(figure: Figure, caption: str, dpi: int = 100) -> str:
    """HTML figure with the embedded picture; the titles of its axes are the alternative text."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi)
    data = base64.b64encode(buffer.getvalue()).decode()
    alt = escape("; ".join(filter(None, (axis.get_title() for axis in figure.axes))).replace("\n", " "))
    return (
        f'<figure><img alt="{alt}" src="data:image/png;base64,{data}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )
