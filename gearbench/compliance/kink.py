"""Hertzian strip on a flank with a kink, such as the start of a linear relief.

Two half-spaces in plane strain touch; their gap is a parabola whose slope rises by κ at x = 0. Lengths ξ = x/a_H are in
Hertzian half-widths, displacements in c₁q, with the mean c₁ of (1−ν²)/(πE) of both materials (E5 of docs/theory.md):

    4(ξ − s)² + 8k max(0, ξ),   s = x_s/a_H, k = κρ/a_H,

where x_s is the vertex of the parabola before the kink, and x_s − κρ that of the one behind it. The strip has the
half-width L and the middle m = −L cos φ: it ends at the kink if φ = 0, and begins there if φ = π. It approaches by D:

    L² + (2/π) k L sin φ = 1,   m = −L cos φ = s − kφ/π,
    D = 4(m − s)² + 2L² + (8k/π)(mφ + L sin φ) + 4 ln(2/L).

Source: Johnson, Contact Mechanics, §2.7 (bounded pressure on an interval).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

#: Steps of Newton's method within a shrinking bracket.
_STEPS = 60


def kink_softening(s: NDArray, k: NDArray) -> NDArray:
    """Λ(s, k) of a strip on a convex kink, k ≥ 0.

    Compression of the strip beyond Hertz's and beyond the least separation of the flanks, in c₁q. Zero if it does not
    reach the kink, s ≤ −1 or s ≥ k + 1.
    """
    s, k = np.broadcast_arrays(np.asarray(s, dtype=float), np.asarray(k, dtype=float))
    value = np.zeros(s.shape)
    near = (s > -1) & (s < k + 1) & (k > 0)
    if near.any():
        value[near] = _on_kink(s[near], k[near])
    return value


def _on_kink(s: NDArray, k: NDArray) -> NDArray:
    """Λ of strips that reach the kink: D minus Hertz's approach and minus the least separation."""
    phi = _part_behind(s, k)
    L = _half_width(phi, k)
    m = -L * np.cos(phi)
    D = 4 * (m - s) ** 2 + 2 * L**2 + 8 * k / math.pi * (m * phi + L * np.sin(phi)) - 4 * np.log(L) - 2
    return D - np.where(s < 0, 0.0, np.where(s <= k, 4 * s**2, 8 * k * s - 4 * k**2))


def _half_width(phi: NDArray, k: NDArray) -> NDArray:
    """L [a_H] from equilibrium."""
    b = k * np.sin(phi) / math.pi
    return np.sqrt(b**2 + 1) - b


def _part_behind(s: NDArray, k: NDArray) -> NDArray:
    """φ between 0 (strip ends at the kink) and π (begins there); s(φ) = kφ/π − L cos φ rises in between."""
    low, high = np.zeros_like(s), np.full_like(s, math.pi)
    phi = np.arccos(np.clip((k - 2 * s) / (k + 2), -1.0, 1.0))
    for _ in range(_STEPS):
        sin, cos, share = np.sin(phi), np.cos(phi), k / math.pi
        b = share * sin
        root = np.sqrt(b**2 + 1)
        L = root - b
        excess = share * phi - L * cos - s
        converged = np.abs(excess) <= 1e-15 * (1 + np.abs(s) + k)
        if converged.all():
            break
        low, high = np.where(excess < 0, phi, low), np.where(excess < 0, high, phi)
        new = phi - excess / (share + L * sin + cos**2 * share * L / root)
        new = np.where((new > low) & (new < high), new, (low + high) / 2)
        # converged values stay: a bound that is the root itself would send them back to the middle
        phi = np.where(converged, phi, new)
    return phi
