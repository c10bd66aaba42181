"""Mesh phases at which the contact is solved, with the weights that average over the mesh cycle."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.pair import Pair
from gearbench.geometry.quadrature import gauss


def uniform_phases(count: int) -> tuple[NDArray, NDArray]:
    """Midpoints of ``count`` equal intervals of [0, 1), and their weights.

    The error of means falls as 1/``count`` if the stiffness jumps.
    """
    return (np.arange(count) + 0.5) / count, np.full(count, 1 / count)


def mirrored_phases(pair: Pair, count: int) -> NDArray:
    """``count`` equidistant phases in [0, 1), ascending, which stay the same if pinion and wheel are exchanged.

    The exchange turns τ into ε_α − ε_β − τ. Panels that are chosen from solutions at these phases thus do not depend on
    which gear is the pinion.
    """
    meshing = pair.meshing
    middle = (meshing.transverse_contact_ratio - meshing.overlap_ratio) / 2
    phase = ((np.arange(count) + 0.5) / count + middle) % 1.0
    return np.sort(phase % 1.0)  # once more, because −1e-17 % 1.0 is 1.0


def gauss_phases(transitions: Iterable[float], points: int) -> tuple[NDArray, NDArray]:
    """Gauss–Legendre points and weights on panels, which end at the ``transitions`` and at phase 0.

    A transition is a phase, modulo 1, at which the curves over the mesh cycle have a kink or jump. Between transitions
    they are smooth, so means and RMS values converge with order 2·``points`` instead of first order. Transitions closer
    than 1e-9 of the cycle are merged.

    Returns
    -------
    Phases in [0, 1), ascending, and weights that sum to 1.
    """
    # phase 0 ends a panel, because a panel across it would have phases at both ends of the cycle
    ends = np.unique([0.0, *(np.asarray(list(transitions), dtype=float) % 1.0)])
    edges = np.append(ends[np.diff(ends, append=1.0) > 1e-9], 1.0)
    edges[0] = 0.0
    widths, (node, weight) = np.diff(edges), gauss(points)
    phase = edges[:-1, None] + widths[:, None] * (node + 1) / 2
    return phase.ravel(), (widths[:, None] * weight / 2).ravel()
