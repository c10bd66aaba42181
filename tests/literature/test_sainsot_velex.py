"""Foundation of a tooth in closed form: Sainsot, Velex, Duverger, Journal of Mechanical Design 126 (2004) 748–752.

δ = F cos²γ/(bE) [L*(u/S)² + M* u/S + P*(1 + Q* tan²γ)], coefficients fitted for rings; and the same from our own ring.
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.compliance.gear_body import ToothedRing
from gearbench.compliance.sainsot_velex import foundation_factor, shape_factors
from gearbench.compliance.solid_tooth import SolidTooth
from gearbench.errors import InputError
from gearbench.geometry.gear import Gear
from tests.support.gears import standard_gear

E, NU = 210e3, 0.3


def stand_in(theta: float, root: float = 20.0, gamma: float = 0.35, base: float = 21.0) -> Any:
    """As much of a gear as the formula asks for."""
    return SimpleNamespace(
        root_radius=root, base_radius=base, face_width=10.0, beta_b=0.0,
        half_angle=lambda radius: np.full(np.shape(radius), theta),
        load_angle=lambda radius: np.full(np.shape(radius), gamma),
    )  # fmt: skip


def gear(teeth=40, module=2.0, width=20.0, helix=0.0) -> Gear:
    return standard_gear(teeth, width, normal_module=module, helix=helix)


def test_shape_factors_worked_by_hand():
    """θ_f = 0.1, h = 2: 1/θ_f² = 100, h² = 4, h/θ_f = 20, 1/θ_f = 10."""
    found = shape_factors(stand_in(0.1), 10.0)
    by_hand = (
        -0.005574 - 0.0079944 - 0.004603 + 0.047702 + 0.0542 + 6.8045,
        0.060111 + 0.1124 - 0.166862 - 0.099256 + 0.3248 + 0.9086,
        -0.050952 + 0.742 + 0.0001076 + 0.533 + 0.579 + 0.9236,
        -0.0062042 + 0.0363556 - 0.008192800 + 0.078297 - 0.2944 + 0.6904,
    )
    assert_allclose(found, by_hand, rtol=1e-12)


def test_deflection_worked_by_hand():
    """θ_f = 0.1, h = 2, r_f = 20: S = 4. γ = 0.35, r_b = 21: u = 21/cos γ − 20 = 2.35534, u/S = 0.58884.

    L*·0.34673 + M*·0.58884 + P*·(1 + Q*·0.13325) = 2.38834 + 0.67115 + 2.90706 = 5.96655; cos²γ = 0.88242;
    divided by b E = 2.1e6: 2.50715e-6 mm/N.
    """
    found = float(foundation_factor(stand_in(0.1), E, 10.0, 21.5) ** 2)
    assert found == pytest.approx(2.50715e-6, rel=2e-6)


def test_normal_of_a_helical_flank():
    """Force and displacement both lose cos β_b on their way to the transverse plane."""
    spur, helical = stand_in(0.1), stand_in(0.1)
    helical.beta_b = 0.4
    ratio = foundation_factor(helical, E, 10.0, 21.5) / foundation_factor(spur, E, 10.0, 21.5)
    assert ratio == pytest.approx(math.cos(0.4))


@pytest.mark.parametrize(
    ("theta", "h", "which"),
    [
        (1e-3, 2.0, r"L\* ="),  # 4000 teeth: −45
        (0.01, 1.4, r"[LMPQ]\* ="),
        (0.08, 1.1, r"M\* ="),
        (0.08, 8.0, r"[MPQ]\* ="),
    ],
)
def test_outside_the_fit_is_refused(theta, h, which):
    with pytest.raises(InputError, match=rf"^bore_diameter = .*({which}).*outside the fit"):
        shape_factors(stand_in(theta), 20.0 / h)


@pytest.mark.parametrize(
    ("teeth", "module", "width", "h"), [(24, 3.0, 24.0, 2.0), (40, 2.0, 20.0, 2.0), (40, 2.0, 20.0, 4.0)]
)
def test_our_ring_agrees_inside_the_fit(teeth, module, width, h):
    """Even line load at five heights. Measured: the closed form is 0.95 … 1.03 of the ring."""
    g = gear(teeth, module, width)
    body = ToothedRing(tooth=SolidTooth(gear=g, E=E, nu=NU, order=(6, 7, 8)), bore_radius=g.root_radius / h)
    C = body.blocks(0)[0]
    x, w = np.polynomial.legendre.leggauss(20)
    radius = np.linspace(g.form_radius, g.tip_radius, 5)
    shapes = body.tooth.flank.shapes(radius[:, None] - g.root_radius, width / 2 * (1 + x))
    even = np.einsum("rya,y->ra", shapes, w / 2)
    ours = np.einsum("ra,ab,rb->r", even, C, even)
    theirs = foundation_factor(g, E, g.root_radius / h, radius) ** 2
    # it takes linear and constant root stresses for granted, and a plane problem
    assert np.all(np.abs(theirs / ours - 1) < 0.06)
    assert ours[-1] > 1.5 * ours[0]  # it follows the height of the load
