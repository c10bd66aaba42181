"""Gear of a REXS model: dimensions from the gear, its flanks and its tools, in the units of a scene."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearbench.errors import InputError
from gearbench.exchange.rexs_document import Component, RexsDocument
from gearbench.exchange.rexs_units import ANGLE, LENGTH, MODULUS, NUMBER, Dimension
from gearbench.geometry.section import TransverseSection


@dataclass(frozen=True, kw_only=True)
class RexsGear(TransverseSection):
    """Cylindrical gear as described in a file; None for missing data.

    Parameters
    ----------
    component
        Component of the gear.
    teeth, normal_module, pressure_angle, helix_angle
        z, m_n [mm], α_n and β [°]; β > 0 is right-handed, z and radii of a ring are negative.
    face_width
        b [mm].
    profile_shift, addendum_coefficient, dedendum_coefficient, fillet_radius
        x, h_aP*, tool addendum h_aP0* = h_f* and tool tip radius ρ_aP0* [normal modules].
    tip_radius, root_radius
        r_a and r_f [mm].
    """

    component: Component
    face_width: float
    profile_shift: float | None
    addendum_coefficient: float | None
    dedendum_coefficient: float | None
    fillet_radius: float | None
    tip_radius: float | None
    root_radius: float | None

    def addendum(self, profile_shift: float) -> float | None:
        """h_a* = (r_a − r)/m_n − x from the tip circle if given, else from the basic profile; None without both."""
        if self.tip_radius is None:
            return self.addendum_coefficient
        return (self.tip_radius - self.pitch_radius) / self.normal_module - profile_shift

    def dedendum(self, profile_shift: float) -> float | None:
        """h_f* = x − (r_f − r)/m_n from the root circle if given, else from the tool; None without both."""
        if self.root_radius is None:
            return self.dedendum_coefficient
        return profile_shift - (self.root_radius - self.pitch_radius) / self.normal_module


def read_gear(document: RexsDocument, component: Component) -> RexsGear:
    """Read the dimensions of a cylindrical gear from the gear itself, its flanks and its tools.

    Raises
    ------
    InputError
        If a value is missing, not a number, in an unknown unit, or different on both flanks; names component and
        attribute.
    """
    if component.kind not in ("cylindrical_gear", "ring_gear"):
        raise InputError(component.label, component.kind, "must be a cylindrical gear or a ring gear")
    ring = component.kind == "ring_gear"
    teeth = document.require(component, "number_of_teeth", NUMBER)
    teeth = abs(teeth) if ring else teeth  # positive in the REXS standard, negative in ISO 21771
    if teeth != int(teeth) or teeth <= 0:
        raise InputError(f"{component.label}.number_of_teeth", teeth, "must be a positive whole number")
    sign = -1 if ring else 1
    source = _Source(document, component)
    m = document.require(component, "normal_module", LENGTH)
    alpha = source.value("normal_pressure_angle", ANGLE)
    if alpha is None:
        raise InputError(f"{component.label}.normal_pressure_angle", "missing", "is required, here or on its flanks")
    beta = document.require(component, "helix_angle_reference_diameter", ANGLE)
    if not 0 < alpha < 90:
        raise InputError(f"{component.label}.normal_pressure_angle", alpha, "must lie between 0° and 90°")
    if not -90 < beta < 90:
        raise InputError(f"{component.label}.helix_angle_reference_diameter", beta, "must lie between −90° and 90°")
    tip, root = (document.number(component, name, LENGTH) for name in ("tip_diameter", "root_diameter"))
    return RexsGear(
        component=component,
        teeth=sign * int(teeth),
        normal_module=m,
        face_width=document.require(component, "face_width", LENGTH),
        pressure_angle=alpha,
        helix_angle=beta,
        profile_shift=source.coefficient("addendum_modification_coefficient", "addendum_modification", m),
        addendum_coefficient=source.coefficient("addendum_coefficient_basic_profile", "addendum_basic_profile", m),
        dedendum_coefficient=source.coefficient(
            "addendum_coefficient_reference_profile", "addendum_reference_profile", m
        ),
        fillet_radius=source.coefficient("tip_radius_factor", "tip_radius", m),
        tip_radius=None if tip is None else sign * abs(tip) / 2,
        root_radius=None if root is None else sign * abs(root) / 2,
    )


@dataclass(frozen=True)
class _Source:
    """Components that hold a gear's attributes: the gear, its left and right flank, and its tools.

    Flanks are called ``flank_geometry`` up to REXS 1.2 and ``cylindrical_gear_flank`` from 1.3; the relation is the
    same.
    """

    document: RexsDocument
    gear: Component

    def _components(self) -> list[Component]:
        flanks = [
            flank for side in ("left", "right") for flank in self.document.related("flank", "gear", self.gear.id, side)
        ]
        # from 1.3, a manufacturing step works on a gear or flank; before, the gear refers to its tools in their order
        tools = [
            tool
            for piece in (self.gear, *flanks)
            for tool in self.document.related("manufacturing_step", "workpiece", piece.id, "tool")
        ]
        tools += self.document.related("ordered_reference", "origin", self.gear.id, "referenced")
        return [self.gear, *flanks, *dict.fromkeys(tools)]

    def value(self, name: str, dimension: Dimension) -> float | None:
        """Value of an attribute; all components that give it must agree."""
        values = {c.label: self.document.number(c, name, dimension) for c in self._components()}
        given = {label: value for label, value in values.items() if value is not None}
        first = next(iter(given.values()), None)
        for label, value in given.items():
            if first is not None and not math.isclose(value, first, rel_tol=1e-6, abs_tol=1e-9):
                others = ", ".join(f"{v:g} on {k}" for k, v in given.items() if k != label)
                raise InputError(f"{label}.{name}", value, f"must be the same on both flanks and tools ({others})")
        return first

    def coefficient(self, factor: str, length: str, module: float) -> float | None:
        """Length in normal modules, from an attribute in modules or from one in mm."""
        value = self.value(factor, NUMBER)
        if value is not None:
            return value
        value = self.value(length, LENGTH)
        return None if value is None else value / module


def read_material(document: RexsDocument, gear: Component) -> tuple[float, float] | None:
    """Young's modulus [GPa] and Poisson's ratio of the material that a gear or its shaft refers to; None without."""
    shafts = document.related("assembly", "part", gear.id, "assembly")
    for owner in (gear, *shafts):
        for material in document.related("reference", "origin", owner.id, "referenced"):
            modulus = document.number(material, "elastic_modulus", MODULUS)
            ratio = document.number(material, "poisson_ratio", NUMBER)
            if material.kind == "material" and modulus is not None:
                return modulus, 0.3 if ratio is None else ratio
    return None


def read_seat(document: RexsDocument, gear: Component) -> float | None:
    """Outer diameter of the shaft section that carries a gear [mm]; None if the file does not give it.

    Some programs write the position of the gear's middle, others that of its end face; both lie on the same section.
    """
    position = document.number(gear, "u_coordinate_on_shaft", LENGTH)
    if position is None:
        return None
    for shaft in document.related("assembly", "part", gear.id, "assembly"):
        for section in document.related("assembly", "assembly", shaft.id, "part"):
            start, length, first, last = (
                document.number(section, name, LENGTH) if section.kind == "shaft_section" else None
                for name in ("u_coordinate_on_shaft", "length", "outer_diameter_begin", "outer_diameter_end")
            )
            if start is None or not length or first is None or last is None:
                continue
            fraction = (position - start) / length
            if -1e-9 <= fraction < 1 - 1e-9:
                return first + max(fraction, 0.0) * (last - first)
    return None


def read_outside(document: RexsDocument, ring: Component) -> float | None:
    """Largest outer diameter of the shaft of a ring [mm]; None if the file does not give it."""
    shafts = document.related("assembly", "part", ring.id, "assembly")
    pieces = [piece for shaft in shafts for piece in document.related("assembly", "assembly", shaft.id, "part")]
    sizes = [
        document.number(piece, "outer_diameter_begin", LENGTH) for piece in pieces if piece.kind == "shaft_section"
    ]
    return max((size for size in sizes if size), default=None)


def read_cutter_teeth(document: RexsDocument, ring: Component) -> int | None:
    """Number of teeth of the cutter of a ring; None if the file does not give it."""
    for tool in document.related("ordered_reference", "origin", ring.id, "referenced"):
        if tool.kind == "cutter_wheel_tool" and (teeth := document.number(tool, "number_of_teeth", NUMBER)):
            return int(teeth)
    return None
