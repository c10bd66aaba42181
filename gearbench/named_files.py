"""Files that a scene refers to: relative to the scene file, known by their content."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from gearbench.errors import InputError

#: Largest file read [bytes].
LARGEST = 50_000_000

_folder: ContextVar[Path] = ContextVar("folder", default=Path())


@contextmanager
def files_in(folder: Path) -> Iterator[None]:
    """Relative names of files mean files in ``folder``; without this, in the current folder."""
    token = _folder.set(folder)
    try:
        yield
    finally:
        _folder.reset(token)


def in_folder(name: str) -> Path:
    """Path of a file that a scene names."""
    return _folder.get() / name


def content(key: str, name: str) -> tuple[bytes, str]:
    """Bytes of a file and their SHA-256.

    Raises
    ------
    InputError
        Keyed ``key``, if it cannot be read or is too large.
    """
    path = in_folder(name)
    try:
        if path.stat().st_size > LARGEST:
            raise InputError(key, name, f"must be at most {LARGEST // 1_000_000} MB")
        data = path.read_bytes()
    except OSError as error:
        reason = (error.strerror or "cannot be read").lower()
        raise InputError(key, name, f"must be a readable file, relative to the scene file ({reason})") from None
    return data, hashlib.sha256(data).hexdigest()
