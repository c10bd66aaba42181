"""Nominal tooth-root stress by ISO 6336-3:2019, method B, on the generated fillet.

σ_F0 = F_t / (b m_n) · Y_F Y_S Y_β Y_B Y_DT, with F_t = 2000 T/d at the reference circle. The application, dynamic and
load distribution factors K are 1: the result is the stress under the nominal load, evenly distributed over the face.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.pair import Pair
from gearbench.strength.section import VirtualTooth

#: Range of notch parameters of the fit of Y_S; the norm clips values outside.
NOTCH_RANGE = (1.0, 8.0)


@dataclass(frozen=True, kw_only=True)
class RootBending:
    """Factors of the root stress of one gear of a pair.

    Parameters
    ----------
    pair
        The gear pair.
    gear
        0 for the driver, 1 for the driven gear.
    load_at
        "single_contact": method B, load at the outer point of single pair contact of the virtual spur gear (for
        ε_αn ≥ 2 the same formula gives the inner point of triple contact, as in the norm); "tip": method C, load at
        the tip, with the contact ratio factor Y_ε = 0.25 + 0.75/ε_αn instead of f_ε.
    """

    pair: Pair
    gear: int
    load_at: Literal["single_contact", "tip"] = "single_contact"

    @cached_property
    def tooth(self) -> VirtualTooth:
        """The virtual spur tooth."""
        return VirtualTooth(gear=self.pair.gears[self.gear])

    @cached_property
    def virtual_contact_ratio(self) -> float:
        """ε_αn = ε_α / cos²β_b."""
        return self.pair.meshing.transverse_contact_ratio / math.cos(self.pair.meshing.beta_b) ** 2

    @cached_property
    def load_radius(self) -> float:
        """Radius r_en of the circle of the virtual gear through the point of load [mm]."""
        tooth, gear = self.tooth, self.tooth.gear
        if self.load_at == "tip":
            return tooth.tip_radius
        # below ε_αn = 1 a single tooth carries the load up to its tip
        back = math.pi * gear.normal_module * math.cos(gear.alpha_n) * max(self.virtual_contact_ratio - 1, 0.0)
        roll = math.sqrt(max(tooth.tip_radius**2 - tooth.base_radius**2, 0.0))
        return math.hypot(tooth.base_radius, max(roll - back, 0.0))

    def factors_at(self, radius: float) -> tuple[float, float]:
        """Y_F without f_ε, and Y_S, for a load at ``radius`` [mm] of the virtual gear.

        Y_F = 6 (h_F/m_n) cos α_Fn / ((s_Fn/m_n)² cos α_n); Y_S = (1.2 + 0.13 L) q_s^(1/(1.21 + 2.3/L)), L = s_Fn/h_F,
        1 ≤ q_s < 8.
        """
        (h_F, alpha_F), section, gear = self.tooth.lever(radius), self.tooth.section, self.tooth.gear
        # load below the critical section (stub teeth): no bending moment; the product Y_F Y_S stays finite
        h_F = max(h_F, 1e-3 * self.pair.normal_module)
        m_n, s_Fn = gear.normal_module, section.chord
        Y_F = 6 * h_F / m_n * math.cos(alpha_F) / ((s_Fn / m_n) ** 2 * math.cos(gear.alpha_n))
        L, q_s = s_Fn / h_F, min(max(self.notch_parameter, NOTCH_RANGE[0]), NOTCH_RANGE[1])
        return Y_F, (1.2 + 0.13 * L) * q_s ** (1 / (1.21 + 2.3 / L))

    @property
    def form_factor(self) -> float:
        """Y_F of ``factors_at`` times f_ε; for a load at the tip without f_ε."""
        Y_F = self.factors_at(self.load_radius)[0]
        return Y_F * (self.load_distribution_factor if self.load_at == "single_contact" else 1.0)

    @property
    def load_distribution_factor(self) -> float:
        """f_ε, which accounts for load sharing with further teeth."""
        eps_b, eps_an = self.pair.meshing.overlap_ratio, self.virtual_contact_ratio
        if eps_b >= 1:
            return eps_an**-0.5
        if eps_b == 0:
            return 1.0 if eps_an < 2 else 0.7
        single = 1 - eps_b if eps_an < 2 else (1 - eps_b) / 2
        return math.sqrt(single + eps_b / eps_an)

    @property
    def notch_parameter(self) -> float:
        """q_s = s_Fn / (2 ρ_F), before it is limited to the range of the fit."""
        return self.tooth.section.chord / (2 * self.tooth.section.radius)

    @property
    def stress_correction(self) -> float:
        """Y_S of ``factors_at``."""
        return self.factors_at(self.load_radius)[1]

    @property
    def helix_factor(self) -> float:
        """Y_β = (1 − ε_β β/120°) / cos³β, with at most ε_β = 1 and β = 30°."""
        beta = min(self.pair.helix_angle, 30.0)
        return (1 - min(self.pair.meshing.overlap_ratio, 1.0) * beta / 120) / math.cos(math.radians(beta)) ** 3

    def loaded(self, radius: NDArray) -> NDArray:
        """Y_F Y_S for loads at transverse radii [mm] on the flank of the actual gear; same shape as ``radius``."""
        tooth = self.tooth
        radii, back = np.unique(radius, return_inverse=True)
        virtual = np.maximum(tooth.pitch_radius + radii - tooth.gear.pitch_radius, tooth.base_radius)
        factors = np.array([math.prod(self.factors_at(float(r))) for r in virtual])
        return factors[back].reshape(radius.shape)

    @property
    def rim_factor(self) -> float:
        """Y_B: 1 for a solid body; with a bore and a rim s_R < 1.2 h_t, 1.6 ln(2.242 h_t/s_R).

        The norm advises against s_R ≤ 0.5 h_t; the formula is continued there.
        """
        member, gear = self.pair.members[self.gear], self.tooth.gear
        if member.bore_diameter is None:
            return 1.0
        rim = member.rim_thickness or gear.root_radius - member.bore_diameter / 2
        # the fit falls below 1 from 1.2 h_t on, where the rim is thick enough
        return max(1.0, 1.6 * math.log(2.242 * gear.tooth_height / rim))

    @property
    def contact_ratio_factor(self) -> float:
        """Y_ε = 0.25 + 0.75/ε_αn for a load at the tip; 1 for method B."""
        return 1.0 if self.load_at == "single_contact" else 0.25 + 0.75 / max(self.virtual_contact_ratio, 1.0)

    def stress(self, torque: float) -> float:
        """σ_F0 [MPa] under ``torque`` [N·m] on the pinion.

        Y_DT = 1: values below 1 need gears of ISO class 4 or better with a trapezoidal load distribution.
        """
        pinion = self.pair.gears[0]
        F_t = 1e3 * torque / pinion.pitch_radius
        b, m_n = self.pair.meshing.face_width, self.pair.normal_module
        Y = self.form_factor * self.stress_correction * self.helix_factor * self.rim_factor * self.contact_ratio_factor
        return F_t / (b * m_n) * Y
