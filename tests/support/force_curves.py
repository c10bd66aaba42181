"""Readable version of the force of a mesh over approach and phase, which ``_kernels.run`` computes compiled."""

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.force_curve import ForceCurve


def force_at(curve: ForceCurve, x: NDArray) -> NDArray:
    """F(x, τ) of (D9) [N] at the approaches x (…, phase) [mm]."""
    low = np.floor(curve.back_phase).astype(int)
    f, share = _drive(curve, x, np.arange(curve.steps)), curve.back_phase - low
    for index, weight in ((low % curve.steps, 1 - share), ((low + 1) % curve.steps, share)):
        f = f - weight * _drive(curve, -x - curve.backlash, index)
    return f


def _drive(curve: ForceCurve, x: NDArray, phase: NDArray) -> NDArray:
    """Force of the drive flanks [N] at x (…, phase) [mm] and at the steps ``phase`` (phase,)."""
    position = np.maximum((x - curve.begin[phase]) / curve.spacing, 0.0)
    interval = np.minimum(position.astype(int), curve.table.shape[1] - 2)
    low, high = curve.table[phase, interval], curve.table[phase, interval + 1]
    return low + (position - interval) * (high - low)
