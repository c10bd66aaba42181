"""Harmonic balance at the meshes: dynamic transmission error and mesh forces where the stiffness varies in time.

Unknown at every mesh: x_0, Re x̂_1, Im x̂_1, …, x(t) = Σ x̂_n e^{inωt}; forces follow from f = F̄ + k(t) (x − δ_s)
(D5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.modes import Modes
from gearbench.dynamics.size import in_blocks


@dataclass(frozen=True, kw_only=True)
class Excitation:
    """What excites meshes of one mesh frequency; (…) may be samples.

    Parameters
    ----------
    stiffness
        k̂ of orders 0 … 2H, (…, mesh, 2H + 1) [N/mm].
    error
        δ̂_s of orders 0 … H, (…, mesh, H + 1) [mm].
    force
        Mean force along the line of action (mesh,) [N].
    """

    stiffness: NDArray
    error: NDArray
    force: NDArray

    @property
    def orders(self) -> int:
        """H."""
        return self.error.shape[-1] - 1


def convolution(stiffness: NDArray) -> NDArray:
    """Real matrix (…, 2H+1, 2H+1) of the product with a function of orders k̂ (…, 2H+1), cut at order H (D6)."""
    H = (stiffness.shape[-1] - 1) // 2
    n, m = np.arange(H + 1)[:, None], np.arange(1, H + 1)
    # k̂_{n−m} for negative orders is the conjugate
    lower = np.where(n >= m, stiffness[..., np.abs(n - m)], np.conj(stiffness[..., np.abs(n - m)]))
    upper = stiffness[..., n + m]
    K = np.empty((*stiffness.shape[:-1], H + 1, 2 * H + 1), dtype=complex)
    K[..., 0] = stiffness[..., : H + 1]
    K[..., 1::2], K[..., 2::2] = lower + upper, 1j * (lower - upper)
    return _real_rows(K, axis=-2)


def _real_rows(values: NDArray, axis: int = -1) -> NDArray:
    """Orders 0 … H (complex) as x_0, Re x̂_1, Im x̂_1, … along an axis."""
    z = np.moveaxis(np.asarray(values, dtype=complex), axis, 0)
    out = np.empty((2 * len(z) - 1, *z.shape[1:]))
    out[0], out[1::2], out[2::2] = np.real(z[0]), np.real(z[1:]), np.imag(z[1:])
    return np.moveaxis(out, 0, axis)


def real(values: NDArray) -> NDArray:
    """Orders 0 … H (…, H+1) as real numbers (…, 2H+1)."""
    return _real_rows(values)


def orders(values: NDArray) -> NDArray:
    """The inverse of ``real``."""
    return np.concatenate([values[..., :1] + 0j, values[..., 1::2] + 1j * values[..., 2::2]], axis=-1)


def receptances(modes: Modes, meshes: NDArray, omega: NDArray, orders: int) -> NDArray:
    """ĥ_c (speed, order 1 … H, mesh, mesh) of the ``meshes`` in question, at mesh frequencies ω (speed,)."""
    n = np.arange(1, orders + 1)
    return modes.at_meshes(omega[:, None] * n, meshes)


def block_rows(h: NDArray) -> NDArray:
    """Real matrices (…, M, 2H+1, M, 2H+1) of ĥ_c (…, H, M, M) acting on orders; nothing acts on order 0."""
    H, M = h.shape[-3], h.shape[-1]
    out = np.zeros((*h.shape[:-3], M, 2 * H + 1, M, 2 * H + 1))
    for n in range(H):
        a, b = 2 * n + 1, 2 * n + 2
        block = h[..., n, :, :]
        out[..., :, a, :, a] = out[..., :, b, :, b] = np.real(block)
        out[..., :, a, :, b], out[..., :, b, :, a] = -np.imag(block), np.imag(block)
    return out


def solve(excitation: Excitation, h: NDArray, mean: NDArray) -> tuple[NDArray, NDArray]:
    """Dynamic transmission error [mm] and mesh force [N] of orders 0 … H, (speed, mesh, H + 1).

    Parameters
    ----------
    excitation
        One sample: stiffness (mesh, 2H+1), error (mesh, H+1).
    h
        ĥ_c (speed, H, mesh, mesh) of the system with the mean stiffnesses.
    mean
        Those mean stiffnesses k̄ (mesh,) [N/mm].
    """
    K = convolution(excitation.stiffness)
    M, N = K.shape[0], K.shape[-1]
    # K on all meshes, and the part of it that the receptances do not hold already
    whole = np.zeros((M, N, M, N))
    whole[range(M), :, range(M), :] = K
    vary = whole.copy()
    for m in range(M):
        vary[m, range(N), m, range(N)] -= mean[m]
    drive = np.einsum("mab,mb->ma", K, real(excitation.error))
    found = np.empty((len(h), M, N))
    for here in in_blocks(len(h), (M * N) ** 2):
        B = block_rows(h[here]).reshape(-1, M * N, M * N)
        # x̂ + ĥ_c (K x̂ − k̄ x̂ − K δ̂) = 0; at order 0 the mean force is F̄: (K x̂ − K δ̂)_0 = 0
        A = np.eye(M * N) + B @ vary.reshape(M * N, M * N)
        b = B @ drive.ravel()
        zero = np.arange(M) * N
        A[:, zero] = whole.reshape(M * N, M * N)[zero]
        b[:, zero] = drive[:, 0]
        found[here] = np.linalg.solve(A, b[..., None])[..., 0].reshape(-1, M, N)
    force = np.einsum("mab,smb->sma", K, found) - drive
    force[..., 0] = excitation.force
    return orders(found), orders(force)
