"""Internal gears cut by a pinion-type cutter: root circle, and fillet as the envelope of the cutter's tip rounding.

The cutter rolls without backlash in the ring. The origin is on the ring's axis, and y points to the tip of the ring's
tooth. The pitch point lies at y = r_w2 and the cutter's axis at y = a_0 = r_w2 + r_w0. r_w2, a_0 and the tooth number
z_2 are negative (ISO 21771). A point of the rounding touches the envelope when its normal passes through the pitch
point. φ is the angle of this normal from −y. The centre of the rounding, at the radius r_c of the cutter, has the
distance t from the pitch point, and the envelope point is (x, y) (G18 of docs/theory.md):

    t = √(r_c² − r_w0² sin²φ) − r_w0 cos φ,    x = −(t + ρ) sin φ,    y = r_w2 − (t + ρ) cos φ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass as checked

from gearbench.errors import InputError
from gearbench.geometry.involute import inv, inverse_involute
from gearbench.geometry.ring_conditions import fouling_room
from gearbench.geometry.section import TransverseSection
from gearbench.schema import STRICT

if TYPE_CHECKING:
    from gearbench.geometry.gear import Gear

#: Default tip rounding of a cutter [modules], if it fits.
STANDARD_ROUNDING = 0.2
#: Default number of cutter teeth: ``FEWER`` than the ring, so that it can be fed radially, within ``STANDARD_TEETH``,
#: but always at least ``LEAST_FEWER`` than the ring.
FEWER, STANDARD_TEETH, LEAST_FEWER = 20, (15, 60), 8


@checked(frozen=True, kw_only=True, config=STRICT)
class Cutter:
    """Pinion-type cutter of an internal gear; ``dedendum`` and ``fillet_radius`` are its addendum and tip rounding.

    Parameters
    ----------
    teeth
        z_0.
    profile_shift
        x_0 [normal modules]: positive for a new cutter, smaller after regrinding.
    """

    teeth: Annotated[int, Field(ge=5, le=1000)]
    profile_shift: Annotated[float, Field(ge=-2.0, le=2.0)] = 0.0


def standard_cutter(teeth: int) -> Cutter:
    """Default cutter for a ring of ``teeth``: 20 teeth fewer, within 15 to 60, at least 8 fewer; no profile shift."""
    low, high = STANDARD_TEETH
    return Cutter(teeth=min(max(abs(teeth) - FEWER, low), high, abs(teeth) - LEAST_FEWER))


@dataclass(frozen=True, kw_only=True)
class Rounding:
    """Rounded corner of a cutter's tooth, in its transverse section.

    Parameters
    ----------
    section
        The cutter.
    tip_radius, radius
        r_a0 and ρ_a0 [mm].
    half_angle_at_base
        Half-angle of the cutter's tooth at its base circle [rad].
    """

    section: TransverseSection
    tip_radius: float
    radius: float
    half_angle_at_base: float

    @property
    def centre_radius(self) -> float:
        """r_c [mm]."""
        return self.tip_radius - self.radius

    @property
    def half_angle(self) -> float:
        """Angle ψ_c of the rounding's centre from the middle of the tooth [rad]; negative if it does not fit."""
        r_b = self.section.base_radius
        return self.half_angle_at_base - self.radius / r_b - inv(math.acos(min(r_b / self.centre_radius, 1.0)))

    @property
    def start(self) -> float:
        """Roll length at which the cutter's involute ends [mm]."""
        return float(self.section.roll_length(self.centre_radius)) + self.radius


def rounding(ring: TransverseSection, cutter: Cutter, sizes: tuple[float, float]) -> Rounding:
    """Tip rounding of the ``cutter`` of a ring; ``sizes`` are addendum and tip radius of the cutter [normal modules].

    Raises
    ------
    InputError
        If the rounding reaches below the base circle of the cutter.
    """
    height, radius = sizes
    m, x0 = ring.normal_module, cutter.profile_shift
    section = TransverseSection(
        teeth=cutter.teeth, normal_module=m, pressure_angle=ring.pressure_angle, helix_angle=ring.helix_angle
    )
    at_base = (math.pi / 2 + 2 * x0 * math.tan(ring.alpha_n)) / cutter.teeth + inv(ring.alpha_t)
    tip = section.pitch_radius + m * (height + x0)
    corner = Rounding(section=section, tip_radius=tip, radius=radius * m, half_angle_at_base=at_base)
    if corner.centre_radius <= section.base_radius:
        raise InputError("fillet_radius", radius, "reaches below the base circle of the cutter: must be smaller")
    return corner


def standard_rounding(ring: TransverseSection, cutter: Cutter, height: float) -> float:
    """Default tip radius of a cutter [normal modules]: 0.2, or the largest that fits (a full rounding) if smaller."""
    if rounding(ring, cutter, (height, STANDARD_ROUNDING)).half_angle >= 0:
        return STANDARD_ROUNDING
    if rounding(ring, cutter, (height, 0.0)).half_angle <= 0:
        raise InputError("dedendum", height, f"the cutter with {cutter.teeth} teeth is pointed: must be smaller")
    from scipy.optimize import root_scalar

    def half_angle(radius: float) -> float:
        return rounding(ring, cutter, (height, radius)).half_angle

    largest = root_scalar(half_angle, bracket=(0.0, STANDARD_ROUNDING), method="brentq", xtol=1e-14).root
    return max(float(largest) - 1e-12, 0.0)


@dataclass(frozen=True, kw_only=True)
class CutterPath:
    """Root curve of an internal gear generated by a pinion-type cutter, in the transverse section.

    Parameters
    ----------
    teeth
        z of the gear, negative.
    base_radius
        r_b of the gear, negative [mm].
    tool
        Rounding of the cutter.
    pressure_angle
        α_w0 of gear and cutter [rad].
    """

    teeth: int
    base_radius: float
    tool: Rounding
    pressure_angle: float

    @property
    def phi_end(self) -> float:
        """φ at which the root curve ends and the involute begins [rad]."""
        return math.pi / 2 - self.pressure_angle

    @cached_property
    def distance(self) -> float:
        """Centre distance a_0 of gear and cutter [mm]."""
        return (self.base_radius + self.tool.section.base_radius) / math.cos(self.pressure_angle)

    @property
    def root_radius(self) -> float:
        """r_f = a_0 − r_a0 [mm]."""
        return self.distance - self.tool.tip_radius

    @cached_property
    def _pitch_radii(self) -> tuple[float, float]:
        """r_w0 of the cutter and r_w2 of the gear [mm]."""
        cos = math.cos(self.pressure_angle)
        return self.tool.section.base_radius / cos, self.base_radius / cos

    @property
    def generated_tip(self) -> float:
        """Radius [mm] cut by the start of the cutter's involute at its base circle; tips inside it are removed."""
        return -math.hypot(self.base_radius, self.distance * math.sin(self.pressure_angle))

    def _lengths(self, phi: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """T = t + ρ, dT/dφ and the increase of T since φ = 0, without cancellation."""
        (r_w0, _), r_c = self._pitch_radii, self.tool.centre_radius
        sin, cos = np.sin(phi), np.cos(phi)
        root = np.sqrt(r_c**2 - (r_w0 * sin) ** 2)
        grown = 2 * r_w0 * np.sin(phi / 2) ** 2 - (r_w0 * sin) ** 2 / (root + r_c)
        slope = r_w0 * sin - r_w0**2 * sin * cos / root
        return self.tool.tip_radius - r_w0 + grown, slope, grown

    def _rise(self, phi: NDArray) -> tuple[NDArray, NDArray]:
        """R² − r_f² and its derivative, without cancellation at the root circle."""
        (r_w0, r_w2), half = self._pitch_radii, np.sin(phi / 2) ** 2
        T, dT, grown = self._lengths(phi)
        T_0 = self.tool.tip_radius - r_w0
        rise = grown * (T + T_0) - 2 * r_w2 * (grown - 2 * T * half)
        return rise, 2 * T * dT - 2 * r_w2 * (dT * np.cos(phi) - T * np.sin(phi))

    def radius(self, phi: ArrayLike) -> NDArray:
        """Radius R [mm] at φ."""
        return -np.sqrt(self.root_radius**2 + self._rise(np.asarray(phi, float))[0])

    def half_angle(self, phi: ArrayLike) -> NDArray:
        """Half-angle ψ of the tooth [rad] at φ."""
        return self.along(np.asarray(phi, dtype=float))[2]

    def along(self, phi: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """R − r_f [mm], dR/dφ, ψ and dψ/dφ."""
        (r_w0, r_w2), rho = self._pitch_radii, self.tool.radius
        sin, cos = np.sin(phi), np.cos(phi)
        (T, dT, _), (rise, d_rise) = self._lengths(phi), self._rise(phi)
        R = self.radius(phi)
        x, y = -T * sin, r_w2 - T * cos
        dx, dy = -dT * sin - T * cos, T * sin - dT * cos
        # centre of the rounding relative to the axis of the cutter; its direction tells how far the cutter has turned
        t = T - rho
        c_x, c_y = -t * sin, r_w0 + t * cos
        direction = np.arctan2(c_x, c_y)
        d_direction = ((-dT * sin - t * cos) * c_y - c_x * (dT * cos - t * sin)) / (c_x**2 + c_y**2)
        ratio = self.tool.section.teeth / self.teeth
        psi = np.arctan2(-x, -y) - (direction + self.tool.half_angle) * ratio + math.pi / self.teeth
        d_psi = (dx * y - x * dy) / R**2 - d_direction * ratio
        return rise / (R + self.root_radius), d_rise / (2 * R), psi, d_psi

    def parameter(self, radius: ArrayLike) -> NDArray:
        """φ [rad] of the point at R [mm]; clipped beyond the ends. Newton's method from a table, to rounding."""
        R, r_f = np.asarray(radius, dtype=float), self.root_radius
        target = np.sqrt(np.maximum((r_f - R) * (r_f + R), 0.0))
        table = np.linspace(0.0, self.phi_end, 65)
        phi = np.interp(target, self._chord(table), table)
        for _ in range(6):
            rise, slope = self._rise(np.maximum(phi, 1e-9))
            chord = np.sqrt(np.maximum(-rise, 1e-300))
            phi = np.clip(phi + (chord - target) * 2 * chord / slope, 0.0, self.phi_end)
        return phi

    def is_monotone(self) -> bool:
        """Whether R changes monotonically along the whole curve, from the root circle to the involute."""
        return bool(np.all(np.diff(self._chord(np.linspace(0.0, self.phi_end, 257))) > 0))

    def _chord(self, phi: NDArray) -> NDArray:
        """√(r_f² − R²), smooth in φ."""
        return np.sqrt(np.maximum(-self._rise(phi)[0], 0.0))


@dataclass(frozen=True)
class PinionCut:
    """An internal gear cut by a pinion-type cutter; its body is held at the outer diameter."""

    def root_radius(self, gear: Gear) -> float:
        """r_f = a_0 − r_a0 [mm], not r − m_n (h_f* − x)."""
        return self.root_curve(gear).root_radius

    def root_curve(self, gear: Gear) -> CutterPath:
        """Envelope of the cutter's tip rounding."""
        return _path(gear)

    def junction(self, gear: Gear) -> float:
        """Parameter φ at which the involute begins."""
        return gear.fillet.phi_end

    def is_undercut(self, gear: Gear) -> bool:
        """False: the cutter's tip moves away from the flank of a ring."""
        return False

    def support(self, gear: Gear, diameter: float) -> float:
        """Outer radius as a negative number, −D/2 [mm]."""
        least = LEAST_OUTSIDE * 2 * abs(gear.root_radius)
        if diameter < least:
            raise InputError("outer_diameter", diameter, f"must be at least {least:.6g} mm, the root circle")
        return -diameter / 2


#: Smallest ratio of outer diameter to root circle of a ring.
LEAST_OUTSIDE = 1.001


def _path(gear: Gear) -> CutterPath:
    """Path of the gear's cutter; refuses cutters that leave no root, overlap, trim the tips or foul them."""
    cutter = gear.cutter or standard_cutter(gear.teeth)
    total = gear.teeth + cutter.teeth
    if total >= 0:
        raise InputError("cutter.teeth", cutter.teeth, f"must be fewer than the {-gear.teeth} teeth of the ring")
    tool = rounding(gear, cutter, (gear.dedendum, gear.fillet_radius))
    if tool.half_angle < -1e-12:
        most = "must be smaller: the two roundings of the cutter's tooth overlap"
        raise InputError("fillet_radius", gear.fillet_radius, most)
    involute = inv(gear.alpha_t) + 2 * (cutter.profile_shift + gear.profile_shift) * math.tan(gear.alpha_n) / total
    if involute <= 0:
        allowed = "too large for this cutter: their shifts leave no working pressure angle"
        raise InputError("profile_shift", gear.profile_shift, allowed)
    path = CutterPath(
        teeth=gear.teeth, base_radius=gear.base_radius, tool=tool, pressure_angle=inverse_involute(involute)
    )
    if not path.is_monotone():
        raise InputError("fillet_radius", gear.fillet_radius, "the cutter leaves no root: must be larger")
    room = _tips_room(gear, cutter, path)
    if gear.tip_radius > path.generated_tip:
        inner, limit = 2 * abs(gear.tip_radius), 2 * abs(path.generated_tip)
        allowed = f"its cutter ({cutter.teeth} teeth) trims tip circles below {limit:.6g} mm, this is {inner:.6g} mm"
        raise InputError("addendum", gear.addendum, f"{allowed}: a smaller addendum or a cutter with more teeth")
    if room < 0:
        allowed = f"fouls the tips of the ring by {-room:.3g} mm: must have fewer teeth"
        raise InputError("cutter.teeth", cutter.teeth, allowed)
    return path


def _tips_room(gear: Gear, cutter: Cutter, path: CutterPath) -> float:
    """Clearance between the ring's tips and the cutter's tip roundings off the path of contact [mm] (G19)."""
    tool = path.tool
    turn = np.linspace(0.0, math.pi / 2, 33)
    x, y = tool.radius * np.sin(turn), tool.centre_radius + tool.radius * np.cos(turn)
    half_space = math.pi / -gear.teeth + float(gear.involute_half_angle(gear.tip_radius))
    points = np.hypot(x, y), tool.half_angle + np.arctan2(x, y)
    return fouling_room(points, cutter.teeth / -gear.teeth, -path.distance, -gear.tip_radius, half_space)
