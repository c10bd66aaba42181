"""Teeth whose root moves with the ring below it: energies, rigid motions, elimination of what does not move."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from gearbench.compliance.bases import axis_functions, gauss, width_functions
from gearbench.compliance.section import ToothSection
from gearbench.compliance.solid import Solid
from gearbench.geometry.material import lame
from tests.support import symbolic_solid
from tests.support.toothed_rings import NU, body, gear

ROOT, HEIGHT, WIDTH = 20.0, 2.25, 8.0
#: Half-width e(x), σ = ψ/ψ(root), root radius, screw.
SHAPES = {
    "block": ("3/2", "1", math.inf, 0.0),
    "tapered block": ("3/2 - x/3", "1 - 2*x/9", math.inf, 0.0),
    "spur sector": ("(20 + x)/16", "1", ROOT, 0.0),
    "screwed sector": ("(20 + x)/16", "1", ROOT, 1 / 15),
    "screwed tooth": ("3/2 - x/3", "(1 - 2*x/9)/(1 + x/20)", ROOT, 1 / 15),
}


def parsed(text: str):
    return sp.sympify(text, {"x": symbolic_solid.x})


def free_solid(shape: str, order=(3, 2, 3)) -> Solid:
    text, _, root, screw = SHAPES[shape]
    half_width = sp.lambdify(symbolic_solid.x, parsed(text), "numpy")
    section = ToothSection(
        height=HEIGHT, half_width=lambda x: half_width(x) + 0 * x, root_radius=root, screw=screw, order=order[:2],
        free=True,
    )  # fmt: skip
    return Solid(section=section, width=WIDTH, E=2.1, nu=NU, order=order[2])


def full_stiffness(solid: Solid) -> np.ndarray:
    n = math.prod(solid.shape)
    return np.einsum("abmn,abkl->mknl", solid.of_section, solid.of_axis).reshape(n, n)


def amplitudes(solid: Solid, field, rtol: float = 1e-9) -> np.ndarray:
    """Amplitudes of displacements (θ, R, z) = ``field(s, x, z)``, from their values at random points."""
    rng = np.random.default_rng(0)
    count = 3 * math.prod(solid.shape[1:])
    s, x, z = rng.uniform(-1, 1, count), rng.uniform(0, solid.section.height, count), rng.uniform(0, solid.width, count)
    x[: count // 4] = 0.0
    one = [solid.functional(x[i], s[i], z[i], np.eye(3)[0]) for i in range(count)]
    one = np.array(one)[:, : math.prod(solid.shape[1:])]  # the three fields have the same functions
    found = []
    for u in field(s, x, z):
        values = np.broadcast_to(u, s.shape)
        found.append(np.linalg.lstsq(one, values)[0])
        assert_allclose(one @ found[-1], values, rtol=0, atol=rtol * max(np.abs(values).max(), 1e-300))
    return np.concatenate(found)


def symbolic_energy(shape: str, field) -> float:
    """2U of the displacement ``field`` by the symbolic gradient, integrated by Gauss points."""
    text, _, root, screw = SHAPES[shape]
    q = symbolic_solid.s, symbolic_solid.x, symbolic_solid.z
    radius = None if math.isinf(root) else sp.nsimplify(root)
    grad = symbolic_solid.gradient(list(map(sp.sympify, field(*q))), parsed(text), radius, sp.nsimplify(screw))
    (a, wa), (b, wb), (c, wc) = gauss(8, -1, 1), gauss(24, 0, HEIGHT), gauss(8, 0, WIDTH)
    points = np.meshgrid(a, b, c, indexing="ij")
    g = np.array([[sp.lambdify(q, grad[i, j], "numpy")(*points) + 0 * points[0] for j in range(3)] for i in range(3)])
    eps = (g + g.swapaxes(0, 1)) / 2
    lam, mu = lame(free_solid(shape).E, free_solid(shape).nu)
    density = lam * np.einsum("iixyz->xyz", eps) ** 2 + 2 * mu * np.einsum("ijxyz,ijxyz->xyz", eps, eps)
    area = sp.lambdify(symbolic_solid.x, parsed(text), "numpy")(b) * wb
    return float(np.einsum("xyz,x,y,z->", density, wa, area, wc))


@pytest.mark.parametrize("shape", SHAPES)
def test_energy_of_motions_of_the_root_is_the_symbolic_one(shape):
    """Fields that move the root, powers of θ, alone and together with those that do not."""
    sigma = parsed(SHAPES[shape][1])
    values = sp.lambdify(symbolic_solid.x, sigma, "numpy")

    def theta(s, x):
        return s * (sigma if isinstance(s, sp.Basic) else values(x))

    fields = [
        lambda s, x, z: (theta(s, x), 1 + 0 * s, 0 * s),
        lambda s, x, z: (theta(s, x) ** 2, theta(s, x) * z, 1 - theta(s, x)),
        lambda s, x, z: (z + x * s, theta(s, x) ** 2 + x**2 * s * z, z**2 * theta(s, x) - x * s**2),
    ]
    solid = free_solid(shape)
    K = full_stiffness(solid)
    for field in fields:
        a = amplitudes(solid, field)
        # rational in x: integrated by more than enough points on either side
        assert a @ K @ a == pytest.approx(symbolic_energy(shape, field), rel=1e-11)


@pytest.mark.parametrize("helix", [0.0, 20.0])
def test_turn_of_the_root_about_the_axis_of_the_gear(helix):
    """No force, and each point of the flank moves by r_b cos β_b against its normal per radian."""
    g = gear(helix)
    b = body(g, order=(4, 5, 6))
    S, phi = b.tooth_parts
    q = np.zeros(len(S))
    q[0] = g.root_radius * math.sqrt(b.root_arc * g.face_width)  # u_θ = r_f on the orthonormal constant
    assert_allclose(S @ q / q[0], 0, atol=1e-14 * np.abs(S).max())
    expected = np.zeros(len(phi))
    expected[0] = -g.base_radius * math.cos(g.beta_b) * math.sqrt((g.tip_radius - g.form_radius) * g.face_width)
    assert_allclose(phi @ q, expected, rtol=0, atol=1e-12 * abs(expected[0]))


@pytest.mark.parametrize("order", [(3, 3, 4), (3, 2, 9)])
@pytest.mark.parametrize("helix", [0.0, 20.0])
def test_parts_of_the_tooth_are_the_schur_complement_of_the_whole(helix, order):
    """Springs of any kind below the root: tooth and springs solved together = clamped tooth + Φ (S + B⁻¹)⁻¹ Φᵀ."""
    b = body(gear(helix), order=order)
    solid, n = b.tooth.build(free=True), b.axis_order
    S, phi = b.tooth_parts
    # amplitudes of root polynomials in the Ritz functions: field, across, height (first), axis
    eta, w = gauss(order[2] + 2)
    h, g = axis_functions(order[2], eta)[0], width_functions(n, eta)[0]
    onto = np.linalg.lstsq(h * np.sqrt(w)[:, None], g * np.sqrt(w)[:, None])[0]  # (axis, n)
    T = np.zeros((*solid.shape, 3, order[0], n))
    for field in range(3):
        for k in range(order[0]):
            T[field, k, 0, :, field, k] = onto
    T = T.reshape(-1, len(S)) / math.sqrt(b.root_arc * b.tooth.gear.face_width)
    inner = np.zeros(solid.shape, dtype=bool)
    inner[:, :, 1:] = True
    P = np.hstack([np.eye(len(T))[:, inner.ravel()], T])
    X = np.random.default_rng(4).standard_normal((len(S), len(S)))
    spring = (X @ X.T + np.eye(len(S))) * np.abs(S).max() * 0.01
    K = P.T @ full_stiffness(solid) @ P
    K[-len(S) :, -len(S) :] += spring
    flank = b.tooth.flank_functionals(solid).matrix() @ P
    together = flank @ np.linalg.solve(K, flank.T)
    clamped = b.tooth.flank_functionals(b.tooth.solid)
    apart = b.tooth.solid.compliance(clamped) + phi @ np.linalg.solve(S + spring, phi.T)
    # condition number 1e6 or so
    assert_allclose(apart, together, rtol=0, atol=1e-10 * together.max())
