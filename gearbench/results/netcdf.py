"""Datasets on disk: netCDF with a digest behind it, written atomically: a file is whole, or it says that it is not."""

from __future__ import annotations

import logging
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearbench.errors import InputError
from gearbench.files import read_bytes, seal_line, unseal, write_bytes
from gearbench.netcdf_bytes import dataset_of, is_netcdf
from gearbench.results.quantities import GROUPS, QUANTITIES

if TYPE_CHECKING:
    import xarray as xr

_LOG = logging.getLogger(__name__)

#: Attributes of Datasets and variables that are text: others may be numbers, or lists.
TEXTS = frozenset(
    ("scene", "scene_sha256", "study", "study_sha256", "reference_scene", "variables", "versions", "git_revision",
     "created", "host", "name", "notes", "warning", "units", "long_name", "symbol")
)  # fmt: skip


def save(dataset: xr.Dataset, path: str | Path) -> Path:
    """Write ``dataset`` to ``path`` as netCDF with the digest of its bytes, whole or not at all.

    Raises
    ------
    InputError
        As ``files.check_target``.
    OSError
        If the disk is full or fails; a file that was there before is untouched.
    """
    return write_sealed(path, _netcdf(dataset))


def write_sealed(path: str | Path, file: BytesIO) -> Path:
    """Write a file made in memory, and the digest of its bytes; a large one is not copied. Raises as ``save``."""
    line = seal_line(file.getbuffer())
    file.seek(0, 2)
    file.write(line)
    return write_bytes(path, file.getbuffer())


def _netcdf(dataset: xr.Dataset) -> BytesIO:
    """The file, made in memory: HDF5 crashes the process at its end if the disk was full."""
    from xarray.backends.h5netcdf_ import H5NetCDFStore

    buffer: Any = BytesIO()
    # as ``Dataset.to_netcdf`` does, with a lock of our own: looking for one it would import dask.distributed
    store = H5NetCDFStore.open(buffer, mode="w", lock=False)
    try:
        dataset.dump_to_store(store)
    finally:
        store.close()
    return buffer


def load(path: str | Path) -> xr.Dataset:
    """Read a Dataset written by ``save`` into memory.

    Raises
    ------
    InputError
        If the file is missing, is none that ``save`` has written, or has been damaged or changed since.
    """
    data = whole_bytes(path)
    try:
        dataset = dataset_of(data)
        for name, attrs in (("", dataset.attrs), *((str(n), v.attrs) for n, v in dataset.variables.items())):
            for key in TEXTS & attrs.keys():
                if not isinstance(attrs[key], str):
                    raise InputError("", "", f"its attribute {key} {f'of {name} ' if name else ''}must be text")
        return _of_now(
            dataset.drop_encoding()
        )  # with it names joined to it would be cut to the length of its own when saved
    except InputError as error:
        raise InputError("", str(path), error.allowed) from None


def _of_now(dataset: xr.Dataset) -> xr.Dataset:
    """With the dimension gear, where an earlier version wrote a variable for the pinion and one for the wheel."""
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


def reading(path: str | Path) -> xr.Dataset:
    """A Dataset that this process has written, a context: its variables are read as they are used."""
    import xarray as xr

    return xr.open_dataset(path, engine="h5netcdf", decode_times=False)


def whole_bytes(path: str | Path) -> bytes:
    """Bytes of a netCDF file that are those ``save`` has written.

    Raises
    ------
    InputError
        As ``load``.
    """
    data = read_bytes(path)
    try:
        if not is_netcdf(data):
            raise InputError("", "", "must be a netCDF file that gearbench has written")
        return unseal(data)
    except InputError as error:
        raise InputError("", str(path), error.allowed) from None
