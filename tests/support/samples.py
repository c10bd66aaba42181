"""Samples of a batch, solved one at a time."""

from dataclasses import replace

import numpy as np

from gearbench.contact.batch import Batch
from gearbench.contact.solver import solve


def single(batch: Batch, draw: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """δ_n [mm] and ∂F/∂δ_n [N/mm] of one sample by the solver of single scenes, with the correction of the cells."""
    p, own = batch.problem, batch.arrays(draw)
    arrays = {name: getattr(own, name) for name in ("gap", "a", "h", "sigma", "active", "factor", "block")}
    found = solve(replace(p, **arrays, along=None, shape=(len(own.gap), 1, own.gap.shape[1])))
    return found.approach + batch.missed[0], found.stiffness * batch.missed[1]
