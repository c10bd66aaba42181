"""Teeth on the body of their gear: the moving root, the joint to the ring, waves around the gear; truths and limits."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from gearbench.compliance import symbolic_solid
from gearbench.compliance.bases import axis_functions, gauss, width_functions
from gearbench.compliance.gear_body import GearBody
from gearbench.compliance.ring import Ring
from gearbench.compliance.section import Section
from gearbench.compliance.solid import Solid
from gearbench.compliance.solid_tooth import SolidTooth
from gearbench.geometry.gear import Gear

E, NU = 210e3, 0.3


def gear(helix=0.0, teeth=25, module=2.0, width=12.0) -> Gear:
    return Gear(
        teeth=teeth, normal_module=module, pressure_angle=20.0, helix_angle=helix, face_width=width,
        profile_shift=0.1, addendum=1.0, dedendum=1.25, fillet_radius=0.38,
    )  # fmt: skip


def tooth(g: Gear | None = None, order=(4, 5, 5), **options) -> SolidTooth:
    return SolidTooth(gear=g or gear(), E=E, nu=NU, order=order, **options)


def body(g: Gear | None = None, bore=0.6, order=(4, 5, 5), along=8, **options) -> GearBody:
    """Bore radius in root radii."""
    t = tooth(g, order, **options)
    return GearBody(tooth=t, bore_radius=bore * t.gear.root_radius, order=along)


# -- the moving root --------------------------------------------------------------------------------------------------
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
    section = Section(
        height=HEIGHT, half_width=lambda x: half_width(x) + 0 * x, root_radius=root, screw=screw, order=order[:2],
        free=True,
    )  # fmt: skip
    return Solid(section=section, width=WIDTH, E=2.1, nu=NU, order=order[2])


def full_stiffness(solid: Solid) -> np.ndarray:
    n = math.prod(solid.shape)
    return np.einsum("abmn,abkl->mknl", solid._of_section, solid._of_axis).reshape(n, n)


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
    lam, mu = free_solid(shape).lame
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
def test_rigid_motions_of_the_root_cost_no_energy(helix):
    """Six directions of S: along and about the axis to rounding; across as polynomials of θ; tilts like θ R near √x."""
    found = []
    for order in ((3, 3, 4), (4, 5, 5), (5, 6, 6)):
        value = np.linalg.eigvalsh(body(gear(helix), order=order)._tooth_parts[0])
        assert value[0] > -1e-13 * value[-1]
        found.append(value[:6] / value[6])
    found = np.array(found)
    assert np.all(found[:, :2] < 1e-12)
    assert np.all(found < 2e-5)
    for k, limit in enumerate((5e-7, 1e-8, 1e-12)):
        assert np.all(found[k, 2:4] < limit)


@pytest.mark.parametrize("helix", [0.0, 20.0])
def test_turn_of_the_root_about_the_axis_of_the_gear(helix):
    """No force, and each point of the flank moves by r_b cos β_b against its normal per radian."""
    g = gear(helix)
    b = body(g, order=(4, 5, 6))
    S, phi = b._tooth_parts
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
    solid, n = b.tooth.free_solid, b.axis_order
    S, phi = b._tooth_parts
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
    flank = b.tooth.flank_functionals(solid) @ P
    together = flank @ np.linalg.solve(K, flank.T)
    clamped = b.tooth.flank_functionals(b.tooth.solid)
    apart = b.tooth.solid.compliance(clamped) + phi @ np.linalg.solve(S + spring, phi.T)
    # condition number 1e6 or so
    assert_allclose(apart, together, rtol=0, atol=1e-10 * together.max())


# -- waves around the gear --------------------------------------------------------------------------------------------
def dense_body(b: GearBody) -> tuple[np.ndarray, np.ndarray]:
    """All z teeth at once: motions q (tooth, r) per unit force on the roots, complex; and Φ.

    Green's function of the rim summed over its harmonics −N … N, tractions and motions integrated over s by Gauss
    points; neither waves nor phases nor symmetry of the roots.
    """
    g, t = b.tooth.gear, b.tooth
    z, psi, count, n_s = g.teeth, float(g.half_angle(g.root_radius)), b.axis_order, t.order[0]
    S, phi = b._tooth_parts
    ring = Ring(
        inner_radius=b.bore_radius, radius=g.root_radius, width=g.face_width, screw=math.tan(g.beta) / g.pitch_radius,
        E=E, nu=NU, order=(b.order, count),
    )  # fmt: skip
    most = z * math.ceil(30.0 / psi / z) + z // 2
    n = np.arange(-most, most + 1)
    positive = ring.all_harmonics(most)
    # of negative harmonics: the conjugate field is another real solution, e^{−inθ} with −i for i
    phase = (1j ** (np.array([1, 0, 1])[:, None] + np.arange(count))).ravel()
    C = phase[:, None] * positive[np.abs(n)] * np.conj(phase)
    C = np.where(n[:, None, None] < 0, np.conj(C), C).reshape(len(n), 3, count, 3, count)
    s, w = gauss(80, -1, 1)
    P = width_functions(n_s, (s + 1) / 2)[0] / math.sqrt(2 * psi * g.root_radius)
    wave = np.einsum("sk,s,ns->nk", P, w * psi * g.root_radius, np.exp(1j * np.multiply.outer(n, s * psi)))
    B = np.zeros((z, 3, n_s, count, 3, n_s, count), dtype=complex)
    for d in range(z):
        turn = np.exp(2j * math.pi * n * d / z) / (2 * math.pi)
        B[d] = np.einsum("n,nk,nl,nfjge->fkjgle", turn, wave, np.conj(wave), C, optimize=True)
    r = len(S)
    B = B.reshape(z, r, r)
    assert_allclose(B.imag, 0, atol=1e-12 * np.abs(B).max())
    whole = np.block([[B[(i - j) % z].real for j in range(z)] for i in range(z)])
    motion = np.linalg.solve(np.eye(z * r) + whole @ np.kron(np.eye(z), S), whole)
    return motion.reshape(z, r, z, r)[:, :, 0], phi


@pytest.mark.parametrize(("helix", "teeth", "bore"), [(0.0, 11, 0.6), (25.0, 12, 0.6), (-15.0, 11, 0.9)])
def test_blocks_against_all_teeth_solved_at_once(helix, teeth, bore):
    b = body(gear(helix, teeth=teeth), bore=bore, order=(3, 3, 3), along=6)
    motion, phi = dense_body(b)
    for d, block in zip(range(-2, 3), b.blocks(2), strict=True):
        # the wave ± z/2 of an even number of teeth ends with one harmonic more on one side
        tolerance = (1e-5 if teeth % 2 == 0 else 1e-10) * np.abs(b.blocks(0)).max()
        assert_allclose(block, phi @ motion[d % teeth] @ phi.T, rtol=0, atol=tolerance)
