"""Numbers whose error is controlled: means, RMS, peak-to-peak values and harmonics of STE and mesh stiffness."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.results.cycle import MeshCycle
from gearbench.results.responses import response

#: Responses measured in work–precision curves and over error samples, in the order of the arrays.
MEASURED = ("transmission_error_mean", "transmission_error_rms", "mesh_stiffness_mean", "mesh_stiffness_rms")
#: Number of harmonics that the accuracy of a single cycle covers.
HARMONICS = 5
#: Responses that the accuracy of a single cycle covers.
COVERED = (
    *MEASURED,
    "transmission_error_peak_to_peak",
    "mesh_stiffness_peak_to_peak",
    *(f"{curve}_amplitude_{n}" for curve in ("transmission_error", "mesh_stiffness") for n in range(1, HARMONICS + 1)),
)
#: Errors are relative to the number itself. The scale of a fluctuation is at least FLOOR times the mean, that of a
#: harmonic at least HARMONIC_FLOOR times the peak-to-peak value.
FLOOR, HARMONIC_FLOOR = 0.01, 0.2


def measured(cycle: MeshCycle) -> NDArray:
    """Compute the four numbers ``MEASURED`` of one or many cycles, (4, …)."""
    return np.array([response(name).reduce(cycle) for name in MEASURED])


def covered(cycle: MeshCycle) -> NDArray:
    """Compute the numbers ``COVERED`` of one or many cycles, (16, …); harmonics beyond uniform phases are NaN."""
    return np.array([response(name).reduce(cycle) for name in COVERED])


def scales(values: ArrayLike) -> NDArray:
    """Scales of relative errors of the numbers ``MEASURED`` or ``COVERED``, (…, number), in the shape of ``values``."""
    v = np.abs(np.asarray(values, dtype=float))
    # the RMS of the stiffness is already relative, in percent
    least = [v[..., 0], FLOOR * v[..., 0], v[..., 2], np.full_like(v[..., 3], 100 * FLOOR)]
    if v.shape[-1] == len(COVERED):
        peaks = [np.maximum(v[..., 4], FLOOR * v[..., 0]), np.maximum(v[..., 5], FLOOR * v[..., 2])]
        least += [*peaks, *(HARMONIC_FLOOR * peak for peak in peaks for _ in range(HARMONICS))]
    return np.maximum(v, np.stack(least, axis=-1))


def relative_errors(values: ArrayLike, reference: ArrayLike) -> NDArray:
    """Relative errors of the numbers, (…, 4) or (…, 16)."""
    return np.abs(np.asarray(values) - np.asarray(reference)) / scales(reference)


def largest_errors(values: ArrayLike, reference: ArrayLike) -> NDArray:
    """Largest ``relative_errors`` over all cycles for every number, (4,) or (16,)."""
    errors = relative_errors(values, reference)
    return errors.reshape(-1, errors.shape[-1]).max(axis=0)
