"""Hostile values and seeded mutations of tables, text and bytes."""

from __future__ import annotations

import datetime
from collections.abc import Iterator, Mapping
from typing import Any

from numpy.random import Generator

#: Names that are markup, formulas, paths or control characters somewhere.
NAMES = (
    "", " ", "a [/b] c", "[red]x[/red]", "<img src=x onerror=alert(1)>", "</script><script>alert(1)</script>",
    "$\\frac{$", "$$x$$<img onerror=alert(1)>", "=cmd|' /C calc'!A0", "@SUM(1)", "../../etc/passwd", "/dev/full",
    "a\x00b", "\x1b[31mred", "line\nbreak", "\r\tx", "\u202egnp.exe", "𝔘𝔫𝔦", "%n%s{0}{x}", "x" * 5000, "|a|b|", "`a`",
    "nan", "inf", "1e5", "spur", ":smile:",
)  # fmt: skip
NUMBERS = (
    0, -1, 1, 2, 3, 0.0, -0.0, 1e-300, 5e-324, -1e-9, 1e-6, 1e9, 1e15, 1e100, 1e300, 1.7e308, -1e300, 2**31, 2**63,
    2**64, 10**400, -(10**400), float("nan"), float("inf"), -float("inf"), 89.99, 90.0, 180.0, 0.5, 0.499999,
)  # fmt: skip


def value(rng: Generator, old: Any) -> Any:
    """Something to stand in the place of ``old``: often near it, often not even of its type."""
    kind = rng.random()
    # a number of 400 digits may stand there already; ``factor`` does not take it
    if kind < 0.6 and isinstance(old, int | float) and not isinstance(old, bool) and not abs(old) > 1e300:
        factor = float(rng.choice([1 + 1e-9, 0.999, 1.05, 0.8, 1.3, 2, 0.1, 10, 1e3, 1e-3, -1]))
        return round(old * factor) if isinstance(old, int) else old * factor
    if kind < 0.8:
        return NUMBERS[rng.integers(len(NUMBERS))]
    if kind < 0.9:
        return NAMES[rng.integers(len(NAMES))].replace("\x00", "\x01")  # TOML has no NUL
    odd = (True, [], {}, [1, "a"], [[[]]], {"x": {"y": 1}}, datetime.date(2024, 2, 30 - 1), [old, old], [old], -7)
    return odd[rng.integers(len(odd))]


def tables(rng: Generator, given: Mapping[str, Any], known: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """``given`` with one to three changes; ``known`` holds further tables by dotted name that may be put in."""
    changed = copy(given)
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        _change(rng, changed, known)
    return changed


def copy(item: Any) -> Any:
    """A deep copy of nested tables."""
    if isinstance(item, Mapping):
        return {key: copy(below) for key, below in item.items()}
    return [copy(below) for below in item] if isinstance(item, list) else item


def _change(rng: Generator, table: dict[str, Any], known: Mapping[str, Mapping[str, Any]]) -> None:
    leaves, kind = list(_leaves(table)), rng.random()
    if rng.random() < 0.85:
        leaves = [(holder, key) for holder, key in leaves if not isinstance(holder[key], dict)]
    if not leaves:
        return
    holder, key = leaves[rng.integers(len(leaves))]
    if kind < 0.6:
        holder[key] = value(rng, holder[key])
    elif kind < 0.65:
        del holder[key]
    elif kind < 0.7 and isinstance(holder, dict):
        holder[f"{key}{rng.choice(['_', 's', '.', ' ', 'ü'])}"] = holder.pop(key)
    elif kind < 0.75 and isinstance(holder, dict):
        holder[NAMES[rng.integers(len(NAMES))].replace("\x00", "")] = value(rng, holder[key])
    else:
        name = list(known)[rng.integers(len(known))]
        below = table
        *parts, last = name.split(".")
        for part in parts:
            below = below.setdefault(part, {})
            if not isinstance(below, dict):
                return
        below[last] = copy(known[name])


def _leaves(item: Any) -> Iterator[tuple[Any, Any]]:
    """(table or list, key or index) of every value, tables themselves included."""
    pairs = item.items() if isinstance(item, dict) else enumerate(item)
    for key, below in list(pairs):
        yield item, key
        if isinstance(below, dict | list):
            yield from _leaves(below)


def data(rng: Generator, whole: bytes) -> bytes:
    """Bytes with a few flipped, cut off, doubled, overwritten or put in."""
    found = bytearray(whole)
    kind = rng.integers(6)
    at, length = int(rng.integers(max(len(found), 1))), int(rng.integers(1, 40))
    if kind == 0:
        for _ in range(rng.integers(1, 6)):
            if found:
                found[rng.integers(len(found))] ^= 1 << int(rng.integers(8))
    elif kind == 1:
        del found[at:]
    elif kind == 2:
        del found[at : at + length]
    elif kind == 3:
        found[at:at] = found[at : at + length] * int(rng.integers(1, 50))
    elif kind == 4:
        found[at : at + length] = rng.integers(0, 256, length, dtype="uint8").tobytes()
    else:
        found[at:at] = (b"\x00", b"\xff\xfe", b"[" * 3000, b"9" * 5000, b"{a=" * 2000, b"\xef\xbb\xbf")[rng.integers(6)]
    return bytes(found)


def csv(rng: Generator, whole: bytes) -> bytes:
    """A table of numbers with cells, rows or bytes changed."""
    if rng.random() < 0.3:
        return data(rng, whole)
    rows = [line.split(",") for line in whole.decode().splitlines()]
    for _ in range(rng.integers(1, 4)):
        row = rows[rng.integers(len(rows))]
        kind = rng.integers(5)
        if kind == 0 and row:
            row[rng.integers(len(row))] = str(value(rng, 1.0))
        elif kind == 1:
            row.append("1.0")
        elif kind == 2 and row:
            row.pop()
        elif kind == 3 and len(rows) > 1:
            rows.remove(row)
        elif row:
            row[rng.integers(len(row))] = NAMES[rng.integers(len(NAMES))]
    return (
        (",;\t"[rng.integers(3)] if rng.random() < 0.2 else ",")
        .join(["\n"])
        .join(map(",".join, rows))
        .encode("utf-8", "surrogatepass")
    )


def xml(rng: Generator, whole: bytes) -> bytes:
    """XML with attributes, numbers and elements changed."""
    import re

    text = whole.decode()
    for _ in range(rng.integers(1, 4)):
        kind = rng.integers(5)
        places = list(
            re.finditer(
                (
                    r'"[^"]*"',
                    r">[^<>\s][^<>]*<",
                    r"<ref [^>]*/>",
                    r"<attribute.*?</attribute>",
                    r"<component .*?</component>",
                )[kind],
                text,
                re.DOTALL,
            )
        )
        if not places:
            continue
        found = places[rng.integers(len(places))]
        old, new = found[0], ""
        if kind < 2:
            try:
                old_value: Any = float(old[1:-1])
            except ValueError:
                old_value = old[1:-1]
            changed = value(rng, old_value)
            shown = f"{changed}" if rng.random() < 0.9 else NAMES[rng.integers(len(NAMES))]
            shown = shown.replace("<", "&lt;").replace('"', "&quot;").replace("\x00", "")
            new = old[0] + shown[:6000] + old[-1]
        elif rng.random() < 0.5:
            new = old * int(rng.choice([2, 3, 30]))
        text = text[: found.start()] + new + text[found.end() :]
    return text.encode("utf-8", "surrogatepass")
