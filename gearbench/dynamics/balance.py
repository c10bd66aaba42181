"""Harmonic balance at the meshes: motions and forces of meshes whose stiffness varies in time.

A row is one relative motion of a mesh (approach, tilt or bending) together with the force that does work on it. The
unknowns are the orders of y = x − x_s, where x(t) = Σ x̂_n e^{inωt} is the motion and x_s(t) the quasi-static motion.
Each row stores them as real numbers y_0, Re ŷ_1, Im ŷ_1, …. The forces are f = f_s + K(t) (x − x_s), (D5) of
docs/theory.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.size import in_blocks


@dataclass(frozen=True, kw_only=True)
class Excitation:
    """Excitation by meshes of one mesh frequency. If there are several samples, they are the first axis.

    Parameters
    ----------
    stiffness
        K̂ of orders 0 … 2H, (row, row, 2H + 1) [N/mm].
    motion, force
        x̂_s [mm] and f̂_s [N] of the orders kept, (row, order).
    kept
        Orders kept, in ascending order from 0 to H; by default all.
    """

    stiffness: NDArray
    motion: NDArray
    force: NDArray
    kept: NDArray | None = None

    @property
    def convolution(self) -> NDArray:
        """Matrix that multiplies the orders kept by K(t), see ``convolution``."""
        return convolution(self.stiffness, self.orders[:, None])

    @property
    def orders(self) -> NDArray:
        """Orders of ``motion`` and ``force`` (order,)."""
        return np.arange(self.motion.shape[-1]) if self.kept is None else self.kept

    def part(self, samples: slice | None) -> Excitation:
        """Select some of the samples; None turns an excitation without samples into a single sample."""
        arrays = {name: getattr(self, name)[samples] for name in ("stiffness", "motion", "force")}
        return replace(self, **arrays)


def convolution(stiffness: NDArray, index: NDArray | None = None, along: int = 0) -> NDArray:
    """Real matrix (…, 2S−1, 2S−1) that multiplies a function with S orders by k(t); other orders are dropped (D6).

    Parameters
    ----------
    stiffness
        Orders 0 … 2H of k(t), (…, 2H + 1).
    index
        Orders as multiples of several frequencies (S, frequency); by default the H + 1 orders 0 … H of one frequency.
        The first order is zero. Of two orders s and −s only one is listed.
    along
        Index of the frequency at which k(t) varies.
    """
    multiples = np.arange((stiffness.shape[-1] + 1) // 2)[:, None] if index is None else index
    lower, upper = (_between(stiffness, multiples[:, None] + sign * multiples, along) for sign in (-1, 1))
    # columns: effect of x_0, and of Re x̂_m and Im x̂_m, which are in the orders m and −m
    K = np.empty((*lower.shape[:-1], 2 * len(multiples) - 1), dtype=complex)
    K[..., 0] = lower[..., 0]
    K[..., 1::2], K[..., 2::2] = (lower + upper)[..., 1:], 1j * (lower - upper)[..., 1:]
    return real(K, axis=-2)


def _between(stiffness: NDArray, difference: NDArray, along: int) -> NDArray:
    """k̂ (…, S, S) that couples two orders, from their ``difference`` (S, S, frequency)."""
    n, last = difference[..., along], stiffness.shape[-1] - 1
    values = stiffness[..., np.minimum(np.abs(n), last)]
    reached = (np.abs(n) <= last) & (np.delete(difference, along, axis=-1) == 0).all(axis=-1)
    # k̂ at a negative order is the conjugate
    return np.where(reached, np.where(n >= 0, values, np.conj(values)), 0.0)


def real(values: NDArray, axis: int = -1) -> NDArray:
    """Orders 0 … H (complex) along an axis as real numbers x_0, Re x̂_1, Im x̂_1, …."""
    z = np.moveaxis(np.asarray(values, dtype=complex), axis, 0)
    out = np.empty((2 * len(z) - 1, *z.shape[1:]))
    out[0], out[1::2], out[2::2] = np.real(z[0]), np.real(z[1:]), np.imag(z[1:])
    return np.moveaxis(out, 0, axis)


def complex_orders(values: NDArray) -> NDArray:
    """Complex orders 0 … H (…, H+1) from real numbers (…, 2H+1): the inverse of ``real``."""
    return np.concatenate([values[..., :1] + 0j, values[..., 1::2] + 1j * values[..., 2::2]], axis=-1)


def block_rows(h: NDArray) -> NDArray:
    """Real matrices (…, M, 2H+1, M, 2H+1) by which ĥ (…, H + 1, M, M) acts on orders as real numbers (M, 2H+1)."""
    H, M = h.shape[-3] - 1, h.shape[-1]
    out = np.zeros((*h.shape[:-3], M, 2 * H + 1, M, 2 * H + 1))
    out[..., :, 0, :, 0] = np.real(h[..., 0, :, :])
    for n in range(1, H + 1):
        a, b = 2 * n - 1, 2 * n
        block = h[..., n, :, :]
        out[..., :, a, :, a] = out[..., :, b, :, b] = np.real(block)
        out[..., :, a, :, b], out[..., :, b, :, a] = -np.imag(block), np.imag(block)
    return out


def solve(excitation: Excitation, h: NDArray, mean: NDArray) -> tuple[NDArray, NDArray]:
    """Motions [mm] and forces [N] of the orders kept, (speed, row, order).

    Parameters
    ----------
    excitation
        Stiffness, and quasi-static motion and force.
    h
        ĥ (speed, order, row, row) [mm/N] of the system with the mean stiffness.
    mean
        Mean stiffness K̄ (row, row) [N/mm].
    """
    K, x_s = excitation.convolution, excitation.motion
    M, N = K.shape[0], K.shape[-1]  # rows, and real numbers of each row
    varying = K - mean[..., None, None] * np.eye(N)
    # f_s − K̄ x_s without order 0, which is in static balance
    p_s = excitation.force - mean @ x_s
    p_s[:, 0] = 0.0
    driven = np.swapaxes(np.einsum("snij,jn->sni", h, p_s), 1, 2)
    driven[..., 1:] += x_s[:, 1:]
    b, y = -real(driven).reshape(len(h), M * N), np.empty((len(h), M, N))
    varying = np.moveaxis(varying, 2, 1).reshape(M * N, M * N)
    for block in in_blocks(len(h), (M * N) ** 2):
        # y + ĥ (K − K̄) y = −x_s − ĥ (f_s − K̄ x_s)
        A = np.eye(M * N) + block_rows(h[block]).reshape(-1, M * N, M * N) @ varying
        y[block] = np.linalg.solve(A, b[block, :, None])[..., 0].reshape(-1, M, N)
    force = excitation.force + complex_orders(np.einsum("ijab,sjb->sia", K, y))
    return x_s + complex_orders(y), force


def generalised_conjugate_residuals(
    apply: Callable[[NDArray], NDArray],
    x: NDArray,
    residual: NDArray,
    product: Callable[[NDArray, NDArray], NDArray],
    tolerance: NDArray,
    steps: int,
) -> tuple[NDArray, NDArray]:
    """Solve many problems A x = b at once by generalised conjugate residuals (GCR); return x and the residual b − A x.

    Parameters
    ----------
    apply
        Function that returns A x.
    x, residual
        First guess and its residual b − A x.
    product
        Function that returns the inner product of each problem; the axes it sums over remain, with length 1.
    tolerance
        Square of the allowed norm of the residual of each problem.
    steps
        Maximum number of steps.
    """
    directions: list[tuple[NDArray, NDArray, NDArray]] = []
    for _ in range(steps):
        if (product(residual, residual) <= tolerance).all():
            break
        direction, image = residual, apply(residual)
        for previous, previous_image, size in directions:
            factor = product(previous_image, image) / size
            direction, image = direction - factor * previous, image - factor * previous_image
        # the smallest number avoids 0/0 in a problem that is already solved
        size = np.maximum(product(image, image), np.finfo(residual.dtype).tiny)
        factor = product(image, residual) / size
        x, residual = x + factor * direction, residual - factor * image
        directions.append((direction, image, size))
    return x, residual
