"""Compression of the material just below a loaded flank, which the contact law contains.

Contact laws of the Weber–Banaschek kind give the compression of an elastic half-space between its surface and the
depth t of the tooth's centre line. The compliance of the tooth is that of the flank minus this compression under
the same load. The half-space is mirrored at the two faces of the gear, so that an even line load compresses it
evenly, as in the law. At the distance r from a line load of wave number k along it the compression is, with
R² = r² + t² (L2, L1 of docs/theory.md),

    ĝ_k(r) = 2(1−ν²)/(πE) [K₀(kr) − K₀(kR)] − (1+ν)/(πE) t² k K₁(kR)/R
    ĝ_0(r) = 2(1−ν²)/(πE) ln(R/r) − (1+ν)/(πE) t²/R².

On a helical flank r counts along the involute, square to the generators, and z along them.

Source: Johnson, Contact Mechanics, §2.3 (Flamant), §3.2 (Boussinesq).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearbench.compliance.bases import gauss, legendre_functions, sampled
from gearbench.compliance.outline import roll_angles
from gearbench.geometry.gear import Gear

#: Number of waves with exact compression, and of all waves (the others fall like 1/k), per function across the width.
WAVES, TAIL = 3, 30
#: Approximate ratio of successive computed waves.
FARTHER = 1.18


def waves_across(gear: Gear) -> int:
    """Number of polynomials in y that resolve waves down to twice the depth t of the flank's middle, at least five.

    Shorter waves of the load only compress the flank.
    """
    middle = 0.5 * (gear.form_radius + gear.tip_radius)
    return int(np.clip(math.ceil(gear.face_width / float(gear.flank_depth(middle))), 5, 40))


def compression(E: float, nu: float, k: NDArray, r: NDArray, t: NDArray) -> NDArray:
    """ĝ_k(r) between the surface and the depth t [mm²/N]; k ≥ 0 [1/mm] along the first axis, r and t [mm]."""
    from scipy.special import k0, k1

    a, c = 2 * (1 - nu**2) / (math.pi * E), (1 + nu) / (math.pi * E)
    R = np.hypot(r, t)
    k = k[:, *(None,) * R.ndim]
    plane = a * np.log(R / r) - c * (t / R) ** 2
    wave = np.where(k > 0, k, 1.0)
    return np.where(k > 0, a * (k0(wave * r) - k0(wave * R)) - c * t**2 / R * wave * k1(wave * R), plane)


def half_space_compression(gear: Gear, E: float, nu: float, order: tuple[int, int], points: int = 18) -> NDArray:
    """Compression projected onto orthonormal Legendre products on the flank, (p·q, p·q) [mm/N].

    Parameters
    ----------
    gear
        The gear; the flank reaches from its form circle to its tip circle.
    E, nu
        Young's modulus [N/mm²] and Poisson's ratio.
    order
        Numbers p, q of polynomials in R and in y.
    points
        Quadrature points along the flank; from a point to the end of the flank there are two more than that. 18 are
        good to 1e-7 or better, and take half the time of 24, good to 1e-9.
    """
    p, q = order
    waves = WAVES * q + 1
    computed, weights = _wave_weights(waves, FARTHER)
    G = np.tensordot(weights, _projected_waves(gear, E, nu, p, computed, points), 1)
    T = _cosines(q, TAIL * q)
    products = T[:, None, :waves] * T[:, :waves]
    near = (products.reshape(q * q, waves) @ G.reshape(waves, p * p)).reshape(q, q, p, p).transpose(2, 0, 3, 1)
    # short waves see the surface only: ĝ_k → 2(1−ν²)/(πE) K₀(kr), whose integral falls like 1/k
    rest = T[:, waves:] * ((waves - 1) / np.arange(waves, T.shape[1]))
    far = (rest @ T[:, waves:].T)[None, :, None, :] * G[-1][:, None, :, None]
    return (near + far).reshape(p * q, p * q)


def _projected_waves(gear: Gear, E: float, nu: float, p: int, waves: NDArray, points: int) -> NDArray:
    """∬ φ_i(R) ĝ_m(R, R′) φ_j(R′) dR dR′ of ``waves`` m, (wave, p, p): the half R < R′ plus its transpose.

    In the roll angle everything is analytic except the logarithm at R = R′ and a pointed tip, where points cluster.
    """
    low, high, r_b = gear.form_radius, gear.tip_radius, gear.base_radius
    form, tip = roll_angles(gear)
    s, ws = gauss(points)
    v, wv = gauss(points + 2)
    below, between = (tip - form) * s**3, v**4
    t = tip - below
    other = tip - below[:, None] * (1 - between)
    R, R2 = r_b * np.sqrt(1 + t**2), r_b * np.sqrt(1 + other**2)
    # arc length of the involute r_b t²/2; it is square to the generators
    r = r_b / 2 * below[:, None] * between * (t[:, None] + other)
    depth = np.sqrt(gear.flank_depth(R)[:, None] * gear.flank_depth(R2))
    # on a face width the generators are b / cos β_b long
    cos_b = math.cos(gear.beta_b)
    g = cos_b * compression(E, nu, waves * math.pi * cos_b / gear.face_width, r, depth)
    # dR = r_b² t/R dt
    dR = r_b**2 * t / R * 3 * (tip - form) * s**2 * ws
    dR2 = r_b**2 * other / R2 * below[:, None] * 4 * v**3 * wv
    left = flank_functions(p, R, low, high) * dR[:, None]
    right = flank_functions(p, R2, low, high) * dR2[..., None]
    G = np.tensordot(g.transpose(1, 0, 2) @ right, left, (0, 0))
    return G + G.transpose(0, 2, 1)


@lru_cache(maxsize=32)
def _wave_weights(waves: int, farther: float) -> tuple[NDArray, NDArray]:
    """Computed waves m, and their weights in all ``waves``, (m, computed).

    In between m ĝ_m is interpolated over ln m by a spline of degree five, to 5e-6 on gears in use.
    """
    from scipy.interpolate import make_interp_spline

    computed, m = sampled(waves - 1, farther), np.arange(1, waves)
    weights = np.eye(waves, len(computed))
    if len(computed) < waves:
        smooth = make_interp_spline(np.log(computed[1:]), np.diag(computed[1:]), k=5)
        weights[1:, 1:] = smooth(np.log(m)) / m[:, None]
    weights.flags.writeable = False
    return computed, weights


def flank_functions(count: int, radius: NDArray, low: float, high: float) -> NDArray:
    """Legendre functions orthonormal on [low, high], (…, count) [1/√mm]; outside, their values at the nearer end."""
    return legendre_functions(count, np.clip((radius - low) / (high - low), 0.0, 1.0)) / math.sqrt(high - low)


@lru_cache(maxsize=32)
def _cosines(count: int, waves: int) -> NDArray:
    """∫ g_k c_m dη of Legendre functions and orthonormal cosines on [0, 1], (count, wave)."""
    eta, weight = gauss(waves + count + 8)
    g = legendre_functions(count, eta)
    c = np.cos(np.arange(waves) * math.pi * eta[:, None]) * math.sqrt(2)
    c[:, 0] = 1.0
    return g.T @ (weight[:, None] * c)
