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
    polynomials = np.tril(_in_axis_functions(count, axis))
    number = np.arange(field * across * count).reshape(field * across, count)
    parity, degrees = np.arange(axis)[::-1] % 2, np.arange(count) % 2
    joint = solid.of_axis[:, :, ::-1] @ polynomials.T
    own = polynomials @ solid.of_axis @ polynomials.T
    own[np.abs(own) <= 1e-13 * np.abs(own).max(axis=(2, 3), keepdims=True)] = 0.0
    held = np.zeros((len(flank), len(flank)))
    S, phi = np.zeros((number.size, number.size)), np.zeros((len(flank), number.size))
    # by rows of functions, which are picked fast
    loads = np.ascontiguousarray(flank.T)
    on_axis = loads.reshape(-1, axis, len(flank))
    for inner, root, chain in zip(solid.classes, solid.root_classes, solid.chains, strict=True):
        position = np.concatenate([number[root[j % 2] // along, j] for j in range(count)])
        K_bi = solid.block(inner, root, joint, (parity, degrees))
        K_ii = solid.block(root, root, own, (degrees, degrees))
        moved, loaded = np.split(np.arange(len(position) + len(flank)), [len(position)])
        found = chain.compliance(np.hstack([K_bi, loads[solid.amplitudes(inner)]]))
        S[np.ix_(position, position)] = K_ii - found[np.ix_(moved, moved)]
        values = [polynomials @ on_axis[mine] for mine in root]
        phi[:, position] = np.vstack([values[j % 2][:, j] for j in range(count)]).T - found[np.ix_(loaded, moved)]
        held += found[np.ix_(loaded, loaded)]
    return RootParts(held=held, stiffness=(S + S.T) / 2, moved=phi)


def _in_axis_functions(count: int, axis: int) -> NDArray:
    """Legendre functions g_j, j < ``count``, as sums of the functions along the axis, (count, axis)."""
    eta, weight = gauss(axis + 2)
    h, g = axis_functions(axis, eta)[0], legendre_functions(count, eta)
    return np.linalg.solve(h.T @ (weight[:, None] * h), h.T @ (weight[:, None] * g)).T
