"""Errors for the user: one line that names the key, its value and the allowed values."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches

#: Longest message, and longest value and path in it [characters], so that a message stays readable.
LONGEST, LONGEST_VALUE, LONGEST_PATH = 288, 80, 120
#: Longest list of allowed names [characters].
LONGEST_LIST = 160


def plain(text: object) -> str:
    """Make a text one harmless line for a terminal: blanks for white space, escapes for control characters."""
    return escaped(" ".join(str(text).split()))


def escaped(text: str) -> str:
    """Escape control characters and characters that change the writing direction."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def shortened(text: object, longest: int = LONGEST_VALUE) -> str:
    """Make a text one line as ``plain`` does, and leave out the middle if it is too long."""
    line = plain(text)
    half = (longest - 3) // 2
    return line if len(line) <= longest else f"{line[: longest - 3 - half]} … {line[-half:]}"


class InputError(ValueError):
    """Error in the input.

    Parameters
    ----------
    key
        Dotted key of the scene, e.g. ``"pair.pinion.teeth"``.
    value
        The given value, or one that follows from it.
    allowed
        Text on the allowed values.
    file
        File that contains the key, if known.
    """

    def __init__(self, key: str, value: object, allowed: str, file: str | None = None) -> None:
        self.key, self.value, self.allowed, self.file = key, value, allowed, file
        shown = f"{value:.6g}" if isinstance(value, float) else shortened(value, LONGEST_VALUE if key else LONGEST_PATH)
        where = f"{shortened(file, LONGEST_PATH)}: " if file else ""
        key = shortened(key)
        position = f"{key} = {shown}: " if key else f"{shown}: " if shown else ""
        message = f"{where}{position}{plain(allowed)}"
        super().__init__(message if len(message) <= LONGEST else f"{message[: LONGEST - 1]}…")

    def __reduce__(self) -> tuple:
        return type(self), (self.key, self.value, self.allowed, self.file)

    def within(self, prefix: str) -> InputError:
        """Return the error with its key below the table ``prefix``."""
        return InputError(f"{prefix}.{self.key}".strip("."), self.value, self.allowed, self.file)

    def in_file(self, file: str) -> InputError:
        """Return the error with the name of the file."""
        return InputError(self.key, self.value, self.allowed, file)


@contextmanager
def naming(file: object = "", *, below: str = "") -> Iterator[None]:
    """Context for every ``InputError``: its key is ``below`` that table, its file is ``file`` unless it names one."""
    try:
        yield
    except InputError as error:
        raise InputError(
            f"{below}.{error.key}".strip("."), error.value, error.allowed, error.file or str(file)
        ) from None


def one_of(name: str, names: Iterable[str]) -> str:
    """Text on the allowed ``names``: a similar one first; of a long list the first ones, and how many more."""
    names = [known for known in names if known != name]
    close = (
        get_close_matches(name, names, n=1, cutoff=0.7) or [known for known in names if f"_{name}" in f"_{known}_"][:1]
    )
    shown = [known for i, known in enumerate(names) if len(", ".join(names[: i + 1])) <= LONGEST_LIST]
    more = f" and {len(names) - len(shown)} more" if len(shown) < len(names) else ""
    return "".join(f"did you mean {match}? " for match in close) + f"allowed: {', '.join(shown)}{more}"


def install_extra(extra: str) -> str:
    """Command that installs an extra of gearbench from the same source as gearbench itself."""
    import json
    from importlib.metadata import PackageNotFoundError, distribution

    try:
        origin = distribution("gearbench").read_text("direct_url.json")
    except PackageNotFoundError:
        origin = None
    source = f" @ {json.loads(origin)['url']}" if origin else ""
    return f"pip install 'gearbench[{extra}]{source}'"


class GearbenchError(RuntimeError):
    """Error of a run that could not be finished; the message is one line."""
