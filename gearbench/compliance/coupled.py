"""Teeth that move each other: from the compliance between a tooth and its neighbours to a factor common to all."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def coupled_root(blocks: NDArray, teeth: int, *, driven: bool, rtol: float = 1e-12) -> NDArray:
    """Square root (teeth, n, r) of the block matrix C_{i−j} of the teeth of neighbouring pairs i = 0 … teeth−1.

    Parameters
    ----------
    blocks
        C_d (2m+1, n, n), d = −m … m: deflection of tooth d under loads on tooth 0. Teeth farther apart do not see each
        other.
    teeth
        Number of pairs.
    driven
        On the driving gear tooth d + 1 carries the next pair; on the driven gear they are counted the other way.
    rtol
        Eigenvalues below this fraction of the largest are dropped: rounding, and negative ones.
    """
    far, size = len(blocks) // 2, blocks.shape[1]
    none = np.zeros((size, size))
    sign = -1 if driven else 1

    def block(d: int) -> NDArray:
        return blocks[far + sign * d] if abs(d) <= far else none

    values, vectors = np.linalg.eigh(np.block([[block(i - j) for j in range(teeth)] for i in range(teeth)]))
    keep = values > rtol * values[-1]
    return (vectors[:, keep] * np.sqrt(values[keep])).reshape(teeth, size, -1)
