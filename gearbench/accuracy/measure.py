"""The numbers whose error is meant: means, RMS and peak-to-peak values and harmonics of STE and mesh stiffness."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.results.cycle import MeshCycle
from gearbench.results.responses import response

#: Names of responses, in the order of the arrays: of work–precision curves, and over error samples.
MEASURED = ("transmission_error_mean", "transmission_error_rms", "mesh_stiffness_mean", "mesh_stiffness_rms")
#: Harmonics that the accuracy of a single cycle covers.
HARMONICS = 5
#: Names of responses that the accuracy of a single cycle covers.
COVERED = (
    *MEASURED,
    "transmission_error_peak_to_peak",
    "mesh_stiffness_peak_to_peak",
    *(f"{curve}_amplitude_{n}" for curve in ("transmission_error", "mesh_stiffness") for n in range(1, HARMONICS + 1)),
)
#: The error of a fluctuation is relative to itself, but to no less than this fraction of the mean, and that of a
#: harmonic to no less than a fraction of peak-to-peak.
FLOOR, HARMONIC_FLOOR = 0.01, 0.2


def measured(cycle: MeshCycle) -> NDArray:
    """The four numbers ``MEASURED`` of a cycle, or of many, (4, …)."""
    return np.array([response(name).reduce(cycle) for name in MEASURED])


def covered(cycle: MeshCycle) -> NDArray:
    """The numbers ``COVERED`` of a cycle, or of many, (16, …); harmonics beyond those of few uniform phases are NaN."""
    return np.array([response(name).reduce(cycle) for name in COVERED])


def scales(values: ArrayLike) -> NDArray:
    """Scales of relative errors of the numbers ``MEASURED`` or ``COVERED``, of the shape of the values (…, number)."""
    v = np.abs(np.asarray(values, dtype=float))
    # the RMS of the stiffness is relative already, in percent
    least = [v[..., 0], FLOOR * v[..., 0], v[..., 2], np.full_like(v[..., 3], 100 * FLOOR)]
    if v.shape[-1] == len(COVERED):
        peaks = [np.maximum(v[..., 4], FLOOR * v[..., 0]), np.maximum(v[..., 5], FLOOR * v[..., 2])]
        least += [*peaks, *(HARMONIC_FLOOR * peak for peak in peaks for _ in range(HARMONICS))]
    return np.maximum(v, np.stack(least, axis=-1))


def relative_errors(values: ArrayLike, reference: ArrayLike) -> NDArray:
    """Relative error of each of the numbers, (…, 4) or (…, 16)."""
    return np.abs(np.asarray(values) - np.asarray(reference)) / scales(reference)


def largest_errors(values: ArrayLike, reference: ArrayLike) -> NDArray:
    """``relative_errors``, of each number the largest of all cycles, (4,) or (16,)."""
    errors = relative_errors(values, reference)
    return errors.reshape(-1, errors.shape[-1]).max(axis=0)
