"""Output of a command: tables, one JSON object (``--json``) or nothing (``--quiet``), and progress on terminals."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from time import monotonic
from typing import Any, Literal

from gearbench.errors import escaped
from gearbench.interruption import check, raising

Form = Literal["tables", "json", "nothing"]
#: Form of the output of the command that runs.
_form: ContextVar[Form] = ContextVar("form", default="tables")


@contextmanager
def printing(form: Form) -> Iterator[None]:
    """Context in which commands print in this form."""
    token = _form.set(form)
    try:
        yield
    finally:
        _form.reset(token)


def answer(data: Mapping[str, Any], lines: Iterable[str] = (), show: Callable[[], object] = lambda: None) -> None:
    """Print the answer of a command in the form that is asked for.

    Parameters
    ----------
    data
        The JSON object. Its ``files`` are also named below the tables.
    lines
        Lines below the tables.
    show
        Function that prints the tables.
    """
    if _form.get() == "json":
        print_mapping(data)
    elif _form.get() == "tables":
        show()
        for line in (*lines, *(f"wrote {path}" for path in data.get("files", ()))):
            say(line)


def say(line: str) -> None:
    """Print a line that may hold names from files, with control characters made harmless."""
    print(escaped(line))


def print_mapping(mapping: Mapping[str, Any]) -> None:
    """Print a mapping as JSON; paths become text, and numbers that are not finite become null."""
    print(json.dumps(_for_json(mapping), indent=2, ensure_ascii=False, allow_nan=False))


def _for_json(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping):
        return {key: _for_json(item) for key, item in value.items()}
    return [_for_json(item) for item in value] if isinstance(value, list | tuple) else value


def shows_progress() -> bool:
    """Whether to show progress: only on a terminal, and not with --quiet or --json."""
    return _form.get() == "tables" and sys.stderr.isatty()


@contextmanager
def progress_line() -> Iterator[Callable[[str], None]]:
    """Context with a function that replaces the progress line, if progress is shown; Ctrl-C raises inside."""
    shown, last = shows_progress(), 0.0

    def tell(line: str) -> None:
        nonlocal last
        check()
        if shown and (now := monotonic()) - last > 0.1:
            last = now
            print(f"\r\x1b[2K{line}", end="", file=sys.stderr, flush=True)

    with raising():
        try:
            yield tell
        finally:
            if shown and last:
                print("\r\x1b[2K", end="", file=sys.stderr, flush=True)


def progress(line: str) -> None:
    """Print a line of progress on stderr, if progress is shown."""
    if shows_progress():
        print(line, file=sys.stderr)
