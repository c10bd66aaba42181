"""Harmonic balance of many error samples of meshes of one frequency, based on the balance of their mean.

The constant K̄ is the mean stiffness of the scene. The stiffness of sample s is K̄ + V_s, and its mean over the samples
K̄ + V_0. Let x and f be the quasi-static motion and force of the sample, without order 0, and p = f − K̄ x. If the gears
were held, the mesh would exert b = p − V_s x. The gears move, and it exerts e in addition to springs K̄ + V_0. This
force e moves the gears by −G e, with G the receptance of the system on these springs. The balance (D5) of
docs/theory.md then reads e + (V_s − V_0) G e = b, and the orders of the mesh force are (1 − (K̄ + V_0) G) e.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.balance import Excitation, block_rows, real
from gearbench.dynamics.waves import curve

#: Residual, relative to the right-hand side, at which the balance of a sample is solved; maximum number of steps.
SETTLED, STEPS = 1e-4, 40


@dataclass(frozen=True, kw_only=True, eq=False)
class SampleBalance:
    """Balance of samples that are close to their mean, at some speeds.

    Parameters
    ----------
    stiffness
        K̄ of the rows (row, row) [N/mm].
    mean
        K̄ + V_0 over time (row, row, time) [N/mm], see ``_over_time``.
    motion
        G (speed, unknown, unknown) [mm/N]; the unknowns are the orders of all rows, row by row, as real numbers.
    force_orders
        Matrix from e to the orders above 0 of the mesh forces (speed, mesh · 2H, unknown).
    """

    stiffness: NDArray
    mean: NDArray
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
            ĥ (speed, H + 1, row, row) [mm/N] of the system on springs K̄.
        stiffness
            K̄ (row, row) [N/mm].
        approach
            Rows whose forces are wanted: those of the approach of each mesh.
        """
        receptance = block_rows(h)
        orders = receptance.shape[-1]
        receptance = receptance.reshape(len(h), len(stiffness) * orders, -1)
        mean, identity = replace(samples, stiffness=samples.stiffness.mean(axis=0)), np.eye(receptance.shape[-1])
        total = np.swapaxes(mean.convolution, 1, 2).reshape(identity.shape)
        varying = total - np.kron(stiffness, np.eye(orders))
        motion = np.linalg.solve(identity + receptance @ varying, receptance)
        wanted = (orders * np.array(approach)[:, None] + np.arange(1, orders)).ravel()
        force_orders = identity[wanted] - total[wanted] @ motion
        # single precision is enough for scatter
        return cls(
            stiffness=stiffness,
            mean=_over_time(mean.stiffness),
            motion=motion.astype(np.float32),
            force_orders=force_orders.astype(np.float32),
        )

    def forces(self, samples: Excitation) -> NDArray:
        """Real and imaginary parts of the orders above 0 of the mesh forces (speed, mesh · 2H, sample) [N].

        The iteration of each sample ends at its own residual, so its forces do not depend on the other ``samples``.
        """
        from gearbench.dynamics._sample_kernels import balance_samples

        x_s = samples.motion.copy()
        p_s = samples.force - np.einsum("ij,sjn->sin", self.stiffness, x_s)
        # order zero is in static balance
        x_s[..., 0], p_s[..., 0] = 0.0, 0.0
        K = np.moveaxis(_over_time(samples.stiffness), 0, -1)
        there, back = _waves(samples.orders, K.shape[2])
        x_t = there @ np.moveaxis(real(x_s), 0, -1)
        force = np.einsum("ijtn,jtn->itn", K - self.stiffness[..., None, None], x_t)
        blocked = (np.moveaxis(real(p_s), 0, -1) - back @ force).reshape(-1, len(x_s))
        forces = np.empty((*self.force_orders.shape[:2], len(x_s)), np.float32)
        arrays = self.motion, self.force_orders, there, back, K - self.mean[..., None], blocked
        single = (np.ascontiguousarray(array, dtype=np.float32) for array in arrays)
        balance_samples(*single, np.float32(SETTLED), STEPS, forces)
        return forces


def _over_time(stiffness: NDArray) -> NDArray:
    """k(t) (…, time) from its orders 0 … 2H (…, 2H + 1).

    Its 4H + 1 times resolve products with functions of H orders up to order H.
    """
    return curve(stiffness, 2 * stiffness.shape[-1] - 1)


def _waves(orders: NDArray, times: int) -> tuple[NDArray, NDArray]:
    """Matrices from ``orders`` (0 first) as real numbers to values at ``times`` equal steps of a period, and back."""
    angle = 2 * np.pi / times * np.outer(np.arange(times), orders[1:])
    waves = np.ones((times, 2 * len(orders) - 1))
    waves[:, 1::2], waves[:, 2::2] = np.cos(angle), -np.sin(angle)
    return waves * np.append(1.0, np.full(waves.shape[1] - 1, 2.0)), waves.T / times
