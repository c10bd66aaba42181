"""Stability of the motion of meshes whose stiffness varies in time: a proof where one is cheap, Floquet multipliers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.modes import Modes
from gearbench.dynamics.size import in_blocks

#: Modes kept: those with the largest share in the compliance at the meshes.
MODES = 12
#: Phase that a mode turns by in a step [rad], at most.
RESOLVED = 1.0
#: Gain of the loop below which stability counts as proven: frequencies between those looked at are allowed for.
PROVEN = 0.9
#: Modes with a smaller peak, over the static compliance, are not looked at one by one.
PEAK = 0.02


def is_proven(modes: Modes, rows: NDArray, stiffness: NDArray) -> bool:
    """Whether the small-gain theorem proves that no motion grows, at any speed (D7).

    The stiffness may vary within its range in any way: the loop of ĥ_c and K(t) − K̄ damps if the product of their
    largest gains is below 1, in units in which every row has the mean stiffness 1.

    Parameters
    ----------
    modes
        Of the system with the mean stiffnesses.
    rows
        Numbers of the rows of the meshes whose stiffness varies.
    stiffness
        K(t) over the period (step, row, row) [N/mm].
    """
    zeta, r = modes.damping_ratio, modes.frequency
    if (zeta[r > 0] == 0).any():
        return False
    mean = modes.stiffness[np.ix_(rows, rows)]
    unit = np.sqrt(np.diag(mean))
    swing = np.linalg.norm((stiffness - mean) / unit[:, None] / unit, 2, axis=(-2, -1)).max()
    high = (r > 0) & (modes.participation.max(axis=0) > 2 * zeta * PEAK)
    peaks = r[high]
    if not len(peaks):
        return False
    near = (peaks * (1 + zeta[high] * np.linspace(-2, 2, 17)[:, None])).ravel()
    omega = np.concatenate([near, np.geomspace(peaks[0] / 100, 2 * peaks[-1], 200)])
    gain = unit[:, None] * modes.at_meshes(omega[omega > 0], rows) * unit
    return bool(swing * np.linalg.norm(gain, 2, axis=(-2, -1)).max() < PROVEN)


def multipliers(modes: Modes, rows: NDArray, omega: NDArray, stiffness: NDArray) -> NDArray:
    """Largest modulus (speed,) of the Floquet multipliers: above 1 the motion grows from period to period.

    The step is split into the modes' own motion, exact, and the kicks of K(t) − K̄, exact too: second order, and without
    damping it preserves area. Modes too fast for the steps are left out: below ``RESOLVED`` rad a step, with k(t) given
    at 16 steps an order, that is a mode which only orders beyond those of k(t) could meet.

    Parameters
    ----------
    modes
        Of the system with the mean stiffnesses.
    rows
        Numbers of the rows of the meshes whose stiffness varies.
    omega
        Mesh frequency (speed,) [rad/s].
    stiffness
        K(t) in the middle of equal steps of the period, (speed or 1, step, row, row) [N/mm].
    """
    from gearbench.dynamics._kernels import monodromy

    elastic = np.flatnonzero(modes.frequency > 0)
    share = np.diag(modes.stiffness)[rows] @ (modes.mesh[np.ix_(rows, elastic)] / modes.frequency[elastic]) ** 2
    keep = np.sort(elastic[np.argsort(-share, kind="stable")[:MODES]])
    r, zeta = modes.frequency[keep], modes.damping_ratio[keep]
    dt = 2 * np.pi / omega / stiffness.shape[1]
    kick = np.ascontiguousarray(stiffness - modes.stiffness[np.ix_(rows, rows)])
    reach, found = np.ascontiguousarray(modes.mesh[np.ix_(rows, keep)]), np.empty(len(omega))
    for here in in_blocks(len(omega), (2 * len(r)) ** 2):
        counts = (np.multiply.outer(dt[here], r) < RESOLVED).sum(axis=1)
        own, half = (free_motion(r, zeta, share * dt[here, None]) for share in (1.0, 0.5))
        maps = monodromy(own, half, reach, kick[here] if len(kick) > 1 else kick, dt[here], r, counts)
        found[here] = np.abs(np.linalg.eigvals(maps)).max(axis=1)
    return found


def free_motion(r: NDArray, zeta: NDArray, dt: NDArray) -> NDArray:
    """Motion of free modes over Δt: coefficients of (p, v) → (p, v), (4, speed, mode)."""
    damped = r * np.sqrt(1 - zeta**2)
    fade = np.exp(-zeta * r * dt)
    c, s = fade * np.cos(damped * dt), fade * np.sin(damped * dt)
    return np.array([c + zeta * r / damped * s, s / damped, -(r**2) / damped * s, c - zeta * r / damped * s])
