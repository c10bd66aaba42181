"""The Ritz method: from a stiffness matrix to the compliance of load functionals."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Ritz:
    """Minimum of ½ aᵀK a − fᵀa over the amplitudes a, for loads f that act on the last ``loaded`` amplitudes only.

    Parameters
    ----------
    stiffness
        K, symmetric positive definite, (n, n).
    loaded
        Number of these last amplitudes; displacements are measured on them too.

    Raises
    ------
    numpy.linalg.LinAlgError
        If K is not positive definite.
    """

    stiffness: NDArray
    loaded: int

    @cached_property
    def _scale(self) -> NDArray:
        """Factors that give the stiffness a unit diagonal, (n,)."""
        return 1 / np.sqrt(np.diagonal(self.stiffness))

    @cached_property
    def _scaled(self) -> NDArray:
        return self.stiffness * self._scale * self._scale[:, None]

    @cached_property
    def _triangle(self) -> NDArray:
        """Trailing block G of the Cholesky factor: G⁻ᵀ G⁻¹ is the loaded block of the inverse of K."""
        return np.linalg.cholesky(self._scaled)[-self.loaded :, -self.loaded :]

    @cached_property
    def _inverse_triangle(self) -> NDArray:
        return np.linalg.inv(self._triangle).T

    @property
    def condition(self) -> float:
        """Condition number of the symmetrically scaled stiffness, the matrix that is factorised."""
        return float(np.linalg.cond(self._scaled))

    def factor(self, functional: NDArray) -> NDArray:
        """ψ with ψ(a) · ψ(b) = f(a)ᵀ K⁻¹ f(b), for functionals f of the loaded amplitudes, (…, loaded)."""
        return (functional * self._scale[-self.loaded :]) @ self._inverse_triangle

    def compliance(self, functional: NDArray) -> NDArray:
        """f(a)ᵀ K⁻¹ f(b), (m, m), for all pairs of m functionals (m, loaded), with fewer operations than ``factor``."""
        from scipy.linalg import solve_triangular

        rows = (functional * self._scale[-self.loaded :]).T
        half = solve_triangular(self._triangle, rows, lower=True, check_finite=False)
        return half.T @ half
