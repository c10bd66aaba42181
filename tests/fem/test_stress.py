"""Stress at the root by triangles against a boundary-element solution from elsewhere."""

from __future__ import annotations

import math

import pytest

from fem_reference.section import Body
from gearbench.geometry.pair import Member, Pair
from gearbench.strength.bending import RootBending
from tests.support.strips import Strip, plane_root_stress, solve_strip


def test_peak_agrees_with_a_boundary_element_solution(steel):
    # z = 17 against 43, load at the outer point of single contact, three teeth on a rim of three modules with free
    # cuts; 2.97959 by quadratic boundary elements, with a cos² patch of the same half-width (project gearcalc, 2026)
    pinion, wheel = (Member(teeth=teeth, fillet_radius=0.38) for teeth in (17, 43))
    pair = Pair(normal_module=1.0, face_width=8.0, centre_distance=30.0, pinion=pinion, wheel=wheel)
    gear = pair.gears[0]
    body = Body(gear=gear, bore_radius=gear.root_radius - 3, teeth=3, rest="free")
    strip = Strip(radius=RootBending(pair=pair, gear=0).load_radius, half_width=0.05)
    stress = plane_root_stress(solve_strip(body, steel, strip, size=0.06), steel)
    # over F_t/(b m); theirs and ours are good to 0.1 and 0.2 %
    assert stress / math.cos(math.radians(pair.pressure_angle)) == pytest.approx(2.97959, rel=4e-3)
