"""Solid: three-dimensional elasticity on a section extruded along a screw, clamped at its root, by the Ritz method.

Each of the displacements u_θ, u_R, u_z is a sum of products (Legendre across) × (integrated Legendre along the height,
zero at the root) × (Legendre along the axis). Symmetry splits the system: a straight tooth is symmetric about its
middle plane and about the middle of its width, four blocks; a screwed one about the half-turn that joins both, two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.compliance.bases import gauss, width_functions
from gearbench.compliance.ritz import Ritz
from gearbench.compliance.section import Section


@dataclass(frozen=True, kw_only=True)
class Solid:
    """Elastic body of constant section along a screw.

    Parameters
    ----------
    section
        The section and its functions.
    width
        Length along the axis [mm].
    E, nu
        Young's modulus [N/mm²] and Poisson's ratio.
    order
        Number of functions along the axis.
    """

    section: Section
    width: float
    E: float
    nu: float
    order: int

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """(field, across, height, axis) of the amplitudes."""
        return 3, *self.section.order, self.order

    @property
    def lame(self) -> tuple[float, float]:
        """Lamé's constants λ, μ [N/mm²]."""
        E, nu = self.E, self.nu
        return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))

    def stiffness(self) -> NDArray:
        """Ritz matrix of all amplitudes, flattened ``shape``, (n, n) [N/mm]."""
        S = self.section.stiffness(self.lame)
        n = S[0, 0].shape[0] * S[0, 0].shape[1] * S[0, 0].shape[2]
        S = S.reshape(2, 2, n, 1, n, 1)
        eta, weight = gauss(self.order + 1)
        g, dg = width_functions(self.order, eta)
        g = np.stack([g, dg / self.width])
        Z = np.einsum("azj,bzl->abjl", g * (weight * self.width)[:, None], g)[:, :, None, :, None, :]
        K = S[1, 1] * Z[1, 1]
        mixed = S[0, 1] * Z[0, 1]
        K += mixed
        K += mixed.transpose(2, 3, 0, 1)
        diagonal = np.arange(self.order)
        K[:, diagonal, :, diagonal] += self.width * S[0, 0, :, 0, :, 0]  # the functions along z are orthonormal
        return K.reshape(n * self.order, -1)

    @cached_property
    def blocks(self) -> Sequence[NDArray]:
        """Amplitudes of each symmetry class, indices into the flattened ``shape``."""
        field, across, _, axis = np.indices(self.shape).reshape(4, -1)
        # u_θ bends the tooth where it is even across; u_R and u_z go with it where they are odd
        bending = (across + (field > 0)) % 2
        symmetric = (axis + (field == 2)) % 2
        label = (bending + symmetric) % 2 if self.section.screw else 2 * bending + symmetric
        return [np.flatnonzero(label == k) for k in range(2 if self.section.screw else 4)]

    @cached_property
    def ritz(self) -> Sequence[Ritz]:
        """The Ritz systems of the blocks."""
        K = self.stiffness()
        return [Ritz(K[np.ix_(index, index)], len(index)) for index in self.blocks]

    @property
    def condition(self) -> float:
        """Largest condition number of the scaled blocks."""
        return max(ritz.condition for ritz in self.ritz)

    def functional(self, x: ArrayLike, s: float, y: ArrayLike, direction: ArrayLike) -> NDArray:
        """Displacement along ``direction`` (…, 3), components θ, R, z, at (x, s, y): rows (…, n)."""
        x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        g, _ = width_functions(self.order, y / self.width)
        values = np.einsum("...c,...ki,...j->...ckij", direction, self.section.values(x, s), g)
        return values.reshape(*x.shape, -1)

    def compliance(self, functional: NDArray) -> NDArray:
        """F K⁻¹ Fᵀ [mm/N] of functionals F (m, n): displacement of each under a unit force along each, (m, m)."""
        total = np.zeros((len(functional), len(functional)))
        for index, ritz in zip(self.blocks, self.ritz, strict=True):
            rows = functional[:, index]
            involved = np.flatnonzero(rows.any(axis=1))
            total[np.ix_(involved, involved)] += ritz.compliance(rows[involved])
        return total
