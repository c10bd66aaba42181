"""Stiffness of one pair at the pitch point on rims of several depths, by plane-strain FE of another program.

Published for z 17/43, m = 1, x = 0, α = 20°, h_a* = 1, h_f* = 1.25, ρ_f* = 0.38, E = 206 GPa, ν = 0.3, bores held, at
about 275 N/mm. Of all rows the same 0.0155 µm per N/mm are left beyond the displacements of the two centre lines: what
Weber and Banaschek give for the compression between flank and centre line at that load, as a secant. Their tangent is
0.0028 less (half of 4(1−ν²)/(πE)): with it the pair comes out 2.5 to 5 % too stiff. The compression of the real tooth,
which is no half-space, is 0.0174.
"""

from __future__ import annotations

import math
from functools import cache

import pytest

from fem_reference.section import Body
from gearbench.effects.hertz import Hertz
from gearbench.geometry.action import contact_lines
from gearbench.geometry.material import Material
from gearbench.geometry.pair import Member, Pair
from tests.support.plane_strain import centre_line_compliance
from tests.support.strips import Strip, solve_strip

LINE_LOAD = 275.0
#: Rims of both gears [mm] and stiffness [N/(mm·µm)].
PUBLISHED = {(2.07, 5.79): 17.06, (3.63, 10.13): 14.61, (5.44, 15.19): 10.10, (2.70, 2.70): 17.53}
RIMS = pytest.mark.parametrize("rims", PUBLISHED)
PINION, WHEEL = (Member(teeth=z, addendum=1.0, dedendum=1.25) for z in (17, 43))
STEEL = Material(youngs_modulus=206.0)
PAIR = Pair(
    normal_module=1.0,
    pressure_angle=20.0,
    helix_angle=0.0,
    face_width=1.0,
    centre_distance=30.0,
    pinion=PINION,
    wheel=WHEEL,
    material=STEEL,
)


@cache
def law() -> tuple[float, float, float]:
    """a, h and half-width a_H [mm] at the pitch point: q (a − h ln q) between flanks and centre lines."""
    meshing = PAIR.meshing
    phase = (meshing.pitch_point - meshing.path_start) / meshing.base_pitch
    lines = contact_lines(PAIR, phase % 1, 1)
    found, pair = Hertz().compliance(lines, {}), math.floor(phase) - lines.index[0]
    rho = float(meshing.curvature_radius(meshing.pitch_point))
    half_width = math.sqrt(8 * LINE_LOAD * rho / (math.pi * STEEL.plane_strain_modulus))
    return float(found.a[0, pair, 0]), float(found.h[0, pair, 0]), half_width


def bodies(rims: tuple[float, float]) -> list[Body]:
    """Both gears."""
    pairs = zip(PAIR.gears, rims, strict=True)
    return [Body(gear=gear, bore_radius=gear.root_radius - rim, teeth=gear.teeth) for gear, rim in pairs]


@cache
def of_centre_lines(rims: tuple[float, float]) -> float:
    """Displacement of both centre lines under a unit line load [mm²/N]."""
    width = law()[2]
    return sum(centre_line_compliance(body, STEEL, body.gear.pitch_radius, width, degree=5) for body in bodies(rims))


@RIMS
def test_pair_stiffness_is_the_published_one(rims):
    a, h, _ = law()
    secant = of_centre_lines(rims) + a - h * math.log(LINE_LOAD)
    # the series comes 0.4 % too soft throughout, all of it by the depth that the logarithm is taken to
    assert 1e-3 / secant == pytest.approx(PUBLISHED[rims], rel=5e-3)


def test_the_rows_differ_by_their_bodies_alone():
    """Within half a digit of the source and 0.25 % of the bodies; tangents would miss all rows by 2.8e-6."""
    for rims, stiffness in PUBLISHED.items():
        left, digit = 1e-3 / stiffness - of_centre_lines(rims), 5e-6 / stiffness**2
        assert left == pytest.approx(15.5e-6, abs=digit + 2.5e-3 * of_centre_lines(rims))


@cache
def by_triangles(rims: tuple[float, float]) -> tuple[float, float]:
    """Displacements of both centre lines, and of the middles of both strips, under a unit line load [mm²/N]."""
    width = law()[2]
    found = [
        solve_strip(body, STEEL, Strip(radius=body.gear.pitch_radius, half_width=width), size=0.12)
        for body in bodies(rims)
    ]
    return sum(each.smooth for each in found), sum(each.surface for each in found)


EQUAL = (2.70, 2.70)
SLOW = [pytest.param(rims, marks=pytest.mark.slow) for rims in PUBLISHED if rims != EQUAL]


@pytest.mark.parametrize("rims", [EQUAL, *SLOW])
def test_triangles_displace_the_centre_lines_alike(rims):
    assert of_centre_lines(rims) == pytest.approx(by_triangles(rims)[0], rel=1.5e-3)


def test_a_real_tooth_is_compressed_more_than_a_half_space():
    """Between the middle of the strip and the centre line, both gears."""
    a, h, _ = law()
    smooth, surface = by_triangles(EQUAL)
    assert surface - smooth == pytest.approx(17.4e-6, rel=5e-3)
    assert surface - smooth > 1.08 * (a - h * math.log(LINE_LOAD))
