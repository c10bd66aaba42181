"""The root fillet: the trochoid that the rounded tip of the generating rack leaves in the gear.

The rack rolls on the pitch circle. A point of its tip rounding, where the normal has the direction θ (α_n at the end of
the straight flank, π/2 at the root circle), lies at (ξ, η): ξ along the pitch line, η above it. It touches its envelope
when its normal passes through the pitch point, i.e. when the rack has moved by s = ξ + η cos β cot θ; the gear has
then turned by s/r (G6 of docs/theory.md). With φ = π/2 − θ everything is smooth in φ, and so is √(R² − r_f²).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.geometry.rack import Rack


@dataclass(frozen=True, kw_only=True)
class Fillet:
    """Transverse section of the generated root fillet.

    Parameters
    ----------
    rack
        The generating rack (normal section).
    teeth, pitch_radius
        Number of teeth z (of a virtual gear: any number) and pitch radius r [mm] of the gear.
    shift
        Profile shift x·m_n [mm].
    beta
        Helix angle at the pitch circle [rad].
    """

    rack: Rack
    teeth: float
    pitch_radius: float
    shift: float
    beta: float

    @property
    def phi_end(self) -> float:
        """Parameter φ [rad] at the end of the rounding, where the rack's straight flank takes over.

        A protuberance continues beyond it, up to the flank of the gear.
        """
        return math.pi / 2 - (self.rack.alpha / 4 if self.rack.protuberance else self.rack.alpha)

    @property
    def root_radius(self) -> float:
        """Root radius r_f [mm]."""
        return self.pitch_radius + self.shift - self.rack.dedendum

    def radius(self, phi: ArrayLike) -> NDArray:
        """Radius R [mm] of the fillet point with parameter φ [rad]."""
        return np.hypot(self.root_radius, self._chord(np.asarray(phi, dtype=float))[0])

    def half_angle(self, phi: ArrayLike) -> NDArray:
        """Half tooth-thickness angle ψ [rad] of the fillet point with parameter φ [rad]."""
        phi = np.asarray(phi, dtype=float)
        x, y = self._contact(phi)
        xi = (self.rack.corner[0] + self.rack.fillet * np.sin(phi)) / math.cos(self.beta)
        return math.pi / self.teeth - np.arctan2(x, y) - (xi - x) / self.pitch_radius

    def along(self, phi: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """R − r_f [mm], dR/dφ, ψ and dψ/dφ at φ [rad]; free of cancellation at the root circle."""
        sin, cos, cos_b = np.sin(phi), np.cos(phi), math.cos(self.beta)
        rho, r, r_f = self.rack.fillet, self.pitch_radius, self.root_radius
        eta, d_eta = self._height(phi), rho * sin
        x, dx = -eta * cos_b * sin / cos, -cos_b * (d_eta * sin / cos + eta / cos**2)
        y = r + eta
        # R² − r_f²: y − r_f = ρ (1 − cos φ)
        height = x**2 + 2 * rho * np.sin(phi / 2) ** 2 * (y + r_f)
        R = np.sqrt(r_f**2 + height)
        xi = self.rack.corner[0] + rho * sin
        psi = math.pi / self.teeth - np.arctan2(x, y) - (xi / cos_b - x) / r
        d_psi = (x * d_eta - dx * y) / R**2 - (rho * cos / cos_b - dx) / r
        return height / (R + r_f), (x * dx + y * d_eta) / R, psi, d_psi

    def parameter(self, radius: ArrayLike) -> NDArray:
        """Parameter φ [rad] of the fillet point at radius R [mm], r_f ≤ R ≤ R(φ_end); clipped outside.

        Newton's method from a table, to rounding.
        """
        radius = np.asarray(radius, dtype=float)
        r_f = self.root_radius
        target = np.sqrt(np.maximum((radius - r_f) * (radius + r_f), 0.0))
        table = np.linspace(0.0, self.phi_end, 65)
        phi = np.interp(target, self._chord(table)[0], table)
        for _ in range(6):
            chord, slope = self._chord(phi)
            phi = np.clip(phi - (chord - target) / slope, 0.0, self.phi_end)
        return phi

    def is_monotone(self) -> bool:
        """Whether the radius grows along the whole fillet, from the root circle to the flank."""
        return bool(np.all(np.diff(self._chord(np.linspace(0.0, self.phi_end, 257))[0]) > 0))

    def _height(self, phi: NDArray) -> NDArray:
        """Height η of the rack point above the pitch line [mm]."""
        return self.shift - self.rack.corner[1] - self.rack.fillet * np.cos(phi)

    def _contact(self, phi: NDArray) -> tuple[NDArray, NDArray]:
        """Point (x, y) [mm] of the envelope at the moment it is cut, from the gear's centre, pitch point on +y."""
        eta = self._height(phi)
        return -eta * math.cos(self.beta) * np.tan(phi), self.pitch_radius + eta

    def _chord(self, phi: NDArray) -> tuple[NDArray, NDArray]:
        """√(R² − r_f²) and its derivative with respect to φ; free of cancellation at the root circle."""
        rho, cos_b, r_f = self.rack.fillet, math.cos(self.beta), self.root_radius
        eta = self._height(phi)
        tan, half = np.tan(phi), np.sin(phi / 2)
        x, y = -eta * cos_b * tan, self.pitch_radius + eta
        square = x**2 + 2 * rho * half**2 * (y + r_f)
        slope_x = -cos_b * (rho * np.sin(phi) * tan + eta * (1 + tan**2))
        chord = np.sqrt(square)
        # both x and 2 sin²(φ/2) vanish at φ = 0: the limit of the slope there is √(η² cos²β + ρ r_f)
        limit = math.sqrt(float(self._height(np.zeros(()))) ** 2 * cos_b**2 + rho * r_f)
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.where(chord > 0, (x * slope_x + y * rho * np.sin(phi)) / chord, limit)
        return chord, slope
