"""Keys of input classes as Markdown lists: meaning and unit, allowed values, default."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, is_dataclass
from typing import Any

import tomli_w
from pydantic import TypeAdapter

from gearbench.schema import Key, keys, parts

#: Limits that are as large only refuse slips, such as a wrong unit; pages leave them out, and 0 as the only limit.
LARGE = 1000.0
#: Tables that a page has shown, and where.
Shown = dict[type, str]


def prose(owner: type) -> str:
    """Text of the docstring of ``owner`` before its parameters."""
    return _markdown(parts(owner)[0])


def key_tables(owner: type, shown: Shown | None = None, here: str = "above") -> str:
    """Lists of the keys of ``owner``, and of the tables below it; one line where it has none.

    A table that the page has already is named by where it is: ``shown`` holds these, and gains those shown ``here``.
    """
    shown = {} if shown is None else shown
    allowed = limits(owner) if keys(owner) else {}
    alike: dict[str, list[Key]] = {}
    for key in keys(owner).values():
        alike.setdefault(key.meaning, []).append(key)
    if not alike:
        return "\nThis table has no keys.\n"
    text = "\n"
    below: dict[type, list[str]] = {}
    for meaning, together in alike.items():
        values: dict[str, list[str]] = {}
        for key in together:
            permitted = "" if key.table else allowed[key.name]
            named = "`" in permitted and all(word.strip("`") in meaning for word in permitted.split(", "))
            value = ", ".join(filter(None, ("" if named else permitted, _default(key.default))))
            values.setdefault(value, []).append(f"`{key.name}`")
            if key.table:
                below.setdefault(key.table, []).append(f"`{key.name}`")
        shared = [f"{', '.join(names)}: {value}" for value, names in values.items() if value]
        noted = next(iter(values)) if len(values) == 1 else "; ".join(shared)
        names = ", ".join(f"`{key.name}`" for key in together)
        text += f"- {names}: {_markdown(meaning)}{noted and f' ({noted})'}\n"
    rows = {(key.name, key.meaning) for key in keys(owner).values()}
    for table, holders in below.items():
        heading = f"\n**{', '.join(holders)}.** {prose(table)}"
        if heading in text:  # a table below has the same key, so that it is described already
            continue
        text += heading
        if table in shown:
            text += f" Keys: see {shown[table]}.\n"
        elif rows >= {(key.name, key.meaning) for key in keys(table).values()}:
            text += f" Keys: {', '.join(f'`{name}`' for name in keys(table))}, as above.\n"
        else:
            shown[table] = here
            text += f"\n{key_tables(table, shown, here)}"
    return text


def limits(kind: type) -> dict[str, str]:
    """What each key of an input class allows, in words."""
    schemas = TypeAdapter(kind).json_schema().get("properties", {})
    either = {name: schema.get("anyOf", (schema,)) for name, schema in schemas.items()}
    return {name: " or ".join(filter(None, map(_allowed, choices))) for name, choices in either.items()}


def _allowed(part: Mapping[str, Any]) -> str:
    if "enum" in part or "const" in part:
        return ", ".join(f"`{toml_value(value)}`" for value in part.get("enum", (part.get("const"),)))
    low, high = part.get("minimum", part.get("exclusiveMinimum")), part.get("maximum")
    low, high = (None if limit is None or abs(limit) >= LARGE else limit for limit in (low, high))
    kind = {"number": "", "integer": "whole, ", "boolean": "", "string": "", "array": "list"}
    text = kind.get(part.get("type", ""), "")
    if low is None or (low == 0 and high is None):
        return text.removesuffix(", ")
    above = "above " if "exclusiveMinimum" in part else ""
    return f"{text}{above}{low:g} to {high:g}" if high is not None else f"{text}{above or 'at least '}{low:g}"


def toml_value(value: object) -> str:
    """A value as a TOML file has it."""
    return tomli_w.dumps({"x": value}).removeprefix("x = ").replace("\n    ", " ").replace(",\n]", " ]").strip()


def _default(value: object) -> str:
    absent = value in (None, (), "") or is_dataclass(value)
    return "required" if value is MISSING else "" if absent else f"default `{toml_value(value)}`"


def _markdown(text: str) -> str:
    """A docstring's text as Markdown."""
    return text.replace("docs/theory.md", "[Theory](theory.md)").replace("``", "`").replace("*", r"\*")
