"""Errors that speak to the person at the keyboard: one line, naming the key, its value and the values allowed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches

#: Longest message, longest value and longest path in it [characters]: a line that can be read, whatever a file holds.
LONGEST, LONGEST_VALUE, LONGEST_PATH = 288, 80, 120
#: Longest list of names allowed [characters].
LONGEST_LIST = 160


def plain(text: object) -> str:
    """A text as one line that a terminal shows as it is: white space as blanks, control characters as escapes."""
    return escaped(" ".join(str(text).split()))


def escaped(text: str) -> str:
    """A text with its control characters, and those that turn the direction of writing, as escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def shortened(text: object, longest: int = LONGEST_VALUE) -> str:
    """``plain``, the middle of a long text left out."""
    line = plain(text)
    half = (longest - 3) // 2
    return line if len(line) <= longest else f"{line[: longest - 3 - half]} … {line[-half:]}"


class InputError(ValueError):
    """Input that cannot be simulated.

    Parameters
    ----------
    key
        Dotted key of the scene, e.g. ``"pair.pinion.teeth"``.
    value
        The value given there (or one that follows from it).
    allowed
        The values allowed, in words.
    file
        The file the key stands in, where there is one.
    """

    def __init__(self, key: str, value: object, allowed: str, file: str | None = None) -> None:
        self.key, self.value, self.allowed, self.file = key, value, allowed, file
        shown = f"{value:.6g}" if isinstance(value, float) else shortened(value, LONGEST_VALUE if key else LONGEST_PATH)
        where = f"{shortened(file, LONGEST_PATH)}: " if file else ""
        key = shortened(key)
        at = f"{key} = {shown}: " if key else f"{shown}: " if shown else ""
        message = f"{where}{at}{plain(allowed)}"
        super().__init__(message if len(message) <= LONGEST else f"{message[: LONGEST - 1]}…")

    def __reduce__(self) -> tuple:
        return type(self), (self.key, self.value, self.allowed, self.file)

    def within(self, prefix: str) -> InputError:
        """Return the same error with its key placed below the table ``prefix``."""
        return InputError(f"{prefix}.{self.key}".strip("."), self.value, self.allowed, self.file)

    def in_file(self, file: str) -> InputError:
        """Return the same error naming the file."""
        return InputError(self.key, self.value, self.allowed, file)


@contextmanager
def naming(file: object) -> Iterator[None]:
    """Let every ``InputError`` of the block that names no file name this one."""
    try:
        yield
    except InputError as error:
        raise error if error.file else error.in_file(str(file)) from None


def one_of(name: str, names: Iterable[str]) -> str:
    """The names allowed in place of ``name``, the one it comes close to first; of many the first ones, and how many."""
    names = [each for each in names if each != name]
    close = get_close_matches(name, names, n=1, cutoff=0.7) or [each for each in names if f"_{name}" in f"_{each}_"][:1]
    shown = [each for i, each in enumerate(names) if len(", ".join(names[: i + 1])) <= LONGEST_LIST]
    more = f" and {len(names) - len(shown)} more" if len(shown) < len(names) else ""
    return "".join(f"did you mean {match}? " for match in close) + f"allowed: {', '.join(shown)}{more}"


def install_extra(extra: str) -> str:
    """The command that installs an extra of gearbench from where gearbench itself came from."""
    import json
    from importlib.metadata import PackageNotFoundError, distribution

    try:
        origin = distribution("gearbench").read_text("direct_url.json")
    except PackageNotFoundError:
        origin = None
    source = f" @ {json.loads(origin)['url']}" if origin else ""
    return f"pip install 'gearbench[{extra}]{source}'"


class GearbenchError(RuntimeError):
    """A run that could not be finished; its message is one clear line."""
