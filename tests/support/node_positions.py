"""Positions of the nodes of a displacement space."""

import numpy as np
from numpy.typing import NDArray

from fem_reference.elasticity import Space


def node_positions(space: Space) -> NDArray:
    """Positions of the nodes, (node, dim) [mm]."""
    shapes, _ = space.geometry_shapes(np.asarray(space.element.doflocs, dtype=float).T)
    out = np.empty((space.n_nodes, space.dim))
    out[space.nodes_of] = np.einsum("eai,aq->qei", space.geometry, shapes)
    return out
