"""Tooth thickness as given on drawings: span, dimension over balls or pins, deviations.

Source: ISO 21771, DIN 3960.
"""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.errors import InputError
from gearbench.geometry.involute import inv, inverse_involute
from gearbench.geometry.section import TransverseSection
from gearbench.schema import STRICT

#: A deviation of a size [µm].
Deviation = Annotated[float, Field(ge=-5000.0, le=5000.0)]
Size = Annotated[float, Field(gt=0.0, le=40000.0)]

_MICROMETRE = 1e-3  # mm


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Thickness:
    """Tooth thickness of a gear: a measured size, deviations, or both; computed at the middle of the deviations.

    Parameters
    ----------
    span
        W_k, base tangent length over k = ``span_teeth`` teeth [mm].
    span_teeth
        k.
    over_balls, over_pins
        M_dK or M_dR over two balls or pins of ``measuring_diameter``, between them for an internal gear [mm]. They
        differ for helical gears with an odd number of teeth.
    measuring_diameter
        D_M [mm].
    upper, lower
        Deviations of the size above, or of the normal tooth thickness (A_sne, A_sni) [µm]; negative: a thinner tooth.
    """

    span: Size | None = None
    span_teeth: Annotated[int, Field(ge=1, le=2000)] | None = None
    over_balls: Size | None = None
    over_pins: Size | None = None
    measuring_diameter: Size | None = None
    upper: Deviation = 0.0
    lower: Deviation = 0.0

    def __post_init__(self) -> None:
        sizes = [name for name in ("span", "over_balls", "over_pins") if getattr(self, name) is not None]
        if len(sizes) > 1:
            raise InputError(sizes[1], getattr(self, sizes[1]), f"conflicts with {sizes[0]}: give one of the two")
        for key, needs in (("span_teeth", ("span",)), ("measuring_diameter", ("over_balls", "over_pins"))):
            is_needed, value = bool(sizes) and sizes[0] in needs, getattr(self, key)
            if is_needed and value is None:
                raise InputError(key, "missing", f"is required with {sizes[0]}")
            if value is not None and not is_needed:
                raise InputError(key, value, f"belongs to {' or '.join(needs)}")
        if self.lower > self.upper:
            raise InputError("lower", self.lower, f"must be at most upper, {self.upper:g}")

    @property
    def is_measured(self) -> bool:
        """Whether a measured size is given; the profile shift then follows from it."""
        return self.span is not None or self._over is not None

    @property
    def middle(self) -> float:
        """Middle of the two deviations [µm]."""
        return (self.upper + self.lower) / 2

    def ends(self, section: TransverseSection) -> tuple[float, float]:
        """Deviations [µm] of the thickest and the thinnest tooth.

        Between balls in an internal gear a larger size means a thinner tooth.
        """
        larger_is_thinner = section.teeth < 0 and self._over is not None
        return (self.lower, self.upper) if larger_is_thinner else (self.upper, self.lower)

    @property
    def _over(self) -> float | None:
        """Dimension over balls or pins, whichever is given [mm]."""
        return self.over_balls if self.over_pins is None else self.over_pins

    def shift(self, section: TransverseSection, nominal: float, deviation: float = 0.0) -> float:
        """Profile shift [normal modules] of a tooth whose size has the ``deviation`` [µm] (G13, G14, G15).

        ``nominal``: x without deviation, used if no measured size is given.

        Raises
        ------
        InputError
            If no tooth can have this size.
        """
        m, alpha, change = section.normal_module, section.alpha_n, _MICROMETRE * deviation
        if self.span is not None and self.span_teeth is not None:
            if section.teeth < 0:
                raise InputError("span", self.span, "belongs to an external gear: give over_balls")
            unshifted = span(section, 0.0, self.span_teeth)
            return (self.span + change - unshifted) / (2 * m * math.sin(alpha))
        if self._over is not None and self.measuring_diameter is not None:
            return self._shift_over(section, self._over + change, self.measuring_diameter)
        return nominal + change / (2 * m * math.tan(alpha))

    def _shift_over(self, section: TransverseSection, size: float, diameter: float) -> float:
        """Profile shift from the ``size`` [mm] over balls or pins of a ``diameter`` [mm]."""
        key = "over_balls" if self.over_pins is None else "over_pins"
        chord = _chord(section, pins=self.over_pins is not None)
        radius = (math.copysign(size, section.teeth) - diameter) / 2 / chord
        if abs(radius) <= abs(section.base_radius):
            least = abs(2 * section.base_radius * chord + diameter)
            raise InputError(key, size, f"must exceed {least:.6g} mm, at which balls or pins touch the base circle")
        z, m, alpha = section.teeth, section.normal_module, section.alpha_n
        # (G14) solved for x
        half = (
            inv(math.acos(section.base_radius / radius)) - inv(section.alpha_t) - diameter / (m * z * math.cos(alpha))
        )
        return (z * half + math.pi / 2) / (2 * math.tan(alpha))


def span(section: TransverseSection, shift: float, teeth: int) -> float:
    """Base tangent length W_k [mm] over ``teeth`` teeth of a gear with profile shift x (G13).

    Examples
    --------
    >>> gear = TransverseSection(teeth=24, normal_module=3.0, pressure_angle=20.0, helix_angle=0.0)
    >>> round(span(gear, 0.4, 4), 4)  # KHK Gear Technical Reference, table 5.10
    32.8266
    """
    m, alpha = section.normal_module, section.alpha_n
    base = (teeth - 0.5) * math.pi + section.teeth * inv(section.alpha_t)
    return m * math.cos(alpha) * base + 2 * shift * m * math.sin(alpha)


def over_balls(section: TransverseSection, shift: float, diameter: float, *, pins: bool = False) -> float:
    """Dimension M_dK over two balls, or M_dR over two pins, of ``diameter`` D_M [mm] (G14).

    It is negative for internal gears (measured between the balls).

    Raises
    ------
    InputError
        If the balls are too thin to touch both flanks of a tooth space.
    """
    z, m, alpha = section.teeth, section.normal_module, section.alpha_n
    value = (
        diameter / (m * z * math.cos(alpha)) - (math.pi / 2 - 2 * shift * math.tan(alpha)) / z + inv(section.alpha_t)
    )
    if value <= 0:
        raise InputError("measuring_diameter", diameter, "must be larger, to touch both flanks of a space")
    radius = section.base_radius / math.cos(inverse_involute(value))
    return 2 * radius * _chord(section, pins=pins) + diameter


def _chord(section: TransverseSection, *, pins: bool) -> float:
    """Distance of two opposite balls divided by the diameter of their circle; 1 for pins of helical gears."""
    if section.teeth % 2 == 0 or (pins and section.helix_angle):
        return 1.0
    return math.cos(math.pi / (2 * section.teeth))
