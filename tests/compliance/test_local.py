"""Compression below the flank against half-space solutions and the contact law it stands for."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from fem_reference.flank import Flank
from gearbench.compliance import local
from gearbench.compliance.local import compression, flank_functions, half_space_compression
from gearbench.geometry.gear import Gear
from tests.support.gears import standard_gear

E, NU = 210e3, 0.3
FLAT = (1 - NU**2) / (math.pi * E)


def gear(helix=0.0) -> Gear:
    return standard_gear(25, 12.0, normal_module=2.0, helix=helix, profile_shift=0.1)


def boussinesq(rho: float, z: float) -> float:
    """Displacement along a unit point force on a half-space, at depth z below a surface point at distance ρ."""
    R = math.hypot(rho, z)
    return (1 + NU) / (2 * math.pi * E) * (z**2 / R**3 + 2 * (1 - NU) / R)


@pytest.mark.parametrize(("k", "r", "t"), [(0.3, 0.5, 1.2), (1.0, 0.1, 2.0), (2.5, 1.0, 0.4)])
def test_wave_is_boussinesq_s_solution_integrated_along_the_line(k, r, t):
    def difference(y):
        rho = math.hypot(r, y)
        return boussinesq(rho, 0.0) - boussinesq(rho, t)

    exact = 2 * quad(difference, 0, np.inf, weight="cos", wvar=k, epsabs=1e-16, limlst=200)[0]
    found = compression(E, NU, np.array([k]), np.array(r), np.array(t))[0]
    assert_allclose(found, exact, rtol=1e-6)  # of the quadrature


def test_even_line_load_is_the_limit_of_long_waves():
    r, t = np.array([0.2, 1.0]), np.array([1.5, 0.7])
    g = compression(E, NU, np.array([0.0, 1e-6]), r, t)
    assert_allclose(g[0], g[1], rtol=1e-9)


def test_even_line_load_under_hertz_s_pressure_is_weber_banaschek_s_law():
    """2(1−ν²)/(πE) [ln(2t/a) − ν/(2(1−ν))] below the middle of a narrow strip of half-width a."""
    a, t = 0.01, 1.7

    def part(v):  # r = a v
        return 2 / math.pi * math.sqrt(1 - v * v) * compression(E, NU, np.array([0.0]), np.array(a * v), np.array(t))[0]

    found = 2 * quad(part, 0, 1)[0]
    # the law is for a ≪ t: (a/t)² is left out
    assert_allclose(found, 2 * FLAT * (math.log(2 * t / a) - NU / (2 * (1 - NU))), rtol=1e-4)


@pytest.mark.parametrize("helix", [0.0, 25.0])
def test_depth_is_the_way_from_the_flank_to_the_centre_line(helix):
    """Along the line of action from the point of the flank, in Cartesian coordinates; cos β_b of it counts."""
    g = gear(helix)
    flank, R = Flank(g), np.linspace(g.form_radius * 1.001, g.tip_radius, 50)
    y = np.zeros_like(R)
    way = flank.position(R, y) - flank.below(R, y)
    assert_allclose(g.flank_depth(R), np.linalg.norm(way, axis=1) * math.cos(g.beta_b), rtol=1e-12)


@pytest.mark.parametrize("helix", [0.0, 25.0])
def test_projection_is_what_its_resolution_says(helix):
    """Default points and waves against many more: 1e-7; symmetric and positive."""
    coarse = half_space_compression(gear(helix), E, NU, (4, 5))
    fine = half_space_compression(gear(helix), E, NU, (4, 5), points=60)
    assert np.linalg.norm(coarse - fine) < 1e-7 * np.linalg.norm(fine)
    assert_allclose(coarse, coarse.T, rtol=0, atol=1e-14 * coarse.max())
    assert np.linalg.eigvalsh(coarse).min() > 0


@pytest.mark.parametrize("count", [5, 24])
def test_waves_between_those_computed_are_interpolated(count, monkeypatch):
    found = half_space_compression(gear(25.0), E, NU, (4, count))
    monkeypatch.setattr(local, "FARTHER", 1.0)
    every = half_space_compression(gear(25.0), E, NU, (4, count))
    assert 0 < np.linalg.norm(found - every) < 1e-7 * np.linalg.norm(every)


def even_helix(g: Gear, R: float, other: float) -> float:
    """Compression at R, y = 0 under point forces all along the helix at ``other``, by positions in space."""
    depth = math.sqrt(float(g.flank_depth(np.array(R))) * float(g.flank_depth(np.array(other))))
    near = abs(R**2 - other**2) / (2 * g.base_radius)
    x, w = np.polynomial.legendre.leggauss(80)
    end = math.asinh(25 * depth / near)  # the rest is (t/y)²/2 of the whole, 0.1 %
    y, dy = near * np.sinh(end * x), near * np.cosh(end * x) * end * w
    own, points = (Flank(g).position(np.full(at.shape, r), at) for r, at in ((R, np.zeros(1)), (other, y)))
    rho = np.linalg.norm(points - own, axis=1)
    return sum(d * (boussinesq(r, 0.0) - boussinesq(r, depth)) for r, d in zip(rho, dy, strict=True))


@pytest.mark.parametrize("helix", [0.0, 15.0, 25.0])
def test_a_helical_flank_is_compressed_as_by_point_forces_all_over_it(helix):
    """On the helicoid generators are b/cos β_b long, and the arc of the involute is square to them."""
    g = gear(helix)
    low, high = g.form_radius, g.tip_radius
    x, w = np.polynomial.legendre.leggauss(8)
    x, w = (x + 1) / 2, w / 2
    total = 0.0
    for share, dR in zip(x, w, strict=True):
        R = low + share * (high - low)
        rest = high - R
        total += (
            2 * dR * sum(d * 4 * v**3 * rest * even_helix(g, R, R + rest * v**4) for v, d in zip(x, w, strict=True))
        )
    assert_allclose(half_space_compression(g, E, NU, (1, 1))[0, 0], total, rtol=2e-3)


def test_flank_functions_are_orthonormal_and_constant_outside():
    R, w = np.polynomial.legendre.leggauss(12)
    R, w = 3 + R, w
    f = flank_functions(5, R, 2.0, 4.0)
    assert_allclose(f.T @ (w[:, None] * f), np.eye(5), rtol=0, atol=1e-13)
    assert_allclose(
        flank_functions(5, np.array([1.0, 9.0]), 2.0, 4.0), flank_functions(5, np.array([2.0, 4.0]), 2.0, 4.0)
    )
