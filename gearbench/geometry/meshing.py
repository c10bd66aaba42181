"""Two gears in mesh: path of contact, contact ratios, phases of the mesh cycle, sliding. Source: ISO 21771."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.gear import Gear
from gearbench.geometry.involute import inv
from gearbench.geometry.section import TransverseSection

Length = TypeVar("Length", float, NDArray)


def working_pressure_angle(sections: Iterable[TransverseSection], centre_distance: float) -> float:
    """Working transverse pressure angle α_wt [rad], cos α_wt = (r_b1 + r_b2)/a′ (G2).

    Raises
    ------
    ValueError
        If the centre distance is below the sum of the base radii.
    """
    return math.acos(sum(section.base_radius for section in sections) / centre_distance)


def profile_shift_sum(
    sections: tuple[TransverseSection, TransverseSection], centre_distance: float, backlash: float = 0.0
) -> float:
    """x_1 + x_2 [normal modules] from centre distance a′ [mm] and circumferential backlash j_wt [mm] (G3).

    x_1 + x_2 = (z_1 + z_2) [(inv α_wt − inv α_t) / (2 tan α_n) − j_wt / (4 a′ tan α_n)].
    """
    z, tan_n = sum(section.teeth for section in sections), math.tan(sections[0].alpha_n)
    d_inv = inv(working_pressure_angle(sections, centre_distance)) - inv(sections[0].alpha_t)
    return z * d_inv / (2 * tan_n) - z * backlash / (4 * centre_distance * tan_n)


@dataclass(frozen=True, kw_only=True)
class Meshing:
    """Two gears at their working centre distance.

    u counts along the path of contact from the pinion's interference point T1 (where the line of action touches its
    base circle), in the transverse plane; the radius of curvature is u on the pinion and T1T2 − u on the wheel. For an
    internal wheel z_2, its radii, a′, T1T2 and the wheel's radius of curvature are negative, and every formula holds.

    Parameters
    ----------
    gears
        The pinion, which drives, and the wheel.
    centre_distance, face_width
        a′ and common face width b [mm].
    """

    gears: tuple[Gear, Gear]
    centre_distance: float
    face_width: float

    @cached_property
    def alpha_wt(self) -> float:
        """Working transverse pressure angle α_wt [rad]."""
        return working_pressure_angle(self.gears, self.centre_distance)

    @property
    def beta_b(self) -> float:
        """Base helix angle β_b [rad]."""
        return self.gears[0].beta_b

    # -- path of contact [mm] -----------------------------------------------------------------------------------------
    @property
    def base_pitch(self) -> float:
        """Transverse base pitch p_bt [mm]."""
        return self.gears[0].base_pitch

    @property
    def tangent_length(self) -> float:
        """Distance T1T2 = a′ sin α_wt between the two interference points [mm]."""
        return self.centre_distance * math.sin(self.alpha_wt)

    @property
    def pitch_point(self) -> float:
        """u of the pitch point, r_b1 tan α_wt [mm]."""
        return self.gears[0].base_radius * math.tan(self.alpha_wt)

    @cached_property
    def tip_path(self) -> tuple[float, float]:
        """u [mm] at which the wheel's tip enters and the pinion's tip leaves, for involutes of any length."""
        pinion, wheel = self.gears
        enters = self.tangent_length - _curvature(wheel, wheel.tip_form_radius)
        return enters, _curvature(pinion, pinion.tip_form_radius)

    @cached_property
    def _form_path(self) -> tuple[float, float]:
        """u [mm] of the form circles of pinion and wheel."""
        pinion, wheel = self.gears
        return _curvature(pinion, pinion.form_radius), self.tangent_length - _curvature(wheel, wheel.form_radius)

    @cached_property
    def path_start(self) -> float:
        """u_A [mm]: the wheel's tip enters, unless the pinion's involute (fillet, undercut) starts later."""
        return max(self.tip_path[0], self._form_path[0])

    @cached_property
    def path_end(self) -> float:
        """u_E [mm]: the pinion's tip leaves, unless the wheel's involute ends earlier."""
        return min(self.tip_path[1], self._form_path[1])

    @property
    def form_room(self) -> float:
        """Least length along the path of contact between fillets and the mates' tips [mm]; negative: interference.

        A negative value for the pinion of a ring is involute interference.
        """
        (enters, leaves), (pinion_form, wheel_form) = self.tip_path, self._form_path
        return min(enters - pinion_form, wheel_form - leaves)

    @cached_property
    def has_interference(self) -> tuple[bool, bool]:
        """Whether the mate's tip reaches the fillet of pinion, wheel (contact below the form circle)."""
        (enters, leaves), (pinion_form, wheel_form) = self.tip_path, self._form_path
        rounding = 1e-12 * abs(self.centre_distance)
        return enters < pinion_form - rounding, leaves > wheel_form + rounding

    def path_coordinate(self, index: int, radius: float) -> float:
        """Position u [mm] on the path of contact of a radius R [mm] of one gear, at least its base radius."""
        return self.along_path(index, _curvature(self.gears[index], radius))

    def along_path(self, index: int, roll: Length) -> Length:
        """Position u [mm] on the path of contact of a roll length of one gear, and vice versa."""
        return roll if index == 0 else self.tangent_length - roll

    def radii(self, u: NDArray) -> tuple[NDArray, NDArray]:
        """Radii R [mm] on pinion and wheel of the points u [mm] of the path of contact."""
        pinion, wheel = self.gears
        return pinion.radius_at(u), wheel.radius_at(self.tangent_length - u)

    @property
    def active_radii(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Radii of start and end of the active profile (root side, tip side) of pinion and wheel [mm]."""
        (a1, e1), (a2, e2) = (r.tolist() for r in self.radii(np.array([self.path_start, self.path_end])))
        return (a1, e1), (e2, a2)

    @property
    def active_rolls(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Roll lengths of start and end of the active profile (root side, tip side) of pinion and wheel [mm]."""
        T = self.tangent_length
        return (self.path_start, self.path_end), (T - self.path_end, T - self.path_start)

    def curvature_radius(self, u: NDArray) -> NDArray:
        """Relative radius of curvature of the flanks in the normal plane, ρ = u (T1T2 − u) / (T1T2 cos β_b) [mm]."""
        T = self.tangent_length
        return u * (T - u) / T / math.cos(self.beta_b)

    # -- contact ratios and phases ------------------------------------------------------------------------------------
    @property
    def transverse_contact_ratio(self) -> float:
        """ε_α = (u_E − u_A) / p_bt (G8)."""
        return (self.path_end - self.path_start) / self.base_pitch

    @property
    def overlap_ratio(self) -> float:
        """ε_β = b tan β_b / p_bt."""
        return self.face_width * math.tan(self.beta_b) / self.base_pitch

    @property
    def total_contact_ratio(self) -> float:
        """ε_γ = ε_α + ε_β."""
        return self.transverse_contact_ratio + self.overlap_ratio

    @property
    def transition_phases(self) -> tuple[float, ...]:
        """Mesh phases in [0, 1) at which a contact line begins, ends, or reaches the edge of a face; sorted."""
        return self.phases_at((self.path_start, self.path_end))

    def phases_at(self, positions: Iterable[float], face: Iterable[float] = ()) -> tuple[float, ...]:
        """Mesh phases in [0, 1) at which an end of the face, or a y in ``face``, passes one of ``positions`` u [mm]."""
        turns = [(u - self.path_start) / self.base_pitch for u in positions]
        lags = [0.0, self.overlap_ratio, *(self.overlap_ratio * y / self.face_width for y in face)]
        # twice, because −1e-17 % 1.0 is 1.0
        return tuple(sorted({(t - lag) % 1.0 % 1.0 for t in turns for lag in lags}))

    # -- clearance and sliding ----------------------------------------------------------------------------------------
    @property
    def tip_clearances(self) -> tuple[float, float]:
        """Radial clearance between the tip of pinion, wheel and the root of its mate [mm]."""
        pinion, wheel = self.gears
        a = self.centre_distance
        return a - pinion.tip_radius - wheel.root_radius, a - wheel.tip_radius - pinion.root_radius

    @property
    def specific_sliding(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Specific sliding (at u_A, at u_E) of pinion and of wheel [–].

        Sliding over rolling velocity, ζ_1 = 1 − (ρ_2/ρ_1)(z_1/z_2), ζ_2 = 1 − (ρ_1/ρ_2)(z_2/z_1); infinite where the
        path of contact ends at an interference point.
        """
        z1, z2 = (gear.teeth for gear in self.gears)
        ends, T = (self.path_start, self.path_end), self.tangent_length

        def zeta(rho: float, teeth: int, mate: int) -> float:
            return 1 - (T - rho) / rho * teeth / mate if rho * teeth > 0 else -math.inf

        (a1, e1), (a2, e2) = ([zeta(u, z1, z2) for u in ends], [zeta(T - u, z2, z1) for u in ends])
        return (a1, e1), (a2, e2)

    @property
    def largest_sliding(self) -> float:
        """Largest absolute specific sliding of both gears and both ends of the path of contact [–]."""
        return max(abs(zeta) for gear in self.specific_sliding for zeta in gear)


def _curvature(gear: Gear, radius: float) -> float:
    """Radius of curvature ρ = √(R² − r_b²) of the flank at R [mm], negative on an internal gear."""
    return float(gear.roll_length(radius))
