"""Harmonic balance of many error samples of one mesh, based on the balance of their mean.

K̄ is the constant mean stiffness. The stiffness of sample s is K̄ + V_s, the mean of all samples K̄ + V_0. Let x be the
quasi-static motion of the sample and p = f̂ − K̄ x̂, both without order 0. With the gears held, the mesh would exert
b = p − V_s x in addition to the springs K̄. It exerts e on moving gears, which move by −G e; G is their receptance on
springs K̄ + V_0. The balance of the sample is then e + (V_s − V_0) G e = b for the unknown e, and the orders of the
mesh force are (1 − (K̄ + V_0) G) e (D5).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.balance import Excitation, block_rows, generalised_conjugate_residuals, real

#: Residual over right-hand side at which the balance of a sample is solved, and maximum number of steps.
SETTLED, STEPS = 3e-4, 40
#: Number of speeds solved at once: so few fit into the cache, and end after about the same number of steps.
SPEEDS = 10


@dataclass(frozen=True, kw_only=True, eq=False)
class SampleBalance:
    """Balance of samples that are close to their mean, at some speeds.

    Parameters
    ----------
    stiffness
        K̄ of the rows (row, row) [N/mm].
    varying
        V_0 (unknown, unknown); the unknowns are the orders of all rows, row by row, as real numbers.
    motion
        G (speed, unknown, unknown) [mm/N].
    force_orders
        Matrix from e' to the orders above 0 of the mesh forces (speed, mesh · 2H, unknown).
    """

    stiffness: NDArray
    varying: NDArray
    motion: NDArray
    force_orders: NDArray

    @classmethod
    def of(cls, samples: Excitation, h: NDArray, stiffness: NDArray, approach: Sequence[int] = (0,)) -> SampleBalance:
        """Balance about the mean of ``samples`` (sample, row, …).

        Parameters
        ----------
        samples
            Excitation by the samples.
        h
            ĥ_c (speed, H + 1, row, row) [mm/N].
        stiffness
            K̄ (row, row) [N/mm].
        approach
            Rows whose forces are wanted: those of the approach of each mesh.
        """
        receptance = block_rows(h)
        orders = receptance.shape[-1]
        receptance = receptance.reshape(len(h), len(stiffness) * orders, -1)
        varying, identity = _varying(samples, stiffness).mean(axis=0), np.eye(receptance.shape[-1])
        motion = np.linalg.solve(identity + receptance @ varying, receptance)
        total = np.kron(stiffness, np.eye(orders)) + varying
        wanted = orders * np.array(approach)[:, None] + np.arange(1, orders)
        force_orders = (identity - total @ motion)[:, wanted.ravel()]
        # single precision is enough for scatter
        return cls(
            stiffness=stiffness,
            varying=varying,
            motion=motion.astype(np.float32),
            force_orders=force_orders.astype(np.float32),
        )

    def forces(self, samples: Excitation) -> NDArray:
        """Real and imaginary parts of the orders above 0 of the mesh forces (speed, mesh · 2H, sample) [N]."""
        varying, x_s = _varying(samples, self.stiffness), samples.motion.copy()
        p_s = samples.force - np.einsum("ij,sjn->sin", self.stiffness, x_s)
        # order zero is in static balance
        x_s[..., 0], p_s[..., 0] = 0.0, 0.0
        blocked = real(p_s).reshape(len(varying), -1) - np.einsum(
            "sab,sb->sa", varying, real(x_s).reshape(len(varying), -1)
        )
        deviation, blocked = (varying - self.varying).astype(np.float32), blocked.T[None].astype(np.float32)

        def balance(motion: NDArray, e: NDArray) -> NDArray:
            motion_under_e = np.ascontiguousarray((motion @ e).transpose(2, 1, 0))
            return e + (deviation @ motion_under_e).transpose(2, 1, 0)

        forces = []
        for first in range(0, len(self.motion), SPEEDS):
            block = slice(first, first + SPEEDS)
            apply, right = partial(balance, self.motion[block]), np.repeat(blocked, len(self.motion[block]), axis=0)
            tolerance = SETTLED**2 * _products(right, right)
            e = generalised_conjugate_residuals(apply, right, right - apply(right), _products, tolerance, STEPS)[0]
            forces.append(self.force_orders[block] @ e)
        return np.concatenate(forces)


def _varying(samples: Excitation, stiffness: NDArray) -> NDArray:
    """K_s − K̄ (sample, unknown, unknown)."""
    K = samples.convolution
    K -= stiffness[..., None, None] * np.eye(K.shape[-1])
    size = K.shape[1] * K.shape[-1]
    return np.swapaxes(K, 2, 3).reshape(len(K), size, size)


def _products(a: NDArray, b: NDArray) -> NDArray:
    """Scalar products over the unknowns, (speed, 1, sample)."""
    return np.einsum("sun,sun->sn", a, b)[:, None]
