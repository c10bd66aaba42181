"""Reader of bodies: matrices or modes of other programs, in netCDF, Matrix Market or Nastran's punched DMIG."""

from __future__ import annotations

import io
import warnings
from dataclasses import dataclass
from pathlib import PurePath

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.lazy import xr
from gearbench.named_files import content
from gearbench.netcdf_bytes import dataset_of
from gearbench.system.dmig import Punched, read_dmig

#: Directions of the motions of a node: translations along the axes, and rotations about them.
DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
#: Largest number of coordinates of a body.
MOST_COORDINATES = 2000
#: Supported number types and symmetries of Matrix Market files.
KINDS, SYMMETRIES = ("real", "double", "integer", "unsigned-integer"), ("general", "symmetric")


@dataclass(frozen=True, kw_only=True, eq=False)
class Matrices:
    """Contents of a body's file, in the units and axes of the file.

    Parameters
    ----------
    mass, stiffness
        Unchecked matrices (n, n); no mass if the file has none.
    rows
        Motion of each labelled degree of freedom per unit of each coordinate, (label, n).
    labels
        Node and direction of each degree of freedom; the direction is empty if it belongs to no node.
    """

    mass: NDArray | None
    stiffness: NDArray
    rows: NDArray
    labels: tuple[tuple[str, str], ...]


def read_body(key: str, name: str) -> tuple[Matrices, str]:
    """Read a body from a netCDF or punch file; also returns the SHA-256 of the file.

    A netCDF file has ``stiffness`` and optionally ``mass``, both (dof, dof). Instead it may have modes: ``frequency``
    (mode) [Hz] and ``shape`` (mode, dof), with unit modal mass. In both cases it also has ``node`` and ``direction``
    (dof). A direction is x, y, z, rx, ry or rz, or empty for a coordinate that belongs to no node. A punch file has one
    matrix K… and at most one M… (KAAX, MAAX). Its nodes are named by their numbers; scalar points belong to no node.

    Raises
    ------
    InputError
        With the key ``key``, the name of the file, and the fault in it.
    """
    data, digest = content(key, name)
    try:
        if PurePath(name).suffix.lower() in (".nc", ".nc4", ".cdf"):
            return _from_netcdf(dataset_of(data)), digest
        return _from_punch(data.decode("ascii", errors="replace")), digest
    except InputError as error:
        where = ", ".join(part for part in (name, error.key, str(error.value)) if part)
        raise InputError(key, where, error.allowed) from None


def _from_netcdf(data: xr.Dataset) -> Matrices:
    """Matrices, or diagonal matrices of modes, of a netCDF file."""
    for name in ("node", "direction"):
        if name not in data.variables or data[name].dims != ("dof",):
            raise InputError(name, "", "must be a coordinate of the dimension dof")
    labels = tuple((str(a), str(b)) for a, b in zip(data["node"].values, data["direction"].values, strict=True))
    n = len(labels)
    if "stiffness" in data:
        mass = _square(data, "mass", n) if "mass" in data else None
        return Matrices(mass=mass, stiffness=_square(data, "stiffness", n), rows=np.eye(n), labels=labels)
    for name, dims in (("frequency", ("mode",)), ("shape", ("mode", "dof"))):
        if name not in data.variables or set(data[name].dims) != set(dims):
            allowed = f"must have stiffness (dof, dof), or frequency (mode) and shape (mode, dof): no {name} {dims}"
            raise InputError("", "", allowed)
    omega = 2 * np.pi * _numbers(data["frequency"])
    rows = _numbers(data["shape"].transpose("dof", "mode"))
    return Matrices(mass=np.eye(len(omega)), stiffness=np.diag(omega**2), rows=rows, labels=labels)


def _square(data: xr.Dataset, name: str, n: int) -> NDArray:
    """Variable ``name`` as a matrix; refuse other shapes than (n, n)."""
    if data[name].shape != (n, n):
        raise InputError(name, f"{data[name].shape}", f"must be {n} × {n}, as many as node and direction name")
    return _numbers(data[name])


def _numbers(variable: xr.DataArray) -> NDArray:
    """Values of a variable as floats; refuse other types than numbers."""
    if variable.dtype.kind not in "iuf":
        raise InputError(str(variable.name), "", "must be numbers")
    return variable.values.astype(float)


def _from_punch(text: str) -> Matrices:
    """Matrices of a punch file; K4… is Nastran's structural damping, and is ignored."""
    punched_matrices = read_dmig(text)
    stiffness = [name for name in punched_matrices if name.startswith("K") and not name.startswith("K4")]
    mass = [name for name in punched_matrices if name.startswith("M")]
    if len(stiffness) != 1 or len(mass) > 1:
        names = ", ".join(punched_matrices) or "none"
        raise InputError("", f"DMIG {names}", "must have one matrix K… and at most one M…, e.g. KAAX and MAAX")
    K, M = punched_matrices[stiffness[0]], punched_matrices[mass[0]] if mass else None
    places = sorted({*K.places, *(M.places if M else ())})
    labels = tuple((str(grid), DIRECTIONS[c - 1] if c else "") for grid, c in places)
    index_of = {place: number for number, place in enumerate(places)}

    def full(punched: Punched) -> NDArray:
        """Full matrix from the punched entries, which are only one triangle of a symmetric matrix."""
        out = np.zeros((len(places), len(places)))
        for (row, column), value in punched.entries.items():
            out[index_of[row], index_of[column]] = value
            if punched.symmetric:
                out[index_of[column], index_of[row]] = value
        return out

    if len(places) > MOST_COORDINATES:
        raise InputError("", f"{len(places)} degrees of freedom", f"must be at most {MOST_COORDINATES}")
    return Matrices(mass=full(M) if M else None, stiffness=full(K), rows=np.eye(len(places)), labels=labels)


def read_matrix(key: str, name: str) -> tuple[NDArray, str]:
    """Read a square matrix (n, n) from a Matrix Market file; also returns the SHA-256 of the file.

    Raises
    ------
    InputError
        With the key ``key`` and the name of the file.
    """
    from scipy.io import mminfo

    data, digest = content(key, name)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            rows, columns, count, form, kind, symmetry = mminfo(io.BytesIO(data))
            if rows != columns or not 0 < rows <= MOST_COORDINATES or kind not in KINDS or symmetry not in SYMMETRIES:
                given = f"{kind}, {symmetry}, {rows} × {columns}"
                size = f"{MOST_COORDINATES} × {MOST_COORDINATES}"
                raise InputError(key, f"{name}: {given}", f"must be real and square, at most {size}")
            return _matrix(data, rows, count, sparse=form == "coordinate", symmetric=symmetry == "symmetric"), digest
    except InputError:
        raise
    except Exception as error:  # SciPy and NumPy raise several kinds
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise InputError(key, name, f"must be a Matrix Market file ({reason})") from None


def _matrix(data: bytes, n: int, count: int, *, sparse: bool, symmetric: bool) -> NDArray:
    """Matrix (n, n) from the lines below the header.

    scipy.io.mmread reads beyond its memory if a damaged file has a different number of entries than its header states.
    """
    lines = [line for line in data.decode("ascii").splitlines()[1:] if line.strip() and not line.startswith("%")][1:]
    expected = (count, 3) if sparse else (n * (n + 1) // 2 if symmetric else n * n, 1)
    if len(lines) != expected[0]:
        raise ValueError(f"{len(lines)} entries, {expected[0]} expected")
    values = np.loadtxt(lines, ndmin=2, comments=None) if lines else np.zeros(expected)
    if values.shape != expected:
        raise ValueError(f"{values.shape[1]} numbers in a line, {expected[1]} expected")
    if sparse:
        row, column = np.rint(values[:, :2]).T.astype(int) - 1
        if not np.array_equal(values[:, :2], np.transpose([row, column]) + 1):
            raise ValueError("rows and columns must be whole numbers")
        if not ((row >= 0) & (row < n) & (column >= 0) & (column < n)).all():
            raise ValueError(f"rows and columns must be 1 to {n}")
    else:  # column by column; symmetric matrices start each column at the diagonal
        column, row = np.triu_indices(n) if symmetric else np.divmod(np.arange(n * n), n)
    out = np.zeros((n, n))
    np.add.at(out, (row, column), values[:, -1])
    return out + np.tril(out, -1).T + np.triu(out, 1).T if symmetric else out
