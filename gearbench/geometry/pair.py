"""A pair of external involute gears at its working centre distance. Source: ISO 21771."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property
from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.errors import InputError
from gearbench.geometry.gear import Gear
from gearbench.geometry.involute import inv
from gearbench.geometry.material import STRICT, Material
from gearbench.geometry.rack import STANDARD_FILLET_RADIUS, full_fillet_radius
from gearbench.notebook import html_table

Length = Annotated[float, Field(gt=0.0, le=20000.0)]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Member:
    """What is chosen for one gear of a pair.

    Parameters
    ----------
    teeth
        Number of teeth z.
    addendum, dedendum
        h_a* and h_f* [normal modules].
    profile_shift
        x [normal modules]; derived from the centre distance where absent.
    fillet_radius
        Tip rounding ρ_f* of the generating rack [normal modules]; 0.38 or, where less fits, the full rounding.
    bore_diameter
        Bore of the gear body [mm]; only models of the body ask for it.
    tip_rounding, tip_chamfer
        Radius of the rounding, or height of the chamfer (at 45° to the flank), of the tip edge [mm]; a sharp edge
        where both are absent.
    """

    teeth: Annotated[int, Field(ge=5, le=2000)]
    addendum: Annotated[float, Field(gt=0.0, le=2.5)] = 1.0
    dedendum: Annotated[float, Field(gt=0.0, le=3.0)] = 1.25
    profile_shift: Annotated[float, Field(ge=-3.0, le=3.0)] | None = None
    fillet_radius: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    bore_diameter: Length | None = None
    tip_rounding: Annotated[float, Field(gt=0.0, le=50.0)] | None = None
    tip_chamfer: Annotated[float, Field(gt=0.0, le=50.0)] | None = None

    def __post_init__(self) -> None:
        if self.tip_rounding is not None and self.tip_chamfer is not None:
            raise InputError("tip_chamfer", self.tip_chamfer, "conflicts with tip_rounding: give one of the two")


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Pair:
    """A pair of external gears, spur or helical.

    The pinion drives; u counts along the path of contact from the pinion's interference point T1 (where the line of
    action touches its base circle), in the transverse plane.

    Parameters
    ----------
    normal_module, face_width, centre_distance
        m_n, common face width b and working centre distance a′ [mm].
    pressure_angle, helix_angle
        α_n and β [°].
    backlash
        Circumferential backlash j_wt at the working pitch circles, transverse [mm]; used to derive the profile shifts,
        derived itself where both are given. Its default is 0.
    pinion, wheel
        The two gears. Profile shifts that are not given share what the centre distance asks for equally.
    material
        Of both gears.

    Raises
    ------
    InputError
        If the two cannot mesh. Wrapped by pydantic's ``ValidationError``.

    Examples
    --------
    >>> pinion, wheel = Member(teeth=17), Member(teeth=43)
    >>> pair = Pair(normal_module=2.0, face_width=20.0, centre_distance=60.0, pinion=pinion, wheel=wheel)
    >>> round(pair.transverse_contact_ratio, 4), pair.overlap_ratio
    (1.6211, 0.0)
    >>> [round(x, 9) + 0.0 for x in pair.profile_shifts]
    [0.0, 0.0]
    """

    normal_module: Annotated[float, Field(ge=0.05, le=200.0)]
    pressure_angle: Annotated[float, Field(ge=5.0, le=40.0)] = 20.0
    helix_angle: Annotated[float, Field(ge=0.0, le=60.0)] = 0.0
    face_width: Length
    centre_distance: Length
    backlash: Annotated[float, Field(ge=0.0)] | None = None
    pinion: Member
    wheel: Member
    material: Material = Material()

    def __post_init__(self) -> None:
        if not 0.05 <= self.face_width / self.normal_module <= 500:
            allowed = f"must be 0.05 to 500 normal modules ({self.normal_module:g} mm); lengths are in mm"
            raise InputError("face_width", self.face_width, allowed)
        self._check_centre_distance()
        for gear, name in zip(self.gears, ("pinion", "wheel"), strict=True):
            self._check_room(gear, name)
        if self.path_end <= self.path_start:
            raise InputError("centre_distance", self.centre_distance, "no contact: the tip circles do not overlap")
        if self.total_contact_ratio < 1:
            allowed = f"total contact ratio {self.total_contact_ratio:.4g} must be at least 1"
            raise InputError("centre_distance", self.centre_distance, allowed)

    def _check_centre_distance(self) -> None:
        lowest = self._base_radii[0] + self._base_radii[1]
        if self.centre_distance <= lowest:
            allowed = f"must exceed the sum of the base radii, {lowest:.6g} mm"
            raise InputError("centre_distance", self.centre_distance, allowed)
        if self.pinion.profile_shift is None or self.wheel.profile_shift is None:
            return
        if self.backlash is not None:
            raise InputError("backlash", self.backlash, "follows from the profile shifts: leave out one of the three")
        if self.actual_backlash < -1e-9 * self.normal_module:
            tight = f"teeth overlap by {-self.actual_backlash:.4g} mm: reduce a profile shift or raise the distance"
            raise InputError("centre_distance", self.centre_distance, tight)

    def _check_room(self, gear: Gear, name: str) -> None:
        clearance = self.tip_clearances[0 if name == "pinion" else 1]
        # coefficients are usually given to three decimals: that much overlap is rounding, not interference
        if clearance < -0.002 * self.normal_module:
            allowed = f"tip runs {-clearance:.4g} mm into the root of its mate: reduce it or raise the distance"
            raise InputError(f"{name}.addendum", gear.addendum, allowed)

    # -- angles [rad] -------------------------------------------------------------------------------------------------
    @cached_property
    def _alpha_t(self) -> float:
        return math.atan(math.tan(math.radians(self.pressure_angle)) / math.cos(math.radians(self.helix_angle)))

    @cached_property
    def _base_radii(self) -> tuple[float, float]:
        m_t = self.normal_module / math.cos(math.radians(self.helix_angle))
        r_b1, r_b2 = (m_t * z / 2 * math.cos(self._alpha_t) for z in (self.pinion.teeth, self.wheel.teeth))
        return r_b1, r_b2

    @cached_property
    def working_pressure_angle(self) -> float:
        """Working transverse pressure angle α_wt [rad], cos α_wt = (r_b1 + r_b2)/a′ (G2)."""
        return math.acos(sum(self._base_radii) / self.centre_distance)

    @property
    def base_helix_angle(self) -> float:
        """Base helix angle β_b [rad], tan β_b = tan β cos α_t."""
        return math.atan(math.tan(math.radians(self.helix_angle)) * math.cos(self._alpha_t))

    # -- profile shifts and gears -------------------------------------------------------------------------------------
    @cached_property
    def profile_shifts(self) -> tuple[float, float]:
        """Profile shifts x_1, x_2 [normal modules], derived where not given (G3).

        x_1 + x_2 = (z_1 + z_2) [(inv α_wt − inv α_t) / (2 tan α_n) − j_wt / (4 a′ tan α_n)].
        """
        z, tan_n = self.pinion.teeth + self.wheel.teeth, math.tan(math.radians(self.pressure_angle))
        total = z * (inv(self.working_pressure_angle) - inv(self._alpha_t)) / (2 * tan_n)
        total -= z * (self.backlash or 0.0) / (4 * self.centre_distance * tan_n)
        x1, x2 = self.pinion.profile_shift, self.wheel.profile_shift
        if x1 is None and x2 is None:
            return total / 2, total / 2
        if x1 is None:
            return total - (x2 or 0.0), x2 or 0.0
        return x1, total - x1 if x2 is None else x2

    @property
    def actual_backlash(self) -> float:
        """Circumferential backlash j_wt [mm] at the working pitch circles that follows from the profile shifts."""
        z, tan_n = self.pinion.teeth + self.wheel.teeth, math.tan(math.radians(self.pressure_angle))
        a, d_inv = self.centre_distance, inv(self.working_pressure_angle) - inv(self._alpha_t)
        return 2 * a * d_inv - 4 * a * sum(self.profile_shifts) * tan_n / z

    @cached_property
    def gears(self) -> tuple[Gear, Gear]:
        """The two gears, pinion first."""
        return self._gear("pinion", 0), self._gear("wheel", 1)

    def _gear(self, name: str, index: int) -> Gear:
        member: Member = getattr(self, name)
        fillet = member.fillet_radius
        if fillet is None:
            fullest = full_fillet_radius(math.radians(self.pressure_angle), member.dedendum)
            fillet = max(0.0, min(STANDARD_FILLET_RADIUS, fullest))
        try:
            return Gear(
                teeth=member.teeth,
                normal_module=self.normal_module,
                pressure_angle=self.pressure_angle,
                helix_angle=self.helix_angle,
                face_width=self.face_width,
                profile_shift=self.profile_shifts[index],
                addendum=member.addendum,
                dedendum=member.dedendum,
                fillet_radius=fillet,
                tip_rounding=member.tip_rounding or 0.0,
                tip_chamfer=member.tip_chamfer or 0.0,
            )
        except InputError as error:
            raise error.within(name) from None

    # -- path of contact [mm] -----------------------------------------------------------------------------------------
    @property
    def base_pitch(self) -> float:
        """Transverse base pitch p_bt = 2π r_b1 / z_1 [mm]."""
        return 2 * math.pi * self._base_radii[0] / self.pinion.teeth

    @property
    def tangent_length(self) -> float:
        """Distance T1 T2 = a′ sin α_wt between the two interference points [mm]."""
        return self.centre_distance * math.sin(self.working_pressure_angle)

    @property
    def pitch_point(self) -> float:
        """u of the pitch point, r_b1 tan α_wt [mm]."""
        return self._base_radii[0] * math.tan(self.working_pressure_angle)

    @cached_property
    def path_start(self) -> float:
        """u_A [mm]: the wheel's tip enters, unless the pinion's involute (fillet, undercut) starts later."""
        pinion, wheel = self.gears
        tip = self.tangent_length - math.sqrt(wheel.tip_form_radius**2 - wheel.base_radius**2)
        return max(tip, math.sqrt(max(pinion.form_radius**2 - pinion.base_radius**2, 0.0)))

    @cached_property
    def path_end(self) -> float:
        """u_E [mm]: the pinion's tip leaves, unless the wheel's involute ends earlier."""
        pinion, wheel = self.gears
        tip = math.sqrt(pinion.tip_form_radius**2 - pinion.base_radius**2)
        form = math.sqrt(max(wheel.form_radius**2 - wheel.base_radius**2, 0.0))
        return min(tip, self.tangent_length - form)

    @cached_property
    def has_interference(self) -> tuple[bool, bool]:
        """Whether the fillet of pinion, wheel is reached by the mate's tip (contact below the form circle)."""
        pinion, wheel = self.gears
        reach = [math.sqrt(g.tip_form_radius**2 - g.base_radius**2) for g in (wheel, pinion)]
        form = [math.sqrt(max(g.form_radius**2 - g.base_radius**2, 0.0)) for g in (pinion, wheel)]
        room = 1e-12 * self.centre_distance
        at_pinion, at_wheel = (self.tangent_length - r < f - room for r, f in zip(reach, form, strict=True))
        return at_pinion, at_wheel

    @property
    def transverse_contact_ratio(self) -> float:
        """ε_α = (u_E − u_A) / p_bt (G8)."""
        return (self.path_end - self.path_start) / self.base_pitch

    @property
    def overlap_ratio(self) -> float:
        """ε_β = b tan β_b / p_bt."""
        return self.face_width * math.tan(self.base_helix_angle) / self.base_pitch

    @property
    def total_contact_ratio(self) -> float:
        """ε_γ = ε_α + ε_β."""
        return self.transverse_contact_ratio + self.overlap_ratio

    def path_coordinate(self, gear: int, radius: float) -> float:
        """Place u [mm] on the path of contact of radius R [mm] on the pinion (0) or the wheel (1)."""
        roll = math.sqrt(max(radius**2 - self._base_radii[gear] ** 2, 0.0))
        return roll if gear == 0 else self.tangent_length - roll

    @property
    def active_radii(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Radii of start and end of the active profile (root side, tip side) of pinion and wheel [mm]."""
        r_b1, r_b2 = self._base_radii
        u, t = (self.path_start, self.path_end), self.tangent_length
        return (math.hypot(r_b1, u[0]), math.hypot(r_b1, u[1])), (
            math.hypot(r_b2, t - u[1]),
            math.hypot(r_b2, t - u[0]),
        )

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
        ratio = self.wheel.teeth / self.pinion.teeth

        def zeta(own: float, mate: float, i: float) -> float:
            return 1 - mate / own * i if own > 0 else -math.inf

        ends = [(u, self.tangent_length - u) for u in (self.path_start, self.path_end)]
        (a1, a2), (e1, e2) = ends
        return (zeta(a1, a2, 1 / ratio), zeta(e1, e2, 1 / ratio)), (zeta(a2, a1, ratio), zeta(e2, e1, ratio))

    @property
    def largest_sliding(self) -> float:
        """Largest specific sliding without its sign, at either end of the path of contact, on either gear [–]."""
        return max(abs(zeta) for gear in self.specific_sliding for zeta in gear)

    @property
    def transition_phases(self) -> tuple[float, ...]:
        """Mesh phases in [0, 1) at which a contact line begins, ends, or reaches the edge of a face; sorted."""
        return self.phases_at((self.path_start, self.path_end))

    def phases_at(self, places: Iterable[float]) -> tuple[float, ...]:
        """Mesh phases in [0, 1) at which an end of the face (y = 0 or y = b) passes one of the ``places`` u [mm]."""
        turns = [(u - self.path_start) / self.base_pitch for u in places]
        # twice, because −1e-17 % 1.0 is 1.0
        return tuple(sorted({x % 1.0 % 1.0 for t in turns for x in (t, t - self.overlap_ratio)}))

    def swapped(self) -> Pair:
        """The same pair with the wheel driving: pinion and wheel exchanged."""
        return replace(self, pinion=self.wheel, wheel=self.pinion)

    def _repr_html_(self) -> str:
        """Tables for notebooks: both gears, and what they make together."""
        pinion, wheel = self.gears
        gears = html_table(
            "gears",
            ("pinion", "wheel"),
            [
                ("teeth z", (pinion.teeth, wheel.teeth)),
                ("profile shift x", self.profile_shifts),
                ("addendum, dedendum [m_n]", [f"{g.addendum:g}, {g.dedendum:g}" for g in (pinion, wheel)]),
                ("tip radius r_a [mm]", (pinion.tip_radius, wheel.tip_radius)),
                ("pitch radius r [mm]", (pinion.pitch_radius, wheel.pitch_radius)),
                ("base radius r_b [mm]", (pinion.base_radius, wheel.base_radius)),
                ("root radius r_f [mm]", (pinion.root_radius, wheel.root_radius)),
                ("tip clearance [mm]", self.tip_clearances),
            ],
        )
        pair = html_table(
            "pair",
            (),
            [
                ("normal module m_n [mm]", (self.normal_module,)),
                ("pressure angle, helix angle [°]", (f"{self.pressure_angle:g}, {self.helix_angle:g}",)),
                ("face width, centre distance [mm]", (f"{self.face_width:g}, {self.centre_distance:g}",)),
                ("working pressure angle α_wt [°]", (math.degrees(self.working_pressure_angle),)),
                ("contact ratios ε_α, ε_β", (f"{self.transverse_contact_ratio:.4g}, {self.overlap_ratio:.4g}",)),
                ("backlash j_wt [mm]", (round(self.actual_backlash, 9),)),
                ("E [GPa], ν", (f"{self.material.youngs_modulus:g}, {self.material.poisson_ratio:g}",)),
            ],
        )
        return gears + pair
