"""Reader of untrusted netCDF bytes; every error is one line."""

from __future__ import annotations

import io
import warnings
from typing import TYPE_CHECKING

from gearbench.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

#: Largest number of values per byte of a file. HDF5 compresses zeros a thousandfold, but measured data only tenfold.
LARGEST_RATIO = 50


def is_netcdf(data: bytes) -> bool:
    """Whether the data begin like a netCDF file of either format."""
    return data[:8] == b"\x89HDF\r\n\x1a\n" or data[:3] == b"CDF"


def dataset_of(data: bytes) -> xr.Dataset:
    """Read a Dataset from the bytes of a netCDF file; numbers with a unit of time stay numbers.

    Raises
    ------
    InputError
        If the data are not netCDF, are damaged, refer to other files, or unpack to too many values; the error has no
        key and value.
    """
    import xarray as xr

    if not is_netcdf(data):
        raise InputError("", "", "must be a netCDF file")
    classic = data[:3] == b"CDF"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            if not classic:
                _walk(data)
            with xr.open_dataset(
                io.BytesIO(data), engine="scipy" if classic else "h5netcdf", decode_times=False
            ) as file:
                _check_size(sum(variable.size for variable in file.variables.values()), data)
                return file.load()
    except InputError:
        raise
    except Exception as error:  # HDF5, h5py, h5netcdf, scipy and xarray raise all kinds
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise InputError("", "", f"must be a readable netCDF file ({reason})") from None


def _walk(data: bytes) -> None:
    """Check all items of an HDF5 file first, because h5netcdf prints to stderr about items that it cannot open."""
    import h5py

    with h5py.File(io.BytesIO(data), "r") as file:
        for name in file:
            item = file[name] if file.get(name, getlink=True).__class__ is h5py.HardLink else None
            if item is None or (isinstance(item, h5py.Dataset) and (item.external or item.is_virtual)):
                raise InputError("", "", f"must hold its data itself: {name} is a reference")
            if isinstance(item, h5py.Dataset):
                _check_size(item.size or 0, data)
                _ = (item.dtype, dict(item.attrs))
        _ = dict(file.attrs)


def _check_size(count: int, data: bytes) -> None:
    if count > LARGEST_RATIO * len(data):
        raise InputError(
            "", "", f"{len(data)} bytes that unpack to {count} values: must be at most {LARGEST_RATIO} each"
        )
