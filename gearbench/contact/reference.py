"""The contact problem linearised at its mean errors: what every sample of a coupled problem is computed against."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Reference(NamedTuple):
    """Linear problem at the mean errors, of segments that all move each other; dimensionless as ``ContactProblem``.

    With z = δ − Ψq and the slopes W₀ of the laws at the mean errors, a solution is z = z₁ + G u, u = W₀ z − P, and
    δ = c + z₁·u, where G is the response to forces beside those of springs W₀ under a given total (B2 of
    docs/theory.md). Arrays start with the position.

    Parameters
    ----------
    weight
        W₀ of the segments, (position, n); 0 of those that are apart at the mean errors, or absent.
    start
        u at the mean errors, (position, n).
    response, single_response
        G, one matrix (count, count) after the other; the latter in single precision.
    rise
        z₁, z under a unit of total force, (position, n).
    flexibility
        c = ∂δ/∂F at the mean errors, (position,).
    """

    weight: NDArray
    start: NDArray
    response: NDArray
    single_response: NDArray
    rise: NDArray
    flexibility: NDArray


def normal_matrix(C: NDArray, W: NDArray) -> NDArray:
    """diag(1, …, 1, 0) + Cᵀ W C of the slopes W (position, n), z = C (q, δ) + …, (position, unknown, unknown)."""
    M = np.swapaxes(C, 1, 2) @ (W[..., None] * C)
    amplitude = np.arange(M.shape[1] - 1)
    M[:, amplitude, amplitude] += 1.0
    # where no segment is loaded δ is arbitrary
    M[:, -1, -1] += M[:, -1, -1] == 0.0
    return M


def linearised(C: NDArray, count: NDArray, z: NDArray, P: NDArray, W: NDArray) -> Reference:
    """Linear problem about a solution: z = C (q, δ), forces P and slopes W, each (position, n).

    C (position, n, unknown) is zero behind the existing segments, of which there are ``count``.
    """
    unit = np.zeros((len(C), C.shape[2], 1))
    unit[:, -1] = 1.0
    half = np.linalg.solve(
        np.linalg.cholesky(normal_matrix(C, W)), np.concatenate([np.swapaxes(C, 1, 2), unit], axis=2)
    )
    rows, end = half[:, :, :-1], half[:, :, -1]
    G = np.swapaxes(rows, 1, 2) @ rows
    response = np.concatenate([matrix[:m, :m].ravel() for matrix, m in zip(G, count, strict=True)])
    return Reference(
        weight=W,
        start=W * z - P,
        response=response,
        single_response=response.astype(np.float32),
        rise=np.einsum("prn,pr->pn", rows, end),
        flexibility=np.einsum("pr,pr->p", end, end),
    )
