"""Image of the flank, interpolated from values on contact lines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def over_flank(u: NDArray, y: NDArray, width: NDArray, values: NDArray, path: NDArray, across: NDArray) -> NDArray:
    """Interpolate values on the segments of contact lines at the points of a grid, (path, across).

    The first step interpolates along the lines, with linear extrapolation to their ends but not through zero. The
    second step interpolates between neighbouring lines, whose segments need not lie side by side: between points with
    the same y and between points with the same u, with more weight on the pair of values that differs less. A feature
    of the face (end relief) or of the profile (tip relief) therefore runs straight from line to line. Points without a
    line nearby are NaN.

    Parameters
    ----------
    u, y, width, values
        Coordinates u and y, width along the face [mm] and values of the segments, (line, segment); lines in the order
        of their u.
    path, across
        Coordinates u (path,) and y (across,) of the grid [mm].
    """
    # contact lines of coast flanks run the other way
    ascending = np.argsort(y, axis=-1)
    u, y, width, values = (np.take_along_axis(each, ascending, axis=-1) for each in (u, y, width, values))
    u, y, values = (_to_the_ends(each, y, width) for each in (u, y, values))
    along = np.array([np.interp(across, *line) for line in zip(y, values, strict=True)])
    over = np.array([_where_reached(path, *line) for line in zip(u, values, strict=True)])
    run = y[:, -1:] - y[:, :1]
    slope = (u[:, -1:] - u[:, :1]) / np.where(run > 0, run, 1.0)
    position = u[:, :1] + (across - y[:, :1]) * slope
    room = 1e-9 * np.ptp(across)
    reached = (across >= y[:, :1] - room) & (across <= y[:, -1:] + room)
    image = np.full((len(path), len(across)), np.nan)
    for column, there in enumerate(reached.T):
        lines = np.flatnonzero(there)
        if len(lines) == 1:
            image[:, column] = along[lines[0], column]
        elif len(lines):
            positions = position[lines, column]
            before = np.clip(np.searchsorted(positions, path) - 1, 0, len(lines) - 2)
            part = np.clip(
                (path - positions[before]) / np.maximum(positions[before + 1] - positions[before], 1e-300),
                0.0,
                1.0,
            )
            pair = lines[before], lines[before + 1]
            same_y, same_u = along[pair, column], over[pair, np.arange(len(path))]
            image[:, column] = _between(part, same_y, same_u)
    return image


def _to_the_ends(values: NDArray, y: NDArray, width: NDArray) -> NDArray:
    """Add values extrapolated to both ends of the lines, (line, segment + 2)."""
    if values.shape[1] == 1:
        return np.repeat(values, 3, axis=1)
    extended = [values]
    for end, inner, place in ((0, 1, 0), (-1, -2, 1)):
        run = y[:, end] - y[:, inner]
        slope = (values[:, end] - values[:, inner]) / np.where(run != 0, run, 1.0)
        beyond = values[:, end] + slope * np.sign(run) * width[:, end] / 2
        # a load does not become negative where it vanishes
        beyond = np.where(values.min(axis=1) >= 0, np.maximum(beyond, 0.0), beyond)
        extended.insert(place * len(extended), beyond[:, None])
    return np.concatenate(extended, axis=1)


def _where_reached(path: NDArray, u: NDArray, values: NDArray) -> NDArray:
    """Interpolate the values of a line over u at the points ``path``, (path,); NaN beyond the ends of the line."""
    if u[0] > u[-1]:
        u, values = u[::-1], values[::-1]
    return np.interp(path, u, values, left=np.nan, right=np.nan)


def _between(part: NDArray, same_y: NDArray, same_u: NDArray) -> NDArray:
    """Interpolate at the share ``part`` of the way between two lines with values (2, path); ``same_u`` may be NaN."""
    by_y, by_u = ((1 - part) * first + part * second for first, second in (same_y, same_u))
    change_y, change_u = (np.diff(each, axis=0)[0] ** 2 for each in (same_y, same_u))
    share = change_y / np.maximum(change_y + change_u, 1e-300)
    return np.where(np.isnan(by_u), by_y, by_y + share * (by_u - by_y))
