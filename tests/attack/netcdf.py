"""NetCDF files damaged byte by byte, and by means of the format itself."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.random import Generator

from tests.attack import hostile


def written(dataset: Any) -> bytes:
    """The bytes of a saved Dataset."""
    import tempfile

    from gearbench.results.netcdf import save

    with tempfile.TemporaryDirectory() as folder:
        return save(dataset, Path(folder) / "whole.nc").read_bytes()


def damaged(rng: Generator, whole: bytes) -> bytes:
    """Bytes flipped, cut or overwritten, or variables and attributes changed through HDF5."""
    if rng.random() < 0.5:
        return hostile.data(rng, whole)
    buffer = io.BytesIO(whole)
    with h5py.File(buffer, "r+") as file:
        changes = (_drop, _rename, _retype, _value, _attribute, _units, _group)
        changes[rng.integers(len(changes))](rng, file)
    return buffer.getvalue()


def _some(rng: Generator, file: Any) -> str:
    names = sorted(file)
    return names[rng.integers(len(names))]


def _drop(rng: Generator, file: Any) -> None:
    del file[_some(rng, file)]


def _rename(rng: Generator, file: Any) -> None:
    name = _some(rng, file)
    file[hostile.NAMES[5]] = file[name]
    if rng.random() < 0.5:
        del file[name]


def _retype(rng: Generator, file: Any) -> None:
    name = _some(rng, file)
    kinds = ("S3", "float32", "bool", "complex128", "int8", h5py.string_dtype())
    shape, kind = file[name].shape, kinds[rng.integers(len(kinds))]
    del file[name]
    file.create_dataset(name, shape[:1] if rng.random() < 0.3 else shape, dtype=kind)


def _value(rng: Generator, file: Any) -> None:
    """One number replaced by a hostile one: nothing that the format itself could notice."""
    names = [name for name in sorted(file) if file[name].dtype.kind in "fi" and file[name].size]
    if not names:
        return
    one = file[names[rng.integers(len(names))]]
    values = one[...]
    numbers = (np.nan, np.inf, 0.0, -1.0, 1e300, 1e-3) if one.dtype.kind == "f" else (-1, 10**6, 0, 1)
    with np.errstate(all="ignore"):
        values.flat[rng.integers(values.size)] = np.array(numbers)[rng.integers(len(numbers))].astype(one.dtype)
    one[...] = values


def _attribute(rng: Generator, file: Any) -> None:
    names = sorted(file.attrs)
    name = names[rng.integers(len(names))] if names else "x"
    values = (b"\xff\xfe", 1.0, "not toml [", "", np.array([1, 2]), hostile.NAMES[5], np.array(["a", "b"], dtype="S1"))
    if name.startswith("_"):
        return
    del file.attrs[name]
    if rng.random() < 0.8:
        file.attrs[name] = values[rng.integers(len(values))]


def _units(rng: Generator, file: Any) -> None:
    one = file[_some(rng, file)]
    one.attrs[("units", "scale_factor", "_FillValue", "calendar", "coordinates")[rng.integers(5)]] = (
        "days since 2000", 3.0, "x", "seconds", np.array([1.0, 2.0]),
    )[rng.integers(5)]  # fmt: skip


def _group(rng: Generator, file: Any) -> None:
    name = _some(rng, file)
    del file[name]
    links: tuple[Callable[[], Any], ...] = (
        lambda: file.create_group(name),
        lambda: file.__setitem__(name, h5py.ExternalLink("/etc/passwd", "/")),
        lambda: file.__setitem__(name, h5py.SoftLink("/nowhere")),
        lambda: file.__setitem__(name, h5py.SoftLink("/" + name)),
    )
    links[rng.integers(len(links))]()
