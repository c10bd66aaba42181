"""Runner for pages of docs/: writes their files, runs their commands and programs, and compares the output.

A fenced block is a file if its first line is a comment that holds only a file name (``# scene.toml``; ``# scene.toml,
at its end`` appends to it). ``sh`` blocks are commands of gearbench. ``python`` blocks are programs; the programs of a
page share their variables. A ``text`` block right after one of them is the expected output: a line ``…`` stands for any
lines, a word ``…`` for any words, and … within a word for any letters. Numbers must agree to 1 %.
"""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from tests.support.paths import ROOT

DOCS = ROOT / "docs"
#: Allowed relative difference between printed and shown numbers; pages show few digits.
TOLERANCE = 0.01

_FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", flags=re.DOTALL | re.MULTILINE)
_FILE = re.compile(r"# ([\w.-]+\.\w+)(, at its end)?\n")


@dataclass(frozen=True)
class Block:
    """A fenced block of a page: language, text, line, and whether only empty lines separate it from the one before."""

    language: str
    text: str
    line: int
    follows: bool


def blocks(page: str, language: str | None = None) -> list[Block]:
    """Fenced blocks of docs/``page``, all or only those of one ``language``."""
    text = (DOCS / page).read_text(encoding="utf-8")
    found, end = [], 0
    for match in _FENCE.finditer(text):
        follows = bool(found) and not text[end : match.start()].strip()
        found.append(Block(match[1], match[2], text[: match.start()].count("\n") + 1, follows))
        end = match.end()
    return [block for block in found if language in (None, block.language)]


def run_command(line: str) -> int:
    """Run a command of gearbench in this process and return its exit code."""
    from gearbench.cli import main

    arguments = sys.argv
    sys.argv = shlex.split(line, comments=True)
    assert sys.argv[0] == "gearbench", line
    try:
        main()
    except SystemExit as end:
        return int(end.code or 0)
    finally:
        sys.argv = arguments
    return 0


def follow(page: str, *, programs: bool = True) -> Iterator[Block]:
    """Follow a page in the current folder, with or without its ``programs``; yields each block after it has run."""
    names: dict[str, Any] = {"__name__": "__main__"}
    printed = ""
    for block in blocks(page):
        named = _FILE.match(block.text)
        if named is not None:
            with Path(named[1]).open("a" if named[2] else "w", encoding="utf-8") as file:
                file.write(block.text[named.end() :])
        elif block.language == "sh" or (programs and block.language == "python"):
            printed = _printed(block, page, names)
        elif block.language == "text" and block.follows:
            compare(block.text, printed, f"{page}:{block.line}")
        yield block


def _printed(block: Block, page: str, names: dict[str, Any]) -> str:
    """Run a block of commands or a program and return its output."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        if block.language == "python":
            # leading empty lines make a traceback name the line of the page
            exec(compile("\n" * block.line + block.text, page, "exec"), names)
        else:
            for line in block.text.replace("\\\n", " ").splitlines():
                assert run_command(line) == 0, f"{page}:{block.line}: {line}"
    return out.getvalue()


def compare(shown: str, printed: str, where: str) -> None:
    """Assert that the output ``printed`` agrees with the block ``shown`` on the page."""
    lines = [line.split() for line in printed.splitlines() if line.strip()]
    skip = False
    for line in (line.split() for line in shown.splitlines() if line.strip()):
        if line == ["…"]:
            skip = True
            continue
        while skip and lines and not _same(line, lines[0]):
            del lines[0]
        assert lines, f"{where}: {' '.join(line)!r} is not in what is printed:\n{printed}"
        assert _same(line, lines[0]), f"{where}: shows {' '.join(line)!r}, printed is {' '.join(lines[0])!r}"
        del lines[0]
        skip = False
    assert skip or not lines, f"{where}: more is printed: {' '.join(lines[0])!r}"


def _same(shown: list[str], printed: list[str]) -> bool:
    if not shown or not printed:
        return shown == printed
    if shown[0] == "…" and any(_same(shown[1:], printed[n:]) for n in range(1, len(printed) + 1)):
        return True
    return _same_word(shown[0], printed[0]) and _same(shown[1:], printed[1:])


def _same_word(shown: str, printed: str) -> bool:
    if "…" in shown:
        return fnmatchcase(printed, re.sub(r"([][?*])", r"[\1]", shown).replace("…", "*"))
    try:
        a, b = float(shown.rstrip(",;")), float(printed.rstrip(",;"))
    except ValueError:
        return shown == printed
    return abs(a - b) <= TOLERANCE * abs(b)
