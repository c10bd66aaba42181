"""Files on disk, written atomically: whole, or as they were before. A file is written beside its name and takes it."""

from __future__ import annotations

import errno
import hashlib
import os
import re
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from gearbench import interruption
from gearbench.errors import InputError

#: Faults that keep a file from being made in a folder.
_REFUSED = frozenset((errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOENT, errno.ENOTDIR, errno.ENAMETOOLONG))


def check_target(path: str | Path) -> Path:
    """Refuse, before anything is computed, a file that cannot be written.

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
    """Make a folder to write into, where it does not exist; ``key`` says where it was named.

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


#: Letters of a name that go into a file's name: up to 4 bytes each, of the 255 that a file system takes.
_NAMED = 40


def file_parts(names: Sequence[str]) -> list[str]:
    """Names, which may hold anything, as parts of names of files: letters, digits, ``-`` and ``_``, not too long.

    All are different, also where a file system does not tell capitals.

    Examples
    --------
    >>> file_parts(["pair", "../../etc", "Pair"])
    ['pair', '_etc', 'Pair_2']
    """
    found: list[str] = []
    taken: set[str] = set()
    for name in names:
        first = part = re.sub(r"[^\w-]+", "_", name)[:_NAMED] or "_"
        number = 1
        while part.casefold() in taken:
            number += 1
            part = f"{first}_{number}"
        taken.add(part.casefold())
        found.append(part)
    return found


#: Last line of a sealed file: the digest of all bytes before it. Readers of HDF5 take no notice of it.
_SEAL = re.compile(rb"\ngearbench sha256 ([0-9a-f]{64})\n", re.ASCII)
_SEAL_LENGTH = len("\ngearbench sha256 \n") + 64


def seal(data: bytes) -> bytes:
    """``data`` with its digest behind it."""
    return data + seal_line(data)


def seal_line(data: bytes | memoryview) -> bytes:
    """Line that ``seal`` appends to ``data``."""
    return seal_of(hashlib.sha256(data).hexdigest())


def seal_of(digest: str) -> bytes:
    """Line that ``seal`` appends to data with this SHA-256."""
    return f"\ngearbench sha256 {digest}\n".encode()


def is_sealed(data: bytes) -> bool:
    """Whether ``data`` end in a digest, right or wrong."""
    return _SEAL.fullmatch(data[-_SEAL_LENGTH:]) is not None


def unseal(data: bytes) -> bytes:
    """Data without the line that ``seal`` appended.

    Raises
    ------
    InputError
        Without key and value, if there is no digest, or the data are not those it was made of.
    """
    found = _SEAL.fullmatch(data[-_SEAL_LENGTH:])
    if found is None:
        raise InputError("", "", "carries no digest: it is cut off, or gearbench did not write it")
    whole = data[:-_SEAL_LENGTH]
    if hashlib.sha256(whole).hexdigest().encode() != found[1]:
        raise InputError("", "", "is damaged: its data are not those of its digest")
    return whole


def read_bytes(path: str | Path) -> bytes:
    """Content of a file.

    Raises
    ------
    InputError
        Naming it, if it cannot be read.
    """
    try:
        return Path(path).read_bytes()
    except FileNotFoundError:
        raise InputError("", str(path), "no such file") from None
    except (OSError, ValueError) as error:  # the last: a name with a NUL
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError("", str(path), f"must be a readable file ({reason.lower()})") from None


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """A temporary file beside ``path``, to be written; at the end of the block it takes the place of ``path``.

    If the block fails or is interrupted, the temporary file is removed and ``path`` is as it was before.

    Raises
    ------
    InputError
        As ``check_target``, and if the folder refuses a new file.
    OSError
        If the disk is full or fails; it names ``path``.
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
    """Whether a file is one that is being written, or was left behind by a writer that was killed."""
    return name.startswith(".") and name.endswith(".part")


def _finish(part: Path) -> None:
    """Make the content durable, and give the file the rights that a new one has."""
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
