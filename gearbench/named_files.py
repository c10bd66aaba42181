"""Files that a scene refers to: paths relative to the scene file, identified by their SHA-256."""

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
    """Context in which relative file names refer to ``folder`` instead of the current folder."""
    token = _folder.set(folder)
    try:
        yield
    finally:
        _folder.reset(token)


def in_folder(name: str) -> Path:
    """Path of a file that a scene names."""
    return _folder.get() / name


def content(key: str, name: str) -> tuple[bytes, str]:
    """Read the bytes of a file, and compute their SHA-256.

    Raises
    ------
    InputError
        If the file cannot be read or is too large; the error has the key ``key``.
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
