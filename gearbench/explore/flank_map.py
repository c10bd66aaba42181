"""A quantity on the flank as an image: face width across, path of contact up."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gearbench.results.flank_map import over_flank
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
    """
    lines, meshing = solved.lines, solved.scene.pair.meshing
    active = lines.active
    order = np.argsort((lines.mesh_phase[:, None] + lines.index)[active])
    u, y, length, own = (each[active][order] for each in (lines.u, lines.y, lines.length, values))
    (first, last), (across, up) = flank_range(solved), size
    path = first + (np.arange(up) + 0.5) / up * (last - first)
    face = (np.arange(across) + 0.5) / across * meshing.face_width
    return over_flank(u, y, length * math.cos(meshing.beta_b), own, path, face)
