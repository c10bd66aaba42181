"""The file of a finished search, written some designs at a time: memory does not grow with them."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from io import RawIOBase
from pathlib import Path
from typing import Any, BinaryIO, cast

from gearbench.files import replacing, seal_of
from gearbench.optimisation.archive import Archive
from gearbench.optimisation.dataset import batches, checksum, history_dataset
from gearbench.optimisation.generation_file import declare, fill
from gearbench.optimisation.study import Design

#: Bytes that are read at a time.
BLOCK = 1 << 20


def write_front(archive: Archive, population: Sequence[Design], wall_time: float, path: Path) -> Path:
    """Write what ``front_dataset`` holds to ``path``, whole or not at all, with the digest of its bytes.

    Raises
    ------
    InputError, OSError
        As ``results.netcdf.save``.
    """
    with replacing(path) as part, part.open("r+b") as disk:
        _write(archive, population, wall_time, disk)
        disk.seek(0)
        digest = hashlib.sha256()
        while block := disk.read(BLOCK):
            digest.update(block)
        disk.write(seal_of(digest.hexdigest()))
    return path


def _write(archive: Archive, population: Sequence[Design], wall_time: float, disk: BinaryIO) -> None:
    """The netCDF-4 file, through HDF5 itself."""
    import h5py

    from gearbench.results.provenance import run_provenance

    faults = _Faults(disk)
    try:
        with h5py.File(faults, "w", track_order=True) as file:
            start, history = 0, history_dataset(archive, population)
            names = set(map(str, history.variables))
            sizes = {str(name): size for name, size in history.sizes.items()}
            for part in batches(archive):
                own = {str(name): size for name, size in part.sizes.items()}
                if not start:
                    declare(file, part, sizes | own | {"design": len(archive)})
                    fill(file, part.drop_dims("design"))
                    file.attrs.update(part.attrs)
                fill(
                    file, part.drop_vars([name for name, v in part.variables.items() if "design" not in v.dims]), start
                )
                start += own["design"]
                names |= set(map(str, part.variables))
            declare(file, history, sizes | {"objective_name": len(archive.study.objectives)})
            fill(file, history)
            data = {name: cast("h5py.Dataset", file[name]) for name in names}
            texts = {name: item.asstr() if item.dtype.kind == "O" else item for name, item in data.items()}
            file.attrs.update(data_sha256=checksum(texts), **run_provenance(wall_time=wall_time))
    except Exception:
        if faults.first is None:
            raise
    if faults.first is not None:
        raise faults.first


class _Faults(RawIOBase):
    """A file that keeps the first fault of the disk instead of raising it: HDF5 crashes the process over one."""

    def __init__(self, disk: BinaryIO) -> None:
        self._disk = disk
        self.first: OSError | None = None

    def write(self, data: Any) -> int:
        """Write ``data``, or let it go where the disk has failed."""
        self._kept(lambda: self._disk.write(data))
        return memoryview(data).nbytes

    def truncate(self, size: int | None = None) -> int:
        """Make the file ``size`` bytes long."""
        self._kept(lambda: self._disk.truncate(size))
        return self._disk.tell() if size is None else size

    def flush(self) -> None:
        """Hand over what is buffered."""
        if not self.closed:
            self._kept(self._disk.flush)

    def readinto(self, buffer: Any) -> int:
        """Read into ``buffer``."""
        return self._disk.readinto(buffer)  # type: ignore[attr-defined]

    def seek(self, offset: int, whence: int = 0) -> int:
        """Go to an offset."""
        return self._disk.seek(offset, whence)

    def tell(self) -> int:
        """The offset."""
        return self._disk.tell()

    def _kept(self, work: Callable[[], object]) -> None:
        """Do ``work`` as long as nothing has failed."""
        try:
            if self.first is None:
                work()
        except OSError as error:
            self.first = error
