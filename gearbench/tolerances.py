"""Flank tolerances of cylindrical gears and parallelism of their shafts.

Sources: ISO 1328-1:1995 (grades 0–12), ISO 1328-1:2013 (classes 1–11), ISO/TR 10064-3:1996. All tolerances in µm.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Literal, get_args

from gearbench.errors import InputError

if TYPE_CHECKING:
    from gearbench.geometry.gear import Gear

Edition = Literal["1995", "2013"]


class ToleranceError(InputError):
    """Error: a gear or class is outside the scope of the standard; names the value and the allowed range."""


@dataclass(frozen=True, kw_only=True, slots=True)
class FlankTolerances:
    """Flank tolerances of one gear [µm].

    Parameters
    ----------
    single_pitch, cumulative_pitch
        f_p, F_p (2013); f_pt, F_p (1995).
    profile_slope, profile_form, profile_total
        f_Hα, f_fα, F_α.
    helix_slope, helix_form, helix_total
        f_Hβ, f_fβ, F_β. In the edition of 1995, f_Hβ and f_fβ are equal by definition.
    """

    single_pitch: float
    cumulative_pitch: float
    profile_slope: float
    profile_form: float
    profile_total: float
    helix_slope: float
    helix_form: float
    helix_total: float


@dataclass(frozen=True, kw_only=True, slots=True)
class ParallelismTolerances:
    """Parallelism of two shafts over their bearing distance L [µm].

    Parameters
    ----------
    inclination
        f_Σδ, in the common plane of the axes.
    deviation
        f_Σβ, perpendicular to it (skew).
    """

    inclination: float
    deviation: float


def flank_tolerances(
    *,
    normal_module: float,
    reference_diameter: float,
    face_width: float,
    iso_class: int,
    edition: Edition = "2013",
    teeth: int | None = None,
    helix_angle: float | None = None,
    rounded: bool = False,
) -> FlankTolerances:
    """Return the flank tolerances of a gear by ISO 1328-1.

    Both editions give class 5 by formula and step by √2 per class. The edition of 1995 evaluates its formulas at
    the geometric mean of the interval in which m, d and b lie (upper ends belong to the interval), that of 2013 at
    the actual values, with F = √(f_H² + f_f²) of unrounded terms.

    Parameters
    ----------
    normal_module, reference_diameter, face_width
        m_n, d and b [mm].
    iso_class
        Flank tolerance class, 1–11 (2013); accuracy grade, 0–12 (1995).
    edition
        ``"1995"`` or ``"2013"``.
    teeth, helix_angle
        z and β [°], only to check the scope of the edition of 2013.
    rounded
        Whether to round as the standard does, see `round_tolerance`.

    Raises
    ------
    ToleranceError
        Outside the scope that the standard itself states. 1995: 0.5 ≤ m ≤ 70, 5 ≤ d ≤ 10 000, 4 ≤ b ≤ 1000.
        2013: 0.5 ≤ m_n ≤ 70, 5 ≤ d ≤ 15 000, 4 ≤ b ≤ 1200, 5 ≤ z ≤ 1000, β ≤ 45°.
    """
    if edition not in _EDITIONS:
        raise ToleranceError("edition", edition, f"ISO 1328-1 must be one of {', '.join(get_args(Edition))}")
    (lowest, highest), scope, formulas = _EDITIONS[edition]
    _check("iso_class", iso_class, lowest, highest, edition)
    if iso_class != int(iso_class) or isinstance(iso_class, bool):
        raise ToleranceError("iso_class", iso_class, "must be a whole number")
    m, d, b = normal_module, reference_diameter, face_width
    given = {"normal_module": m, "reference_diameter": d, "face_width": b, "teeth": teeth, "helix_angle": helix_angle}
    for name, (low, high, unit) in scope.items():
        if given[name] is not None:
            _check(name, abs(given[name]) if name == "helix_angle" else given[name], low, high, edition, unit)
    step = math.sqrt(2.0) ** (iso_class - 5)
    values = [step * value for value in formulas(m, d, b)]
    return FlankTolerances(**dict(zip(_NAMES, map(round_tolerance, values) if rounded else values, strict=True)))


@lru_cache(maxsize=256, typed=True)
def gear_tolerances(gear: Gear, iso_class: int, edition: Edition = "2013", rounded: bool = False) -> FlankTolerances:
    """Return the flank tolerances [µm] of a gear; see `flank_tolerances`, which also states the errors raised."""
    return flank_tolerances(
        normal_module=gear.normal_module,
        reference_diameter=2 * abs(gear.pitch_radius),
        face_width=gear.face_width,
        iso_class=iso_class,
        edition=edition,
        teeth=abs(gear.teeth),
        helix_angle=gear.helix_angle,
        rounded=rounded,
    )


def shaft_parallelism(
    helix_total: float, face_width: float, bearing_distance: float | None = None
) -> ParallelismTolerances:
    """Return the recommended limits f_Σδ = (L/b) F_β and f_Σβ = f_Σδ/2 by ISO/TR 10064-3.

    Over the face width alone they are F_β and F_β/2 for any L.

    Parameters
    ----------
    helix_total
        F_β of the gear [µm]; for a pair, the larger of both.
    face_width, bearing_distance
        b and L [mm]; by default L = b.

    Raises
    ------
    ToleranceError
        If a value is not positive and finite.
    """
    L = face_width if bearing_distance is None else bearing_distance
    for name, value in (("helix_total", helix_total), ("face_width", face_width), ("bearing_distance", L)):
        if not 0 < value < math.inf:
            raise ToleranceError(name, value, "must be positive and finite")
    f_Σδ = L / face_width * helix_total
    return ParallelismTolerances(inclination=f_Σδ, deviation=0.5 * f_Σδ)


def round_tolerance(value: float) -> float:
    """Round a tolerance [µm] as both editions do.

    To whole micrometres above 10 µm, to 0.5 µm from 5 to 10 µm, to 0.1 µm below 5 µm; ties away from zero.
    """
    parts = 1 if value > 10 else 2 if value >= 5 else 10
    return math.floor(value * parts + 0.5) / parts


# -- the editions ------------------------------------------------------------------------------------------------------
def _class_5_of_1995(m: float, d: float, b: float) -> tuple[float, ...]:
    """ISO 1328-1:1995, 6.4: f_pt, F_p, f_Hα, f_fα, F_α, f_Hβ, f_fβ, F_β of grade 5 [µm]."""
    m, d, b = _interval_mean(m, _MODULES), _interval_mean(d, _DIAMETERS), _interval_mean(b, _WIDTHS)
    sqrt_m, sqrt_d, sqrt_b = math.sqrt(m), math.sqrt(d), math.sqrt(b)
    f_pt = 0.3 * (m + 0.4 * sqrt_d) + 4
    F_p = 0.3 * m + 1.25 * sqrt_d + 7
    f_Hα = 2 * sqrt_m + 0.14 * sqrt_d + 0.5
    f_fα = 2.5 * sqrt_m + 0.17 * sqrt_d + 0.5
    F_α = 3.2 * sqrt_m + 0.22 * sqrt_d + 0.7
    f_Hβ = f_fβ = 0.07 * sqrt_d + 0.45 * sqrt_b + 3
    F_β = 0.1 * sqrt_d + 0.63 * sqrt_b + 4.2
    return f_pt, F_p, f_Hα, f_fα, F_α, f_Hβ, f_fβ, F_β


def _class_5_of_2013(m: float, d: float, b: float) -> tuple[float, ...]:
    """ISO 1328-1:2013, 5.3: f_p, F_p, f_Hα, f_fα, F_α, f_Hβ, f_fβ, F_β of class 5 [µm]."""
    sqrt_d, sqrt_b = math.sqrt(d), math.sqrt(b)
    f_p = 0.001 * d + 0.4 * m + 5
    F_p = 0.002 * d + 0.55 * sqrt_d + 0.7 * m + 12
    f_Hα = 0.4 * m + 0.001 * d + 4
    f_fα = 0.55 * m + 5
    f_Hβ = 0.05 * sqrt_d + 0.35 * sqrt_b + 4
    f_fβ = 0.07 * sqrt_d + 0.45 * sqrt_b + 4
    return f_p, F_p, f_Hα, f_fα, math.hypot(f_Hα, f_fα), f_Hβ, f_fβ, math.hypot(f_Hβ, f_fβ)


def _interval_mean(value: float, ends: tuple[float, ...]) -> float:
    """Geometric mean of the ends of the interval (low, high] that contains the value; the first one is closed."""
    i = max(bisect_left(ends, value), 1)
    return math.sqrt(ends[i - 1] * ends[i])


def _check(name: str, value: float, low: float, high: float, edition: str, unit: str = "") -> None:
    if not low <= value <= high:  # refuses NaN too
        raise ToleranceError(name, value, f"ISO 1328-1:{edition} covers {low:g} to {high:g}{unit}")


_NAMES = tuple(field.name for field in fields(FlankTolerances))
_MODULES = (0.5, 2, 3.5, 6, 10, 16, 25, 40, 70)
_DIAMETERS = (5, 20, 50, 125, 280, 560, 1000, 1600, 2500, 4000, 6000, 8000, 10000)
_WIDTHS = (4, 10, 20, 40, 80, 160, 250, 400, 650, 1000)

_Scope = dict[str, tuple[float, float, str]]
_SCOPE_1995: _Scope = {
    "normal_module": (0.5, 70, " mm"),
    "reference_diameter": (5, 10000, " mm"),
    "face_width": (4, 1000, " mm"),
}
_SCOPE_2013: _Scope = {
    "normal_module": (0.5, 70, " mm"),
    "reference_diameter": (5, 15000, " mm"),
    "face_width": (4, 1200, " mm"),
    "teeth": (5, 1000, ""),
    "helix_angle": (0, 45, "°"),
}
_EDITIONS: dict[str, tuple[tuple[int, int], _Scope, Callable[[float, float, float], tuple[float, ...]]]] = {
    "1995": ((0, 12), _SCOPE_1995, _class_5_of_1995),
    "2013": ((1, 11), _SCOPE_2013, _class_5_of_2013),
}
