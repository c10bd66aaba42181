"""Keys of an effect's table, for the documentation: meaning and unit, default, what is allowed."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from dataclasses import MISSING, fields, is_dataclass
from itertools import groupby
from typing import Any, get_args, get_type_hints

from pydantic import TypeAdapter


def prose(owner: type) -> str:
    """What the docstring of ``owner`` says before its parameters, as Markdown."""
    return _markdown(_parts(owner)[0])


def key_tables(owner: type) -> str:
    """Markdown tables of the keys of ``owner``, and of the tables below it; nothing where it has none."""
    rows, below = "", {}
    for (meaning, default, allowed, nested), keys in groupby(_keys(owner), key=lambda key: key[1:]):
        names = ", ".join(f"`{key[0]}`" for key in keys)
        rows += f"| {names} | {_markdown(' '.join(meaning.split()))} | {default} | {allowed} |\n"
        below |= {nested: None} if nested is not None else {}
    if not rows:
        return "\nThis table has no keys.\n"
    text = f"\n| key | meaning | default | allowed |\n|---|---|---|---|\n{rows}"
    return text + "".join(f"\n{prose(table)} Its table:\n{key_tables(table)}" for table in below)


def _keys(owner: type) -> Iterator[tuple[str, str, str, str, type | None]]:
    """Name, meaning, default, what is allowed, and the class of a table below, of each key."""
    meanings, hints = _parts(owner)[1], get_type_hints(owner)
    schema = TypeAdapter(owner).json_schema()
    for field in fields(owner):
        name = field.name
        nested = next(
            (a for a in (hints[name], *get_args(hints[name])) if isinstance(a, type) and is_dataclass(a)), None
        )
        absent = field.default in (None, ()) or is_dataclass(field.default)
        default = "required" if field.default is MISSING else "–" if absent else _code(field.default)
        yield name, meanings[name], default, "a table" if nested else _allowed(schema["properties"][name]), nested


def _parts(owner: type) -> tuple[str, dict[str, str]]:
    """Text of a numpy docstring before its parameters, and what it says of each of them."""
    text, _, rest = (inspect.getdoc(owner) or "").partition("\n\nParameters\n----------\n")
    meanings = {}
    listed = rest.split("\n\nRaises\n")[0]
    for names, meaning in re.findall(r"^(\S.*)\n((?:    .*\n?|\n)+)", listed, flags=re.MULTILINE):
        meanings |= dict.fromkeys(names.split(", "), meaning.strip())
    return text, meanings


def _allowed(schema: dict[str, Any]) -> str:
    """What a JSON schema allows, in words."""
    either = [part for part in schema.get("anyOf", (schema,)) if part.get("type") != "null"]
    return " or ".join(filter(None, map(_one, either)))


def _one(part: dict[str, Any]) -> str:
    if "enum" in part or "const" in part:
        return ", ".join(_code(value) for value in part.get("enum", (part.get("const"),)))
    low, high = part.get("minimum", part.get("exclusiveMinimum")), part.get("maximum")
    kind = {"number": "", "integer": "whole, ", "boolean": "true or false", "string": "text", "array": "list"}
    text = kind.get(part.get("type", ""), "")
    if low is None:
        return text.removesuffix(", ")
    above = "above " if "exclusiveMinimum" in part else ""
    return f"{text}{above}{low:g} to {high:g}" if high is not None else f"{text}{above or 'at least '}{low:g}"


def _code(value: object) -> str:
    return f"`{toml(value)}`"


def toml(value: object) -> str:
    """A value as a scene file has it."""
    import tomli_w

    return tomli_w.dumps({"x": value}).removeprefix("x = ").replace("\n    ", " ").replace(",\n]", " ]").strip()


def _markdown(text: str) -> str:
    """A docstring's text as Markdown."""
    return text.replace("``", "`").replace("*", r"\*").replace("|", r"\|")
