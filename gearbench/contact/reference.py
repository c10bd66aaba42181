"""The contact problem linearised at its mean errors: what every sample of a coupled problem is computed against."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.law import inverse


@dataclass(frozen=True, kw_only=True)
class Reference:
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


def linearised(
    factor: NDArray, active: NDArray, gap: NDArray, laws: tuple[NDArray, NDArray, NDArray], q: NDArray, delta: NDArray
) -> Reference:
    """Linear problem about the solution (``q`` (position, rank), ``delta``) at the gaps (position, n).

    ``factor`` (position, n, rank), zero where no segment is ``active`` (position, n); existing segments first.
    ``laws`` are a, h and soft.
    """
    z = delta[:, None] - np.einsum("pnr,pr->pn", factor, q)
    P, W, _ = inverse(z - gap, *laws)
    P, W = np.where(active, P, 0.0), np.where(active, W, 0.0)
    C = np.concatenate([-factor, active[..., None]], axis=2)  # z = C (q, δ)
    M = np.swapaxes(C, 1, 2) @ (W[..., None] * C)
    index = np.arange(factor.shape[2])
    M[:, index, index] += 1.0
    unit = np.zeros((len(M), index.size + 1, 1))
    unit[:, -1] = 1.0
    half = np.linalg.solve(np.linalg.cholesky(M), np.concatenate([np.swapaxes(C, 1, 2), unit], axis=2))
    rows, end = half[:, :, :-1], half[:, :, -1]
    G = np.swapaxes(rows, 1, 2) @ rows
    response = np.concatenate([matrix[:m, :m].ravel() for matrix, m in zip(G, active.sum(axis=1), strict=True)])
    return Reference(
        weight=W,
        start=W * z - P,
        response=response,
        single_response=response.astype(np.float32),
        rise=np.einsum("prn,pr->pn", rows, end),
        flexibility=np.einsum("pr,pr->p", end, end),
    )
