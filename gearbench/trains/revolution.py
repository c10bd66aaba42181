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
    ring = solved.linkage.train.meshes[-1].pair.wheel
    offset = eccentric(solved, abs(ring.teeth) * turns)
    forces = curves(solved, float(short.keys.number))
    _, F = solved.statics(offset[:, None]).balanced(forces, solved.begun(POINTS), SETTLED)
    sharing: NDArray = (F / solved.even).max(axis=1).T
    coords: Columns = {"revolution": (("revolution",), turns)}
    return coords, {"load_sharing_over_revolution": (("mesh", "revolution"), sharing)}


def eccentric(solved: SolvedTrain, time: NDArray) -> NDArray:
    """Approach that run-outs add to each mesh since the ``time`` 0 [mesh periods], (…, mesh) [mm]."""
    found = np.zeros((*time.shape, len(solved.even)))
    short = None if solved.scene.train is None else solved.scene.train.planetary
    if short is None:
        return found
    modes = short.modes(solved.linkage)
    for name, amount in short.eccentricities.items():
        angle = turned(solved, name, time)[..., None]
        found += amount * ((np.cos(angle) - 1) * modes[f"{name} x"] + np.sin(angle) * modes[f"{name} y"])
    return found


def turned(solved: SolvedTrain, body: str, time: NDArray) -> NDArray:
    """Angle by which a body has turned in the frame of the axes since the ``time`` 0 [mesh periods], (…) [rad]."""
    train = solved.linkage.train
    rate = solved.linkage.rates.get(body, 0.0) / train.meshes[0].pair.gears[0].teeth
    return 2 * np.pi * train.turn(train.meshes[0].name) * rate * time
