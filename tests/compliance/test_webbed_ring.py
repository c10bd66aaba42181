"""Rim, web and hub against closed forms of discs, against the plain ring, and seen in a mirror."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.compliance.ring import Ring
from gearbench.compliance.webbed_ring import WebbedRing
from gearbench.geometry.web import Web

E, NU, BORE, WIDTH = 210e3, 0.3, 12.0, 15.0
MU = E / (2 * (1 + NU))
WEB = Web(rim_radius=36.0, hub_radius=20.0, start=5.0, stop=9.0)


def body(web: Web = WEB, bore: float = BORE, order: tuple[int, int] = (10, 8), **changes) -> WebbedRing:
    values = {"inner_radius": web.rim_radius, "radius": 40.0, "width": WIDTH, "screw": 0.0, "E": E, "nu": NU}
    return WebbedRing(rim=Ring(**{**values, "order": order, **changes}), web=web, bore_radius=bore, seen=3)


def test_foundation_in_torsion_is_that_of_a_disc():
    """n = 0, U even: τ = T/(2πR²b_s) gives u_θ(r)/r = (T/4πμb_s)(1/a² − 1/r²), exact in a disc on a rigid hub."""
    found = np.linalg.inv(body(bore=WEB.hub_radius).foundation(np.zeros(1)))[0]
    a, r = WEB.hub_radius, WEB.rim_radius
    # per harmonic: unit force in the amplitude of 1/√b_s, work without the circumference
    assert_allclose(found[0, 0], r / (2 * MU) * (r / a**2 - 1 / r), rtol=1e-6)


def test_foundation_of_a_thin_web_bends_like_a_plate():
    """n = 0, W even: Kirchhoff's annular plate, clamped at the hub, free of moments at the rim, sheared there."""
    a, r, h = WEB.hub_radius, WEB.rim_radius, 0.2
    thin = replace(WEB, start=7.4, stop=7.6)
    q = 8
    found = np.linalg.inv(body(thin, bore=a).foundation(np.zeros(1)))[0][2 * q, 2 * q]
    D = E * h**3 / (12 * (1 - NU**2))
    # w = c·(1, ln R, R², R² ln R): w(a) = w′(a) = 0, M(r) = 0, D (Δw)′(r) = −1 per length of the edge
    rows = [
        [1, math.log(a), a**2, a**2 * math.log(a)],
        [0, 1 / a, 2 * a, a * (2 * math.log(a) + 1)],
        [0, -(1 - NU) / r**2, 2 * (1 + NU), 2 * (1 + NU) * math.log(r) + 3 + NU],
        [0, 0, 0, 4 / r],
    ]
    c = np.linalg.solve(np.array(rows), [0, 0, 0, -1 / D])
    w = abs(c @ [1, math.log(r), r**2, r**2 * math.log(r)])
    # force on the amplitude of 1/√h: h times that of a unit line force, work per R
    assert_allclose(found, w * h / r, rtol=0.01)


@pytest.mark.parametrize("screw", [0.0, 0.01])
def test_a_web_as_wide_as_the_face_is_the_plain_ring(screw):
    n = np.array([0.0, 1.0, 2.0, 5.0, 20.0, 200.0])
    whole = replace(WEB, start=0.0, stop=WIDTH)
    plain = Ring(inner_radius=BORE, radius=40.0, width=WIDTH, screw=screw, E=E, nu=NU, order=(16, 3))
    rings = replace(body(whole, order=(16, 3), screw=screw), seen=3)
    exact = plain.harmonics(n)
    assert_allclose(rings.harmonics(n), exact, atol=2e-4 * np.abs(exact).max(axis=(1, 2)).min())


@pytest.mark.parametrize("offset", [0.0, 4.0])
def test_without_a_hub_and_with_a_rigid_one(offset):
    """A hub makes the body softer, the more the smaller its bore, and hardly so just below the web."""
    web, n = replace(WEB, start=WEB.start + offset, stop=WEB.stop + offset), np.arange(6.0)
    stiff, nearly, soft = (body(web, bore).harmonics(n) for bore in (20.0, 19.999, 12.0))
    assert_allclose(nearly, stiff, atol=1e-3 * np.abs(stiff).max())
    assert np.linalg.eigvalsh(soft - stiff).min() > -1e-9 * np.abs(stiff).max()
