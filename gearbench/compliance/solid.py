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
        return 3, *self.section.shape, self.order

    @property
    def lame(self) -> tuple[float, float]:
        """Lamé's constants λ, μ [N/mm²]."""
        E, nu = self.E, self.nu
        return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))

    def stiffness(self) -> NDArray:
        """Ritz matrix of all amplitudes, flattened ``shape``, (n, n) [N/mm]: its blocks, zero between them."""
        n = int(np.prod(self.shape))
        K = np.zeros((n, n))
        for index, ritz in zip(self.blocks, self.ritz, strict=True):
            K[np.ix_(index, index)] = ritz.stiffness
        return K

    @cached_property
    def _classes(self) -> Sequence[Sequence[tuple[NDArray, NDArray]]]:
        """Symmetry classes, each a list of (functions of the section, functions along the axis), all their products.

        u_θ bends the tooth where it is even across; u_R and u_z go with it where they are odd. u_θ and u_R go
        together where they have the same parity along the axis, and u_z where it has the other one.
        """
        field, across, _ = np.indices(self.shape[:3]).reshape(3, -1)
        kind = 2 * ((across + (field > 0)) % 2) + (field == 2)
        members = [np.flatnonzero(kind == k) for k in range(4)]
        axis = [np.arange(parity, self.order, 2) for parity in range(2)]
        parts = [[(members[2 * b], axis[p]), (members[2 * b + 1], axis[1 - p])] for b in range(2) for p in range(2)]
        classes = [parts[0] + parts[3], parts[1] + parts[2]] if self.section.screw else parts
        return [groups for groups in classes if any(len(a) * len(j) for a, j in groups)]

    @cached_property
    def blocks(self) -> Sequence[NDArray]:
        """Amplitudes of each symmetry class, indices into the flattened ``shape``."""
        return [np.concatenate([(a[:, None] * self.order + j).ravel() for a, j in groups]) for groups in self._classes]

    @cached_property
    def ritz(self) -> Sequence[Ritz]:
        """The Ritz systems of the blocks."""
        S = self.section.stiffness(self.lame)
        n = int(np.prod(self.shape[:3]))
        S = S.reshape(4, n, n)
        eta, weight = gauss(self.order + 1)
        g, dg = width_functions(self.order, eta)
        g = np.stack([g, dg / self.width])
        Z = np.einsum("azj,bzl->abjl", g * (weight * self.width)[:, None], g).reshape(4, self.order, -1)
        systems = []
        for groups in self._classes:
            rows = [[_kronecker(S, Z, a, b, j, l) for b, l in groups] for a, j in groups]
            K = np.block(rows)
            systems.append(Ritz(K, len(K)))
        return systems

    @property
    def condition(self) -> float:
        """Largest condition number of the scaled blocks."""
        return max(ritz.condition for ritz in self.ritz)

    def functional(self, x: ArrayLike, s: float, y: ArrayLike, direction: NDArray) -> NDArray:
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


def _kronecker(S: NDArray, Z: NDArray, a: NDArray, b: NDArray, j: NDArray, l: NDArray) -> NDArray:
    """Σ S[a, b] ⊗ Z[j, l] over the derivatives along the axis, stacked along the first axis of S and Z."""
    part, across = S[:, a[:, None], b].reshape(4, -1), Z[:, j[:, None], l].reshape(4, -1)
    product = (part.T @ across).reshape(len(a), len(b), len(j), len(l))
    return product.transpose(0, 2, 1, 3).reshape(len(a) * len(j), len(b) * len(l))
