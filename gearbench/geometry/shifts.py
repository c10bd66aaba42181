"""Profile shifts of two gears, and the backlash that follows, from thickness and centre distance. Source: ISO 21771."""

from __future__ import annotations

import math

from gearbench.errors import naming
from gearbench.geometry.meshing import profile_shift_sum
from gearbench.geometry.names import GEARS
from gearbench.geometry.section import TransverseSection
from gearbench.geometry.thickness import Thickness

Sections = tuple[TransverseSection, TransverseSection]
Thicknesses = tuple[Thickness | None, Thickness | None]


def given_shift(
    section: TransverseSection, index: int, given: float | None, thickness: Thickness | None
) -> float | None:
    """x as given, or from a size of the teeth; None without either [normal modules]."""
    if given is not None or thickness is None or not thickness.is_measured:
        return given
    return _of_thickness(section, index, thickness, 0.0, 0.0)


def generating_shifts(
    sections: Sections, shifts: tuple[float, float], thicknesses: Thicknesses, deviations: tuple[float, float]
) -> tuple[float, float]:
    """x_E of both gears [normal modules] with the ``deviations`` [µm] of their thickness; ``shifts`` are x.

    Raises
    ------
    InputError
        If no tooth has such a size.
    """
    generating = []
    for index, (x, thickness, deviation) in enumerate(zip(shifts, thicknesses, deviations, strict=True)):
        shift = x if thickness is None else _of_thickness(sections[index], index, thickness, x, deviation)
        generating.append(shift)
    return generating[0], generating[1]


def _of_thickness(
    section: TransverseSection, index: int, thickness: Thickness, nominal: float, deviation: float
) -> float:
    """``Thickness.shift``; errors name the gear."""
    with naming(below=f"{GEARS[index]}.thickness"):
        return thickness.shift(section, nominal, deviation)


def backlash(sections: Sections, shifts: tuple[float, float], distance: float) -> float:
    """Circumferential backlash j_wt [mm] at the working pitch circles of teeth with the shifts x_E (G3)."""
    one, two = sections
    excess = profile_shift_sum(sections, distance) - sum(shifts)
    return 4 * distance * math.tan(one.alpha_n) / (one.teeth + two.teeth) * excess
