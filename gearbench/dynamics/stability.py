"""Stability of meshes whose stiffness varies in time: first a cheap proof, and if it fails, Floquet multipliers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.modes import Modes
from gearbench.dynamics.size import in_blocks

#: Number of modes kept, those with the largest share in the compliance at the meshes.
MODES = 12
#: Maximum angle by which a mode turns per step [rad].
RESOLVED = 1.0
#: Loop gain below which stability is proven; the margin to 1 allows for frequencies between those evaluated.
PROVEN = 0.9
#: Frequencies are refined around modes whose resonance peak exceeds this share of the static compliance.
PEAK = 0.02


def is_proven_stable(modes: Modes, rows: NDArray, stiffness: NDArray) -> bool:
    """Whether the small-gain theorem proves that no motion grows, at any speed: docs/algorithms.md, "Stability".

    The loop of K(t) − K̄ and the receptance ĥ, (D4) of docs/theory.md, of the system with the mean stiffness K̄ is
    stable if the product of their largest gains is below 1, however the stiffness varies within its range. Gains are in
    units in which every row has the mean stiffness 1.

    Parameters
    ----------
    modes
        Modes of the system with the mean stiffnesses.
    rows
        Indices of the rows (relative motions, see ``balance``) of the meshes whose stiffness varies.
    stiffness
        K(t) over the period (step, row, row) [N/mm].
    """
    zeta, r = modes.damping_ratio, modes.frequency
    if (zeta[r > 0] == 0).any():
        return False
    mean = modes.stiffness[np.ix_(rows, rows)]
    scale = np.sqrt(np.diag(mean))
    stiffness_gain = np.linalg.norm((stiffness - mean) / scale[:, None] / scale, 2, axis=(-2, -1)).max()
    resonant = (r > 0) & (modes.participation.max(axis=0) > 2 * zeta * PEAK)
    peaks = r[resonant]
    if not len(peaks):  # no frequencies to search
        return False
    # frequencies: 17 across each resonance peak, whose half width is ζω, and 200 over the whole range
    refined = (peaks * (1 + zeta[resonant] * np.linspace(-2, 2, 17)[:, None])).ravel()
    omega = np.concatenate([refined, np.geomspace(peaks[0] / 100, 2 * peaks[-1], 200)])
    gain = scale[:, None] * modes.mesh_receptance(omega[omega > 0], rows) * scale
    return bool(stiffness_gain * np.linalg.norm(gain, 2, axis=(-2, -1)).max() < PROVEN)


def multipliers(modes: Modes, rows: NDArray, omega: NDArray, stiffness: NDArray) -> NDArray:
    """Largest modulus of the Floquet multipliers (speed,); above 1 the motion grows from period to period.

    A step combines free motion of the modes with a kick by K(t) − K̄, (D7) of docs/algorithms.md. Both are exact.
    Alternating them is accurate to second order in the step, and preserves area in phase space if there is no damping.
    Modes that turn by more than ``RESOLVED`` per step are left out. ``analysis.growth`` gives at least
    16 H steps for H orders of the motion, so these modes lie above order 16 H/2π, beyond the 2 H orders of K(t).

    Parameters
    ----------
    modes
        Modes of the system with the mean stiffnesses.
    rows
        Indices of the rows, as in ``is_proven_stable``.
    omega
        Mesh frequency (speed,) [rad/s].
    stiffness
        K(t) at equal steps of a period that begins at any phase, (speed or 1, step, row, row) [N/mm].
    """
    from gearbench.dynamics._kernels import monodromy

    elastic = np.flatnonzero(modes.frequency > 0)
    # modes with the largest shares in the compliance of the meshes
    share = np.diag(modes.stiffness)[rows] @ (modes.mesh[np.ix_(rows, elastic)] / modes.frequency[elastic]) ** 2
    kept = np.sort(elastic[np.argsort(-share, kind="stable")[:MODES]])
    r, zeta = modes.frequency[kept], modes.damping_ratio[kept]
    dt = 2 * np.pi / omega / stiffness.shape[1]
    kick = np.ascontiguousarray(stiffness - modes.stiffness[np.ix_(rows, rows)])
    mesh_motion, largest = np.ascontiguousarray(modes.mesh[np.ix_(rows, kept)]), np.empty(len(omega))
    for block in in_blocks(len(omega), (2 * len(r)) ** 2):
        counts = (np.multiply.outer(dt[block], r) < RESOLVED).sum(axis=1)
        full, half = (free_motion(r, zeta, part * dt[block, None]) for part in (1.0, 0.5))
        maps = monodromy(full, half, mesh_motion, kick[block] if len(kick) > 1 else kick, dt[block], r, counts)
        largest[block] = np.abs(np.linalg.eigvals(maps)).max(axis=1)
    return largest


def free_motion(r: NDArray, zeta: NDArray, dt: NDArray) -> NDArray:
    """Coefficients (4, speed, mode) by which free motion over Δt maps modal coordinates p and velocities v.

    In this order: of p in the new p, of v in the new p, of p in the new v, of v in the new v.
    """
    damped = r * np.sqrt(1 - zeta**2)
    decay = np.exp(-zeta * r * dt)
    c, s = decay * np.cos(damped * dt), decay * np.sin(damped * dt)
    return np.array([c + zeta * r / damped * s, s / damped, -(r**2) / damped * s, c - zeta * r / damped * s])
