"""Grid of measured flank deviations, read from CSV or netCDF and interpolated.

CSV: the first cell of the first row names the coordinate of the first column: ``radius``, ``diameter`` or
``roll_length`` (√(R² − r_b²)), in mm. The rest of the first row holds the positions y [mm] over the face of the
gear, whose ends are at 0 and its face width. Every further row holds one coordinate and its deviations [µm]. Cells are
separated by commas, tabs or semicolons; with tabs or semicolons the decimal mark may be a comma. Lines that begin with
# are comments.
NetCDF: one variable with two dimensions: face_position, and radius, diameter or roll_length. Both coordinates
are in mm; the attribute ``units`` of the variable is µm or mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.geometry.gear import Gear
from gearbench.lazy import xr
from gearbench.netcdf_bytes import dataset_of, is_netcdf

ALONG = ("radius", "diameter", "roll_length")
FACE = "face_position"
#: Largest coordinate [mm] and largest deviation [µm] that are accepted.
LARGEST, LARGEST_DEVIATION = 1e5, 1000
_MICROMETRES = {"µm": 1.0, "μm": 1.0, "um": 1.0, "micrometer": 1.0, "micrometre": 1.0, "mm": 1e3}


@dataclass(frozen=True, kw_only=True)
class FlankGrid:
    """Deviations on a grid of a flank: bilinear within the grid, constant beyond its edges.

    Parameters
    ----------
    along
        Kind of ``coordinate``: one of ``ALONG``.
    coordinate, face
        Increasing positions along the profile (n,) and over the face (m,) [mm].
    deviation
        Deviations (n, m) [µm]; their sign is that of the file (``Topography.positive``).
    """

    along: str
    coordinate: NDArray
    face: NDArray
    deviation: NDArray

    def at(self, gear: Gear, radius: NDArray, y: NDArray) -> NDArray:
        """Deviation [µm] at radius R and position y over the face [mm] of ``gear``; arrays of one shape."""
        i, s = _position(self.coordinate, self.coordinate_of(gear, radius))
        j, t = _position(self.face, y)
        next_i, next_j = np.minimum(i + 1, len(self.coordinate) - 1), np.minimum(j + 1, len(self.face) - 1)
        z = self.deviation
        low = (1 - t) * z[i, j] + t * z[i, next_j]
        high = (1 - t) * z[next_i, j] + t * z[next_i, next_j]
        return (1 - s) * low + s * high

    def coordinate_of(self, gear: Gear, radius: NDArray) -> NDArray:
        """Coordinate of the grid at the radius R [mm]."""
        radius = np.abs(radius)  # radii of internal gears are negative
        if self.along == "roll_length":
            return np.abs(gear.roll_length(radius))
        return radius if self.along == "radius" else 2 * radius

    def radii(self, gear: Gear) -> NDArray:
        """Radii R [mm] of the grid, (n,)."""
        if self.along == "roll_length":
            return gear.radius_at(self.coordinate)
        return gear.sign * (self.coordinate if self.along == "radius" else self.coordinate / 2)

    def to_array(self, name: str) -> xr.DataArray:
        """The grid as a variable ``name`` of a Dataset [µm], with dimensions whose names begin with ``name`` [mm]."""
        dims = tuple(f"{name}_{axis}" for axis in (self.along, FACE))
        coords = {
            dim: (dim, values, {"units": "mm", "long_name": axis.replace("_", " ")})
            for dim, axis, values in zip(dims, (self.along, FACE), (self.coordinate, self.face), strict=True)
        }
        return xr.DataArray(self.deviation, coords, dims, name, {"units": "µm"})


def grid_of(array: xr.DataArray) -> FlankGrid:
    """Grid from a variable made by ``FlankGrid.to_array``.

    Raises
    ------
    InputError
        If the variable is not a grid.
    """
    name = str(array.name)
    plain = array.rename({dim: str(dim).removeprefix(f"{name}_") for dim in array.dims})
    return _checked(name, "dataset", _of_variable(name, "dataset", plain))


def _position(grid: NDArray, x: NDArray) -> tuple[NDArray, NDArray]:
    """Number of the interval of ``grid`` that contains x, and the position in it from 0 to 1, clipped to the grid."""
    if len(grid) == 1:
        return np.zeros(x.shape, dtype=np.intp), np.zeros(x.shape)
    i = np.clip(np.searchsorted(grid, x, side="right") - 1, 0, len(grid) - 2)
    return i, np.clip((x - grid[i]) / (grid[i + 1] - grid[i]), 0.0, 1.0)


def read_grid(key: str, name: str, data: bytes) -> FlankGrid:
    """Grid from the bytes of a file.

    Raises
    ------
    InputError
        For the key ``key``; the message names the file ``name`` and its row (CSV) or variable (netCDF).
    """
    return _checked(key, name, _from_netcdf(key, name, data) if is_netcdf(data) else _from_csv(key, name, data))


def _checked(key: str, name: str, grid: FlankGrid) -> FlankGrid:
    """Check that coordinates increase and deviations are plausible, and return the grid."""
    for axis, values in ((grid.along, grid.coordinate), (FACE, grid.face)):
        if not (values.size and np.isfinite(values).all() and np.all(np.diff(values) > 0)):
            raise InputError(key, f"{name}, {axis}", "must be finite and strictly increasing")
        if max(-values[0], values[-1]) > LARGEST:
            raise InputError(key, f"{name}, {axis} {values[0]:g} to {values[-1]:g}", f"must be within ±{LARGEST:g} mm")
    implausible = np.argwhere(~(np.abs(grid.deviation) <= LARGEST_DEVIATION))  # not >, to include NaN
    if len(implausible):
        row, column = implausible[0]
        where = f"{name}, {grid.along} {grid.coordinate[row]:g}, y {grid.face[column]:g}"
        allowed = f"must be a number within ±{LARGEST_DEVIATION} µm"
        raise InputError(key, where, f"deviation {grid.deviation[row, column]:g} µm: {allowed}")
    return grid


def _from_csv(key: str, name: str, data: bytes) -> FlankGrid:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(key, name, "must be text (UTF-8) or netCDF") from None
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and line.lstrip()[0] != "#"]
    if len(lines) < 2:
        raise InputError(key, name, "must have a first row of positions y and at least one row of deviations")
    separator = next((mark for mark in ";\t" if mark in lines[0][1]), ",")
    (first, *face), *rows = ([cell.strip() for cell in line.split(separator)] for _, line in lines)
    along = first.lower().replace(" ", "_").removesuffix("_mm").removesuffix("_[mm]")
    if along not in ALONG:
        allowed = f"the first cell must be {', '.join(ALONG[:-1])} or {ALONG[-1]} [mm]"
        raise InputError(key, f"{name}, row {lines[0][0]}: {first!r}", allowed)
    if not face:
        raise InputError(key, f"{name}, row {lines[0][0]}", f"no positions y: separate them with {separator!r}")
    values = [_numbers(key, f"{name}, row {lines[0][0]}", face, len(face), separator)]
    for (n, _), row in zip(lines[1:], rows, strict=True):
        values.append(_numbers(key, f"{name}, row {n}", row, len(face) + 1, separator))
    table = np.array(values[1:])
    return FlankGrid(along=along, coordinate=table[:, 0], face=np.array(values[0]), deviation=table[:, 1:])


def _numbers(key: str, where: str, cells: list[str], count: int, separator: str) -> list[float]:
    if len(cells) != count:
        raise InputError(key, where, f"{len(cells)} values where {count} are needed")
    numbers = []
    for column, cell in enumerate(cells, 1):
        try:
            numbers.append(float(cell.replace(",", ".") if separator != "," else cell))
        except ValueError:
            raise InputError(key, f"{where}, column {column}: {cell[:20]!r}", "must be a number") from None
    return numbers


def _from_netcdf(key: str, name: str, data: bytes) -> FlankGrid:
    try:
        dataset = dataset_of(data)
    except InputError as error:
        raise InputError(key, name, error.allowed) from None
    fitting = [v for along in ALONG for v in dataset.data_vars.values() if set(v.dims) == {along, FACE}]
    if len(fitting) != 1:
        allowed = f"exactly one variable must have the dimensions {FACE} and one of {', '.join(ALONG)}"
        raise InputError(key, f"{name}, {len(fitting)} fitting variables", allowed)
    return _of_variable(key, name, fitting[0])


def _of_variable(key: str, name: str, variable: xr.DataArray) -> FlankGrid:
    """Grid from a variable with one dimension of ``ALONG``, and ``FACE``."""
    along = next((str(dim) for dim in variable.dims if dim in ALONG), "")
    if set(variable.dims) != {along, FACE}:
        allowed = f"must have the dimensions {FACE} and one of {', '.join(ALONG)}"
        raise InputError(key, f"{name}, {variable.name}", allowed)
    for coordinate in (along, FACE):
        if coordinate not in variable.coords:
            raise InputError(key, f"{name}, {coordinate}", "must be a coordinate, in mm")
        if (units := str(variable[coordinate].attrs.get("units", "mm"))) != "mm":
            raise InputError(key, f"{name}, {coordinate} in {units}", "must be in mm")
    for part in (variable[along], variable[FACE], variable):
        if part.dtype.kind not in "iuf":
            raise InputError(key, f"{name}, {part.name}", "must be numbers")
    factor = _factor(key, name, variable)
    deviation = factor * variable.transpose(along, FACE).values.astype(float)
    coordinates = (variable[along].values.astype(float), variable[FACE].values.astype(float))
    return FlankGrid(along=along, coordinate=coordinates[0], face=coordinates[1], deviation=deviation)


def _factor(key: str, name: str, variable: xr.DataArray) -> float:
    """Factor from the variable's unit to µm."""
    units = str(variable.attrs.get("units", "missing"))
    if units not in _MICROMETRES:
        raise InputError(key, f"{name}, {variable.name}: units {units}", "must be µm or mm")
    return _MICROMETRES[units]
