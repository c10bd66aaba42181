"""Dotted keys such as "pair.pinion.teeth": describe, read and set values inside input objects.

A part of a key names a field of an input class, or an item of a list or of a table of tables, as in "gears.sun.teeth".
An item of a list is named by its number from 0, as in "waviness.pinion.0.amplitude", or by its name, as effects are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import is_dataclass
from typing import Any

from gearbench.errors import InputError, naming, one_of
from gearbench.schema import Key, changed, keys, read


def key_at(kind: type, path: str) -> Key | None:
    """Find the key of a value by its path below an input class; None if the path names a table or a list of tables.

    Items of a list of values have the key of the list.

    Raises
    ------
    InputError
        If there is no such key; names the allowed keys.
    """
    name, _, rest = path.partition(".")
    if name not in keys(kind):
        raise InputError("", path, f"must be a key of a scene: {', '.join(keys(kind))}")
    key = keys(kind)[name]
    if key.items and (key.table is None or rest.partition(".")[0] not in keys(key.table)):
        rest = rest.partition(".")[2]  # skip the name or number of the item
    if key.table is None:
        return None if rest else key
    return key_at(key.table, rest) if rest else None


def value_at(table: Any, path: str) -> Any:
    """Read the value at the dotted key ``path`` below ``table``; None if there is none."""
    for part in path.split("."):
        if isinstance(table, Mapping):
            table = table.get(part)
        elif isinstance(table, list | tuple):
            number = _number(table, part)
            table = None if number is None else table[number]
        else:
            fields = keys(type(table)) if is_dataclass(table) else ()
            table = getattr(table, part) if part in fields else None
    return table


def with_values(
    table: Any, values: Mapping[str, Any], class_of: Callable[[str], type] | None = None, at: str = ""
) -> Any:
    """Return ``table`` with ``values`` at dotted keys, all set at once; other parts stay the same objects.

    Parameters
    ----------
    table
        Input object, or a table, list or tuple of them.
    values
        Values by dotted key. A missing table is made from the values below it.
    class_of
        Function from a dotted key to the input class of a missing table, needed if its field does not tell the class.
    at
        Dotted key of ``table``, for messages.

    Raises
    ------
    InputError
        If a value is not allowed, or there is no such key or item; names the dotted key.
    """
    below: dict[str, dict[str, Any]] = {}
    for path, value in values.items():
        name, _, rest = path.partition(".")
        below.setdefault(name, {})[rest] = value

    def new(old: Any, name: str, kind: type | None) -> Any:
        """Make the replacement of the item or field ``old``."""
        inner, inner_path = below[name], f"{at}.{name}".strip(".")
        if "" in inner:
            return inner[""]
        if old is None and (made := kind or (class_of and class_of(inner_path))):
            return read(made, with_values({}, inner), inner_path)
        return with_values({} if old is None else old, inner, class_of, inner_path)

    if isinstance(table, Mapping):
        return {**table, **{name: new(table.get(name), name, None) for name in below}}
    if isinstance(table, list | tuple):
        items = list(table)
        for name in below:
            number = _number(items, name)
            if number is not None:
                items[number] = new(items[number], name, None)
            elif class_of is not None and not name.isdecimal() and all(hasattr(item, "name") for item in items):
                items.append(new(None, name, None))
            else:
                allowed = f"must be an item of the list, counted from 0 to {len(items) - 1}"
                raise InputError(".".join((at, next(iter(values)))), name, allowed)
        return type(table)(items)
    known = keys(type(table))
    if unknown := [name for name in below if name not in known]:
        raise InputError(f"{at}.{unknown[0]}".strip("."), "unknown key", one_of(unknown[0], known))
    parts = {name: new(getattr(table, name), name, known[name].table) for name in below}
    with naming(below=at):
        return changed(table, **parts)


def _number(items: Sequence[Any], part: str) -> int | None:
    """Index of the list item that ``part`` of a dotted key names; None if there is none."""
    if part.isdecimal():
        return int(part) if int(part) < len(items) else None
    return next((i for i, item in enumerate(items) if getattr(item, "name", None) == part), None)
