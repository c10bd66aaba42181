"""Warnings about a scene or a result, one line per warning."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from gearbench.effects.tooth_bending import tooth_bending
from gearbench.geometry.names import GEARS
from gearbench.geometry.ring_conditions import radial_room
from gearbench.lazy import xr
from gearbench.results.provenance import support
from gearbench.scene import Scene

if TYPE_CHECKING:
    from gearbench.effects.base import Effect
    from gearbench.geometry.pair import Pair

#: Contact pressure above which a result carries a warning: σ_Hlim of case-hardened wrought steel of quality MQ,
#: ISO 6336-5:2016 table 1 (1300 for quality ML, 1650 for ME) [MPa].
HARDENED = 1500.0
#: Least tip thickness of a tooth [normal modules], ISO 21771-1 and usual practice.
LEAST_TIP = 0.2
#: Range in which solid teeth on a ring were compared with finite elements (``studies/s11_gears_in_use``): largest helix
#: angle [°], largest face width and smallest rim thickness [normal modules].
STEEPEST, WIDEST, THINNEST_RIM = 40.0, 25.0, 1.5
#: Half-width of contact over the difference of the radii of curvature of a ring and its mate, above which the contact
#: law of half-spaces is doubtful.
CONFORMING = 0.1
_OFF_LINE = "add [effects.off_line_contact]"


def warnings(scene: Scene, dataset: xr.Dataset | None = None) -> tuple[str, ...]:
    """Warnings: effects left out, errors at their means, bodies beyond validation, pointed tips, interference.

    With a ``dataset``, excessive contact pressure too.
    """
    pair, lines = scene.pair, []
    on_line = scene.effect("hertz") is not None and scene.effect("off_line_contact") is None
    if on_line:
        lines.append(f"contact is kept on the line of action and within the path of contact: {_OFF_LINE}")
    if support(scene) == "rigid" and not scene.has_shafts:
        lines.append("teeth are rigid but for their contact: add [effects.tooth_bending] and [effects.gear_body]")
    if support(scene) == "clamped":
        lines.append("teeth are clamped at their roots and too stiff: add [effects.gear_body]")
    if support(scene) == "ring" and tooth_bending(scene.effects_by_name, "solid") is not None:
        lines += _unproven(pair)
    if (errors := scene.effect("manufacturing_errors")) is not None:
        lines += _at_their_means(errors, pair)
    for index in (0, 1):
        gear = pair.gears[index]
        tip = float(gear.normal_thickness(gear.tip_radius))
        if tip < LEAST_TIP * pair.normal_module:
            lines.append(f"pointed tip of the {scene.gear_names[index]}: s_an = {tip:.3g} mm is below {LEAST_TIP} m_n")
        if pair.meshing.has_interference[index]:
            gear_name, mate_name = scene.gear_names[index], scene.gear_names[1 - index]
            lines.append(f"interference: the tip of the {mate_name} reaches below the form circle of the {gear_name}")
    if pair.is_internal:
        lines += _of_ring(pair, dataset)
    if dataset is not None:
        lines += _of_result(dataset, on_line)
    return tuple(lines)


def _of_result(dataset: xr.Dataset, on_line: bool) -> list[str]:
    """Warnings for a mesh that parts, and for excessive pressure, which contact kept ``on_line`` may cause."""
    lines = []
    if "mesh_load" in dataset and (parted := 100 * float((dataset["mesh_load"] <= 0).mean())):
        where = "" if parted == 100 else f" at {parted:.3g} % of the positions"
        lines.append(f"{dataset['mesh'].item()} carries no load{where}: its δ and k are NaN")
    if "flank_pressure_max" in dataset and (p := float(dataset["flank_pressure_max"].max())) > HARDENED:
        reason = f"; contact kept on the line of action may be the cause: {_OFF_LINE}" if on_line else ""
        limit = f"a case-hardened flank carries {HARDENED:.0f} MPa (ISO 6336-5)"
        lines.append(f"contact pressure {p:.0f} MPa: {limit}{reason}")
    return lines


def _of_ring(pair: Pair, dataset: xr.Dataset | None) -> list[str]:
    """Warnings of an internal pair: axial assembly only, and a contact too wide for the half-space contact law."""
    lines = []
    if (room := radial_room(pair)) < 0:
        lines.append(f"assembly along the axis only: pushed in radially tips would overlap by {-room:.3g} mm")
    if dataset is None or "flank_pressure_max" not in dataset:
        return lines
    meshing, pressure = pair.meshing, float(dataset["flank_pressure_max"].max())
    # a_H = 2pρ/E*; along the path |ρ_2| − ρ_1 is |T₁T₂| everywhere
    rho = float(meshing.curvature_radius(np.linspace(meshing.path_start, meshing.path_end, 9)).max())
    width, difference = 2 * pressure * rho / pair.contact_modulus, abs(meshing.tangent_length)
    if width > CONFORMING * difference:
        sizes = f"half-width of contact up to {width:.2g} mm, radii of curvature differ by {difference:.3g} mm"
        lines.append(f"conforming flanks: {sizes}; the contact law assumes at most {CONFORMING:g} of this difference")
    return lines


def _at_their_means(errors: Effect, pair: Pair) -> list[str]:
    """Warning that random errors act with their means, if these are not zero."""
    from gearbench.effects.manufacturing_errors import ManufacturingErrors

    assert isinstance(errors, ManufacturingErrors)
    largest = float(np.abs(errors.mean(pair)).max())
    said = f"random errors act with their means, up to {largest:.2g} µm: gearbench robust draws them"
    return [said] if largest else []


def _unproven(pair: Pair) -> list[str]:
    """Warnings for gears outside the range in which solid teeth were compared with finite elements."""
    lines, proof = [], "compared with finite elements"
    if pair.helix_angle > STEEPEST:
        lines.append(f"helix angle {pair.helix_angle:g}°: teeth on a ring were {proof} up to {STEEPEST:g}°")
    for name, member, gear in zip(GEARS, pair.members, pair.gears, strict=True):
        wide = gear.face_width / gear.normal_module
        if wide > WIDEST:
            lines.append(f"face of the {name} {wide:.3g} m_n wide: teeth on a ring were {proof} up to {WIDEST:g}")
        bore_or_outside = -(member.outer_diameter or math.inf) if gear.teeth < 0 else member.bore_diameter or 0.0
        rim = (member.rim_thickness or gear.root_radius - bore_or_outside / 2) / gear.normal_module
        if rim < THINNEST_RIM:
            lines.append(f"rim of the {name} {rim:.3g} m_n thick: teeth on a ring were {proof} from {THINNEST_RIM}")
    return lines
