"""Harmonic balance at the meshes: their motions and forces where the stiffness varies in time.

A row is a motion of a mesh, approach or tilt, and the force that works on it. The unknowns of every row, as real
numbers x_0, Re x̂_1, Im x̂_1, …, are the difference of x(t) = Σ x̂_n e^{inωt} from x_s(t), the quasi-static motion at
each phase; forces
follow from f = f_s + K(t) (x − x_s) (D5).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.modes import Modes
from gearbench.dynamics.size import in_blocks


@dataclass(frozen=True, kw_only=True)
class Excitation:
    """Excitation of meshes of one mesh frequency; samples, where there are many, come first.

    Parameters
    ----------
    stiffness
        K̂ of orders 0 … 2H, (row, row, 2H + 1) [N/mm].
    motion, force
        x̂_s [mm] and f̂_s [N] of orders 0 … H, (row, H + 1).
    """

    stiffness: NDArray
    motion: NDArray
    force: NDArray

    def part(self, samples: slice | None) -> Excitation:
        """Some of the samples, where these come first; None makes a sample of one excitation."""
        arrays = {name: getattr(self, name)[samples] for name in ("stiffness", "motion", "force")}
        return Excitation(**arrays)


def convolution(stiffness: NDArray, index: NDArray | None = None, along: int = 0) -> NDArray:
    """Real matrix (…, 2S−1, 2S−1) of the product with a function of orders k̂ (…, 2H+1), cut at the S orders kept (D6).

    Orders are 0 … H, or where several frequencies meet, ``index`` (S, frequency), multiples of each: the first is zero,
    of the others either one or its negative is listed; k̂ has the frequency number ``along``.
    """
    at = np.arange((stiffness.shape[-1] + 1) // 2)[:, None] if index is None else index
    lower, upper = (_between(stiffness, at[:, None] + sign * at, along) for sign in (-1, 1))
    K = np.empty((*lower.shape[:-1], 2 * len(at) - 1), dtype=complex)
    K[..., 0] = lower[..., 0]
    K[..., 1::2], K[..., 2::2] = (lower + upper)[..., 1:], 1j * (lower - upper)[..., 1:]
    return _real_rows(K, axis=-2)


def _between(stiffness: NDArray, difference: NDArray, along: int) -> NDArray:
    """k̂ (…, S, S) that leads from order to order, by their ``difference`` (S, S, frequency)."""
    n, last = difference[..., along], stiffness.shape[-1] - 1
    values = stiffness[..., np.minimum(np.abs(n), last)]
    reached = (np.abs(n) <= last) & (np.delete(difference, along, axis=-1) == 0).all(axis=-1)
    # k̂ of negative orders is the conjugate
    return np.where(reached, np.where(n >= 0, values, np.conj(values)), 0.0)


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


def receptances(modes: Modes, rows: NDArray, omega: NDArray, orders: int) -> NDArray:
    """ĥ_c (speed, order 0 … H, row, row) in the ``rows`` in question, at mesh frequencies ω (speed,)."""
    return modes.at_meshes(omega[:, None] * np.arange(orders + 1), rows)


def block_rows(h: NDArray) -> NDArray:
    """Real matrices (…, M, 2H+1, M, 2H+1) of ĥ_c (…, H + 1, M, M) acting on the orders of M rows."""
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
    """Motions [mm] and forces [N] of orders 0 … H, (speed, row, H + 1).

    Parameters
    ----------
    excitation
        Stiffness, motion and force at rest.
    h
        ĥ_c (speed, H + 1, row, row) of the system with the mean stiffness.
    mean
        That mean stiffness K̄ (row, row) [N/mm].
    """
    K, rest = convolution(excitation.stiffness), excitation.motion
    M, N = K.shape[0], K.shape[-1]
    vary = K - mean[..., None, None] * np.eye(N)
    # excitation beside the mean stiffness; none at order 0
    push = excitation.force - mean @ rest
    push[:, 0] = 0.0
    moved = np.swapaxes(np.einsum("snij,jn->sni", h, push), 1, 2)
    moved[..., 1:] += rest[:, 1:]
    b, found = -real(moved).reshape(len(h), M * N), np.empty((len(h), M, N))
    vary = np.moveaxis(vary, 2, 1).reshape(M * N, M * N)
    for here in in_blocks(len(h), (M * N) ** 2):
        # y + ĥ_c (K − K̄) y = −x_s − ĥ_c (f_s − K̄ x_s)
        A = np.eye(M * N) + block_rows(h[here]).reshape(-1, M * N, M * N) @ vary
        found[here] = np.linalg.solve(A, b[here, :, None])[..., 0].reshape(-1, M, N)
    force = excitation.force + orders(np.einsum("ijab,sjb->sia", K, found))
    return rest + orders(found), force


def least_residual(
    apply: Callable[[NDArray], NDArray],
    x: NDArray,
    left: NDArray,
    product: Callable[[NDArray, NDArray], NDArray],
    enough: NDArray,
    steps: int,
) -> tuple[NDArray, NDArray]:
    """Solutions x of many problems A x = b at once, and what is left of b, by conjugate residuals.

    Parameters
    ----------
    apply
        From x to A x.
    x, left
        First guess, and b − A x.
    product
        Inner product of each problem, with axes of length 1 in place of those it sums over.
    enough
        Square of what may be left of each problem.
    steps
        At most.
    """
    tried: list[tuple[NDArray, NDArray, NDArray]] = []
    for _ in range(steps):
        if (product(left, left) <= enough).all():
            break
        step, answer = left, apply(left)
        for before, of, size in tried:
            share = product(of, answer) / size
            step, answer = step - share * before, answer - share * of
        # where nothing is left there is no step
        size = np.maximum(product(answer, answer), np.finfo(left.dtype).tiny)
        share = product(answer, left) / size
        x, left = x + share * step, left - share * answer
        tried.append((step, answer, size))
    return x, left
