"""Compiled sums of products of the integrals along the radius of a ring and of those along its axis."""

from __future__ import annotations

from gearbench.compiled import SUMS, entry


@entry(SUMS)
def assemble(along, across, K):
    """K (p, n, p, n) = Σ_i along (p, p, i) · across (i, n, n) of the eight integrals, into all of it."""
    p, n = along.shape[0], across.shape[1]
    for k in range(p):
        for l in range(p):
            f = along[k, l]
            for a in range(n):
                for b in range(n):
                    K[k, a, l, b] = (
                        (f[0] * across[0, a, b] + f[1] * across[1, a, b])
                        + (f[2] * across[2, a, b] + f[3] * across[3, a, b])
                    ) + (
                        (f[4] * across[4, a, b] + f[5] * across[5, a, b])
                        + (f[6] * across[6, a, b] + f[7] * across[7, a, b])
                    )
