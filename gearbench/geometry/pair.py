"""A pair of involute gears, the wheel external or internal, at its working centre distance. Source: ISO 21771."""

from __future__ import annotations

import math
from dataclasses import is_dataclass, replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field
from pydantic.dataclasses import dataclass

from gearbench.errors import InputError, naming
from gearbench.geometry.blank import CUTTER, RACK, blank_of
from gearbench.geometry.cutter import Cutter, standard_cutter, standard_rounding
from gearbench.geometry.faces import Ends, Faces
from gearbench.geometry.gear import Gear
from gearbench.geometry.material import Material
from gearbench.geometry.meshing import Meshing, profile_shift_sum
from gearbench.geometry.names import GEARS
from gearbench.geometry.rack import STANDARD_FILLET_RADIUS, full_fillet_radius
from gearbench.geometry.ring_conditions import tip_room
from gearbench.geometry.section import TransverseSection
from gearbench.geometry.shifts import backlash, generating_shifts, given_shift
from gearbench.geometry.support import Support
from gearbench.geometry.temperature import Temperatures, strain
from gearbench.geometry.thickness import Deviation, Thickness
from gearbench.html import notebook_table
from gearbench.schema import STRICT

#: Centre distances [mm] and profile shifts [modules] are published to four decimals; teeth may overlap by as much.
ROUNDING = 1e-4
#: Largest profile shift [modules]; more means a wrong centre distance.
LARGEST_SHIFT = 1.5

Length = Annotated[float, Field(gt=0.0, le=20000.0)]
Signed = Annotated[float, Field(ge=-20000.0, le=20000.0)]


def _teeth(count: Any) -> Any:
    """Take numpy's integers too; refuse gears of fewer than 5 teeth, and rings of fewer than 15."""
    count = int(count) if isinstance(count, np.integer) else count
    if isinstance(count, int) and -15 < count < 5:
        raise InputError("", count, "must be at least 5, or at most -15 for an internal gear")
    return count


#: Keys of external gears only, and of internal gears only.
_EXTERNAL = ("bore_diameter", "rim_thickness", "protuberance", "grinding_stock")
_INTERNAL = ("outer_diameter", "support", "cutter")


def foreign_keys(teeth: int) -> tuple[str, ...]:
    """Keys that a gear of ``teeth`` cannot have."""
    return _EXTERNAL if teeth < 0 else _INTERNAL


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Member:
    """Data of one gear of a pair.

    Parameters
    ----------
    teeth
        Number of teeth z; negative for an internal gear (ISO 21771), whose diameters may have either sign.
    addendum, dedendum
        h_a* and h_f* [normal modules]. For an internal gear h_f* is the addendum of its cutter above the shifted
        reference line.
    tip_diameter, root_diameter
        d_a instead of the addendum, d_f instead of the dedendum [mm].
    profile_shift
        x [normal modules]; by default from the centre distance. Flanks with given shifts may overlap by up to
        10⁻⁴ (1 mm + m_n), because printed shifts are rounded.
    fillet_radius
        Tip rounding ρ_f* of the generating rack, or of the cutter in its transverse section [normal modules]; by
        default 0.38 (cutter 0.2), or the full rounding if that is less.
    cutter
        Pinion-type cutter of an internal gear; by default 20 teeth fewer than the gear, within 15 to 60.
    bore_diameter, outer_diameter
        Where the body is held: the bore of an external gear, the outside of an internal gear [mm].
    support
        Springs or lugs at the outside of an internal gear; by default it is held rigidly.
    rim_thickness, web_thickness, web_offset, hub_diameter
        Rim below the root circle, axial width of the web, its offset from the middle of the face towards y = b, and
        diameter of the hub [mm]. Without hub the web reaches the bore; without rim and web the body is solid.
    tip_rounding, tip_chamfer
        Radius of the rounding, or height of the 45° chamfer, of the tip edge [mm] (G17); by default a sharp edge.
    face_width
        Face width b_i, if different from that of the pair [mm].
    axial_offset
        Offset of the middle of its face from that of the pair, towards y = b [mm].
    thickness
        Tooth thickness. The profile shift follows from a measured size; if both are given, the tip circle follows from
        the profile shift, flanks and root from the size.
    protuberance, grinding_stock
        pr_P0 of the tool, and stock q ground off each flank [mm] (G12). Dedendum and fillet radius are then those of
        the tool.
    material
        Material, if different from that of the pair.
    blank
        How the gear is cut (see ``gearbench.geometry.blank``): "rack", "pinion_cutter" for an internal gear, or a type
        of another package.
    """

    teeth: Annotated[int, Field(ge=-2000, le=2000), BeforeValidator(_teeth)]
    addendum: Annotated[float, Field(gt=0.0, le=2.5)] = 1.0
    dedendum: Annotated[float, Field(gt=0.0, le=3.0)] = 1.25
    tip_diameter: Signed | None = None
    root_diameter: Signed | None = None
    profile_shift: Annotated[float, Field(ge=-3.0, le=3.0)] | None = None
    fillet_radius: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    cutter: Cutter | None = None
    bore_diameter: Length | None = None
    outer_diameter: Length | None = None
    support: Support | None = None
    rim_thickness: Length | None = None
    web_thickness: Length | None = None
    web_offset: Annotated[float, Field(ge=-20000.0, le=20000.0)] = 0.0
    hub_diameter: Length | None = None
    tip_rounding: Annotated[float, Field(gt=0.0, le=50.0)] | None = None
    tip_chamfer: Annotated[float, Field(gt=0.0, le=50.0)] | None = None
    face_width: Length | None = None
    axial_offset: Annotated[float, Field(ge=-20000.0, le=20000.0)] = 0.0
    thickness: Thickness | None = None
    protuberance: Annotated[float, Field(gt=0.0, le=20.0)] | None = None
    grinding_stock: Annotated[float, Field(gt=0.0, le=20.0)] | None = None
    material: Material | None = None
    blank: str | None = None

    def __post_init__(self) -> None:
        if self.tip_diameter is not None and self.addendum != 1.0:
            raise InputError("tip_diameter", self.tip_diameter, "conflicts with addendum: give one of the two")
        if self.root_diameter is not None and self.dedendum != 1.25:
            raise InputError("root_diameter", self.root_diameter, "conflicts with dedendum: give one of the two")
        kind = "an internal" if self.teeth < 0 else "an external"
        for key in foreign_keys(self.teeth):
            if (value := getattr(self, key)) is not None:
                shown = "given" if is_dataclass(value) else value
                raise InputError(key, shown, f"is not a key of {kind} gear (teeth = {self.teeth})")
        if self.tip_rounding is not None and self.tip_chamfer is not None:
            raise InputError("tip_chamfer", self.tip_chamfer, "conflicts with tip_rounding: give one of the two")
        stock = self.grinding_stock
        if stock is not None and stock > (self.protuberance or 0.0):
            allowed = "must be at most the protuberance: grinding would leave a notch in the fillet"
            raise InputError("grinding_stock", stock, allowed)
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

    @property
    def blank_name(self) -> str:
        """Name of the blank."""
        return self.blank or (CUTTER if self.teeth < 0 else RACK)

    @property
    def depth_of_fillet(self) -> float:
        """pr_P0 − q, the depth of the fillet below the flank [mm]."""
        return (self.protuberance or 0.0) - (self.grinding_stock or 0.0)


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Pair:
    """A pair of gears, spur or helical, one of which may be internal.

    The pinion drives. Their contact is described by ``meshing``.

    Parameters
    ----------
    normal_module, face_width, centre_distance
        m_n, face width b of both gears, and working centre distance a′ [mm], with either sign for an internal pair.
        Teeth touch on the common face.
    centre_distance_upper, centre_distance_lower
        Deviations of the centre distance [µm]; the pair is computed at their middle.
    pressure_angle, helix_angle
        α_n and β [°].
    backlash
        Circumferential backlash j_wt, transverse at the working pitch circles [mm], 0 by default. It thins teeth whose
        profile shifts are derived; if both shifts are given, the backlash follows.
    pinion, wheel
        The two gears. Profile shifts that are not given share the sum from the centre distance equally.
    material
        Material of both gears.
    temperature
        Temperatures in operation; 20 °C by default.

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
    centre_distance: Signed
    centre_distance_upper: Deviation = 0.0
    centre_distance_lower: Deviation = 0.0
    backlash: Annotated[float, Field(ge=0.0)] | None = None
    pinion: Member
    wheel: Member
    material: Material = Material()
    temperature: Temperatures | None = None

    def __post_init__(self) -> None:
        total = self.pinion.teeth + self.wheel.teeth
        if min(self.pinion.teeth, self.wheel.teeth) < 0 and (self.pinion.teeth * self.wheel.teeth > 0 or total >= 0):
            ring = 0 if self.pinion.teeth < 0 else 1
            allowed = "an internal gear meshes with an external gear of fewer teeth than its own"
            raise InputError(f"{GEARS[ring]}.teeth", self.members[ring].teeth, allowed)
        if self.pinion.teeth < 0:
            allowed = "an internal gear must be the driven one, the wheel; if it drives, reverse the torque on its mate"
            raise InputError("pinion.teeth", self.pinion.teeth, allowed)
        if self.centre_distance == 0 or (total > 0 > self.centre_distance):
            raise InputError("centre_distance", self.centre_distance, "must be greater than 0")
        object.__setattr__(self, "centre_distance", math.copysign(self.centre_distance, total))
        self.faces.check(self.normal_module)
        self._check_centre_distance()
        if self.is_internal and self.strains[0] != self.strains[1]:
            allowed = "must give both gears of an internal pair the same thermal strain"
            raise InputError("temperature.wheel", self.temperature and self.temperature.wheel, allowed)
        for index in (0, 1):
            self._check_clearance(index)
            self._check_body(index)
        if self.meshing.path_end <= self.meshing.path_start:
            raise InputError("centre_distance", self.centre_distance, "no contact: the tip circles do not overlap")
        if self.is_internal and (room := tip_room(self)) < 0:
            allowed = f"its tips foul those of the ring by {-room:.3g} mm off the path of contact: must have fewer"
            pinion = min((0, 1), key=lambda index: abs(self.members[index].teeth))
            raise InputError(f"{GEARS[pinion]}.teeth", self.members[pinion].teeth, allowed)
        if self.meshing.total_contact_ratio < 1:
            allowed = f"total contact ratio {self.meshing.total_contact_ratio:.4g} must be at least 1"
            raise InputError("centre_distance", self.centre_distance, allowed)

    def _check_centre_distance(self) -> None:
        if self.centre_distance_lower > self.centre_distance_upper:
            allowed = f"must be at most centre_distance_upper, {self.centre_distance_upper:g}"
            raise InputError("centre_distance_lower", self.centre_distance_lower, allowed)
        lowest = abs(sum(section.base_radius for section in self.sections))
        if min(abs(self.centre_distance), abs(self.working_distance(self.centre_distance_lower))) <= lowest:
            name = "difference" if self.is_internal else "sum"
            allowed = f"must exceed the {name} of the base radii, {lowest:.6g} mm"
            raise InputError("centre_distance", abs(self.centre_distance), allowed)
        if self.backlash is not None and any(member.thickness is not None for member in self.members):
            raise InputError("backlash", self.backlash, "follows from the tooth thickness: leave out one of the two")
        if None not in self._given_shifts and self.backlash is not None:
            raise InputError("backlash", self.backlash, "follows from the profile shifts: leave out one of the three")
        if self.actual_backlash < -ROUNDING * (1.0 + self.normal_module):
            way = "reduce" if self.is_internal else "raise"
            tight = f"teeth overlap by {-self.actual_backlash:.4g} mm: reduce a profile shift or {way} the distance"
            raise InputError("centre_distance", self.centre_distance, tight)

    def _check_clearance(self, index: int) -> None:
        clearance = self.meshing.tip_clearances[index]
        # coefficients are usually given to three decimals: that much overlap is rounding, not interference
        if clearance < -0.002 * self.normal_module:
            way = "" if self.is_internal else " or raise the distance"
            allowed = f"tip runs {-clearance:.4g} mm into the root of its mate: reduce it{way}"
            name = "addendum" if self.members[index].tip_diameter is None else "tip_diameter"
            raise InputError(f"{GEARS[index]}.{name}", getattr(self.members[index], name), allowed)

    def _check_body(self, index: int) -> None:
        member, gear = self.members[index], self.gears[index]
        diameter = member.bore_diameter if gear.teeth > 0 else member.outer_diameter
        if diameter is not None:
            with naming(below=GEARS[index]):
                blank_of(gear.blank).support(gear, diameter)
                if member.support is not None:
                    member.support.check(diameter)

    @property
    def is_internal(self) -> bool:
        """Whether one of the gears is internal."""
        return self.pinion.teeth * self.wheel.teeth < 0

    @property
    def members(self) -> tuple[Member, Member]:
        """Input data of pinion and wheel."""
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
    def _given_shifts(self) -> tuple[float | None, float | None]:
        """Profile shifts that are given, directly or by a measured size of the teeth [normal modules]."""
        one, two = (
            given_shift(self.sections[index], index, member.profile_shift, member.thickness)
            for index, member in enumerate(self.members)
        )
        return one, two

    @cached_property
    def profile_shifts(self) -> tuple[float, float]:
        """Profile shifts x_1, x_2 [normal modules]; (G3) of docs/theory.md gives those that are not given.

        The backlash does not change them: it thins the teeth but leaves the tip circles.
        """
        total = profile_shift_sum(self.sections, self.centre_distance)
        x1, x2 = self._given_shifts
        if x1 is None and x2 is None:
            return total / 2, total / 2
        if x1 is None:
            return total - (x2 or 0.0), x2 or 0.0
        return x1, total - x1 if x2 is None else x2

    @cached_property
    def _thinned_shifts(self) -> tuple[float, float]:
        """Profile shifts of the flanks: the shifts that are derived share the thinning by the backlash equally."""
        x1, x2 = self.profile_shifts
        if not self.backlash:
            return x1, x2
        thinner = profile_shift_sum(self.sections, self.centre_distance, self.backlash) - (x1 + x2)
        derived = [x is None for x in self._given_shifts]
        one, two = (x + thinner * is_derived / sum(derived) for x, is_derived in zip((x1, x2), derived, strict=True))
        return one, two

    @cached_property
    def generating_shifts(self) -> tuple[float, float]:
        """x_E1, x_E2 [normal modules], the shifts of flanks and roots, for teeth in the middle of their deviations."""
        return self._generating_shifts("middle")

    def _generating_shifts(self, limit: str) -> tuple[float, float]:
        """x_E1, x_E2 at the "upper" or "lower" limit of the tooth thickness, or in the "middle" of both."""

        def deviation(thickness: Thickness | None, section: TransverseSection) -> float:
            if thickness is None:
                return 0.0
            thickest, thinnest = thickness.ends(section)
            return {"upper": thickest, "lower": thinnest, "middle": thickness.middle}[limit]

        one, two = map(deviation, self._thicknesses, self.sections)
        return generating_shifts(self.sections, self._thinned_shifts, self._thicknesses, (one, two))

    @property
    def _thicknesses(self) -> tuple[Thickness | None, Thickness | None]:
        return self.pinion.thickness, self.wheel.thickness

    # -- faces, materials, temperatures -------------------------------------------------------------------------------
    @cached_property
    def faces(self) -> Faces:
        """Faces of both gears."""
        widths, offsets = ((getattr(self.pinion, k), getattr(self.wheel, k)) for k in ("face_width", "axial_offset"))
        return Faces(width=self.face_width, given=widths, offsets=offsets)

    @cached_property
    def overhangs(self) -> tuple[Ends, Ends]:
        """Lengths by which each gear's face reaches beyond the common one, at y = 0 and at y = b [mm]."""
        return self.faces.overhangs

    def face_of(self, index: int | None) -> float:
        """Face width of gear ``index``, or of the common face if it is None [mm]."""
        return self.meshing.face_width if index is None else self.gears[index].face_width

    @property
    def materials(self) -> tuple[Material, Material]:
        """Materials of pinion and wheel."""
        return self.pinion.material or self.material, self.wheel.material or self.material

    @property
    def contact_modulus(self) -> float:
        """E* of the contact of both materials, 1/E* = (1−ν₁²)/E₁ + (1−ν₂²)/E₂ [N/mm²]."""
        one, two = (material.plane_strain_modulus for material in self.materials)
        return one * two / (one + two)

    @property
    def strains(self) -> tuple[float, float]:
        """Free thermal strains of pinion and wheel [–]."""
        if self.temperature is None:
            return 0.0, 0.0
        one, two = (material.thermal_expansion for material in self.materials)
        return strain(self.temperature.pinion, one), strain(self.temperature.wheel, two)

    def working_distance(self, deviation: float) -> float:
        """a′ [mm] with a ``deviation`` [µm], at the given temperatures, for gears with their sizes at 20 °C (G16).

        A positive deviation moves the axes apart, whatever the sign of a′.
        """
        distance = self.centre_distance + math.copysign(1e-3, self.centre_distance) * deviation
        if self.temperature is None:
            return distance
        housing = strain(self.temperature.housing, self.temperature.housing_expansion)
        return distance * (1 + housing) / (1 + sum(self.strains) / 2)

    # -- backlash -----------------------------------------------------------------------------------------------------
    @property
    def actual_backlash(self) -> float:
        """Circumferential backlash j_wt [mm] at the working pitch circles that follows from the profile shifts.

        It may be slightly negative, because data are rounded (``ROUNDING``).
        """
        return backlash(self.sections, self.generating_shifts, self._working_distance)

    @property
    def backlash_limits(self) -> tuple[float, float]:
        """Least and greatest j_wt [mm] within the deviations of tooth thickness and centre distance."""
        near, far = self.centre_distance_lower, self.centre_distance_upper
        ends = (("upper", far), ("lower", near)) if self.is_internal else (("upper", near), ("lower", far))
        least, most = (
            backlash(self.sections, self._generating_shifts(limit), self.working_distance(distance))
            for limit, distance in ends
        )
        return least, most

    def backlash_with(self, thickness: tuple[float, float], distance: float) -> float:
        """j_wt [mm] if thicknesses and centre distance differ by these amounts [µm] from the middle of deviations."""
        first, second = (nominal or Thickness() for nominal in self._thicknesses)
        one, two = first.middle + thickness[0], second.middle + thickness[1]
        shifts = generating_shifts(self.sections, self._thinned_shifts, (first, second), (one, two))
        middle = (self.centre_distance_upper + self.centre_distance_lower) / 2
        return backlash(self.sections, shifts, self.working_distance(middle + distance))

    @property
    def _working_distance(self) -> float:
        return self.working_distance((self.centre_distance_upper + self.centre_distance_lower) / 2)

    # -- gears in mesh ------------------------------------------------------------------------------------------------

    @cached_property
    def gears(self) -> tuple[Gear, Gear]:
        """The two gears, pinion first."""
        return self._gear(0), self._gear(1)

    def _addendum(self, index: int) -> float:
        """h_a* counted from x_E [normal modules]; it follows from the tip diameter if that is given."""
        member = self.members[index]
        if member.tip_diameter is None:
            return member.addendum + self.profile_shifts[index] - self.generating_shifts[index]
        section = self.sections[index]
        height = math.copysign(member.tip_diameter, section.teeth) / 2 - section.pitch_radius
        return height / self.normal_module - self.generating_shifts[index]

    def _gear(self, index: int) -> Gear:
        member = self.members[index]
        try:
            gear = Gear(
                teeth=member.teeth,
                normal_module=self.normal_module,
                pressure_angle=self.pressure_angle,
                helix_angle=self.helix_angle,
                face_width=self.faces.widths[index],
                profile_shift=self.generating_shifts[index],
                addendum=self._addendum(index),
                dedendum=member.dedendum,
                fillet_radius=self._fillet_radius(index, member.dedendum),
                tip_rounding=member.tip_rounding or 0.0,
                tip_chamfer=member.tip_chamfer or 0.0,
                protuberance=member.depth_of_fillet,
                cutter=self._cutter(index),
                blank=member.blank_name,
            )
            if member.root_diameter is None:
                return gear
            # the root radius decreases by as much as the dedendum increases
            deeper = gear.root_radius - math.copysign(member.root_diameter, member.teeth) / 2
            dedendum = gear.dedendum + deeper / self.normal_module
            return replace(gear, dedendum=dedendum, fillet_radius=self._fillet_radius(index, dedendum))
        except InputError as error:
            shift = self.profile_shifts[index]
            if self._given_shifts[index] is None and abs(shift) > LARGEST_SHIFT:
                plain = abs(sum(section.pitch_radius for section in self.sections))
                total = sum(self.profile_shifts)
                allowed = f"needs a sum of profile shifts of {total:.3g}: without profile shift it is {plain:.6g} mm"
                raise InputError("centre_distance", abs(self.centre_distance), allowed) from None
            raise error.within(GEARS[index]) from None

    def _cutter(self, index: int) -> Cutter | None:
        member = self.members[index]
        return member.cutter or (standard_cutter(member.teeth) if member.teeth < 0 else None)

    def _fillet_radius(self, index: int, dedendum: float) -> float:
        """Rounding of the tool that is given, or the standard one as far as it fits [normal modules]."""
        member, cutter = self.members[index], self._cutter(index)
        if member.fillet_radius is not None:
            return member.fillet_radius
        if cutter is not None:
            return standard_rounding(self.sections[index], cutter, dedendum)
        depth = member.depth_of_fillet / self.normal_module
        fullest = full_fillet_radius(math.radians(self.pressure_angle), dedendum, depth)
        return max(0.0, min(STANDARD_FILLET_RADIUS, fullest))

    @cached_property
    def meshing(self) -> Meshing:
        """The two gears in mesh: path of contact, contact ratios, sliding."""
        start, end = self.faces.common
        return Meshing(gears=self.gears, centre_distance=self._working_distance, face_width=end - start)

    def _repr_html_(self) -> str:
        both, meshing = self.gears, self.meshing
        gears = {
            "teeth z": [gear.teeth for gear in both],
            "profile shift x": self.profile_shifts,
            "addendum, dedendum [m_n]": [f"{gear.addendum:g}, {gear.dedendum:g}" for gear in both],
            "tip radius r_a [mm]": [gear.tip_radius for gear in both],
            "pitch radius r [mm]": [gear.pitch_radius for gear in both],
            "base radius r_b [mm]": [gear.base_radius for gear in both],
            "root radius r_f [mm]": [gear.root_radius for gear in both],
            "tip clearance [mm]": meshing.tip_clearances,
        }
        materials = dict.fromkeys(
            f"{material.youngs_modulus:g}, {material.poisson_ratio:g}" for material in self.materials
        )
        together = {
            "normal module m_n [mm]": [self.normal_module],
            "pressure angle, helix angle [°]": [f"{self.pressure_angle:g}, {self.helix_angle:g}"],
            "face width, centre distance [mm]": [f"{meshing.face_width:g}, {self.centre_distance:g}"],
            "working pressure angle α_wt [°]": [math.degrees(meshing.alpha_wt)],
            "contact ratios ε_α, ε_β": [f"{meshing.transverse_contact_ratio:.4g}, {meshing.overlap_ratio:.4g}"],
            "backlash j_wt [mm]": [round(self.actual_backlash, 9)],
            "E [GPa], ν": ["; ".join(materials)],
        }
        return notebook_table("gears", GEARS, gears) + notebook_table("pair", (), together)
