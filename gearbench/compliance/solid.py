"""Solid: three-dimensional elasticity on a section extruded along a screw, clamped at its root, by the Ritz method.

Each of the displacements u_θ, u_R, u_z is a sum of products (Legendre across) × (integrated Legendre along the height,
zero at the root) × (integrated Legendre along the axis, ``axis_functions``, S4 of docs/theory.md). Symmetry splits the
system: a straight tooth is symmetric about its middle plane and about the middle of its width, four classes; a screwed
one about the half-turn that joins both, two. Within a class the functions along the axis form a chain, so that the work
grows linearly with their number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.compliance.bases import axis_functions, gauss
from gearbench.compliance.chain import Chain
from gearbench.compliance.section import Section
from gearbench.geometry.material import lame
from gearbench.threads import lazy

#: Functions of the section that go with the even and with the odd functions along the axis.
Class = tuple[NDArray, NDArray]


@dataclass(frozen=True, kw_only=True)
class Solid:
    """Elastic body of constant section along a screw.

    Parameters
    ----------
    section
        The section and its functions. If it is free, its first function along the height moves the root.
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

    @lazy
    def of_section(self) -> NDArray:
        """S[a, b] of the section, (2, 2, n, n)."""
        n = int(np.prod(self.shape[:3]))
        return self.section.stiffness(lame(self.E, self.nu)).reshape(2, 2, n, n)

    @lazy
    def of_axis(self) -> NDArray:
        """∫ h_k⁽ᵃ⁾ h_l⁽ᵇ⁾ dz of the functions along the axis, (2, 2, q, q); zero where |k − l| > 2."""
        b = self.width
        return axis_integrals(self.order) * np.array([[b, 1.0], [1.0, 1 / b]])[:, :, None, None]

    def _classes(self, rows: NDArray) -> Sequence[Class]:
        """Symmetry classes of the functions of the section in ``rows`` (field, across, height) of those wanted.

        u_θ bends the tooth where it is even across; u_R and u_z go with it where they are odd. u_θ and u_R go
        together where they have the same parity along the axis, and u_z where it has the other one.
        """
        field, across, _ = np.indices(self.shape[:3]).reshape(3, -1)
        kind = 2 * ((across + (field > 0)) % 2) + (field == 2)
        m = [np.flatnonzero((kind == k) & rows.ravel()) for k in range(4)]
        if self.section.screw:
            one, other = np.concatenate([m[0], m[3]]), np.concatenate([m[1], m[2]])
            return [(one, other), (other, one)]
        return [(m[0], m[1]), (m[1], m[0]), (m[2], m[3]), (m[3], m[2])]

    @lazy
    def classes(self) -> Sequence[Class]:
        """Symmetry classes of the functions that are zero at the root."""
        inner = np.ones(self.shape[:3], dtype=bool)
        inner[:, :, : self.section.free] = False
        return self._classes(inner)

    @lazy
    def root_classes(self) -> Sequence[Class]:
        """The same of the functions that move the root."""
        root = np.zeros(self.shape[:3], dtype=bool)
        root[:, :, : self.section.free] = True
        return self._classes(root)

    def amplitudes(self, chosen: Class) -> NDArray:
        """Indices of a class in the flattened ``shape``, functions along the axis one after the other, last one first.

        Loads and motions are polynomials of low degree: they begin late in a chain of this order.
        """
        return np.concatenate([chosen[k % 2] * self.order + k for k in reversed(range(self.order))])

    @lazy
    def chains(self) -> Sequence[Chain]:
        """The systems of the classes: every function along the axis makes a block, and meets the next two."""
        return [self._chain(chosen) for chosen in self.classes]

    def _chain(self, chosen: Class) -> Chain:
        found: list[list[NDArray]] = []
        for apart in range(3):
            k = np.arange(self.order)[::-1][: max(self.order - apart, 0)]
            blocks: list[NDArray] = [np.empty(0)] * len(k)
            for parity in range(2):
                mine = np.flatnonzero(k % 2 == parity)
                products = self._products(
                    chosen, parity, chosen, (parity + apart) % 2, self.of_axis[:, :, k[mine], k[mine] - apart]
                )
                for i, block in zip(mine, products, strict=True):
                    blocks[i] = block
            found.append(blocks)
        return Chain(diagonal=found[0], coupling=found[1], beyond=found[2])

    def _products(self, left: Class, a: int, right: Class, b: int, Z: NDArray) -> NDArray:
        """Blocks Σ Z S between functions of parity ``a`` and ``b`` along the axis, Z (2, 2, n): (n, left, right)."""
        S, position = self.of_section, np.ix_(left[a], right[b])
        # functions of the same parity meet undifferentiated or both differentiated, others one and the other way
        used = ((0, 0), (1, 1)) if a == b else ((0, 1), (1, 0))
        both = np.stack([S[i, j][position] for i, j in used])
        coefficients = np.stack([Z[i, j] for i, j in used], axis=1)
        return (coefficients @ both.reshape(2, -1)).reshape(len(coefficients), *both.shape[1:])

    def block(self, left: Class, right: Class, Z: NDArray, parities: tuple[NDArray, NDArray]) -> NDArray:
        """Stiffness between functions of two classes, those along the axis one after the other.

        ``Z``: ∫ a_k⁽ⁱ⁾ b_l⁽ʲ⁾ dz of the functions along the axis, (2, 2, k, l); ``parities``: theirs, (k,) and (l,).
        """
        sizes = [[len(side[p]) for p in parity] for side, parity in zip((left, right), parities, strict=True)]
        rows, columns = (np.cumsum([0, *size]) for size in sizes)
        result = np.zeros((rows[-1], columns[-1]))
        there = Z.any(axis=(0, 1))
        for a, b in product(range(2), range(2)):
            k, l = np.nonzero(there & (parities[0] == a)[:, None] & (parities[1] == b))
            for i, j, part in zip(k, l, self._products(left, a, right, b, Z[:, :, k, l]), strict=True):
                result[rows[i] : rows[i + 1], columns[j] : columns[j + 1]] = part
        return result

    @property
    def condition(self) -> float:
        """Largest condition number of the systems."""
        return max(chain.condition for chain in self.chains)

    def functional(self, x: ArrayLike, s: float, y: ArrayLike, direction: NDArray) -> NDArray:
        """Displacement along ``direction`` (…, 3), components θ, R, z, at (x, s, y): rows (…, n)."""
        x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        h, _ = axis_functions(self.order, y / self.width)
        values = np.einsum("...c,...ki,...j->...ckij", direction, self.section.values(x, s), h)
        return values.reshape(*x.shape, -1)

    def compliance(self, functional: NDArray) -> NDArray:
        """F K⁻¹ Fᵀ [mm/N] of functionals F (m, n): displacement of each under a unit force along each, (m, m)."""
        total = np.zeros((len(functional), len(functional)))
        for chosen, chain in zip(self.classes, self.chains, strict=True):
            total += chain.compliance(functional[:, self.amplitudes(chosen)].T)
        return total


@lru_cache(maxsize=64)
def axis_integrals(order: int) -> NDArray:
    """∫ h_k⁽ᵃ⁾ h_l⁽ᵇ⁾ dη on [0, 1], (2, 2, q, q), exact zeros where the functions are orthogonal."""
    eta, weight = gauss(order + 2)
    both = np.stack(axis_functions(order, eta))
    Z = np.einsum("azk,bzl->abkl", both * weight[:, None], both)
    Z[np.abs(Z) <= 1e-13 * np.abs(Z).max(axis=(2, 3), keepdims=True)] = 0.0
    Z.flags.writeable = False
    return Z
