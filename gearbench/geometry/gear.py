"""One gear: sizes, and the transverse section of its teeth with involute flank and root."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.errors import InputError
from gearbench.geometry.blank import RACK, RootCurve, blank_of
from gearbench.geometry.cutter import Cutter
from gearbench.geometry.involute import inv, inverse_involute
from gearbench.geometry.section import TransverseSection

#: Thinnest neck that undercut may leave [modules].
THINNEST_NECK = 0.01


@dataclass(frozen=True, kw_only=True)
class Gear(TransverseSection):
    """Involute gear, spur or helical, external or internal. Source: ISO 21771.

    The number of teeth, all radii and half-angles ψ of an internal gear are negative; its R grows from root to tip too,
    and arcs R ψ are positive. Seen with its tip up, (R sin θ, R cos θ) is a point of either gear.

    Parameters
    ----------
    teeth, normal_module, pressure_angle, helix_angle
        Data of the transverse section.
    face_width
        b [mm].
    profile_shift, addendum, dedendum, fillet_radius
        x, h_a*, h_f* and ρ_f*, in normal modules.
    tip_rounding, tip_chamfer
        Radius of the rounding, height of the chamfer (at 45° to the flank) of the tip edge [mm].
    protuberance
        s_pr = pr_P0 − q, protuberance of the tool minus grinding stock: how much deeper the fillet is cut than the
        flank [mm].
    cutter
        Cutter of an internal gear; by default ``standard_cutter``.
    blank
        Name of the blank, see ``gearbench.geometry.blank``.

    Raises
    ------
    InputError
        If such a gear cannot be generated: rack tip pointed, tooth pointed below the tip circle, no involute left,
        tooth cut off by undercut.

    Examples
    --------
    >>> gear = Gear(
    ...     teeth=20, normal_module=2.0, pressure_angle=20.0, helix_angle=0.0, face_width=20.0,
    ...     profile_shift=0.0, addendum=1.0, dedendum=1.25, fillet_radius=0.38,
    ... )
    >>> gear.tip_radius, gear.root_radius, round(gear.base_radius, 3)
    (22.0, 17.5, 18.794)
    """

    face_width: float
    profile_shift: float
    addendum: float
    dedendum: float
    fillet_radius: float
    tip_rounding: float = 0.0
    tip_chamfer: float = 0.0
    protuberance: float = 0.0
    cutter: Cutter | None = None
    blank: str = RACK

    def __post_init__(self) -> None:
        if self.teeth < 0 and self.tip_radius > self.base_radius:
            below = (
                f"tip circle {-2 * self.tip_radius:.6g} mm is inside of the base circle {-2 * self.base_radius:.6g} mm"
            )
            raise InputError("addendum", self.addendum, f"{below}: a smaller addendum or more teeth")
        if self.root_radius * self.sign <= 0:
            raise InputError("dedendum", self.dedendum, f"root radius {self.root_radius:.4g} mm must be positive")
        _ = self.fillet  # raises an error if the cutter leaves no tooth
        if self.sign * self._half_angle_at_base <= 0 < self.sign:
            limit = -(math.pi / 2 + self.teeth * inv(self.alpha_t)) / (2 * math.tan(self.alpha_n))
            raise InputError("profile_shift", self.profile_shift, f"must be above {limit:.4g} (no tooth left)")
        if self.tip_radius <= self.form_radius:
            below = f"tip radius {self.tip_radius:.4g} mm must exceed the form radius {self.form_radius:.4g} mm"
            raise InputError("addendum", self.addendum, f"{below} (no involute left)")
        if self.tip_form_radius <= self.form_radius:
            key = "tip_rounding" if self.tip_rounding else "tip_chamfer"
            raise InputError(key, getattr(self, key), "must leave some of the involute")
        if self.sign * self.involute_half_angle(self.tip_radius) <= 0:
            assert self.pointed_radius is not None
            limit = (self.pointed_radius - self.pitch_radius) / self.normal_module - self.profile_shift
            raise InputError("addendum", self.addendum, f"pointed tip: must be below {limit:.4g}")
        if self.neck < THINNEST_NECK * self.normal_module:
            raise InputError("teeth", self.teeth, "undercut cuts the tooth off: needs more teeth or profile shift")

    # -- sizes [mm] ---------------------------------------------------------------------------------------------------
    @property
    def tip_radius(self) -> float:
        """Tip radius r_a = r + m_n (h_a* + x) [mm] (G4 of docs/theory.md)."""
        return self.pitch_radius + self.normal_module * (self.addendum + self.profile_shift)

    @property
    def tip_form_radius(self) -> float:
        """Radius at which the involute ends: r_a, or where the rounding or the chamfer of the tip begins [mm] (G17)."""
        if self.tip_rounding:
            # the arc's centre lies on the tangent of the involute's last point, ρ below it
            inner = self.roll_length(self.tip_radius - self.tip_rounding)
            return float(self.radius_at(inner + self.tip_rounding))
        return self.tip_radius - self.tip_chamfer

    @cached_property
    def root_radius(self) -> float:
        """Root radius r_f [mm]."""
        return blank_of(self.blank).root_radius(self)

    @property
    def tooth_height(self) -> float:
        """Tooth height h_e = r_a − r_f [mm]."""
        return self.tip_radius - self.root_radius

    @cached_property
    def fillet(self) -> RootCurve:
        """The curve between root circle and involute."""
        return blank_of(self.blank).root_curve(self)

    @cached_property
    def fillet_end(self) -> float:
        """Fillet parameter φ [rad] at the junction with the involute."""
        return blank_of(self.blank).junction(self)

    @property
    def is_undercut(self) -> bool:
        """Whether the cutter removes part of the involute (G7)."""
        return blank_of(self.blank).is_undercut(self)

    @cached_property
    def form_radius(self) -> float:
        """Root form radius: junction of fillet and involute [mm]."""
        at_end = float(self.fillet.radius(self.fillet_end))
        return at_end if self.teeth < 0 else max(at_end, self.base_radius)

    @cached_property
    def neck(self) -> float:
        """Smallest transverse tooth thickness of the fillet [mm]; undercut makes it thinner than the flank above."""
        phi = np.linspace(0.0, self.fillet_end, 257)
        return float(np.min(2 * self.fillet.radius(phi) * self.fillet.half_angle(phi)))

    @cached_property
    def pointed_radius(self) -> float | None:
        """Radius at which the two flanks of a tooth meet [mm]; None if they do not."""
        at_base = self._half_angle_at_base
        return None if at_base < 0 else self.base_radius / math.cos(inverse_involute(at_base))

    @cached_property
    def _half_angle_at_base(self) -> float:
        """Half tooth-thickness angle of the involute at the base circle [rad]."""
        s_over_2r = (math.pi / 2 + 2 * self.profile_shift * math.tan(self.alpha_n)) / self.teeth
        return s_over_2r + inv(self.alpha_t)

    # -- section of the tooth -----------------------------------------------------------------------------------------
    def involute_half_angle(self, radius: ArrayLike) -> NDArray:
        """Half tooth-thickness angle ψ [rad] of the involute at R [mm] (G5); below the base circle its value there."""
        radius = np.asarray(radius, dtype=float)
        r_b = self.base_radius
        tan = np.sqrt(np.maximum((radius - r_b) * (radius + r_b), 0.0)) / abs(r_b)
        return self._half_angle_at_base - (tan - np.arctan(tan))

    def load_angle(self, radius: ArrayLike) -> NDArray:
        """Load angle γ = α_R − ψ(R) [rad] between the line of action at R and the normal of the centre line."""
        radius = np.asarray(radius, dtype=float)
        return np.arccos(np.clip(self.base_radius / radius, 0.0, 1.0)) - self.involute_half_angle(radius)

    def flank_depth(self, radius: ArrayLike) -> NDArray:
        """Depth t [mm] from the flank at R to the tooth's centre line along the line of action, normal section.

        The line of action touches the base circle at T. It passes the flank at the distance ℓ from T, and the centre
        line, which is at the angle ℓ/r_b − ψ(r_b) from T, at the distance r_b tan(ℓ/r_b − ψ(r_b)).
        """
        roll, r_b = self.roll_length(radius), self.base_radius
        return (roll - r_b * np.tan(roll / r_b - self._half_angle_at_base)) * math.cos(self.beta_b)

    def half_angle(self, radius: ArrayLike) -> NDArray:
        """Half tooth-thickness angle ψ [rad] of flank and generated fillet at radius R [mm], r_f ≤ R ≤ r_a."""
        radius = np.asarray(radius, dtype=float)
        psi, below = np.array(self.involute_half_angle(radius)), radius < self.form_radius
        if below.any():
            psi[below] = self.fillet.half_angle(np.minimum(self.fillet.parameter(radius[below]), self.fillet_end))
        return psi

    @cached_property
    def root_half_angle(self) -> float:
        """Half tooth-thickness angle ψ [rad] at the root circle, where the fillet begins."""
        return float(self.fillet.half_angle(0.0))

    def transverse_thickness(self, radius: ArrayLike, *, fillet: bool = True) -> NDArray:
        """Transverse (arc) tooth thickness s_t = 2 R ψ [mm] at radius R [mm], with or without the root fillet."""
        radius = np.asarray(radius, dtype=float)
        return 2 * radius * (self.half_angle(radius) if fillet else self.involute_half_angle(radius))

    def normal_thickness(self, radius: ArrayLike, *, fillet: bool = True) -> NDArray:
        """Normal tooth thickness s_n = s_t cos β(R), tan β(R) = R tan β / r [mm]."""
        radius = np.asarray(radius, dtype=float)
        tan = radius * math.tan(self.beta) / self.pitch_radius
        return self.transverse_thickness(radius, fillet=fillet) / np.sqrt(1 + tan**2)

    def flank_points(self, n_flank: int = 40, n_fillet: int = 20) -> NDArray:
        """Right flank from root circle to tip circle, tooth centre line on +y: (n_fillet + n_flank − 1, 2) [mm]."""
        phi = np.linspace(0.0, self.fillet_end, n_fillet)
        roll = [float(self.roll_length(r)) for r in (self.form_radius, self.tip_radius)]
        flank = self.radius_at(np.linspace(roll[0], roll[1], n_flank)[1:])
        radius = np.concatenate([self.fillet.radius(phi), flank])
        psi = np.concatenate([self.fillet.half_angle(phi), self.involute_half_angle(flank)])
        return np.column_stack([radius * np.sin(psi), radius * np.cos(psi)])
