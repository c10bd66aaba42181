"""Atomic writing of files: a temporary file beside the target is written first and then renamed."""

from __future__ import annotations

import errno
import os
import re
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from gearbench import interruption
from gearbench.errors import InputError

#: Errors that mean a folder does not accept a new file.
_REFUSED = frozenset((errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOENT, errno.ENOTDIR, errno.ENAMETOOLONG))


def check_target(path: str | Path) -> Path:
    """Refuse a file that cannot be written, before anything is computed.

    Raises
    ------
    InputError
        If ``path`` is a folder, or its folder is missing or not writable.
    """
    path = Path(path)
    if path.is_dir():
        raise InputError("output", str(path), "must be a file, not a folder")
    if not path.parent.is_dir():
        raise InputError("output", str(path), f"the folder {path.parent} does not exist")
    if not os.access(path.parent, os.W_OK):
        raise InputError("output", str(path), f"the folder {path.parent} is not writable")
    return path


def make_folder(key: str, path: str | Path) -> Path:
    """Make an output folder if it does not exist; ``key`` says where it was named.

    Raises
    ------
    InputError
        If ``path`` is a file, or cannot be made or written.
    """
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(key, str(path), f"must be a folder ({error.strerror})") from None
    if not os.access(path, os.W_OK | os.X_OK):
        raise InputError(key, str(path), "the folder is not writable")
    return path


#: Characters of a name that go into a file name: at up to 4 bytes they stay below the 255 bytes of file systems.
_NAMED = 40


def file_parts(names: Sequence[str]) -> list[str]:
    """Turn arbitrary names into parts of file names: letters, digits, ``-`` and ``_``, not too long.

    The parts are all different, even on a file system that ignores case.

    Examples
    --------
    >>> file_parts(["pair", "../../etc", "Pair"])
    ['pair', '_etc', 'Pair_2']
    """
    parts: list[str] = []
    taken: set[str] = set()
    for name in names:
        first = part = re.sub(r"[^\w-]+", "_", name)[:_NAMED] or "_"
        number = 1
        while part.casefold() in taken:
            number += 1
            part = f"{first}_{number}"
        taken.add(part.casefold())
        parts.append(part)
    return parts


def read_bytes(path: str | Path) -> bytes:
    """Read the content of a file.

    Raises
    ------
    InputError
        If it cannot be read; names the file.
    """
    try:
        return Path(path).read_bytes()
    except FileNotFoundError:
        raise InputError("", str(path), "no such file") from None
    except (OSError, ValueError) as error:  # ValueError: a name with a NUL character
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError("", str(path), f"must be a readable file ({reason.lower()})") from None


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Context with a temporary file beside ``path`` to write to; at the end it replaces ``path``.

    If the block fails or is interrupted, the temporary file is removed and ``path`` stays as it was.

    Raises
    ------
    InputError
        As in ``check_target``, and if the folder does not accept a new file.
    OSError
        If the disk is full or fails; names ``path``.
    """
    path = check_target(path)
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
    except OSError as error:
        if error.errno not in _REFUSED:
            raise OSError(error.errno, error.strerror, str(path)) from None
        reason = f"the folder {path.parent} is not writable ({error.strerror})"
        raise InputError("output", str(path), reason) from None
    os.close(handle)
    part = Path(name)
    _parts.add(part)
    try:
        yield part
        _finish(part)
        part.replace(path)
    except OSError as error:
        if error.errno is None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from None
    finally:
        part.unlink(missing_ok=True)
        _parts.discard(part)


#: Temporary files of this process.
_parts: set[Path] = set()


def _remove_all() -> None:
    for part in _parts:
        part.unlink(missing_ok=True)


interruption.cleanups.append(_remove_all)


def is_part(name: str) -> bool:
    """Whether a file is a temporary file of ``replacing``, in use or left behind by a killed process."""
    return name.startswith(".") and name.endswith(".part")


def _finish(part: Path) -> None:
    """Flush the content to disk, and give the file the permissions of a new file."""
    with part.open("rb") as file:
        os.fsync(file.fileno())
    mask = os.umask(0)
    os.umask(mask)
    part.chmod(0o666 & ~mask)


def write_bytes(path: str | Path, data: bytes | memoryview) -> Path:
    """Write ``data`` to ``path``; raises as ``replacing``."""
    with replacing(path) as part:
        part.write_bytes(data)
    return Path(path)


def write_text(path: str | Path, text: str) -> Path:
    """Write ``text`` to ``path`` in UTF-8; raises as ``replacing``."""
    return write_bytes(path, text.encode())
