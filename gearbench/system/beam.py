"""Timoshenko beam elements of circular section, exact in statics; (W1) and (W2) are in docs/theory.md.

Source: Przemieniecki, Theory of Matrix Structural Analysis (1968), §5.6, §11.3; shear coefficient by Cowper (1966).
Each end moves by (u_x, u_y, u_z, φ_x, φ_y, φ_z), with z along the axis. Units: mm, rad, N, N·mm, tonnes (N·s²/mm).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike, NDArray

#: Gauss nodes and weights for the flexibility of tapered elements, and for the mass.
_TAPERED, _MASS = leggauss(12), leggauss(6)


@dataclass(frozen=True, kw_only=True)
class Beam:
    """A solid or hollow piece of a shaft with constant or linearly tapering section.

    Parameters
    ----------
    length
        L [mm].
    diameter, bore
        Outer and inner diameter at both ends (2,) [mm].
    E, G, nu
        Moduli [N/mm²] and Poisson's ratio.
    density
        ρ [t/mm³].
    """

    length: float
    diameter: tuple[float, float]
    bore: tuple[float, float]
    E: float
    G: float
    nu: float
    density: float

    def section(self, s: ArrayLike) -> tuple[NDArray, NDArray, NDArray]:
        """Area A [mm²], second moment I [mm⁴] and shear coefficient κ at s = z/L ∈ [0, 1]."""
        t = np.asarray(s, dtype=float)
        D, d = ((1 - t) * start + t * end for start, end in (self.diameter, self.bore))
        m2 = (d / D) ** 2
        nu = self.nu
        kappa = 6 * (1 + nu) * (1 + m2) ** 2 / ((7 + 6 * nu) * (1 + m2) ** 2 + (20 + 12 * nu) * m2)
        return math.pi / 4 * (D**2 - d**2), math.pi / 64 * (D**4 - d**4), kappa

    def stiffness(self) -> NDArray:
        """Exact static stiffness (12, 12), from the flexibility of the element held at its start (W1)."""
        free = np.linalg.inv(self._whole)
        carry = _carry(self.length)
        K = np.empty((12, 12))
        K[6:, 6:], K[:6, 6:] = free, -carry @ free
        K[6:, :6], K[:6, :6] = K[:6, 6:].T, carry @ free @ carry.T
        return (K + K.T) / 2

    def twist(self) -> float:
        """Rotation of one end relative to the other per torque [rad/(N·mm)]."""
        return float(self._whole[5, 5])

    @cached_property
    def _whole(self) -> NDArray:
        """Flexibility (6, 6) of the far end, with the start held."""
        uq, um, fq, fm, axial, torsion = self._flexibility(np.array(1.0))
        F = np.diag([uq, uq, axial, fm, fm, torsion])
        # u_x with φ_y, and u_y with −φ_x
        F[0, 4], F[4, 0], F[1, 3], F[3, 1] = um, fq, -um, -fq
        return F

    def shapes(self, s: ArrayLike) -> NDArray:
        """Motion (…, 6, 12) at s ∈ [0, 1] of the unloaded element per motion of its ends: exact in statics (W2)."""
        start, end = np.hsplit(np.eye(12), 2)
        return np.swapaxes(self.motion(np.asarray(s, dtype=float)[..., None], start, end), -1, -2)

    def motion(self, s: NDArray, start: NDArray, end: NDArray) -> NDArray:
        """Motion (…, 6) at s ∈ [0, 1] of the unloaded element whose ends move by ``start`` and ``end`` (…, 6)."""
        # forces at the far end that produce its motion relative to rigid motion
        relative = end - start @ _carry(self.length)
        Q_x, Q_y, N, M_x, M_y, T = np.moveaxis(relative @ np.linalg.inv(self._whole).T, -1, 0)
        uq, um, fq, fm, axial, torsion = self._flexibility(s)
        x, y, z, phi_x, phi_y, phi_z = np.moveaxis(start, -1, 0)
        return np.stack(
            [
                x + s * self.length * phi_y + uq * Q_x + um * M_y,
                y - s * self.length * phi_x + uq * Q_y - um * M_x,
                z + axial * N,
                phi_x - fq * Q_y + fm * M_x,
                phi_y + fq * Q_x + fm * M_y,
                phi_z + torsion * T,
            ],
            axis=-1,
        )

    def mass(self) -> NDArray:
        """Consistent mass matrix (12, 12), including rotary inertia."""
        node, weight = _MASS
        s = (node + 1) / 2
        A, I, _ = self.section(s)
        per_length = self.density * np.stack([A, A, A, I, I, 2 * I], axis=-1)
        N = self.shapes(s)
        M = np.einsum("g,gia,gi,gib->ab", weight / 2 * self.length, N, per_length, N)
        return (M + M.T) / 2

    def _flexibility(self, s: NDArray) -> tuple[NDArray, ...]:
        """Motion (…,) at s of the element held at its start, per unit load at its far end.

        The six values: deflection by force and by moment (uq, um), rotation by force and by moment (fq, fm), elongation
        by force, twist by torque.
        """
        L = self.length
        if self.diameter[0] == self.diameter[1] and self.bore[0] == self.bore[1]:
            A, I, kappa = self.section(0.0)
            x, EI = s * L, self.E * I
            fm, fq, um = x / EI, x * (L - x / 2) / EI, x**2 / (2 * EI)
            return um * (L - x / 3) + x / (kappa * self.G * A), um, fq, fm, x / (self.E * A), x / (2 * self.G * I)
        node, weight = _TAPERED
        t = s[..., None] * (node + 1) / 2
        w = s[..., None] * weight / 2 * L
        A, I, kappa = self.section(t)
        z, x = t * L, s[..., None] * L
        over_ei, shear = w / (self.E * I), w / (kappa * self.G * A)
        # M = M_L + Q (L − z); a curvature at z moves the section x by (x − z)
        arm, lever = L - z, x - z
        parts = (
            over_ei * lever * arm + shear, over_ei * lever, over_ei * arm, over_ei,
            w / (self.E * A), w / (2 * self.G * I),
        )  # fmt: skip
        return tuple(part.sum(-1) for part in parts)


def _carry(distance: ArrayLike) -> NDArray:
    """Force and moment at the start per unit force and moment at the ``distance`` z, (…, 6, 6).

    The transpose gives the motion at z due to a rigid motion of the start.
    """
    z = np.asarray(distance, dtype=float)
    T = np.zeros((*z.shape, 6, 6))
    T[..., range(6), range(6)] = 1.0
    T[..., 3, 1], T[..., 4, 0] = -z, z
    return T
