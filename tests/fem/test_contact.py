"""The local part of the compliance: the half-space, the contact law, and real contact strips."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from fem_reference.contact import compression, depth, local_compliance, weber_banaschek
from fem_reference.elasticity import Lame, Space, free_dofs, surface_points
from fem_reference.flank import Flank, Legendre
from fem_reference.plane import Strip, plane_mesh, solve_strip
from fem_reference.section import Body
from fem_reference.solver import solve


def boussinesq(steel, x: float, y: float, t: float) -> float:
    """Compression of the half-space between surface and depth t at (x, y) from a unit force (Johnson, eq. 3.19)."""
    E, nu = steel.E, steel.nu
    r, rho = math.hypot(x, y), math.sqrt(x * x + y * y + t * t)
    deep = (1 + nu) / (2 * math.pi * E) * (t**2 / rho**3 + 2 * (1 - nu) / rho)
    return (1 - nu**2) / (math.pi * E * r) - deep


@pytest.mark.parametrize("k", [0.0, 0.3, 2.0])
def test_compression_is_the_transform_of_boussinesq(steel, k):
    r, t = 0.4, 1.3
    value, _ = quad(lambda y: 2 * boussinesq(steel, r, y, t) * math.cos(k * y), 0, 400, limit=4000, epsabs=1e-12)
    # the integrand beyond 400 falls like y⁻³; the quadrature is good to 1e-9
    assert_allclose(compression(steel, k, np.array(r), np.array(t)), value, rtol=1e-4, atol=1e-11)


def test_hertz_pressure_on_the_half_plane_gives_the_contact_law(steel):
    a, t = 0.02, 1.0
    theta = (np.arange(40_000) + 0.5) * np.pi / 40_000
    s, w = a * np.cos(theta), a * np.sin(theta) * np.pi / 40_000
    centre = np.sum(w * Strip(radius=1.0, half_width=a).pressure(s) * compression(steel, 0.0, np.abs(s), t))
    # the law leaves out terms of order (a/t)² = 4e-4 of a small part; the midpoint rule meets a logarithm
    assert_allclose(centre, weber_banaschek(steel, t, a), rtol=2e-4)


def test_local_compliance_of_a_uniform_line_is_that_of_the_half_plane(steel, spur):
    basis = Legendre(gear=spur, order=(4, 6))
    L = local_compliance(basis, steel).reshape(4, 6, 4, 6)
    assert_allclose(L[:, 0, :, 1:], 0, atol=1e-12)  # mirrored at both faces: uniform load, uniform compression
    plane = local_compliance(Legendre(gear=spur, order=(4, 1)), steel)
    assert_allclose(L[:, 0, :, 0], plane, rtol=1e-10)
    assert np.linalg.eigvalsh(L.reshape(24, 24)).min() > 0
    # more points change nothing: the singular integral has converged
    assert_allclose(local_compliance(basis, steel, points=40), L.reshape(24, 24), atol=2e-5 * np.abs(L).max())


def plane_compliance(body: Body, steel, p: int) -> np.ndarray:
    """Surface compliance projected onto p Legendre polynomials over the height, plane strain."""
    gear = body.gear
    mesh = plane_mesh(
        body, Strip(radius=0.5 * (gear.form_radius + gear.tip_radius), half_width=gear.normal_module), 0.12
    )
    space = Space(mesh, "tri6")
    free = np.ones(space.n_nodes, dtype=bool)
    for name in body.held:
        free[space.boundary_nodes(name)] = False
    points = surface_points(space, mesh.boundaries["right_flank"], 14)
    R = np.maximum(np.hypot(*points.position.T), gear.base_radius)
    density = shapes(gear, R, p) / Flank(gear).stretch(R)[:, None]
    normal = Flank(gear).normal(R, np.zeros_like(R))[:, :2]
    force = points.load(normal[:, :, None] * density[:, None, :], space)
    dofs = free_dofs(free, 2)
    u = solve(space.stiffness(Lame.of(steel.E, steel.nu), free), force[dofs]).x
    return force[dofs].T @ u


def shapes(gear, R: np.ndarray, p: int) -> np.ndarray:
    return Legendre(gear=gear, order=(p, 1))(R, np.zeros_like(R)) * math.sqrt(gear.face_width)


@pytest.mark.parametrize("on_rim", [False, True])
def test_smooth_part_and_contact_law_give_back_a_real_contact_strip(spur, steel, on_rim):
    """Displacement of the flank under a Hertzian strip = smooth compliance + Weber–Banaschek, all from FE."""
    body = Body(gear=spur, bore_radius=spur.root_radius / 1.4, teeth=3, rest="free") if on_rim else Body(gear=spur)
    low, high = spur.form_radius, spur.tip_radius
    R = low + (high - low) * np.array([0.1, 0.5, 0.9])
    a = 0.01
    law = weber_banaschek(steel, depth(spur, R), a)
    strips = np.array([solve_strip(body, steel, Strip(radius=r, half_width=a)) for r in R])
    total = np.array([s.surface for s in strips])
    p = 5
    local = local_compliance(Legendre(gear=spur, order=(p, 1)), steel)
    smooth = np.einsum("ai,ij,aj->a", shapes(spur, R, p), plane_compliance(body, steel, p) - local, shapes(spur, R, p))
    # five polynomials over the height: within 0.6 % of the total
    assert_allclose(smooth + law, total, rtol=6e-3)
    # the displacement of the centre line alone, the other usual definition, leaves out what the tooth itself does
    # between its flank and its centre line
    centre = np.array([s.smooth for s in strips])
    assert np.all(centre + law < total * (1 - 0.008))
