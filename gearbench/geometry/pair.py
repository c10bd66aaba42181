"""A pair of external involute gears at its working centre distance. Source: ISO 21771."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field
from pydantic.dataclasses import dataclass

from gearbench.errors import InputError
from gearbench.geometry.gear import Gear
from gearbench.geometry.material import Material
from gearbench.geometry.meshing import Meshing, profile_shift_sum
from gearbench.geometry.rack import STANDARD_FILLET_RADIUS, full_fillet_radius
from gearbench.geometry.role import Role
from gearbench.geometry.section import TransverseSection
from gearbench.notebook import pair_html
from gearbench.schema import STRICT

#: Centre distances [mm] and profile shifts [modules] are published to four decimals; less overlap is their rounding.
ROUNDING = 1e-4

Length = Annotated[float, Field(gt=0.0, le=20000.0)]


def _external(teeth: Any) -> Any:
    """Take numpy's integers too; refuse the negative count of an internal gear, which ISO 21771 writes so."""
    teeth = int(teeth) if isinstance(teeth, np.integer) else teeth
    if isinstance(teeth, int) and teeth < 0:
        raise InputError("", teeth, "internal gears are not there yet: must be at least 5")
    return teeth


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Member:
    """The free choices of one gear of a pair.

    Parameters
    ----------
    teeth
        Number of teeth z.
    addendum, dedendum
        h_a* and h_f* [normal modules].
    tip_diameter
        d_a, in place of the addendum, as on a drawing [mm].
    profile_shift
        x [normal modules]; derived from the centre distance where absent. Those of both gears may make the teeth
        overlap by 10⁻⁴ (1 mm + m_n), as shifts and a distance rounded to four decimals do.
    fillet_radius
        Tip rounding ρ_f* of the generating rack [normal modules]; 0.38 or, where less fits, the full rounding.
    bore_diameter
        Bore of the gear body [mm]; only models of the body ask for it.
    rim_thickness, web_thickness, web_offset, hub_diameter
        Body of a rim below the root circle, a web b_s wide along the axis, its middle ``web_offset`` towards y = b from
        that of the face, and a hub, without which the web reaches down to the bore [mm]; rim and hub are as wide as the
        face. Without rim and web the body is solid down to the bore.
    tip_rounding, tip_chamfer
        Radius of the rounding, or height of the chamfer (at 45° to the flank), of the tip edge [mm]; a sharp edge
        where both are absent.
    """

    teeth: Annotated[int, Field(ge=5, le=2000), BeforeValidator(_external)]
    addendum: Annotated[float, Field(gt=0.0, le=2.5)] = 1.0
    dedendum: Annotated[float, Field(gt=0.0, le=3.0)] = 1.25
    tip_diameter: Length | None = None
    profile_shift: Annotated[float, Field(ge=-3.0, le=3.0)] | None = None
    fillet_radius: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    bore_diameter: Length | None = None
    rim_thickness: Length | None = None
    web_thickness: Length | None = None
    web_offset: Annotated[float, Field(ge=-20000.0, le=20000.0)] = 0.0
    hub_diameter: Length | None = None
    tip_rounding: Annotated[float, Field(gt=0.0, le=50.0)] | None = None
    tip_chamfer: Annotated[float, Field(gt=0.0, le=50.0)] | None = None

    def __post_init__(self) -> None:
        if self.tip_diameter is not None and self.addendum != 1.0:
            raise InputError("tip_diameter", self.tip_diameter, "conflicts with addendum: give one of the two")
        if self.tip_rounding is not None and self.tip_chamfer is not None:
            raise InputError("tip_chamfer", self.tip_chamfer, "conflicts with tip_rounding: give one of the two")
        self._check_web()

    def _check_web(self) -> None:
        rim, width, hub = self.rim_thickness, self.web_thickness, self.hub_diameter
        if rim is not None and self.bore_diameter is None:
            raise InputError("rim_thickness", rim, "needs bore_diameter: the body is held there")
        if rim is not None and width is None:
            raise InputError("rim_thickness", rim, "needs web_thickness: the rim stands on a web")
        for name, value in (("web_thickness", width), ("web_offset", self.web_offset or None), ("hub_diameter", hub)):
            if value is not None and rim is None:
                raise InputError(name, value, "needs rim_thickness: the web lies below a rim")


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Pair:
    """A pair of external gears, spur or helical.

    The pinion drives. Their contact is described by ``meshing``.

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
        The two gears. Profile shifts that are not given share equally the sum that the centre distance asks for.
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
    >>> round(pair.meshing.transverse_contact_ratio, 4), pair.meshing.overlap_ratio
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
        for role in Role:
            self._check_clearance(role)
        if self.meshing.path_end <= self.meshing.path_start:
            raise InputError("centre_distance", self.centre_distance, "no contact: the tip circles do not overlap")
        if self.meshing.total_contact_ratio < 1:
            allowed = f"total contact ratio {self.meshing.total_contact_ratio:.4g} must be at least 1"
            raise InputError("centre_distance", self.centre_distance, allowed)

    def _check_centre_distance(self) -> None:
        lowest = sum(section.base_radius for section in self.sections)
        if self.centre_distance <= lowest:
            allowed = f"must exceed the sum of the base radii, {lowest:.6g} mm"
            raise InputError("centre_distance", self.centre_distance, allowed)
        if self.pinion.profile_shift is None or self.wheel.profile_shift is None:
            return
        if self.backlash is not None:
            raise InputError("backlash", self.backlash, "follows from the profile shifts: leave out one of the three")
        if self.actual_backlash < -ROUNDING * (1.0 + self.normal_module):
            tight = f"teeth overlap by {-self.actual_backlash:.4g} mm: reduce a profile shift or raise the distance"
            raise InputError("centre_distance", self.centre_distance, tight)

    def _check_clearance(self, role: Role) -> None:
        clearance = self.meshing.tip_clearances[role]
        # coefficients are usually given to three decimals: that much overlap is rounding, not interference
        if clearance < -0.002 * self.normal_module:
            allowed = f"tip runs {-clearance:.4g} mm into the root of its mate: reduce it or raise the distance"
            name = "addendum" if self.members[role].tip_diameter is None else "tip_diameter"
            raise InputError(f"{role.label}.{name}", getattr(self.members[role], name), allowed)

    @property
    def members(self) -> tuple[Member, Member]:
        """Given data of pinion and wheel."""
        return self.pinion, self.wheel

    # -- sections, profile shifts, gears ------------------------------------------------------------------------------
    @cached_property
    def sections(self) -> tuple[TransverseSection, TransverseSection]:
        """Transverse sections of pinion and wheel."""
        pinion, wheel = (
            TransverseSection(
                teeth=member.teeth,
                normal_module=self.normal_module,
                pressure_angle=self.pressure_angle,
                helix_angle=self.helix_angle,
            )
            for member in (self.pinion, self.wheel)
        )
        return pinion, wheel

    @cached_property
    def profile_shifts(self) -> tuple[float, float]:
        """Profile shifts x_1, x_2 [normal modules], derived from the centre distance where not given (G3)."""
        total = profile_shift_sum(self.sections, self.centre_distance, self.backlash or 0.0)
        x1, x2 = self.pinion.profile_shift, self.wheel.profile_shift
        if x1 is None and x2 is None:
            return total / 2, total / 2
        if x1 is None:
            return total - (x2 or 0.0), x2 or 0.0
        return x1, total - x1 if x2 is None else x2

    @property
    def actual_backlash(self) -> float:
        """Circumferential backlash j_wt [mm] at the working pitch circles that follows from the profile shifts.

        Negative by no more than the rounding of the data.
        """
        one, two = self.sections
        excess = profile_shift_sum(self.sections, self.centre_distance) - sum(self.profile_shifts)
        return 4 * self.centre_distance * math.tan(one.alpha_n) / (one.teeth + two.teeth) * excess

    @cached_property
    def gears(self) -> tuple[Gear, Gear]:
        """The two gears, pinion first."""
        return self._gear(Role.PINION), self._gear(Role.WHEEL)

    def _addendum(self, role: Role) -> float:
        """h_a*, of the tip diameter where that is given [normal modules]."""
        member = self.members[role]
        if member.tip_diameter is None:
            return member.addendum
        height = member.tip_diameter / 2 - self.sections[role].pitch_radius
        return height / self.normal_module - self.profile_shifts[role]

    def _gear(self, role: Role) -> Gear:
        member = self.members[role]
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
                profile_shift=self.profile_shifts[role],
                addendum=self._addendum(role),
                dedendum=member.dedendum,
                fillet_radius=fillet,
                tip_rounding=member.tip_rounding or 0.0,
                tip_chamfer=member.tip_chamfer or 0.0,
            )
        except InputError as error:
            raise error.within(role.label) from None

    @cached_property
    def meshing(self) -> Meshing:
        """The two gears in mesh: path of contact, contact ratios, sliding."""
        return Meshing(gears=self.gears, centre_distance=self.centre_distance, face_width=self.face_width)

    def swapped(self) -> Pair:
        """The same pair with the wheel driving: pinion and wheel exchanged."""
        return replace(self, pinion=self.wheel, wheel=self.pinion)

    def _repr_html_(self) -> str:
        return pair_html(self)
