"""The file of a generation: netCDF-4, written and read through HDF5 itself.

It holds what ``results.netcdf`` would write, in a sixth of the time: a generation near the end, whose designs are known
or stop early, is evaluated in less than the other took.
"""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from gearbench.results.netcdf import whole_bytes, write_sealed

if TYPE_CHECKING:
    import xarray as xr

#: Name that netCDF-4 gives to the scale of a dimension without a variable.
_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable. {:9d}"


def write_generation(dataset: xr.Dataset, path: Path) -> Path:
    """Write a Dataset of numbers and texts to ``path``, whole or not at all, with the digest of its bytes.

    Raises
    ------
    InputError, OSError
        As ``results.netcdf.save``.
    """
    import h5py

    buffer = BytesIO()
    with h5py.File(buffer, "w", track_order=True) as file:
        scales = {}
        for dimension, size in dataset.sizes.items():
            if dimension in dataset.variables:
                scales[dimension] = _put(file, dataset[dimension])
                scales[dimension].make_scale(str(dimension))
            else:
                scales[dimension] = file.create_dataset(str(dimension), (size,), ">f4")
                scales[dimension].make_scale(_NO_VARIABLE.format(size))
        for name in dataset.variables:
            if name not in scales:
                item = _put(file, dataset[name])
                for axis, dimension in enumerate(dataset[name].dims):
                    item.dims[axis].attach_scale(scales[dimension])
        file.attrs.update(dataset.attrs)
    return write_sealed(path, buffer)


def _put(file: Any, variable: xr.DataArray) -> Any:
    """A variable with its attributes in an HDF5 file."""
    import h5py

    values: Any = variable.values
    texts = values.dtype.kind in "OU"
    item = file.create_dataset(
        str(variable.name),
        data=values.astype(object) if texts else values,
        dtype=h5py.string_dtype() if texts else None,
    )
    item.attrs.update(variable.attrs)
    return item


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
