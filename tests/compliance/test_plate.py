"""The plate against closed forms, bounds, invariants, and its declared convergence."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.compliance.bases import (
    gauss,
    height_functions,
    height_quadrature,
    jointed_height_functions,
    width_functions,
)
from gearbench.compliance.plate import SHEAR_FACTOR, PlateTooth

E, NU = 210e3, 0.3


def plate(height=2.0, width=8.0, h=1.5, nu=NU, basis=(6, 6), taper=0.0, **options) -> PlateTooth:
    def thickness(x):
        return h * (1 - taper * np.asarray(x) / height)

    return PlateTooth(height=height, width=width, thickness=thickness, E=E, nu=nu, basis=basis, **options)


def line_load_deflection(tooth: PlateTooth, x: float) -> float:
    """Mean deflection of the line at height x under a unit force spread evenly over it."""
    eta, w = gauss(12)
    factor = w @ tooth.factor(np.full(12, x), eta * tooth.width)
    return float(factor @ factor)


def cantilever(thinness: float, basis) -> float:
    """Deflection of the tip under an even load there, with ν = 0, over Timoshenko's FH³/3EI + FH/κGA."""
    height, width = 2.0, 5.0
    h = thinness * height
    exact = height**3 / (3 * E * width * h**3 / 12) + height / (SHEAR_FACTOR * E / 2 * width * h)
    return line_load_deflection(plate(height=height, width=width, h=h, nu=0.0, basis=basis), height) / exact


@pytest.mark.parametrize("thinness", [500.0, 5.0, 1.0, 1e-1, 1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("basis", [(3, 1), (4, 3), (8, 4), (20, 20)])
def test_cubic_plates_do_not_lock(basis, thinness):
    """ν = 0 and a uniform load bend the plate to a cylinder, which three height functions hold: exact at any thinness.

    The condition number grows like 1/thinness², and as many digits are lost.
    """
    assert_allclose(cantilever(thinness, basis), 1, rtol=1e-12 + 1e-14 / thinness**2)


def test_the_papers_basis_is_too_stiff_by_a_quarter_in_the_thin_limit():
    """w and θ of second degree: c x² instead of x²(3H − x) gives ¾ of Kirchhoff's deflection, no less: no locking."""
    for thinness in (1e-2, 1e-3, 1e-4):
        assert_allclose(cantilever(thinness, "paper"), 0.75, rtol=10 * thinness**2 + 1e-13 / thinness**2)


def test_tapered_timoshenko_cantilever():
    """w = ∫ (L−x)²/(E I) + 1/(κ G A) dx with a linear taper, both integrals in closed form."""
    height, width, h0, taper = 2.0, 3.0, 1.4, 0.5
    a = taper / height
    d = h0 * (1 - a * height)
    # with t = h(x)/h0 = 1 − a x: ∫ (L−x)² / t³ dx, L − x = (t − t_L)/a
    t_l = 1 - a * height
    bending = (np.log(1 / t_l) - 2 * t_l * (1 / t_l - 1) + t_l**2 * (1 / t_l**2 - 1) / 2) / a**3
    shear = np.log(1 / t_l) / a
    exact = 12 / (E * width * h0**3) * bending + shear / (SHEAR_FACTOR * E / 2 * width * h0)
    tooth = plate(height=height, width=width, h=h0, nu=0.0, basis=(16, 1), taper=taper)
    assert d > 0
    assert_allclose(line_load_deflection(tooth, height), exact, rtol=1e-9)


def test_wide_strip_is_stiffer_by_one_minus_nu_squared():
    """Plane strain in the middle of a very wide plate: D instead of E h³/12, under an even line load."""
    height, h = 1.0, 0.02
    tooth = plate(height=height, width=20.0, h=h, basis=(5, 24))
    eta, w = gauss(60)
    load = w @ tooth.factor(np.full(60, height), eta * tooth.width)
    middle = float(tooth.factor(height, 10.0) @ load) * 20.0  # unit force per unit width
    exact = height**3 / (3 * E * h**3 / (12 * (1 - NU**2))) + height / (SHEAR_FACTOR * E / 2.6 * h)
    # the free ends, ten heights away, are resolved by the 24 functions to 1e-3 in the middle
    assert_allclose(middle, exact, rtol=1e-3)


def test_ritz_bound_compliance_grows_with_every_function():
    points = [(2.0, 4.0), (1.2, 0.5), (2.0, 8.0)]
    for x, y in points:
        values = [
            float(plate(basis=(n, m), taper=0.3).deflection(x, y, x, y))
            for n, m in [(1, 1), (2, 1), (2, 2), (3, 3), (4, 4), (6, 6), (8, 8), (12, 12)]
        ]
        assert np.all(np.diff(values) > 0)
    paper = float(plate(basis="paper", taper=0.3).deflection(2.0, 4.0, 2.0, 4.0))
    assert paper < float(plate(basis=(2, 2), taper=0.3).deflection(2.0, 4.0, 2.0, 4.0))


def test_declared_order_in_p_of_a_line_load_inside_the_height():
    """First order: the shear deflection has a kink under the load. Error against Timoshenko's closed form."""
    height, width, h, x = 2.0, 3.0, 1.5, 0.9
    exact = x**3 / (3 * E * width * h**3 / 12) + x / (SHEAR_FACTOR * E / 2 * width * h)
    orders = np.arange(6, 40)
    error = [
        1 - line_load_deflection(plate(height=height, width=width, h=h, nu=0.0, basis=(int(p), 1)), x) / exact
        for p in orders
    ]
    assert -np.polyfit(np.log(orders), np.log(error), 1)[0] == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize("thinness", [0.1, 0.5, 1.0, 3.0])
@pytest.mark.parametrize("aspect", [0.5, 4.0, 50.0])
@pytest.mark.parametrize("order", ["paper", (5, 5), (15, 15)])
def test_condition_number(thinness, aspect, order):
    tooth = plate(height=2.0, width=2.0 * aspect, h=2.0 * thinness, basis=order, taper=0.6)
    assert tooth.condition < 1e8


def test_families_of_functions():
    t, w = gauss(40)
    f, df = height_functions(9, t)
    g, dg = width_functions(9, t)
    assert_allclose(height_functions(9, 0.0)[0], 0.0, atol=1e-15)
    assert_allclose(df.T @ (w[:, None] * df), np.eye(9), atol=1e-13)
    assert_allclose(g.T @ (w[:, None] * g), np.eye(9), atol=1e-13)
    step = 1e-6
    for family in (height_functions, width_functions):
        slope = (family(9, t + step)[0] - family(9, t - step)[0]) / (2 * step)
        assert_allclose(family(9, t)[1], slope, atol=2e-6)  # central difference: h² f''' ~ 1e-12 · 1e5
    assert dg.shape == f.shape


def test_two_families_of_height_functions_meet_with_a_kink():
    joint, counts = 0.3, (3, 4)
    nodes, w = height_quadrature(12, [joint], [])
    f, df = jointed_height_functions(counts, joint, nodes)
    lengths = np.repeat([joint, 1 - joint], counts)
    assert_allclose(df.T @ (w[:, None] * df), np.diag(1 / lengths), atol=1e-12)
    assert_allclose(np.add.reduce(w[:, None] * df), jointed_height_functions(counts, joint, 1.0)[0], atol=1e-12)
    # the best fit of a function with a kink at the joint is exact, and zero at the root remains zero
    kink = np.abs(nodes - joint) - joint
    assert_allclose(f @ np.linalg.lstsq(f, kink, rcond=None)[0], kink, atol=1e-12)
    assert_allclose(jointed_height_functions(counts, joint, 0.0)[0], 0.0, atol=1e-15)


def test_quadrature_in_height_integrates_square_roots_at_the_root_and_kinks_at_breaks():
    x, w = height_quadrature(12, [0.3])
    assert_allclose(w @ np.sqrt(x), 2 / 3, rtol=1e-9)
    assert_allclose(w @ np.abs(x - 0.3), (0.3**2 + 0.7**2) / 2, rtol=1e-14)


@pytest.mark.parametrize("base", [0.4, 0.0, -1e-3, -0.2])
def test_quadrature_in_height_is_exact_where_the_involute_begins(base):
    """ψ ~ (R − r_b)^{3/2} above the base circle, inside the tooth or just below its root."""
    x, w = height_quadrature(20, [base], [base])
    power = np.where(x > base, np.maximum(x - base, 0.0) ** 1.5, 0.0)
    exact = ((1 - base) ** 2.5 - max(-base, 0.0) ** 2.5) / 2.5
    assert_allclose(w @ power, exact, rtol=1e-13)
    assert_allclose(w @ np.maximum(x - base, 0.0) ** 15, ((1 - base) ** 16 - max(-base, 0.0) ** 16) / 16, rtol=1e-13)
