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

#: Files that are being read, each named by the one before it.
_files: ContextVar[tuple[Path, ...]] = ContextVar("files", default=())


@contextmanager
def files_of(file: Path) -> Iterator[None]:
    """Context in which relative file names refer to the folder of ``file`` instead of the current folder."""
    token = _files.set((*_files.get(), file))
    try:
        yield
    finally:
        _files.reset(token)


def in_folder(name: str) -> Path:
    """Path of a file that a scene names."""
    return _files.get()[-1].parent / name if _files.get() else Path(name)


def circle(name: str) -> tuple[Path, ...]:
    """Files that lead from the file ``name``, if it is being read, to itself; empty if it is not."""
    files = [file.resolve() for file in (*_files.get(), in_folder(name))]
    return tuple(files[files.index(files[-1]) :]) if files[-1] in files[:-1] else ()


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
