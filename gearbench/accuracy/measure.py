"""The numbers whose error is meant: mean and fluctuation of STE and mesh stiffness over the mesh cycle."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.results.cycle import MeshCycle
from gearbench.results.responses import response

#: Names of responses, in the order of the arrays.
MEASURED = ("transmission_error_mean", "transmission_error_rms", "mesh_stiffness_mean", "mesh_stiffness_rms")
#: The error of a fluctuation is relative to itself, but to no less than this fraction of the mean.
FLOOR = 0.01


def measured(cycle: MeshCycle) -> NDArray:
    """The four numbers of a cycle, or of many, (4, …)."""
    return np.array([response(name).reduce(cycle) for name in MEASURED])


def scales(values: ArrayLike) -> NDArray:
    """Scales of relative errors, (…, 4): the values, fluctuations not below ``FLOOR`` of their mean."""
    v = np.abs(np.asarray(values, dtype=float))
    # the RMS of the stiffness is relative already, in percent
    least = np.stack([v[..., 0], FLOOR * v[..., 0], v[..., 2], np.full_like(v[..., 3], 100 * FLOOR)], axis=-1)
    return np.maximum(v, least)


def relative_errors(values: ArrayLike, reference: ArrayLike) -> NDArray:
    """Relative error of each of the four numbers, (…, 4)."""
    return np.abs(np.asarray(values) - np.asarray(reference)) / scales(reference)
