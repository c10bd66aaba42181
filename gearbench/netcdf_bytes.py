"""Reader of netCDF bytes; every error is one line."""

from __future__ import annotations

import io
import warnings

from gearbench.errors import InputError
from gearbench.lazy import xr


def is_netcdf(data: bytes) -> bool:
    """Whether the data begin like a netCDF file of either format."""
    return data[:8] == b"\x89HDF\r\n\x1a\n" or data[:3] == b"CDF"


def dataset_of(data: bytes) -> xr.Dataset:
    """Read a Dataset from the bytes of a netCDF file; numbers with a unit of time stay numbers.

    Raises
    ------
    InputError
        If the data are not netCDF, or are damaged; the error has no key and value.
    """
    if not is_netcdf(data):
        raise InputError("", "", "must be a netCDF file")
    engine = "scipy" if data[:3] == b"CDF" else "h5netcdf"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            if engine == "h5netcdf":
                _open_all(data)
            return xr.load_dataset(io.BytesIO(data), engine=engine, decode_times=False)
    except Exception as error:  # HDF5, h5py, h5netcdf, scipy and xarray raise all kinds
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise InputError("", "", f"must be a readable netCDF file ({reason})") from None


def _open_all(data: bytes) -> None:
    """Open all items of an HDF5 file first, because h5netcdf prints to stderr about items that it cannot open."""
    import h5py

    with h5py.File(io.BytesIO(data), "r") as file:
        for item in (file, *(file[name] for name in file)):
            _ = (dict(item.attrs), item.dtype if isinstance(item, h5py.Dataset) else None)
