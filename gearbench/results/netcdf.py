"""Datasets on disk: netCDF, written atomically, so that a file is either whole or not there."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearbench.errors import InputError
from gearbench.files import write_bytes

if TYPE_CHECKING:
    import xarray as xr


def save(dataset: xr.Dataset, path: str | Path) -> Path:
    """Write ``dataset`` to ``path`` as netCDF, whole or not at all.

    Raises
    ------
    InputError
        As ``files.check_target``.
    OSError
        If the disk is full or fails; a file that was there before is untouched.
    """
    return write_bytes(path, _netcdf(dataset))


def _netcdf(dataset: xr.Dataset) -> bytes:
    """The file, made in memory: HDF5 crashes the process at its end if the disk was full."""
    from xarray.backends.h5netcdf_ import H5NetCDFStore

    buffer: Any = BytesIO()
    # as ``Dataset.to_netcdf`` does, with a lock of our own: looking for one it would import dask.distributed
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
    except FileNotFoundError:
        raise InputError("", f"{path}", "no such file") from None
    except (OSError, ValueError) as error:
        reason = str(error).splitlines()[0]
        raise InputError("", f"{path}", f"must be a readable netCDF file ({reason})") from None
