"""Solid: three-dimensional elasticity on a section extruded along a screw, clamped at its root, by the Ritz method.

Each of the displacements u_θ, u_R, u_z is a sum of products (Legendre across) × (integrated Legendre along the height,
zero at the root) × (integrated Legendre along the axis, ``axis_functions``, S4 of docs/theory.md). Symmetry splits the
system into classes. A straight tooth has four: it is symmetric about its middle plane and about the middle of its
width. A screwed tooth has two: only the half-turn about the radius through its middle maps it onto itself. In a class
the functions along the axis form a chain, so that the work grows linearly with their number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.compliance.bases import axis_functions, gauss
from gearbench.compliance.chain import Chain, Sides, Sums
from gearbench.compliance.section import ToothSection
from gearbench.geometry.material import lame
from gearbench.threads import lazy

#: A symmetry class: indices of the section's functions that go with even, and with odd functions along the axis.
Class = tuple[NDArray, NDArray]
#: Orders of the derivatives of two functions k, l along the axis whose product has an integral, (parity of k + l, case,
#: function): neither or both are differentiated if k and l have the same parity, otherwise one of the two.
_DERIVATIVES = np.array([[[0, 0], [1, 1]], [[0, 1], [1, 0]]])


@dataclass(frozen=True, kw_only=True)
class Functionals:
    """Displacements weighted over a surface with products of functions along the section and along the axis.

    Parameters
    ----------
    rows
        Coefficients of the functions of the section, (p, field·across·height).
    along
        Coefficients of the functions along the axis, (q, order).
    """

    rows: NDArray
    along: NDArray

    def matrix(self) -> NDArray:
        """Coefficients of the amplitudes of the solid, (p·q, n)."""
        return np.kron(self.rows, self.along)

    def by_rows(self, matrix: NDArray) -> NDArray:
        """Reorder rows (q·p, …) of a chain to the order of ``matrix``, (p·q, …)."""
        parts = matrix.reshape(len(self.along), len(self.rows), -1)
        return parts.swapaxes(0, 1).reshape(matrix.shape)


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

    section: ToothSection
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
        """S[a, b] of the section, for derivatives a, b along the axis, (2, 2, n, n); see ``ToothSection.stiffness``."""
        n = int(np.prod(self.shape[:3]))
        return self.section.stiffness(lame(self.E, self.nu)).reshape(2, 2, n, n)

    @lazy
    def of_axis(self) -> NDArray:
        """∫ h_k⁽ᵃ⁾ h_l⁽ᵇ⁾ dz of the functions along the axis, (2, 2, q, q); zero where |k − l| > 2."""
        b = self.width
        return axis_integrals(self.order) * np.array([[b, 1.0], [1.0, 1 / b]])[:, :, None, None]

    def _classes(self, rows: NDArray) -> Sequence[Class]:
        """Symmetry classes of the functions of the section selected by ``rows`` (field, across, height).

        Across the tooth, even functions of u_θ (bending) couple with odd ones of u_R and u_z, and vice versa. Along the
        axis, functions of u_θ and u_R couple if their parities agree, with those of u_z if they differ.
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
        """Symmetry classes of the functions that move the root."""
        root = np.zeros(self.shape[:3], dtype=bool)
        root[:, :, : self.section.free] = True
        return self._classes(root)

    def amplitudes(self, chosen: Class) -> NDArray:
        """Indices of a class in the flattened ``shape``, sorted by the function along the axis, the last one first.

        Loads and motions are polynomials of low degree: in this order they are zero in the first blocks of the chain.
        """
        return np.concatenate([chosen[k % 2] * self.order + k for k in reversed(range(self.order))])

    @lazy
    def chains(self) -> Sequence[Chain]:
        """The systems of the classes: every function along the axis is a block, coupled to the next two."""
        return [self._chain(chosen) for chosen in self.classes]

    def _chain(self, chosen: Class) -> Chain:
        k = np.arange(self.order)[::-1]
        l = np.maximum(k - np.arange(3)[:, None], 0)
        sizes = np.array([len(chosen[parity]) for parity in k % 2], dtype=int)
        return Chain(sizes=sizes, blocks=self.blocks(chosen, chosen, k, l))

    def blocks(self, left: Class, right: Class, k: NDArray, l: NDArray) -> Sums:
        """Stiffness blocks (…) between functions of two classes, for the functions ``k`` and ``l`` along the axis."""
        S, Z, k, l = self.of_section, self.of_axis, *np.broadcast_arrays(k, l)
        matrices = [
            S[i, j][left[a][:, None], right[b]] for a, b in product(range(2), range(2)) for i, j in _DERIVATIVES[a ^ b]
        ]
        i, j = np.moveaxis(_DERIVATIVES[(k + l) % 2], -1, 0)
        which = (4 * (k % 2) + 2 * (l % 2))[..., None] + np.arange(2)
        return Sums(matrices=matrices, which=which, factors=Z[i, j, k[..., None], l[..., None]])

    def loads(self, functionals: Functionals, chosen: Class) -> Sides:
        """Functionals as right-hand sides of the chain of a class, grouped by polynomials in y."""
        k = np.arange(self.order)[::-1]
        along = functionals.along[:, k].T
        which, factors = np.zeros((2, *along.shape, 2))
        which[..., 0], factors[..., 0] = k[:, None] % 2, along
        matrices = [np.ascontiguousarray(functionals.rows[:, part].T) for part in chosen]
        widths = np.full(len(functionals.along), len(functionals.rows))
        return Sides(widths=widths, blocks=Sums(matrices=matrices, which=which.astype(int), factors=factors))

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

    def compliance(self, functionals: NDArray | Functionals) -> NDArray:
        """F K⁻¹ Fᵀ [mm/N] of functionals F (m, n): displacement of each under a unit force along each, (m, m)."""
        products = isinstance(functionals, Functionals)
        parts = []
        for chosen, chain in zip(self.classes, self.chains, strict=True):
            sides = self.loads(functionals, chosen) if products else functionals[:, self.amplitudes(chosen)].T
            parts.append(chain.compliance(sides))
        total = np.sum(parts, axis=0)
        return functionals.by_rows(functionals.by_rows(total).T) if products else total


@lru_cache(maxsize=64)
def axis_integrals(order: int) -> NDArray:
    """∫ h_k⁽ᵃ⁾ h_l⁽ᵇ⁾ dη on [0, 1], (2, 2, q, q), exact zeros where the functions are orthogonal."""
    eta, weight = gauss(order + 2)
    both = np.stack(axis_functions(order, eta))
    Z = np.einsum("azk,bzl->abkl", both * weight[:, None], both)
    Z[np.abs(Z) <= 1e-13 * np.abs(Z).max(axis=(2, 3), keepdims=True)] = 0.0
    Z.flags.writeable = False
    return Z
