"""Tables on the terminal: plain columns, separated by two blanks."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from gearbench.errors import escaped


def print_columns(
    title: str, heads: Sequence[str], rows: Sequence[Sequence[str]], left: Collection[int] = (0,)
) -> None:
    """Print ``rows`` below ``heads``, which may have several lines; the columns ``left`` are left-aligned."""
    print(escaped(title))
    tall = [head.split("\n") for head in heads]
    lines = [[head[i] if i < len(head) else "" for head in tall] for i in range(max(map(len, tall)))]
    lines += [list(map(escaped, row)) for row in rows]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for line in lines:
        cells = (c.ljust(w) if i in left else c.rjust(w) for i, (c, w) in enumerate(zip(line, widths, strict=True)))
        print("  ".join(cells).rstrip())
