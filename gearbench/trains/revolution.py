"""Load sharing of a planetary set over a revolution of its carrier: eccentric members turn, each with its own speed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.results.points import Columns
from gearbench.trains.scatter import SETTLED, curves
from gearbench.trains.solve import SolvedTrain

#: Positions of the carrier against the ring.
POINTS = 128


def revolution_columns(solved: SolvedTrain) -> tuple[Columns, Columns]:
    """Coordinates and variables over the revolution; none where no member is eccentric.

    The greatest load share of each mesh over the mesh cycle at every position: the cycle is short beside a revolution.
    """
    assert solved.scene.train is not None
    short = solved.scene.train.planetary
    if short is None or short.keys.run_out is None:
        return {}, {}
    turns = np.arange(POINTS) / POINTS
    sense, rates = solved.linkage.train.turn(solved.linkage.train.meshes[0].name), solved.linkage.rates
    of_ring = abs(rates[solved.linkage.ends[1]])
    modes, offset = short.modes(solved.linkage), np.zeros((POINTS, len(solved.even)))
    for name, amount in short.eccentricities.items():
        angle = 2 * np.pi * sense * rates.get(name, 0.0) / of_ring * turns
        way = np.cos(angle)[:, None] * modes[f"{name} x"] + np.sin(angle)[:, None] * modes[f"{name} y"]
        offset += amount * (way - modes[f"{name} x"])  # the set itself is at the beginning
    forces = curves(solved.contacts, float(short.keys.number))
    _, F = solved.statics(offset[:, None]).balanced(forces, solved.begun(POINTS), SETTLED)
    sharing: NDArray = (F / solved.even).max(axis=1).T
    coords: Columns = {"revolution": (("revolution",), turns)}
    return coords, {"load_sharing_over_revolution": (("mesh", "revolution"), sharing)}
