"""The local (Hertz) part of the flank's compliance, counted once.

Contact laws of the Weber–Banaschek kind give the compression of an elastic half-plane between its loaded surface and
the depth t of the tooth's centre line. What remains for the teeth is therefore

    smooth compliance = compliance of the flank surface − compression of the half-space between surface and depth t,

both for the same load. Remote from the load nothing is subtracted; the remainder has no singularity any more; and for
a line load along the whole tooth the subtracted part is the law itself. The half-space is the elastic one
(Boussinesq), mirrored at the two faces of the gear so that a uniform line load compresses uniformly, as in the law.

Fourier transform of the compression along the line, wave number k, distance r across it, R² = r² + t²:

    ĝ_k(r) = 2(1−ν²)/(πE) [K₀(kr) − K₀(kR)] − (1+ν)/(πE) t² k K₁(kR)/R,    ĝ_0(r): K₀(kr) − K₀(kR) → ln(R/r), kRK₁ → 1.

Source: Johnson, Contact Mechanics, §2.3 (Flamant), §3.2 (Boussinesq); Weber & Banaschek 1953.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fem_reference.flank import Legendre
from gearbench.geometry.gear import Gear
from gearbench.geometry.material import Material


def depth(gear: Gear, R: NDArray) -> NDArray:
    """Depth t [mm] from the flank at R to the centre line of the tooth along the line of action (normal section)."""
    psi = gear.involute_half_angle(R)
    load_angle = np.arccos(np.clip(gear.base_radius / R, 0.0, 1.0)) - psi
    return R * np.sin(psi) / np.cos(load_angle) * math.cos(gear.beta_b)


def weber_banaschek(material: Material, t: NDArray | float, half_width: NDArray | float) -> NDArray:
    """Compression of one tooth per unit line load [mm per N/mm]: 2(1−ν²)/(πE) [ln(2t/a) − ν/(2(1−ν))]."""
    E, nu = material.E, material.nu
    return 2 * (1 - nu**2) / (math.pi * E) * (np.log(2 * np.asarray(t) / half_width) - nu / (2 * (1 - nu)))


def compression(material: Material, k: NDArray | float, r: NDArray, t: NDArray) -> NDArray:
    """Compression ĝ_k(r) of the half-space between surface and depth t [mm²/N]; k [1/mm], r, t [mm] broadcast."""
    from scipy.special import k0, k1

    E, nu = material.E, material.nu
    k, r, t = np.broadcast_arrays(np.asarray(k, dtype=float), r, t)
    R = np.hypot(r, t)
    plane = k == 0
    kr = np.where(plane, 1.0, k * r)
    kR = np.where(plane, 1.0, k * R)
    spread = np.where(plane, np.log(R / r), k0(kr) - k0(kR))
    shear = np.where(plane, 1.0, kR * k1(kR)) * (t / R) ** 2
    return 2 * (1 - nu**2) / (math.pi * E) * spread - (1 + nu) / (math.pi * E) * shear


def local_compliance(basis: Legendre, material: Material, points: int = 24) -> NDArray:
    """Compression of the half-space projected onto the polynomials of ``basis``: (p·q, p·q) [mm/N]."""
    p, q = basis.order
    modes = 6 * q + 12
    G = _across(basis, material, modes, points)
    T = _cosines(q, modes)
    # Σ_m T_km T_lm G_m,ij
    return np.einsum("km,mij,lm->ikjl", T, G, T, optimize=True).reshape(p * q, p * q)


def _across(basis: Legendre, material: Material, modes: int, points: int) -> NDArray:
    """Projection of ĝ_m in the direction of the height, (mode, p, p); the logarithm at s = s′ is integrated exactly."""
    gear, (low, high), b = basis.gear, basis.ends, basis.gear.face_width
    x, w = np.polynomial.legendre.leggauss(points)
    # x = v³ clusters the points at the singular end of each side
    v, wv = np.polynomial.legendre.leggauss(points)
    v = 0.5 * (v + 1)
    near, weight = v**3, 1.5 * wv * v**2
    R = 0.5 * (low + high) + 0.5 * (high - low) * x
    sides = [(R[:, None] + (end - R[:, None]) * near, np.abs(end - R[:, None]) * weight) for end in (low, high)]
    other = np.concatenate([side for side, _ in sides], axis=1)
    dR = np.concatenate([area for _, area in sides], axis=1)
    # arc length across the generators of y: s = (R² − r_b²)/2r_b in the section, shortened by the helix
    r_b = gear.base_radius
    distance = np.abs(other - R[:, None]) * (other + R[:, None]) / (2 * r_b) * math.cos(gear.beta_b)
    t = np.sqrt(depth(gear, R)[:, None] * depth(gear, other))
    wave = np.arange(modes) * math.pi / b
    g = compression(material, wave[:, None, None], distance, t)
    section = Legendre(gear=gear, order=(basis.order[0], 1))
    scale = math.sqrt(b)  # of the constant function across the width
    zero = np.zeros_like
    left, right = section(R, zero(R)) * scale, section(other, zero(other)) * scale
    left = left * (0.5 * (high - low) * w)[:, None]
    G = np.einsum("ai,mac,ac,acj->mij", left, g, dR, right, optimize=True)
    return 0.5 * (G + G.transpose(0, 2, 1))


def _cosines(q: int, modes: int) -> NDArray:
    """∫ P_k c_m of orthonormal Legendre polynomials and cosines on an interval, (q, mode)."""
    x, w = np.polynomial.legendre.leggauss(2 * modes + q)
    P = np.polynomial.legendre.legvander(x, q - 1) * np.sqrt((2 * np.arange(q) + 1) / 2)
    c = np.cos(np.arange(modes) * math.pi * (x[:, None] + 1) / 2)
    c[:, 0] = math.sqrt(0.5)
    return P.T @ (w[:, None] * c)
