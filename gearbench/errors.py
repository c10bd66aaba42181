"""Errors that speak to the person at the keyboard: one line, naming the key, its value and the values allowed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches


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
        shown = f"{value:.6g}" if isinstance(value, float) else f"{value}"
        where = f"{file}: " if file else ""
        at = f"{key} = {shown}: " if key else f"{shown}: " if shown else ""
        super().__init__(f"{where}{at}{allowed}")

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
    """The names allowed in place of ``name``, the one it comes close to first."""
    names = list(names)
    close = get_close_matches(name, names, n=1, cutoff=0.7)
    return "".join(f"did you mean {match}? " for match in close) + f"allowed: {', '.join(names)}"


class GearbenchError(RuntimeError):
    """A run that could not be finished; its message is one clear line."""
