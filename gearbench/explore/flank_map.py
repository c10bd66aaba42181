"""A quantity on the flank as an image: face width across, path of contact up."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gearbench.results.solved import Solved

#: Pixels across and up.
SIZE = (48, 72)


def flank_range(solved: Solved) -> tuple[float, float]:
    """u [mm] between which a map is drawn: the path of contact, or as far as lines reach beyond it."""
    lines, meshing = solved.lines, solved.scene.pair.meshing
    u = lines.u[lines.active]
    return min(meshing.path_start, float(u.min())), max(meshing.path_end, float(u.max()))


def flank_map(solved: Solved, values: NDArray, size: tuple[int, int] = SIZE) -> NDArray:
    """``values`` (position, pair, segment) over the rectangle of 0 … b and ``flank_range``, (up, across).

    NaN where no line is near.

    At fixed y the line of phase τ + k stands at u = u_A + (τ + k) p_bt + y tan β_b: interpolated along each line in y,
    then between lines in u.
    """
    lines, pair = solved.lines, solved.scene.pair
    active = lines.active
    turn = (lines.mesh_phase[:, None] + lines.index)[active]
    order = np.argsort(turn)
    turn, y, q = turn[order], lines.y[active][order], values[active][order]
    half = lines.length[active][order] * math.cos(pair.meshing.beta_b) / 2
    across, up = size
    positions = (np.arange(across) + 0.5) / across * pair.meshing.face_width
    first, last = flank_range(solved)
    u = first + (np.arange(up) + 0.5) / up * (last - first)
    along = np.array([np.interp(positions, *line) for line in zip(y, q, strict=True)])  # (line, across)
    reached = (positions >= y[:, :1] - half[:, :1]) & (positions <= y[:, -1:] + half[:, -1:])
    image = np.full((up, across), np.nan)
    for column, face in enumerate(positions):
        there = reached[:, column]
        if there.any():
            at = pair.meshing.path_start + turn[there] * pair.meshing.base_pitch + face * math.tan(pair.meshing.beta_b)
            image[:, column] = np.interp(u, at, along[there, column])
    return image
