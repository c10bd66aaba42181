"""The solid tooth against finite elements: its compliance, and with the contact law a real contact strip."""

from __future__ import annotations

import numpy as np
import pytest

from fem_reference.refinement import Level, solved
from fem_reference.section import Body
from gearbench.compliance.local import waves_across
from gearbench.compliance.solid_tooth import SolidTooth
from tests.support.gears import standard_gear
from tests.support.strips import Strip, solve_strip


@pytest.mark.parametrize(("order", "tolerance"), [((5, 7, 14), 0.012), ((8, 12, 14), 0.006)])
def test_solid_and_contact_law_give_back_a_real_contact_strip(steel, law, order, tolerance):
    """Wide tooth under an even line load: in its middle, solid + law = a Hertzian strip in plane strain, by FE."""
    body = standard_gear(25, 12.0)
    tooth = SolidTooth(gear=body, E=steel.E, nu=steel.nu, order=order)
    x, w = np.polynomial.legendre.leggauss(60)
    y = 0.5 * body.face_width * (1 + x)
    for fraction in (0.2, 0.5, 0.8):
        R = body.form_radius + fraction * (body.tip_radius - body.form_radius)
        height = R - body.root_radius
        line = tooth.flank.deflection(height, body.face_width / 2, height, y) @ (0.5 * body.face_width * w)
        strip = solve_strip(Body(gear=body), steel, Strip(radius=R, half_width=0.01))
        pressed = float(law(body.flank_depth(R), 0.01))
        # the default order lacks 0.8 % of the tooth's compliance; five polynomials over the height are good to 0.4 %
        assert line + pressed == pytest.approx(strip.surface, rel=tolerance)
        # the law alone, or the flank without taking the law's part out, would be far off
        assert pressed < 0.75 * strip.surface


@pytest.mark.parametrize(("helix", "teeth"), [(0.0, 25), (20.0, 18)])
def test_solid_converges_to_the_finite_elements(steel, helix, teeth):
    """Compliance of low polynomials on the flank; from below, as Rayleigh and Ritz have it."""
    body = standard_gear(teeth, 6.0, helix=helix)
    found = solved(Level(body=Body(gear=body), number=4, waves=8), steel, (5, 8))
    low = np.add.outer(8 * np.arange(3), np.arange(3)).ravel()
    exact = found.block(0)[np.ix_(low, low)]
    errors = []
    for order in ((4, 5, 5), (5, 7, waves_across(body) + 1), (8, 12, 9)):
        tooth = SolidTooth(gear=body, E=steel.E, nu=steel.nu, order=order, heights=5)
        at = np.add.outer(tooth.flank_order[1] * np.arange(3), np.arange(3)).ravel()
        mine = tooth.matrix[np.ix_(at, at)]
        assert mine[0, 0] < exact[0, 0]
        errors.append(np.linalg.norm(mine - exact) / np.linalg.norm(exact))
    assert errors[0] > errors[1] > errors[2]
    assert errors[1] < 0.02
    assert errors[2] < 0.01
