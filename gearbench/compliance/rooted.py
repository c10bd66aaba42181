"""A solid tooth with moving root: its stiffness against motions of the root, and the compliance of its flank."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.bases import axis_functions, gauss, legendre_functions
from gearbench.compliance.chain import Sides, Sums
from gearbench.compliance.solid import Class, Functionals, Solid


@dataclass(frozen=True, kw_only=True)
class RootParts:
    """Tooth condensed to flank and root (R5 of docs/theory.md).

    The root moves by polynomials r: in each direction, of degree k over the thickness and j along the axis. ``flank``
    stands for the load polynomials of the flank (``Functionals``).

    Parameters
    ----------
    held
        Compliance of the flank while the root is held, (flank, flank).
    stiffness
        Stiffness against motions of the root, (r, r).
    moved
        Displacement of the flank under motions of the root, (flank, r).
    """

    held: NDArray
    stiffness: NDArray
    moved: NDArray


def root_parts(solid: Solid, flank: Functionals, count: int) -> RootParts:
    """Condense a ``solid`` with moving root to its ``flank`` and root polynomials, ``count`` of them along the axis."""
    field, across, along, axis = solid.shape
    number = np.arange(field * across * count).reshape(field * across, count)
    S, phi = _of_root(solid, flank, count)
    clamped = np.zeros(2 * (len(phi),))
    for inner, root, chain in zip(solid.classes, solid.root_classes, solid.chains, strict=True):
        position = np.concatenate([number[root[j % 2] // along, j] for j in range(count)])
        condensed, n = chain.compliance(_sides(solid, inner, root, flank, count)), len(position)
        S[position[:, None], position] -= condensed[:n, :n]
        phi[:, position] -= condensed[n:, :n]
        clamped += condensed[n:, n:]
    # from motions by functions along the axis to polynomials: that of degree j is a sum of the first j + 1 functions
    polynomials = np.tril(_in_axis_functions(count, axis))[:, :count].T
    S = (S.reshape(-1, count) @ polynomials).reshape(S.shape).T
    S = (S.reshape(-1, count) @ polynomials).reshape(S.shape)
    phi = (flank.by_rows(phi).reshape(-1, count) @ polynomials).reshape(phi.shape)
    return RootParts(held=flank.by_rows(flank.by_rows(clamped).T), stiffness=(S + S.T) / 2, moved=phi)


def _of_root(solid: Solid, flank: Functionals, count: int) -> tuple[NDArray, NDArray]:
    """Stiffness between the functions that move the root, and the displacement of the flank under them.

    The other functions are held at zero; rows are ordered as in a chain.
    """
    field, across, along, _ = solid.shape
    n, (p, _), (q, _) = field * across, flank.rows.shape, flank.along.shape
    Z = solid.of_axis[:, :, :count, :count].reshape(4, -1)
    S = solid.of_section.reshape(4, n, along, n, along)[:, :, 0, :, 0].reshape(4, -1)
    stiffness = (Z.T @ S).reshape(count, count, n, n).transpose(2, 0, 3, 1).reshape(n * count, n * count)
    at_root = flank.rows.reshape(p, n, along)[:, :, 0]
    flank_motion = at_root[:, :, None] * flank.along[:, None, None, :count]
    return stiffness, flank_motion.reshape(q * p, n * count)


def _sides(solid: Solid, inner: Class, root: Class, flank: Functionals, count: int) -> Sides:
    """Motions of the root, the first ``count`` functions along the axis, and loads of the flank, on a chain."""
    k, j = np.arange(solid.order)[::-1], np.arange(count)
    motions, loads = solid.blocks(inner, root, k[:, None], j), solid.loads(flank, inner)
    which = np.concatenate([motions.which, loads.blocks.which + len(motions.matrices)], axis=1)
    factors = np.concatenate([motions.factors, loads.blocks.factors], axis=1)
    matrices = [*motions.matrices, *loads.blocks.matrices]
    widths = np.concatenate([[len(root[parity]) for parity in j % 2], loads.widths])
    return Sides(widths=widths, blocks=Sums(matrices=matrices, which=which, factors=factors))


@lru_cache(maxsize=64)
def _in_axis_functions(count: int, axis: int) -> NDArray:
    """Legendre functions g_j, j < ``count``, as sums of the functions along the axis, (count, axis)."""
    eta, weight = gauss(axis + 2)
    h, g = axis_functions(axis, eta)[0], legendre_functions(count, eta)
    coefficients = np.linalg.solve(h.T @ (weight[:, None] * h), h.T @ (weight[:, None] * g)).T
    coefficients.flags.writeable = False
    return coefficients
