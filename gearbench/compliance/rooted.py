"""A solid tooth whose root moves: its stiffness against that, and the compliance of its flank with the root held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.bases import axis_functions, gauss, legendre_functions
from gearbench.compliance.solid import Solid


@dataclass(frozen=True, kw_only=True)
class RootParts:
    """Condensed to flank and root, (R5) of docs/theory.md; polynomials of the root r = (field, k, j), on [0, 1].

    Parameters
    ----------
    held
        Displacements of the flank's functionals under each other with the root held, (flank, flank).
    stiffness
        Forces against motions of the root, (r, r).
    moved
        Displacement of the flank with motions of the root, (flank, r).
    """

    held: NDArray
    stiffness: NDArray
    moved: NDArray


def root_parts(solid: Solid, flank: NDArray, count: int) -> RootParts:
    """Parts of a ``solid`` with free root, its ``flank`` functionals (flank, n), and ``count`` polynomials in z."""
    field, across, along, axis = solid.shape
    # polynomials of degree j are sums of the first j + 1 functions along the axis
    polynomials = _in_axis_functions(count, axis)[:, :count]
    number = np.arange(field * across * count).reshape(field * across, count)
    held = np.zeros((len(flank), len(flank)))
    S, phi = np.zeros((number.size, number.size)), np.zeros((len(flank), number.size))
    for inner, root, chain in zip(solid.classes, solid.root_classes, solid.chains, strict=True):
        # from functions along the axis to polynomials in z of this class
        position = np.concatenate([number[root[j % 2] // along, j] for j in range(count)])
        owner = np.concatenate([root[k % 2] for k in range(count)])
        degree = np.concatenate([np.full(len(root[k % 2]), k) for k in range(count)])
        T = np.where(owner[:, None] == owner, polynomials[degree][:, degree].T, 0.0)
        at = solid.amplitudes(root)[: len(owner)]
        K_bi = solid.block(inner, root, count) @ T
        K_ii = T.T @ solid.block(root, root, count)[: len(owner)] @ T
        rows = flank[:, solid.amplitudes(inner)]
        involved = np.flatnonzero(rows.any(axis=1))
        half = chain.half_solve(np.hstack([K_bi, rows[involved].T]))
        moved, loaded = half[:, : len(position)], half[:, len(position) :]
        S[np.ix_(position, position)] = K_ii - moved.T @ moved
        phi[:, position] += flank[:, at] @ T
        phi[np.ix_(involved, position)] -= loaded.T @ moved
        held[np.ix_(involved, involved)] += loaded.T @ loaded
    return RootParts(held=held, stiffness=(S + S.T) / 2, moved=phi)


def _in_axis_functions(count: int, axis: int) -> NDArray:
    """Legendre functions g_j, j < ``count``, as sums of the functions along the axis, (count, axis)."""
    eta, weight = gauss(axis + 2)
    h, g = axis_functions(axis, eta)[0], legendre_functions(count, eta)
    return np.linalg.solve(h.T @ (weight[:, None] * h), h.T @ (weight[:, None] * g)).T
