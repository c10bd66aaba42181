"""Keys of input classes as Markdown: meaning and unit, default, what is allowed."""

from __future__ import annotations

from dataclasses import MISSING
from itertools import groupby

from gearbench.schema import keys, limits, parts, toml_value


def prose(owner: type) -> str:
    """Text of the docstring of ``owner`` before its parameters."""
    return _markdown(parts(owner)[0])


def key_tables(owner: type) -> str:
    """Tables of the keys of ``owner``, and of the tables below it; one line where it has none."""
    allowed = limits(owner) if keys(owner) else {}
    listed = [
        (key.name, key.meaning, _default(key.default), "a table" if key.table else allowed[key.name], key.table)
        for key in keys(owner).values()
    ]
    if not listed:
        return "\nThis table has no keys.\n"
    text, below = "\n| key | meaning | default | allowed |\n|---|---|---|---|\n", {}
    for (meaning, default, permitted, table), alike in groupby(listed, key=lambda row: row[1:]):
        names = ", ".join(f"`{row[0]}`" for row in alike)
        text += f"| {names} | {_markdown(meaning)} | {default} | {permitted} |\n"
        below |= {table: None} if table is not None else {}
    return text + "".join(f"\n{prose(table)} Its table:\n{key_tables(table)}" for table in below)


def _default(value: object) -> str:
    return "required" if value is MISSING else "–" if value is None else f"`{toml_value(value)}`"


def _markdown(text: str) -> str:
    """A docstring's text as Markdown."""
    return text.replace("``", "`").replace("*", r"\*").replace("|", r"\|")
