"""The file of a generation: netCDF-4, written and read through HDF5 itself.

It holds what ``results.netcdf`` would write, in a sixth of the time: a generation near the end, whose designs are known
or stop early, is evaluated in less than the other took.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from gearbench.results.netcdf import whole_bytes, write_sealed

if TYPE_CHECKING:
    import xarray as xr

#: Name that netCDF-4 gives to the scale of a dimension without a variable.
_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable. {:9d}"


def write_generation(dataset: xr.Dataset, path: Path, blanks: dict[tuple[int, ...], bytes]) -> Path:
    """Write a Dataset of numbers and texts to ``path``, whole or not at all, with the digest of its bytes.

    ``blanks`` holds files without values by the sizes of their dimensions: to declare the variables of a generation,
    which are always the same ones, takes as long as all the rest.

    Raises
    ------
    InputError, OSError
        As ``results.netcdf.save``.
    """
    import h5py

    sizes = {str(name): size for name, size in dataset.sizes.items()}
    blank = blanks.get(tuple(sizes.values()))
    if blank is None:
        buffer = BytesIO()
        with h5py.File(buffer, "w", track_order=True) as file:
            declare(file, dataset, sizes)
        blank = blanks[tuple(sizes.values())] = buffer.getvalue()
    buffer = BytesIO(blank)
    with h5py.File(buffer, "r+") as file:
        fill(file, dataset)
        file.attrs.update(dataset.attrs)
    return write_sealed(path, buffer)


def declare(file: Any, dataset: xr.Dataset, sizes: Mapping[str, int]) -> None:
    """Make the dimensions, of ``sizes``, and the variables of a Dataset in an HDF5 file; those that are there stay."""
    import h5py

    for dimension in map(str, dataset.dims):
        if dimension in file:
            continue
        if dimension in dataset.variables:
            _declare(file, dataset[dimension], sizes)
            file[dimension].make_scale(dimension)
        else:
            file.create_dataset(dimension, (sizes[dimension],), ">f4")
            file[dimension].make_scale(_NO_VARIABLE.format(sizes[dimension]))
    for name in map(str, dataset.variables):
        if name in file:
            continue
        item: h5py.Dataset = _declare(file, dataset[name], sizes)
        for axis, dimension in enumerate(dataset[name].dims):
            item.dims[axis].attach_scale(file[str(dimension)])


def _declare(file: Any, variable: xr.DataArray, sizes: Mapping[str, int]) -> Any:
    import h5py

    kind = h5py.string_dtype() if variable.dtype.kind in "OU" else variable.dtype
    item = file.create_dataset(str(variable.name), [sizes[str(dimension)] for dimension in variable.dims], kind)
    item.attrs.update(variable.attrs)
    return item


def fill(file: Any, dataset: xr.Dataset, start: int = 0) -> None:
    """Write the values of a Dataset, as rows from ``start`` on, to variables that are declared."""
    for name in map(str, dataset.variables):
        values = dataset[name].values
        values = values.astype(object) if values.dtype.kind in "OU" else values
        file[name][start : start + len(values)] = values


def read_generation(path: Path, names: Sequence[str]) -> tuple[dict[str, NDArray], str]:
    """Variables of a generation by name, and the versions it was searched with.

    Raises
    ------
    InputError
        If the file is not one that was written whole.
    OSError, KeyError
        If it is no such file.
    """
    import h5py

    with h5py.File(BytesIO(whole_bytes(path)), "r") as file:
        found: dict[str, Any] = {name: file[name] for name in names}
        arrays = {name: (v.asstr()[...] if v.dtype.kind == "O" else v[...]) for name, v in found.items()}
        return arrays, str(file.attrs["versions"])
