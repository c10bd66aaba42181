"""Values on contact lines as an image of the flank: face width across, path of contact up."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def over_flank(u: NDArray, y: NDArray, width: NDArray, values: NDArray, path: NDArray, across: NDArray) -> NDArray:
    """Values on the segments of contact lines at the points of a grid, (path, across); NaN where no line is near.

    Interpolated along each line in y first, as far as its outermost segments reach, then between lines in u:
    neighbouring lines need not have their segments side by side.

    Parameters
    ----------
    u, y, width, values
        (line, segment), lines in the order of their u; ``width`` of the segments along the face [mm].
    path, across
        Coordinates u and y of the grid [mm].
    """
    # lines of the coast flanks run the other way
    ascending = np.argsort(y, axis=-1)
    u, y, width, values = (np.take_along_axis(each, ascending, axis=-1) for each in (u, y, width, values))
    along = np.array([np.interp(across, *line) for line in zip(y, values, strict=True)])
    run = y[:, -1:] - y[:, :1]
    slope = (u[:, -1:] - u[:, :1]) / np.where(run > 0, run, 1.0)
    position = u[:, :1] + (across - y[:, :1]) * slope
    reached = (across >= y[:, :1] - width[:, :1] / 2) & (across <= y[:, -1:] + width[:, -1:] / 2)
    image = np.full((len(path), len(across)), np.nan)
    for column, there in enumerate(reached.T):
        if there.any():
            image[:, column] = np.interp(path, position[there, column], along[there, column])
    return image
