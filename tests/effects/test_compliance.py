"""Effects that add compliance: the Hertz laws and tooth bending against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydantic import ValidationError

from gearbench.contact.law import compression
from gearbench.effects.hertz import Hertz
from gearbench.effects.teeth import plate_tooth
from gearbench.effects.tooth_bending import ToothBending, normal_component
from gearbench.geometry.action import ContactLines, contact_lines
from gearbench.geometry.gear import Gear
from gearbench.geometry.material import Material
from gearbench.geometry.pair import Member, Pair

SPUR = Pair(normal_module=3.0, face_width=24.0, centre_distance=90.4, pinion=Member(teeth=24), wheel=Member(teeth=36))
HELICAL = replace(SPUR, helix_angle=18.0, centre_distance=94.9)
BRASS = replace(SPUR, material=Material(youngs_modulus=100.0, poisson_ratio=0.36))
PAIRS = pytest.mark.parametrize("pair", [SPUR, HELICAL, BRASS], ids=["spur", "helical", "brass"])


def lines(pair: Pair) -> ContactLines:
    return contact_lines(pair, np.linspace(0.05, 0.95, 5), 4)


def right_flank(gear: Gear, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Point of the flank at ``radius`` and the direction of its normal into the tooth, tooth centre line along +y.

    The involute is the path of the end of a string unwound from the base circle: the normal is the string.
    """
    polar = math.acos(gear.base_radius / radius)
    roll = math.tan(polar)
    # foot of the string on the base circle seen from the point: ahead by α_R, and the tooth thickens towards the root
    psi = float(gear.involute_half_angle(radius))
    point = radius * np.array([math.sin(psi), math.cos(psi)])
    foot_angle = psi - polar  # the string touches the base circle on the far side of the centre line
    foot = gear.base_radius * np.array([math.sin(foot_angle), math.cos(foot_angle)])
    assert np.linalg.norm(point - foot) == pytest.approx(gear.base_radius * roll, rel=1e-12)
    return point, (foot - point) / np.linalg.norm(foot - point)


def tangent(gear: Gear, radius: float) -> np.ndarray:
    """Direction of the flank, by central differences of its polyline."""
    ends = [
        r * np.array([math.sin(p), math.cos(p)])
        for r in (radius - 1e-5, radius + 1e-5)
        for p in [float(gear.involute_half_angle(r))]
    ]
    return ends[1] - ends[0]


def depth(gear: Gear, radius: float) -> float:
    """Along the flank's normal to the tooth's centre line x = 0, in the transverse plane."""
    point, normal = right_flank(gear, radius)
    assert abs(tangent(gear, radius) @ normal) < 1e-12  # mm per 2e-5 mm: it is the normal
    return -point[0] / normal[0]


@PAIRS
@pytest.mark.parametrize("q", [0.01, 30.0, 400.0, 2000.0])
def test_weber_banaschek_is_the_printed_formula(pair, q):
    """The printed formula in 30 digits, with curvature radii and depths from the geometry of the flanks."""
    at = lines(pair)
    law = Hertz(law="weber_banaschek").compliance(at, {})
    beta_b = math.asin(math.sin(math.radians(pair.helix_angle)) * math.cos(math.radians(20)))
    for index in np.ndindex(at.shape):
        if not at.active[index[:2]]:
            continue
        radii = [r[index] for r in at.radii]
        t1, t2 = (depth(g, r) * math.cos(beta_b) for g, r in zip(pair.gears, radii, strict=True))
        curvature = [math.sqrt(r**2 - g.base_radius**2) for g, r in zip(pair.gears, radii, strict=True)]
        with mpmath.workdps(30):
            nu, E = mpmath.mpf(pair.material.poisson_ratio), mpmath.mpf(1000 * pair.material.youngs_modulus)
            rho = 1 / (1 / mpmath.mpf(curvature[0]) + 1 / mpmath.mpf(curvature[1])) / mpmath.cos(beta_b)
            a_H = mpmath.sqrt(8 * q * rho * (1 - nu**2) / (mpmath.pi * E))
            bracket = mpmath.log(2 * mpmath.sqrt(t1 * t2) / a_H) - nu / (2 * (1 - nu))
            expected = 4 * q * (1 - nu**2) / (mpmath.pi * E) * bracket
        found = compression(np.array([q]), law.a[index].reshape(1), law.h[index].reshape(1))[0]
        # beyond its validity (contact half as wide as the tooth is deep) the law goes on along its tangent
        assert law.a[index] / law.h[index] - math.log(q) > 2
        assert found == pytest.approx(float(expected), rel=1e-11)


@PAIRS
def test_yang_sun_is_constant(pair):
    law = Hertz(law="yang_sun").compliance(lines(pair), {})
    nu, E = pair.material.poisson_ratio, 1e3 * pair.material.youngs_modulus
    assert_allclose(law.a, 4 * (1 - nu**2) / (math.pi * E), rtol=1e-15)
    assert np.all(law.h == 0)


def test_a_contact_at_the_interference_point_stays_finite():
    """There ρ = 0 and the logarithm is infinite; a large wheel reaches this point on a pinion with few teeth."""
    pair = Pair(
        normal_module=3.0, face_width=24.0, centre_distance=141.0, pinion=Member(teeth=14), wheel=Member(teeth=80)
    )
    law = Hertz().compliance(replace(lines(pair), u=np.zeros(lines(pair).shape)), {})
    assert np.all(np.isfinite(law.a) & (law.a > 0))


# -- tooth bending ----------------------------------------------------------------------------------------------------
@PAIRS
@pytest.mark.parametrize("bending", [ToothBending(), ToothBending(order=(4, 3)), ToothBending(fillet=True)])
def test_both_teeth_deflect_in_series(pair, bending):
    """Ψ Ψᵀ is the plate of the pinion plus the plate of the wheel, at heights above each root."""
    at = lines(pair)
    psi = bending.compliance(at, {}).factor
    order, material = bending.order, pair.material
    teeth = [plate_tooth(g, material, order, bending.fillet) for g in pair.gears]
    (p, k) = np.argwhere(at.active)[0]
    heights = [
        np.hypot(g.base_radius, x) - g.root_radius
        for g, x in zip(pair.gears, (at.u, pair.meshing.tangent_length - at.u), strict=True)
    ]
    for j in range(4):
        expected = sum(
            t.deflection(h[p, k], at.y[p, k], h[p, k, [j]], at.y[p, k, [j]])
            for t, h in zip(teeth, heights, strict=True)
        )
        assert_allclose(psi[p, k] @ psi[p, k, j], expected, rtol=1e-12)
    assert psi.shape[-1] == 2 * (3 if order is None else 12)


@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
def test_load_component_of_a_tooth(pair):
    """Unit vectors in space: flank normal inclined by β_b, mid-plane along the helix at R; cos α_n where γ = α_t."""
    gear = pair.gears[0]
    for radius in np.linspace(gear.form_radius + 0.1, gear.tip_radius, 5):
        _, n = right_flank(gear, float(radius))
        flank = np.array([math.cos(gear.beta_b) * -n[0], math.cos(gear.beta_b) * n[1], math.sin(gear.beta_b)])
        beta = math.atan(radius / gear.pitch_radius * math.tan(gear.beta))
        plane = np.array([math.cos(beta), 0.0, math.sin(beta)])
        assert np.linalg.norm(flank) == pytest.approx(1)
        assert float(normal_component(gear, radius)) == pytest.approx(flank @ plane, rel=1e-12)
    # many teeth: a rack, whose load angle is the pressure angle in its normal section
    rack = replace(gear, teeth=2_000_000)
    assert float(normal_component(rack, rack.pitch_radius)) == pytest.approx(math.cos(math.radians(20)), abs=1e-6)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"basis": "paper", "order": (3, 3)}, "conflicts with basis"),
        ({"order": (3, 3, 3)}, "two numbers"),
        ({"order": (0, 3)}, "greater than or equal to 1"),
    ],
)
def test_contradictory_orders_are_refused(keys, message):
    with pytest.raises(ValidationError, match=message):
        ToothBending(**keys)
