"""Contact problem linearised at the mean errors.

``gearbench.contact.batch`` prepares it if all segments deflect each other through many amplitudes. The compiled solver
then computes every sample of the errors from its difference to this linear problem (B2 of docs/algorithms.md).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Reference(NamedTuple):
    """Linear problem at the mean errors, dimensionless like ``ContactProblem``.

    z = δ − Ψq are the motions of the n segments, with the amplitudes q of the smooth compliance, and W₀ the slopes of
    their contact laws at the mean errors. A solution is z = z₁ + G u and δ = c + z₁·u. Here u = W₀ z − P are the forces
    of springs of stiffness W₀ minus the forces P of the laws, and G is the response of z to u under a given total force
    (B2). Arrays start with the position.

    Parameters
    ----------
    weight
        W₀ of the segments, (position, n); 0 if a segment is separated at the mean errors, or absent.
    start
        u at the mean errors, (position, n).
    response, single_response
        Matrices G (count, count) of the existing segments of each position, one after the other in a flat array; the
        second array is in single precision.
    rise
        z₁, which is z under a unit total force, (position, n).
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
    """Matrix of a Newton step for (q, δ), diag(1, …, 1, 0) + Cᵀ W C, (position, unknown, unknown).

    See (B1) of docs/algorithms.md. z = C (q, δ) are the motions of the segments, W (position, n) the slopes of their
    laws.
    """
    M = np.swapaxes(C, 1, 2) @ (W[..., None] * C)
    amplitude = np.arange(M.shape[1] - 1)
    M[:, amplitude, amplitude] += 1.0
    # if no segment is loaded, δ is arbitrary
    M[:, -1, -1] += M[:, -1, -1] == 0.0
    return M


def linearised(C: NDArray, count: NDArray, z: NDArray, P: NDArray, W: NDArray) -> Reference:
    """Linear problem about a solution with z = C (q, δ), forces P and slopes W, all (position, n).

    Only the first ``count`` segments of a position exist; the other rows of C (position, n, unknown) are zero.
    """
    unit = np.zeros((len(C), C.shape[2], 1))
    unit[:, -1] = 1.0
    # with M = L Lᵀ: G = (L⁻¹Cᵀ)ᵀ (L⁻¹Cᵀ), z₁ = (L⁻¹Cᵀ)ᵀ L⁻¹e and c = |L⁻¹e|²
    L = np.linalg.cholesky(normal_matrix(C, W))
    solved = np.linalg.solve(L, np.concatenate([np.swapaxes(C, 1, 2), unit], axis=2))
    of_C, of_unit = solved[:, :, :-1], solved[:, :, -1]
    G = np.swapaxes(of_C, 1, 2) @ of_C
    response = np.concatenate([matrix[:m, :m].ravel() for matrix, m in zip(G, count, strict=True)])
    return Reference(
        weight=W,
        start=W * z - P,
        response=response,
        single_response=response.astype(np.float32),
        rise=np.einsum("prn,pr->pn", of_C, of_unit),
        flexibility=np.einsum("pr,pr->p", of_unit, of_unit),
    )
