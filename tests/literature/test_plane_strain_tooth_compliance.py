"""Plane-strain compliance of single teeth on a whole gear, bore clamped at r_f/1.4, Hertz part excluded.

Published values for m = 1, x = 0, α = 20°, h_a* = 1, h_f* = 1.25, ρ_f* = 0.38, E = 206 GPa, ν = 0.3; displacement along
the line of action per unit line load. Excluding the Hertz part there means the displacement of the tooth's centre line.
"""

from __future__ import annotations

import math

import pytest

from fem_reference.section import Body
from gearbench.compliance.gear_body import ToothedRing
from gearbench.compliance.solid_tooth import SolidTooth
from gearbench.geometry.material import Material
from tests.support.gears import standard_gear
from tests.support.plane_strain import centre_line_compliance
from tests.support.strips import Strip, solve_strip

PUBLISHED = pytest.mark.parametrize(
    ("teeth", "radius", "compliance"),
    [(17, 8.0023, 0.01626), (17, 8.5, 0.02226), (43, 21.5, 0.02085), (43, 22.4434, 0.05411)],
)


@PUBLISHED
def test_single_tooth_compliance(teeth, radius, compliance):
    gear = standard_gear(teeth, 1.0)
    body = Body(gear=gear, bore_radius=gear.root_radius / 1.4, teeth=teeth)
    solution = solve_strip(body, Material(youngs_modulus=206.0), Strip(radius=radius, half_width=0.02))
    # asked for: 2 %. The published digits are good to 0.03 %, the mesh to 0.02 %; the rest is their mesh
    assert solution.smooth * 1e3 == pytest.approx(compliance, rel=3e-3)


@PUBLISHED
def test_condensed_sector(teeth, radius, compliance):
    """The route that the compliance of flanks takes: one sector in quadrilaterals of high order, all teeth by waves."""
    gear = standard_gear(teeth, 1.0)
    body = Body(gear=gear, bore_radius=gear.root_radius / 1.4, teeth=teeth)
    found = centre_line_compliance(body, Material(youngs_modulus=206.0), radius, half_width=0.01, degree=5)
    # asked for: 0.5 %; the published digits are good to 0.03 %
    assert found * 1e3 == pytest.approx(compliance, rel=2e-3)


@PUBLISHED
def test_solid_tooth_on_its_ring(teeth, radius, compliance):
    """An even line load on a gear 100 modules wide: plane strain but for its ends."""
    gear = standard_gear(teeth, 100.0)
    tooth = SolidTooth(gear=gear, E=206e3, nu=0.3, order=(10, 14, 6), measured_at="mid", heights=9)
    body = ToothedRing(tooth=tooth, bore_radius=gear.root_radius / 1.4)
    p, q = tooth.flank_order
    even = tooth.flank.shapes(radius - gear.root_radius, 50.0).reshape(p, q)[:, 0] * math.sqrt(gear.face_width)
    matrix = (tooth.matrix + body.blocks(0)[0]).reshape(p, q, p, q)[:, 0, :, 0]
    # the ends, and a line load as nine polynomials: 0.5 %
    assert even @ matrix @ even * 1e3 == pytest.approx(compliance, rel=0.008)
