"""Datasets on disk: netCDF, written atomically, so that a file is either whole or not there."""

from __future__ import annotations

import os
import tempfile
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearbench.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


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


def save(dataset: xr.Dataset, path: str | Path) -> Path:
    """Write ``dataset`` to ``path`` through a temporary file beside it, then put it in place at once.

    Raises
    ------
    InputError
        As ``check_target``.
    OSError
        If the disk is full or fails; a file that was there before is untouched.
    """
    path = check_target(path)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
    os.close(handle)
    part = Path(name)
    try:
        with part.open("wb") as file:
            file.write(_netcdf(dataset))
            file.flush()
            os.fsync(file.fileno())
        mask = os.umask(0)
        os.umask(mask)
        part.chmod(0o666 & ~mask)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    return path


def _netcdf(dataset: xr.Dataset) -> bytes:
    """The file, made in memory: HDF5 crashes the process at its end if the disk was full."""
    from xarray.backends.h5netcdf_ import H5NetCDFStore

    buffer: Any = BytesIO()
    # what ``Dataset.to_netcdf`` does, with a lock of our own: looking for one it would import dask.distributed
    store = H5NetCDFStore.open(buffer, mode="w", lock=False)
    try:
        dataset.dump_to_store(store)
    finally:
        store.close()
    return buffer.getvalue()


def load(path: str | Path) -> xr.Dataset:
    """Read a Dataset written by ``save`` into memory.

    Raises
    ------
    InputError
        If the file is missing or no netCDF file.
    """
    import xarray as xr

    try:
        return xr.load_dataset(path, engine="h5netcdf")
    except (OSError, ValueError) as error:
        reason = str(error).splitlines()[0]
        raise InputError("", f"{path}", f"must be a readable netCDF file ({reason})") from None
