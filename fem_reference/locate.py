"""Interpolation at arbitrary points of a mesh: find the element, invert its (curved) geometry by Newton's method."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem_reference.elasticity import Points, Space


class OutsideError(ValueError):
    """A point lies outside the mesh."""


def interior_points(space: Space, position: NDArray, candidates: int = 24) -> Points:
    """Interpolation at the points ``position`` (point, dim) [mm].

    Points up to 1 % of an element outside use the nearest element (boundaries of curved meshes).

    Raises
    ------
    OutsideError
        If a point lies farther outside.
    """
    from scipy.spatial import KDTree

    position = np.asarray(position, dtype=float)
    n, dim = position.shape
    k = min(candidates, space.mesh.nelements)
    _, near = KDTree(space.geometry.mean(axis=1)).query(position, k=k)
    near = np.asarray(near).reshape(n, k)
    best, excess, reference = near[:, 0].copy(), np.full(n, np.inf), np.zeros((n, dim))
    for j in range(k):
        open_ = np.flatnonzero(excess > 1e-9)
        if open_.size == 0:
            break
        X = _invert(space, near[open_, j], position[open_])
        outside = _outside(X, simplex=space.kind.startswith("t"))
        better = outside < excess[open_]
        who = open_[better]
        best[who], excess[who], reference[who] = near[who, j], outside[better], X[better]
    if excess.max(initial=0.0) > 0.01:
        at = position[int(np.argmax(excess))]
        raise OutsideError(f"the point {np.array2string(at, precision=4)} mm lies outside the mesh")
    values, _ = space.reference_gradients(reference.T)
    nodes = space.nodes_of[:, best]
    row = np.broadcast_to(np.arange(n), nodes.shape)
    matrix = sp.csr_matrix((values.ravel(), (row.ravel(), nodes.ravel())), shape=(n, space.n_nodes))
    return Points(position, matrix, np.ones(n))


def _outside(X: NDArray, *, simplex: bool) -> NDArray:
    """Distance of reference points (point, dim) from their cell, 0 inside."""
    over = (X.sum(axis=1) - 1 if simplex else (X - 1).max(axis=1)) * 1.0
    return np.nan_to_num(np.maximum(np.maximum(over, (-X).max(axis=1)), 0.0), nan=np.inf)


def _invert(space: Space, element: NDArray, position: NDArray, steps: int = 12) -> NDArray:
    """Reference coordinates (point, dim) of the points in the given elements."""
    geometry = space.geometry[element]
    X = np.full_like(position, 0.25 if space.kind.startswith("t") else 0.5)
    for _ in range(steps):
        shapes, grads = space.geometry_shapes(np.clip(X, -0.5, 1.5).T)
        residual = position - np.einsum("pai,ap->pi", geometry, shapes)
        J = np.einsum("pai,paj->pij", geometry, grads)
        try:
            step = np.linalg.solve(J, residual[..., None])[..., 0]
        except np.linalg.LinAlgError:  # singular far outside a curved element: not this one
            step = np.full_like(X, np.nan)
        X = np.clip(X, -0.5, 1.5) + step
        if np.nanmax(np.abs(step), initial=0.0) < 1e-12:
            break
    return X
