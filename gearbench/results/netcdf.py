"""Datasets on disk: netCDF with a digest of the values, written whole or not at all."""

from __future__ import annotations

import hashlib
import logging
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from gearbench.errors import InputError, naming
from gearbench.files import read_bytes, write_bytes
from gearbench.lazy import xr
from gearbench.netcdf_bytes import dataset_of
from gearbench.results.quantities import GROUPS, QUANTITIES

_LOG = logging.getLogger(__name__)

#: Attribute that holds the SHA-256 of names, shapes and values.
DIGEST = "data_sha256"


def save(dataset: xr.Dataset, path: str | Path) -> Path:
    """Write ``dataset`` to ``path`` as netCDF with a digest of its values, whole or not at all.

    The digest survives when another program saves the Dataset again. Equal results have equal digests.

    Raises
    ------
    InputError
        As in ``files.check_target``.
    OSError
        If the disk is full or fails; an existing file stays untouched.
    """
    from xarray.backends.h5netcdf_ import H5NetCDFStore

    # made in memory, because HDF5 crashes the process at exit if the disk was full
    buffer: Any = BytesIO()
    # as in ``Dataset.to_netcdf``, but without its lock, which is one of the whole cluster where dask is connected
    store = H5NetCDFStore.open(buffer, mode="w", lock=False)
    try:
        dataset.assign_attrs({DIGEST: _digest(dataset)}).dump_to_store(store)
    finally:
        store.close()
    return write_bytes(path, buffer.getbuffer())


def open_result(path: str | Path) -> xr.Dataset:
    """Read a Dataset into memory; ``save`` or another program may have written it.

    A file without digest is read with a warning in the log.

    Raises
    ------
    InputError
        If the file is missing, is not netCDF, or its digest contradicts its values.
    """
    data = read_bytes(path)
    with naming(path):
        dataset = dataset_of(data)
        digest = dataset.attrs.pop(DIGEST, None)
        if digest is None:
            _LOG.warning("gearbench: %s has no digest: its values may have been changed", path)
        elif digest != _digest(dataset):
            raise InputError("", "", f"is damaged or changed: its digest ({DIGEST}) contradicts its values")
        # without drop_encoding, text joined to the Dataset later would be cut to the old length when saved
        return _in_current_form(dataset.drop_encoding())


def _digest(dataset: xr.Dataset) -> str:
    digest = hashlib.sha256()
    for name in sorted(map(str, dataset.variables)):
        values = dataset[name].values
        digest.update(f"{name} {values.shape} ".encode())
        text = values.dtype.kind in "OUS"
        digest.update("\0".join(map(str, values.ravel())).encode() if text else np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _in_current_form(dataset: xr.Dataset) -> xr.Dataset:
    """Convert a Dataset of an earlier version, with variables per gear, to variables over the dimension gear."""
    gears = ["pinion", "wheel"]
    old_names = {name: [f"{name}_{gear}" for gear in gears] for name in GROUPS["on the flank"]}
    present = {name: names for name, names in old_names.items() if dataset.variables.keys() >= set(names)}
    if not present:
        return dataset
    _LOG.warning("Dataset of an earlier version: %s are now over the dimension gear", ", ".join(present))
    for name, names in present.items():
        both = xr.concat([dataset[one] for one in names], "gear").assign_attrs(GROUPS["on the flank"][name].attrs)
        dataset = dataset.drop_vars(names).assign({name: both})
    return dataset.assign_coords(gear=("gear", gears, QUANTITIES["gear"].attrs))
