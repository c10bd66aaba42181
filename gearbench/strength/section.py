"""Critical section of a tooth root, where the tangent of the generated fillet is at 30° to the tooth centre line.

A helical tooth is rated in its normal section, as a tooth of the virtual spur gear with z_n = z/(cos²β_b cos β) teeth
and the same rack. Source: ISO 6336-3:2019, 6.2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from gearbench.errors import InputError
from gearbench.geometry.fillet import Fillet
from gearbench.geometry.gear import Gear
from gearbench.geometry.involute import inv

#: Angle [rad] between the tooth centre line and the tangent of the fillet at the critical section.
TANGENT_ANGLE = math.radians(30.0)


@dataclass(frozen=True, kw_only=True)
class RootSection:
    """Critical section of the virtual spur tooth; lengths in mm.

    Parameters
    ----------
    chord
        s_Fn, chordal thickness of the tooth at the section.
    height
        Distance of the chord from the centre of the virtual gear.
    radius
        ρ_F, radius of curvature of the fillet there.
    """

    chord: float
    height: float
    radius: float


@dataclass(frozen=True, kw_only=True)
class VirtualTooth:
    """Tooth of the virtual spur gear of the normal section of ``gear``."""

    gear: Gear

    def __post_init__(self) -> None:
        if not isinstance(self.gear.fillet, Fillet):
            raise InputError("blank", self.gear.blank, "root stress of ISO 6336-3 needs a gear cut by a rack")

    @property
    def teeth(self) -> float:
        """z_n = z / (cos²β_b cos β)."""
        return self.gear.teeth / (math.cos(self.gear.beta_b) ** 2 * math.cos(self.gear.beta))

    @property
    def pitch_radius(self) -> float:
        """r_n = m_n z_n / 2 [mm]."""
        return self.gear.normal_module * self.teeth / 2

    @property
    def base_radius(self) -> float:
        """r_bn = r_n cos α_n [mm]."""
        return self.pitch_radius * math.cos(self.gear.alpha_n)

    @property
    def tip_radius(self) -> float:
        """r_an = r_n + r_a − r [mm]."""
        return self.pitch_radius + self.gear.tip_radius - self.gear.pitch_radius

    @property
    def fillet(self) -> Fillet:
        """Root fillet that the rack generates in the virtual gear."""
        fillet, shift = self.gear.fillet, self.gear.profile_shift * self.gear.normal_module
        assert isinstance(fillet, Fillet)
        return Fillet(rack=fillet.rack, teeth=self.teeth, pitch_radius=self.pitch_radius, shift=shift, beta=0.0)

    @cached_property
    def section(self) -> RootSection:
        """Critical section.

        If the whole fillet is steeper than 30° (pressure angles above 30°), the section is at the end of the fillet.
        """
        fillet = self.fillet
        phi = _tangent_parameter(fillet)
        R, psi = float(fillet.radius(phi)), float(fillet.half_angle(phi))
        return RootSection(
            chord=2 * R * math.sin(psi), height=R * math.cos(psi), radius=fillet_curvature_radius(fillet, phi)
        )

    def lever(self, radius: float) -> tuple[float, float]:
        """Bending moment arm h_F [mm] and load angle α_Fn [rad] of a normal force at ``radius`` [mm] of this gear.

        The force runs along the tangent of the base circle, which meets the tooth centre line at r_bn / cos α_Fn;
        α_Fn = α_e − γ_e, where γ_e is half the angle of the tooth thickness at ``radius``.
        """
        g = self.gear
        alpha_e = math.acos(min(self.base_radius / radius, 1.0))
        x, alpha_n, z_n = g.profile_shift, g.alpha_n, self.teeth
        gamma_e = (math.pi / 2 + 2 * x * math.tan(alpha_n)) / z_n + inv(alpha_n) - inv(alpha_e)
        alpha_F = alpha_e - gamma_e
        return self.base_radius / math.cos(alpha_F) - self.section.height, alpha_F


def fillet_curvature_radius(fillet: Fillet, phi: float) -> float:
    """Radius of curvature [mm] of a spur fillet at its parameter φ: ρ + G² / (cos φ (r cos²φ − G)).

    G is the height of the centre of the rack's tip rounding above the pitch line (negative below it).
    """
    r, G = fillet.pitch_radius, _corner_height(fillet)
    return fillet.rack.fillet + G**2 / (math.cos(phi) * (r * math.cos(phi) ** 2 - G))


def _corner_height(fillet: Fillet) -> float:
    return fillet.shift - fillet.rack.corner[1]


def _tangent_parameter(fillet: Fillet) -> float:
    """Parameter φ at which the tangent of a spur fillet is at 30° to the tooth centre line, or the end of the fillet.

    When the rack cuts the point φ, the tooth centre line is at the angle π/z − (ξ + G tan φ)/r to the common normal
    plane, and the tangent of the fillet at the angle π/2 − φ.
    """
    r, G, xi = fillet.pitch_radius, _corner_height(fillet), fillet.rack.corner[0]
    target = math.pi / 2 - TANGENT_ANGLE - math.pi / fillet.teeth + xi / r

    def excess(phi: float) -> float:
        return phi - G / r * math.tan(phi) - target

    low, high = 0.0, fillet.phi_end
    if excess(high) <= 0:
        return high
    phi = min(target, high)
    # Newton's method within a bracket, since extreme profile shifts make the function non-monotone
    for _ in range(60):
        value = excess(phi)
        low, high = (low, phi) if value > 0 else (phi, high)
        step = value / (1 - G / r / math.cos(phi) ** 2)
        phi = phi - step if low < phi - step < high else (low + high) / 2
        if abs(step) < 1e-14 or high - low < 1e-14:
            break
    return phi
