"""Waves around a gear of equal sectors: those that are computed, and the compliance between teeth from them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import block_diag

from gearbench.compliance.lugs import multiplicity


def wave_numbers(z: int, dense: int = 12, growth: float = 1.15) -> NDArray:
    """Wave numbers from 0 to z/2: all up to ``dense``, then each ``growth`` times the one before."""
    k = [0]
    while k[-1] < z // 2:
        k.append(min(z // 2, k[-1] + 1 if k[-1] < dense else max(k[-1] + 1, round(growth * k[-1]))))
    return np.array(k)


def tooth_weights(z: int, teeth: ArrayLike) -> NDArray:
    """Weights (tooth, wave) of the waves ``wave_numbers(z)``, complex: C_d is the real part of the sum w_dk Ĉ_k.

    The compliance is smooth in log k beyond the first few waves: those left out are interpolated.
    """
    k, waves = np.arange(z // 2 + 1), wave_numbers(z)
    weights = np.exp(2j * math.pi / z * np.outer(np.asarray(teeth), k)) * multiplicity(z) / z
    if len(waves) == len(k):
        return weights
    between = CubicSpline(np.log(waves[1:]), np.eye(len(waves) - 1), bc_type="natural")(np.log(k[1:]))
    return weights @ np.asarray(block_diag(1.0, between))


def blocks_of_waves(values: NDArray, z: int, n: int) -> NDArray:
    """C_d, d = −n … n, of the compliance Ĉ of the waves ``wave_numbers(z)``."""
    return np.real(np.tensordot(tooth_weights(z, np.arange(-n, n + 1)), values, 1))
