"""Gear body of rim, web and hub, all rotationally symmetric."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gearbench.errors import InputError
from gearbench.geometry.gear import Gear


@dataclass(frozen=True, kw_only=True)
class Web:
    """Disc that carries the rim of a gear; rim and hub are as wide as the face.

    Parameters
    ----------
    rim_radius
        Inner radius of the rim, where the web ends [mm].
    hub_radius
        Outer radius of the hub; the bore radius of a gear without one [mm].
    start, stop
        Positions y over the face at which the web begins and ends [mm].
    """

    rim_radius: float
    hub_radius: float
    start: float
    stop: float

    @property
    def thickness(self) -> float:
        """Thickness of the web b_s [mm]."""
        return self.stop - self.start

    def mirrored(self, face_width: float) -> Web:
        """The web seen from the other end of the face, of the ``face_width`` [mm]."""
        return replace(self, start=face_width - self.stop, stop=face_width - self.start)


#: Least thickness of rim and web, and least height of the web [normal modules].
THINNEST = 0.05


def make_web(gear: Gear, bore: float, rim_thickness: float, thickness: float, offset: float, hub: float | None) -> Web:
    """The web of a ``gear``, checked.

    ``bore`` and ``hub`` are diameters; without a hub (None) the web reaches the bore. ``thickness`` and ``offset`` are
    those of the web, the offset from the middle of the face towards y = b. All are in mm.

    Raises
    ------
    InputError
        If the parts do not fit into each other.
    """
    b, least, rim_radius = gear.face_width, THINNEST * gear.normal_module, gear.root_radius - rim_thickness
    inner = "bore_diameter" if hub is None else "hub_diameter"
    if hub is not None and hub < bore:
        raise InputError("hub_diameter", hub, f"must be at least bore_diameter, {bore:.6g} mm")
    hub = bore if hub is None else hub
    most = gear.root_radius - hub / 2 - least
    if not least <= rim_thickness <= most:
        allowed = f"must be {least:.4g} to {most:.6g} mm, for a web between root circle and {inner}"
        raise InputError("rim_thickness", rim_thickness, allowed)
    if not least <= thickness <= b:
        raise InputError("web_thickness", thickness, f"must be {least:.4g} mm to the face width, {b:.6g} mm")
    start = 0.5 * (b - thickness) + offset
    if not -1e-9 * b <= start <= (1 + 1e-9) * b - thickness:
        furthest = 0.5 * (b - thickness)
        raise InputError("web_offset", offset, f"must be at most {furthest:.6g} mm either way, within the face")
    start = min(max(start, 0.0), b - thickness)
    return Web(rim_radius=rim_radius, hub_radius=hub / 2, start=start, stop=start + thickness)
