"""Datasets on disk: netCDF with a digest at the end of the file, written whole or not at all."""

from __future__ import annotations

import hashlib
import logging
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.errors import InputError
from gearbench.files import is_sealed, read_bytes, seal_line, unseal, write_bytes
from gearbench.netcdf_bytes import dataset_of
from gearbench.results.quantities import GROUPS, QUANTITIES

if TYPE_CHECKING:
    import xarray as xr

_LOG = logging.getLogger(__name__)

#: Attribute that holds the digest of the values.
DIGEST = "data_sha256"


def save(dataset: xr.Dataset, path: str | Path) -> Path:
    """Write ``dataset`` to ``path`` as netCDF with the digest of its bytes, whole or not at all.

    Raises
    ------
    InputError
        As in ``files.check_target``.
    OSError
        If the disk is full or fails; an existing file stays untouched.
    """
    file = _netcdf(dataset)
    line = seal_line(file.getbuffer())
    file.seek(0, 2)
    file.write(line)
    return write_bytes(path, file.getbuffer())


def _netcdf(dataset: xr.Dataset) -> BytesIO:
    """Make the file in memory, because HDF5 crashes the process at exit if the disk was full."""
    from xarray.backends.h5netcdf_ import H5NetCDFStore

    buffer: Any = BytesIO()
    # like ``Dataset.to_netcdf``, but without a lock: the search for one would import dask.distributed
    store = H5NetCDFStore.open(buffer, mode="w", lock=False)
    try:
        dataset.dump_to_store(store)
    finally:
        store.close()
    return buffer


def open_result(path: str | Path, *, proven: bool = False) -> xr.Dataset:
    """Read a Dataset into memory; ``save`` or another program may have written it.

    Digests must agree with the data: the digest of the bytes at the end of a file from ``save``, and the digest of the
    values from ``with_digest``. A file with neither is read with a warning in the log.

    Parameters
    ----------
    path
        The file.
    proven
        Whether to refuse a file without any digest.

    Raises
    ------
    InputError
        If the file is missing, is not netCDF, or has been damaged or changed since it was written.
    """
    data = read_bytes(path)
    try:
        sealed = is_sealed(data)
        dataset = dataset_of(unseal(data) if sealed else data)
        _check_digest(dataset, sealed=sealed, proven=proven, path=path)
        # without this, text joined to the Dataset later would be cut to the old length when saved
        return _of_now(dataset.drop_encoding())
    except InputError as error:
        raise InputError("", str(path), error.allowed) from None


def _of_now(dataset: xr.Dataset) -> xr.Dataset:
    """Convert a Dataset of an earlier version, with variables per gear, to variables over the dimension gear."""
    import xarray as xr

    gears = ["pinion", "wheel"]
    each = {name: [f"{name}_{gear}" for gear in gears] for name in GROUPS["on the flank"]}
    found = {name: own for name, own in each.items() if dataset.variables.keys() >= set(own)}
    if not found:
        return dataset
    _LOG.warning("Dataset of an earlier version: %s are now over the dimension gear", ", ".join(found))
    for name, own in found.items():
        both = xr.concat([dataset[one] for one in own], "gear").assign_attrs(GROUPS["on the flank"][name].attrs)
        dataset = dataset.drop_vars(own).assign({name: both})
    return dataset.assign_coords(gear=("gear", gears, QUANTITIES["gear"].attrs))


def with_digest(dataset: xr.Dataset) -> xr.Dataset:
    """Add the digest of the values, which survives when another program saves the Dataset again.

    Equal results have equal digests, wherever and whenever they are computed. Code that changes the values must renew
    or remove the digest.
    """
    return dataset.assign_attrs({DIGEST: _digest(dataset)})


def _digest(dataset: xr.Dataset) -> str:
    """SHA-256 of names, shapes and values."""
    digest = hashlib.sha256()
    for name in sorted(map(str, dataset.variables)):
        values = dataset[name].values
        digest.update(f"{name} {values.shape} ".encode())
        if values.dtype.kind in "OUS":
            digest.update("\0".join(map(str, values.ravel())).encode())
        else:
            digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _check_digest(dataset: xr.Dataset, *, sealed: bool, proven: bool, path: str | Path) -> None:
    if DIGEST in dataset.attrs:
        if dataset.attrs[DIGEST] != _digest(dataset):
            raise InputError("", "", f"is damaged or changed: its data are not those of its digest ({DIGEST})")
    elif not sealed:
        missing = "carries no digest: whether its data are those that were computed is not known"
        if proven:
            raise InputError("", "", missing)
        _LOG.warning("gearbench: %s %s", path, missing)
