"""Transverse section of the meshed body and its exact boundary curves.

Polar coordinates: radius R and angle θ, clockwise from the centre line (+y axis) of the loaded tooth, so that the
tooth's right flank, the loaded one, is at θ > 0. Tooth d stands at θ = 2πd/z. Radii and angles of an internal gear are
negative (``gearbench.geometry.gear``): R grows from the outside, where it is held, to the tips, arcs R θ are as above.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.compliance.lugs import Lugs
from gearbench.errors import GearbenchError, InputError
from gearbench.geometry.gear import Gear
from gearbench.geometry.web import Web


class Side(IntEnum):
    """The two flanks of a tooth, its tip up; the value is the sign of the angle θ from the tooth's centre line."""

    LEFT = -1
    RIGHT = 1

    @property
    def label(self) -> str:
        """Name of its boundaries: left, right."""
        return self.name.lower()


class MeshingError(GearbenchError):
    """The body cannot be meshed."""


@dataclass(frozen=True, kw_only=True)
class Body:
    """The part of a gear that is meshed.

    Parameters
    ----------
    gear
        The gear.
    bore_radius
        None: one tooth alone, cut out and clamped along the root circle R = r_f between the feet of its two fillets.
        Otherwise a sector of the gear down to the bore [mm], clamped at the bore; out to the outside, a negative
        radius, of an internal gear.
    web
        Rim, web and hub between root circle and bore, seen as on a driving gear; None if all of the body is as wide as
        the face.
    teeth
        Number of neighbouring teeth on the sector, odd, the loaded one in the middle; ``gear.teeth`` makes the
        whole gear.
    support
        Stiffness of springs at the bore or outside, radial and along it [N/mm³], both 0 of a free ring; None where it
        is held firmly. Of the condensed sector only.
    lugs
        Lugs that hold a ring which is free besides.
    rest
        The gear beyond the sector: "ring", the body without teeth, or "free", nothing. Only the ring keeps the
        stiffness of the body: five teeth of a solid gear with free cuts are half as stiff as they should be.

    Raises
    ------
    InputError
        If the sector does not exist.
    """

    gear: Gear
    bore_radius: float | None = None
    web: Web | None = None
    teeth: int = 1
    support: tuple[float, float] | None = None
    lugs: Lugs | None = None
    rest: Literal["ring", "free"] = "ring"

    def __post_init__(self) -> None:
        z, r_f = self.gear.teeth, self.gear.root_radius
        if self.bore_radius is None:
            if self.teeth != 1:
                raise InputError("teeth", self.teeth, "must be 1 for a tooth alone (no bore_radius)")
            return
        if z < 0:
            if not self.bore_radius <= 1.001 * r_f:
                raise InputError("bore_radius", self.bore_radius, f"must be at most {1.001 * r_f:.6g} mm (root circle)")
        elif not 0 < self.bore_radius <= 0.999 * r_f:
            raise InputError("bore_radius", self.bore_radius, f"must lie in (0, {0.999 * r_f:.6g}] mm (root circle)")
        z = abs(z)
        if not (self.teeth == z or (self.teeth % 2 == 1 and 1 <= self.teeth <= z - 2)):
            raise InputError("teeth", self.teeth, f"must be odd and at most {z - 2}, or all {z} teeth")

    @property
    def closed(self) -> bool:
        """Whether the whole gear is modelled."""
        return self.bore_radius is not None and self.teeth == abs(self.gear.teeth)

    @property
    def axis_breaks(self) -> tuple[float, ...]:
        """Positions along the face width at which the body changes: its ends and the faces of the web [mm]."""
        b = self.gear.face_width
        if self.web is None:
            return 0.0, b
        least = 1e-6 * b  # a web that is flush with a face
        inner = [y for y in (self.web.start, self.web.stop) if least < y < b - least]
        return 0.0, *inner, b

    @property
    def web_piece(self) -> int:
        """Piece between ``axis_breaks`` that is the web."""
        assert self.web is not None
        return int(self.web.start > 1e-6 * self.gear.face_width)

    @property
    def offsets(self) -> range:
        """Numbers d of the teeth, 0 the loaded one."""
        first = -(self.teeth // 2) if not self.closed else -((self.teeth - 1) // 2)
        return range(first, first + self.teeth)

    @property
    def pitch_angle(self) -> float:
        """Angular pitch 2π/z [rad]."""
        return 2 * math.pi / self.gear.teeth

    @property
    def held(self) -> str:
        """Name of the clamped boundary."""
        return "clamp" if self.bore_radius is None else "bore"

    @property
    def rest_angles(self) -> tuple[float, ...]:
        """Angles θ [rad] where the ring that closes the gear is divided, from the right cut round to the left one.

        The first and last part are about as long as the depth of the body.
        """
        psi = float(self.gear.half_angle(self.junction_radius))
        start = (self.offsets[-1] + 1) * self.pitch_angle - psi
        sign = self.gear.sign
        end = 2 * math.pi * sign + (self.offsets[0] - 1) * self.pitch_angle + psi
        near = sign * min(abs(end - start) / 4, abs(1 - (self.bore_radius or 0.0) / self.gear.root_radius))
        return start, start + near, 0.5 * (start + end), end - near, end

    # -- curves -------------------------------------------------------------------------------------------------------
    @cached_property
    def junction_radius(self) -> float:
        """Radius R_j on the fillet where the blocks of tooth, rim and gap meet (rim models) [mm]."""
        return float(self._radius_at(0.55 * self._chord(self.gear.form_radius)))

    def _chord(self, radius: ArrayLike) -> NDArray:
        """c = √|R² − r_f²|, in which the fillet is smooth down to the root circle."""
        r_f, radius = self.gear.root_radius, np.asarray(radius, dtype=float)
        return np.sqrt(np.maximum(self.gear.sign * (radius - r_f) * (radius + r_f), 0.0))

    def _radius_at(self, chord: ArrayLike) -> NDArray:
        r_f, sign = self.gear.root_radius, self.gear.sign
        return sign * np.sqrt(r_f**2 + sign * np.square(chord))

    def fillet(self, low: float, high: float, n: int = 24) -> tuple[NDArray, NDArray]:
        """Points (R, ψ) of the fillet between two radii, evenly in c."""
        radius = self._radius_at(np.linspace(self._chord(low), self._chord(high), n))
        radius[0], radius[-1] = low, high
        return radius, self.gear.half_angle(radius)

    def involute(self, n: int = 24) -> tuple[NDArray, NDArray]:
        """Points (R, ψ) of the involute flank, evenly in the roll angle."""
        gear = self.gear
        ends = gear.roll_length([gear.form_radius, gear.tip_radius])
        radius = gear.radius_at(np.linspace(ends[0], ends[1], n))
        radius[0], radius[-1] = gear.form_radius, gear.tip_radius
        return radius, gear.half_angle(radius)

    # -- exact positions of boundary nodes -----------------------------------------------------------------------------
    def snap(self, boundary: str, R: NDArray, theta: NDArray, ends: tuple[NDArray, NDArray] | None = None) -> tuple:
        """Move points (R, θ) that belong to a named boundary exactly onto it.

        ``ends``: for the middles of edges, radii of the two ends; the middle is then placed so that quadratic edges
        at the foot of the fillet, where it is tangent to the root circle, keep a positive Jacobian.
        """
        name, d = split_name(boundary)
        gear = self.gear
        exact = {"tip": gear.tip_radius, "clamp": gear.root_radius, "root": gear.root_radius, "bore": self.bore_radius}
        exact["rest"] = self.junction_radius if name == "rest" else None
        if name in exact:
            return np.full_like(R, exact[name]), theta
        if not name.endswith(("flank", "fillet")):
            return R, theta
        if ends is not None and name.endswith("fillet"):
            low, high = sorted_pair(self._chord(ends[0]), self._chord(ends[1]))
            middle = 0.5 * (low + high)
            R = self._radius_at(np.where(low < 1e-6 * gear.root_radius, 0.6 * high, middle))
        low, high = (
            (gear.root_radius, gear.form_radius) if name.endswith("fillet") else (gear.form_radius, gear.tip_radius)
        )
        R = np.clip(R, low, high)
        psi = gear.half_angle(R)
        return R, d * self.pitch_angle + (psi if name.startswith(Side.RIGHT.label) else -psi)


def check_section(body: Body) -> None:
    """Refuse a section that crosses itself, naming the curves.

    The flanks are functions ψ(R), so the outline is simple exactly if 0 < ψ(R) everywhere and ψ ≤ π/z at the root,
    without their signs.
    """
    gear = body.gear
    R = np.concatenate([body.fillet(gear.root_radius, gear.form_radius, 200)[0], body.involute(200)[0]])
    psi, pitch = gear.sign * gear.half_angle(R), abs(body.pitch_angle)
    if not np.all(np.isfinite(psi)) or psi.min() <= 1e-6 * pitch:
        at = R[int(np.argmin(np.nan_to_num(psi, nan=-1.0)))]
        raise MeshingError(f"the flanks of the tooth cross at R = {at:.6g} mm (pointed, or cut off by undercut)")
    on_fillet = gear.form_radius >= R
    if psi[on_fillet].max() > 0.5 * pitch * (1 + 1e-9):
        raise MeshingError("the fillets of neighbouring teeth cross")


def polar(xy: NDArray) -> tuple[NDArray, NDArray]:
    """Radius [mm] and angle, clockwise from the y axis [rad], of points (2, …)."""
    return np.hypot(xy[0], xy[1]), np.arctan2(xy[0], xy[1])


def sorted_pair(a: NDArray, b: NDArray) -> tuple[NDArray, NDArray]:
    """Elementwise smaller and larger."""
    return np.minimum(a, b), np.maximum(a, b)


def split_name(boundary: str) -> tuple[str, int]:
    """Name and tooth number of a boundary: "right_flank+1" is ("right_flank", 1)."""
    for sign in "+-":
        name, _, number = boundary.partition(sign)
        if number:
            return name, int(sign + number)
    return boundary, 0


def on_tooth(name: str, d: int) -> str:
    """Name of a boundary of tooth d: plain for the loaded tooth, "…+1", "…-1" for its neighbours."""
    return f"{name}{d:+d}" if d else name
