"""Datasets on disk: netCDF, written whole or not at all."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING

from gearbench.errors import naming
from gearbench.files import read_bytes, write_bytes
from gearbench.netcdf_bytes import dataset_of
from gearbench.results.quantities import GROUPS, QUANTITIES

if TYPE_CHECKING:
    import xarray as xr

_LOG = logging.getLogger(__name__)


def save(dataset: xr.Dataset, path: str | Path) -> Path:
    """Write ``dataset`` to ``path`` as netCDF, whole or not at all.

    Raises
    ------
    InputError
        As in ``files.check_target``.
    OSError
        If the disk is full or fails; an existing file stays untouched.
    """
    # made in memory, because HDF5 crashes the process at exit if the disk was full
    return write_bytes(path, dataset.to_netcdf(engine="h5netcdf"))


def open_result(path: str | Path) -> xr.Dataset:
    """Read a Dataset into memory; ``save`` or another program may have written it.

    Raises
    ------
    InputError
        If the file is missing, or is not netCDF.
    """
    data = read_bytes(path)
    with naming(path):
        # without drop_encoding, text joined to the Dataset later would be cut to the old length when saved
        return _of_now(dataset_of(data).drop_encoding())


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
