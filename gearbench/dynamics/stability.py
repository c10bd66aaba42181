"""Stability of the motion of meshes whose stiffness varies in time: Floquet multipliers (D7)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.modes import Modes

#: Modes kept: those with the largest share in the compliance at the meshes.
MODES = 12


def multipliers(modes: Modes, meshes: NDArray, omega: NDArray, stiffness: NDArray) -> NDArray:
    """Largest modulus (speed,) of the Floquet multipliers: above 1 the motion grows from period to period.

    The step is split into the modes' own motion, exact, and the kicks of k(t) − k̄, exact too: second order, and without
    damping it preserves area.

    Parameters
    ----------
    modes
        Of the system with the mean stiffnesses.
    meshes
        Numbers of the meshes whose stiffness varies.
    omega
        Mesh frequency (speed,) [rad/s].
    stiffness
        k(t) in the middle of equal steps of the period, (speed or 1, mesh, step) [N/mm].
    """
    keep = np.argsort(-modes.participation[meshes].sum(axis=0), kind="stable")[:MODES]
    keep = keep[modes.frequency[keep] > 0]
    a, r, zeta = modes.mesh[np.ix_(meshes, keep)], modes.frequency[keep], modes.damping_ratio
    size, steps = len(keep), stiffness.shape[-1]
    dt = 2 * np.pi / omega / steps
    own = _propagator(r, zeta, dt[:, None])
    # v ← v − Δt Σ a_m (k_m − k̄_m) a_m · p
    kick = stiffness - modes.stiffness[meshes][:, None]
    p = np.zeros((len(omega), size, 2 * size))
    v = np.zeros_like(p)
    p[:, range(size), range(size)] = 1.0
    v[:, range(size), range(size, 2 * size)] = r
    half = _propagator(r, zeta, dt[:, None] / 2)
    p, v = _move(half, p, v)
    for step in range(steps):
        push = np.einsum("sm,mr,srj->smj", kick[..., step] * np.ones((len(omega), 1)) * dt[:, None], a, p)
        v = v - np.einsum("mr,smj->srj", a, push)
        p, v = _move(own if step < steps - 1 else half, p, v)
    monodromy = np.concatenate([p, v / r[:, None]], axis=1)
    return np.abs(np.linalg.eigvals(monodromy)).max(axis=1)


def _propagator(r: NDArray, zeta: float, dt: NDArray) -> tuple[NDArray, ...]:
    """Motion of free modes over Δt: coefficients of (p, v) → (p, v), (speed, mode)."""
    damped = r * np.sqrt(1 - zeta**2)
    fade = np.exp(-zeta * r * dt)
    c, s = fade * np.cos(damped * dt), fade * np.sin(damped * dt)
    return c + zeta * r / damped * s, s / damped, -(r**2) / damped * s, c - zeta * r / damped * s


def _move(by: tuple[NDArray, ...], p: NDArray, v: NDArray) -> tuple[NDArray, NDArray]:
    pp, pv, vp, vv = (x[..., None] for x in by)
    return pp * p + pv * v, vp * p + vv * v
