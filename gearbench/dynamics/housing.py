"""Motion or pressure at points of a housing, from bearing forces and transfer functions."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gearbench.errors import InputError, naming
from gearbench.files import read_bytes
from gearbench.lazy import xr
from gearbench.netcdf_bytes import dataset_of
from gearbench.results.responses import described

#: Largest allowed value of a transfer function; sums of squares stay far below overflow.
LARGEST = 1e100
#: Dimensions of a file of transfer functions, and its variables.
DIMENSIONS, PARTS = ("point", "bearing", "direction", "frequency"), ("transfer_real", "transfer_imaginary")


def read_housing(path: str | Path) -> xr.Dataset:
    """Read the transfer functions of a housing from a netCDF file.

    ``transfer_real`` and ``transfer_imaginary`` (point, bearing, direction, frequency) are the response at a point per
    force on a bearing of the shafts; their attribute ``units`` holds the unit ("m/s²/N", "Pa/N"). ``frequency`` [Hz]
    ascends. Bearings have the names that the scene gives them; directions are "x", "y" and "axial".

    Raises
    ------
    InputError
        If a part is missing or invalid; the message names the file and the part.
    """
    content = read_bytes(path)
    with naming(path):
        data = dataset_of(content)
        for name in (*PARTS, *DIMENSIONS):
            if name not in data.variables:
                raise InputError(name, "missing", f"the file must contain {', '.join((*PARTS, *DIMENSIONS))}")
            dimensions = DIMENSIONS if name in PARTS else (name,)
            if set(data[name].dims) != set(dimensions) or not data[name].size:
                raise InputError(
                    name, str(data[name].dims), f"must have the dimensions {dimensions}, none of them empty"
                )
        for name in ("bearing", "direction"):
            labels = [str(label) for label in data[name].values]
            if len({*labels}) < len(labels):
                raise InputError(name, ", ".join(labels), "must all be different")
            data = data.assign_coords({name: labels})
        for name in (*PARTS, "frequency"):
            if data[name].dtype.kind not in "iuf":
                raise InputError(name, f"{data[name].dtype}", "must be finite numbers")
            if not np.isfinite(data[name].values).all():
                raise InputError(name, "not finite", "must be finite numbers")
        frequency = data["frequency"].values
        if len(frequency) < 2 or np.any(np.diff(frequency.astype(float)) <= 0):
            shown = "not ascending" if len(frequency) > 1 else "one value"
            raise InputError("frequency", shown, "must ascend and have at least two values")
        for part in PARTS:
            largest = float(np.abs(data[part].values.astype(float)).max())
            if largest > LARGEST:
                raise InputError(part, largest, f"must be at most {LARGEST:g}")
    return data


def housing_response(dataset: xr.Dataset, housing: xr.Dataset) -> xr.Dataset:
    """Add to the ``dataset`` that ``response`` returned the vibration of a housing under its bearing forces.

    The contributions of all bearings and directions add up with their phases, for each order of each mesh. Between two
    frequencies of the file, real and imaginary part are interpolated linearly. At a resonance this is accurate to 1 %
    of the peak if the step is a tenth of the half-power bandwidth.

    Returns
    -------
    The Dataset with ``housing_amplitude`` and ``housing_phase`` (speed, mesh, point, harmonic), at the orders of
    every mesh. Orders outside the frequencies of the transfer functions are NaN, and a note says so.

    Raises
    ------
    InputError
        If the Dataset has no bearing forces by order, or the housing lacks a bearing or direction.
    """
    if "bearing_force_phase" not in dataset:
        raise InputError("bearing_force_phase", "missing", "a housing needs a linear response of a pair on shafts")
    if "lobes" in dataset.dims:  # force waves round the ring of a planetary set
        raise InputError(
            "housing",
            "a planetary set",
            "needs a pair on shafts: forces of a planetary set are given in the frame of its carrier",
        )
    bearings = list(map(str, housing["bearing"].values))
    for name in map(str, dataset["bearing"].values):
        if name not in bearings:
            raise InputError("housing", f"no bearing {name}", f"must contain every bearing; it contains {bearings}")
    directions = list(map(str, housing["direction"].values))
    if missing := [name for name in map(str, dataset["direction"].values) if name not in directions]:
        raise InputError("housing", f"no direction {missing[0]}", f"must have x, y and axial: it has {directions}")
    transfer_functions = housing.sel(bearing=dataset["bearing"].values, direction=dataset["direction"].values)
    real, imaginary = (transfer_functions[part].transpose(*DIMENSIONS).values for part in PARTS)
    H, frequencies = real + 1j * imaginary, transfer_functions["frequency"].values
    force = dataset["bearing_force_amplitude"] * np.exp(1j * dataset["bearing_force_phase"])
    force = force.transpose("speed", "mesh", "harmonic", "bearing", "direction").values
    f = dataset["mesh_frequency"].values[..., None] * dataset["harmonic"].values
    k = np.clip(np.searchsorted(frequencies, f) - 1, 0, len(frequencies) - 2)
    weight = (f - frequencies[k]) / (frequencies[k + 1] - frequencies[k])
    outside = (weight < 0) | (weight > 1)
    # (speed, mesh, harmonic, point, bearing, direction)
    transfer = np.moveaxis(H[..., k] * (1 - weight) + H[..., k + 1] * weight, (0, 1, 2), (-3, -2, -1))
    vibration = np.einsum("smnpbd,smnbd->smpn", transfer, force)
    vibration[np.broadcast_to(outside[:, :, None], vibration.shape)] = np.nan
    dims = ("speed", "mesh", "point", "harmonic")
    values = {"housing_amplitude": (dims, np.abs(vibration)), "housing_phase": (dims, np.angle(vibration))}
    data = described(values, "outside the frequencies of the housing")
    result = dataset.assign(data).assign_coords(point=("point", list(map(str, housing["point"].values))))
    units = str(housing[PARTS[0]].attrs.get("units", "1/N")).removesuffix("/N")
    result["housing_amplitude"].attrs["units"] = units
    if outside.any():
        covered = f"{frequencies[0]:g} to {frequencies[-1]:g} Hz"
        line = f"orders outside {covered} have no housing response: the file covers only this range"
        result.attrs["notes"] = "\n".join(filter(None, [dataset.attrs.get("notes", ""), line]))
    return result
