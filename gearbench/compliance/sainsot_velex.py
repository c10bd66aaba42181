"""Closed form for the foundation of a tooth: a half-ring under linear normal and constant tangential root stress.

Source: Sainsot, Velex, Duverger, Contribution of gear body to tooth deflections – a new bidimensional analytical
formula, Journal of Mechanical Design 126 (2004) 748–752 (R9 of docs/theory.md). The coefficients are a fit,
invalid outside its range.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.errors import InputError
from gearbench.geometry.gear import Gear

#: X = A/θ_f² + B h² + C h/θ_f + D/θ_f + E h + F, h = r_f/r_int, and the range of values of X that the fit covers.
COEFFICIENTS: dict[str, tuple[tuple[float, ...], tuple[float, float]]] = {
    "L": ((-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045), (6.82, 6.94)),
    "M": ((60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086), (1.08, 3.29)),
    "P": ((-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236), (2.56, 13.47)),
    "Q": ((-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904), (0.141, 0.62)),
}
#: Relative tolerance of the ranges: the paper prints them with three digits.
_PRINTED = 0.005


def shape_factors(gear: Gear, bore_radius: float) -> tuple[float, float, float, float]:
    """L*, M*, P*, Q* of a gear with the given bore [mm].

    Raises
    ------
    InputError
        If one of them is outside the range of the fit.
    """
    theta, h = float(gear.half_angle(gear.root_radius)), gear.root_radius / bore_radius
    result = []
    for name, ((A, B, C, D, E, F), (low, high)) in COEFFICIENTS.items():
        value = A / theta**2 + B * h**2 + C * h / theta + D / theta + E * h + F
        if not low * (1 - _PRINTED) <= value <= high * (1 + _PRINTED):
            where = f"θ_f = {theta:.4g}, r_f/r_bore = {h:.4g}"
            allowed = f"{name}* = {value:.4g} at {where} is outside the fit, {low} … {high}"
            raise InputError("bore_diameter", 2 * bore_radius, allowed)
        result.append(value)
    return result[0], result[1], result[2], result[3]


def foundation_factor(gear: Gear, E: float, bore_radius: float, radius: ArrayLike) -> NDArray:
    """√(δ/F) [√(mm/N)], with the deflection δ at R along the line of action under F, spread over the face width.

    δ = F cos²γ / (b E) [L* (u/S)² + M* u/S + P* (1 + Q* tan²γ)]. S is the thickness at the root; u reaches from the
    root circle to the point where the line of action meets the centre line of the tooth. On a helical gear F cos β_b is
    the force in the transverse plane, and a second cos β_b projects the deflection there onto the normal.
    """
    radius = np.asarray(radius, dtype=float)
    L, M, P, Q = shape_factors(gear, bore_radius)
    gamma = gear.load_angle(radius)
    u = gear.base_radius / np.cos(gamma) - gear.root_radius
    S = 2 * gear.root_radius * float(gear.half_angle(gear.root_radius))
    value = L * (u / S) ** 2 + M * u / S + P * (1 + Q * np.tan(gamma) ** 2)
    return np.cos(gamma) * np.cos(gear.beta_b) * np.sqrt(value / (gear.face_width * E))
