"""Load sharing of a planetary set with eccentric members over one revolution of the carrier."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.results.points import Columns
from gearbench.trains.scatter import FORCE_TOLERANCE, curves
from gearbench.trains.solve import SolvedTrain

#: Number of carrier positions over one revolution relative to the ring.
POINTS = 128


def revolution_columns(solved: SolvedTrain) -> tuple[Columns, Columns]:
    """Coordinates and variables over the carrier revolution; both empty without ``[planetary.run_out]``.

    At each carrier position the variable is the largest load share of each mesh over one mesh cycle. The eccentric
    members stand still during this cycle, which is short compared with the revolution.
    """
    planetary = solved.scene.planetary
    if planetary is None or planetary.keys.run_out is None:
        return {}, {}
    turns = np.arange(POINTS) / POINTS
    train = solved.linkage.train
    *_, last = train.periods  # a mesh at the ring
    period = train.periods[train.meshes[0].name] / train.periods[last]  # mesh period at the ring over that at the sun
    offset = eccentric(solved, abs(train[last].pair.wheel.teeth) * period * turns)[:, None]
    forces = curves(solved, float(planetary.keys.number))
    _, F = solved.statics(offset).balanced(forces, *solved.first_guess(offset), FORCE_TOLERANCE)
    sharing: NDArray = (F / solved.even).max(axis=1).T
    coords: Columns = {"revolution": (("revolution",), turns)}
    return coords, {"load_sharing_over_revolution": (("mesh", "revolution"), sharing)}


def eccentric(solved: SolvedTrain, time: NDArray) -> NDArray:
    """Approach (…, mesh) [mm] that run-out adds to each mesh between time 0 and ``time`` (…) [mesh periods]."""
    approach = np.zeros((*time.shape, len(solved.even)))
    planetary = solved.scene.planetary
    if planetary is None:
        return approach
    modes = planetary.modes(solved.linkage)
    for name, amount in planetary.eccentricities.items():
        angle = turned(solved, name, time)[..., None]
        approach += amount * ((np.cos(angle) - 1) * modes[f"{name} x"] + np.sin(angle) * modes[f"{name} y"])
    return approach


def turned(solved: SolvedTrain, body: str, time: NDArray) -> NDArray:
    """Angle a body has turned since time 0 in the frame of the axes, at ``time`` (…) [mesh periods]; (…) [rad]."""
    train = solved.linkage.train
    rate = solved.linkage.rates.get(body, 0.0) / train.meshes[0].pair.gears[0].teeth
    return 2 * np.pi * train.turn(train.meshes[0].name) * rate * time
