"""Mesh stiffness of helical gears in closed form: Gu, Velex, Sainsot, Bruyère (2015), J. Mech. Des. 137, 063302."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def relative_stiffness(
    mesh_phase: ArrayLike, transverse_contact_ratio: float, overlap_ratio: float, terms: int = 200
) -> NDArray:
    """k(τ) over its mean: 1 + 2 Σ Ξ_k sinc(k ε_β) cos[πk(2τ − ε_α − ε_β)].

    Ξ_k are the harmonics of a stiffness per unit length that falls parabolically along the path of contact, from its
    middle to its ends by 45 % of the mean: k′ ∝ 1.15 − 0.45 (2s − 1)². This agrees with both the single and the mean
    stiffness of the norm.
    """
    tau = np.asarray(mesh_phase, dtype=float)[..., None]
    k = np.arange(1, terms + 1)
    a, b = transverse_contact_ratio, overlap_ratio
    xi = (0.7 + 0.09 / (k * a) ** 2) * np.sinc(k * a) - 0.09 * np.cos(np.pi * k * a) / (k * a) ** 2
    return 1 + 2 * np.sum(xi * np.sinc(k * b) * np.cos(np.pi * k * (2 * tau - a - b)), axis=-1)
