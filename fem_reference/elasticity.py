"""Linear elasticity by finite elements: fast assembly of the weak form.

Weak form: find u with ∫ σ(u) : ε(v) dx = ∫ t · v ds for all v, σ = λ tr(ε) 1 + 2μ ε, ε = ½(∇u + ∇uᵀ). In two
dimensions the same form is plane strain per unit width.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
import skfem
from numpy.typing import NDArray
from skfem.assembly.dofs import Dofs
from skfem.quadrature import get_quadrature

from gearbench.geometry.material import lame


@dataclass(frozen=True)
class ElementKind:
    """A type of finite element.

    Parameters
    ----------
    element
        scikit-fem element of one displacement component.
    quadrature
        Polynomial degree integrated exactly in the reference cell.
    """

    element: Any
    quadrature: int


#: Elements by name, with their number of nodes: hexahedron; in plane strain quadrilateral and triangle.
ELEMENTS: dict[str, ElementKind] = {
    "hex20": ElementKind(skfem.ElementHexS2, 5),
    "quad9": ElementKind(skfem.ElementQuad2, 5),
    "tri6": ElementKind(skfem.ElementTriP2, 4),
}


@dataclass(frozen=True)
class Lame:
    """Lamé's constants λ and μ [N/mm²]."""

    lam: float
    mu: float

    @classmethod
    def of(cls, E: float, nu: float) -> Lame:
        """From Young's modulus [N/mm²] and Poisson's ratio."""
        return cls(*lame(E, nu))


class InvalidMeshError(ValueError):
    """An element is turned inside out (its Jacobian determinant is not positive)."""


@dataclass(frozen=True)
class Space:
    """Displacement space on a mesh: every node carries ``dim`` components, degree of freedom = dim·node + component.

    Parameters
    ----------
    mesh
        scikit-fem mesh, straight or curved.
    kind
        Name of the element, a key of ``ELEMENTS``.
    """

    mesh: Any
    kind: str

    @property
    def dim(self) -> int:
        """Number of displacement components."""
        return self.mesh.dim()

    @cached_property
    def element(self) -> Any:
        """scikit-fem element of one component."""
        return ELEMENTS[self.kind].element()

    @cached_property
    def nodes_of(self) -> NDArray:
        """Nodes of each element, (local node, element)."""
        return self._dofs.element_dofs

    @cached_property
    def _dofs(self) -> Any:
        return Dofs(self.mesh, self.element)

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return int(self._dofs.N)

    def boundary_nodes(self, name: str) -> NDArray:
        """Nodes on the named boundary."""
        return np.unique(self._dofs.get_facet_dofs(self.mesh.boundaries[name]).flatten())

    def reference_gradients(self, X: NDArray) -> tuple[NDArray, NDArray]:
        """Shape functions (local node, q) and their gradients (q, local node, dim) at reference points X (dim, q)."""
        return _shapes(self.element, self.nodes_of.shape[0], X)

    @cached_property
    def geometry(self) -> NDArray:
        """Geometry nodes of each element, (element, geometry node, dim) [mm]."""
        return self.mesh.doflocs.T[self.mesh.dofs.element_dofs.T]

    def geometry_shapes(self, X: NDArray) -> tuple[NDArray, NDArray]:
        """Shape functions of the geometry, like ``reference_gradients``."""
        return _shapes(self.mesh.elem(), self.geometry.shape[1], X)

    def gradients(self, X: NDArray, elements: slice = slice(None)) -> tuple[NDArray, NDArray]:
        """∇N (element, q, local node, dim) [1/mm] and |J| (element, q) at reference points X.

        Raises
        ------
        InvalidMeshError
            If a Jacobian determinant is not positive.
        """
        _, dN = self.reference_gradients(X)
        _, dM = self.geometry_shapes(X)
        # ∂x_i/∂X_j = Σ_a x_ai ∂M_a/∂X_j
        J = np.matmul(np.swapaxes(self.geometry[elements], 1, 2)[:, None], dM)
        det, inverse = _inverse(J)
        # scikit-fem's reference cells may be left-handed: the sign is common to all elements of a proper mesh; its
        # simplices are numbered without regard to orientation: there only a change within the element is an error
        sign = np.sign(det[:, :1]) if self.kind == "tri6" else np.sign(det.flat[0])
        if np.any(det * sign <= 0):
            bad = int(np.count_nonzero((det * sign <= 0).any(axis=1)))
            raise InvalidMeshError(f"{bad} of {det.shape[0]} elements are turned inside out (Jacobian ≤ 0)")
        return np.matmul(dN, inverse), det * sign

    def stiffness(self, material: Lame, free: NDArray | None = None) -> sp.csr_matrix:
        """Upper triangle of the stiffness matrix [N/mm] on the nodes ``free`` (boolean mask; default all).

        K_ai,bj = ∫ λ N_a,i N_b,j + μ N_a,j N_b,i + μ δ_ij ∇N_a · ∇N_b dx, all elements of a chunk at once.
        """
        number = np.arange(self.n_nodes) if free is None else np.where(free, np.cumsum(free) - 1, -1)
        X, weight = get_quadrature(self.element.refdom, ELEMENTS[self.kind].quadrature)
        a, b = np.triu_indices(self.nodes_of.shape[0])
        row, col, blocks = [], [], []
        for start in range(0, self.mesh.nelements, _CHUNK):
            chunk = slice(start, start + _CHUNK)
            grad, det = self.gradients(X, chunk)
            grad *= np.sqrt(weight * det)[..., None, None]
            nodes = number[self.nodes_of[:, chunk].T]
            order = np.argsort(nodes, axis=1, kind="stable")  # so that local a ≤ b means global row ≤ column
            nodes = np.take_along_axis(nodes, order, axis=1)
            grad = np.take_along_axis(grad, order[:, None, :, None], axis=2)
            block = _element_blocks(grad, material, a, b)
            keep = nodes[:, a] >= 0
            row.append(nodes[:, a][keep])
            col.append(nodes[:, b][keep])
            blocks.append(block[keep])
        size = self.n_nodes if free is None else int(np.count_nonzero(free))
        return _upper_csr(np.concatenate(row), np.concatenate(col), np.concatenate(blocks), size)


#: Number of elements at a time, so that work arrays fit into the cache.
_CHUNK = 512


def _shapes(element: Any, n: int, X: NDArray) -> tuple[NDArray, NDArray]:
    values, grads = zip(*(element.lbasis(X, i) for i in range(n)), strict=True)
    ones = np.ones(X.shape[1])
    return np.array([v * ones for v in values]), np.stack([g * ones for g in grads]).transpose(2, 0, 1)


def _inverse(J: NDArray) -> tuple[NDArray, NDArray]:
    """Determinant and inverse of (…, d, d) matrices, d = 2 or 3, by cofactors."""
    c = np.empty_like(J)
    if J.shape[-1] == 2:
        c[..., 0, 0], c[..., 0, 1] = J[..., 1, 1], -J[..., 0, 1]
        c[..., 1, 0], c[..., 1, 1] = -J[..., 1, 0], J[..., 0, 0]
        det = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
    else:
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            for m in range(3):
                n, p = (m + 1) % 3, (m + 2) % 3
                c[..., m, i] = J[..., j, n] * J[..., k, p] - J[..., j, p] * J[..., k, n]
        det = J[..., 0, 0] * c[..., 0, 0] + J[..., 0, 1] * c[..., 1, 0] + J[..., 0, 2] * c[..., 2, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        return det, c / det[..., None, None]


def _element_blocks(grad: NDArray, material: Lame, a: NDArray, b: NDArray) -> NDArray:
    """Blocks K_ab (element, pair, dim, dim) from weighted gradients (element, q, node, dim) for node pairs (a, b)."""
    n, q, nodes, dim = grad.shape
    A = grad.reshape(n, q, nodes * dim)
    M = np.matmul(A.transpose(0, 2, 1), A).reshape(n, nodes, dim, nodes, dim)
    M = M[:, a, :, b, :]  # (pair, element, i, j): advanced indices first
    block = material.lam * M + material.mu * M.swapaxes(2, 3)
    shear = material.mu * np.trace(M, axis1=2, axis2=3)
    for i in range(dim):
        block[..., i, i] += shear
    return block.swapaxes(0, 1)


def _upper_csr(row: NDArray, col: NDArray, blocks: NDArray, size: int) -> sp.csr_matrix:
    """Sum blocks (…, dim, dim) at block positions row ≤ column to the upper triangle in CSR form, indices sorted."""
    dim = blocks.shape[-1]
    key = row.astype(np.int64) * size + col
    order = np.argsort(key, kind="stable")
    key = key[order]
    first = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    data = np.add.reduceat(blocks[order], first, axis=0)
    key = key[first]
    indptr = np.searchsorted(key, np.arange(size + 1, dtype=np.int64) * size)
    full = sp.bsr_matrix((data, key % size, indptr), shape=(dim * size, dim * size)).tocsr()
    # the diagonal block comes first in its block row: drop the blocks below the diagonal
    keep = np.ones(full.nnz, dtype=bool)
    start = full.indptr[:-1].reshape(size, dim)
    for i in range(1, dim):
        keep[(start[:, i, None] + np.arange(i)).ravel()] = False
    counts = np.diff(full.indptr) - np.tile(np.arange(dim), size)
    pointer = np.concatenate([[0], np.cumsum(counts)])
    return sp.csr_matrix((full.data[keep], full.indices[keep], pointer), shape=full.shape)


def free_dofs(free: NDArray, dim: int) -> NDArray:
    """Degrees of freedom of the free nodes (boolean mask)."""
    return (dim * np.flatnonzero(free)[:, None] + np.arange(dim)).ravel()
