"""The solid tooth against closed forms, bounds, invariants and limits."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.compliance.bases import gauss
from gearbench.compliance.section import ToothSection
from gearbench.compliance.solid import Solid
from gearbench.compliance.solid_tooth import SolidTooth
from gearbench.effects.teeth import solid_order
from gearbench.geometry.gear import Gear
from gearbench.geometry.material import lame
from tests.support.gears import standard_gear

E, NU = 210e3, 0.3


def gear(helix=0.0, teeth=25, module=2.0, width=12.0) -> Gear:
    return standard_gear(teeth, width, normal_module=module, helix=helix, profile_shift=0.1)


def block(height=2.0, thickness=1.5, width=3.0, nu=NU, order=(3, 3, 3)) -> Solid:
    section = ToothSection(
        height=height, half_width=lambda x: np.full_like(x, thickness / 2), root_radius=math.inf, screw=0.0,
        order=order[:2],
    )  # fmt: skip
    return Solid(section=section, width=width, E=E, nu=nu, order=order[2])


def tooth(g=None, order=(4, 5, 5), **options) -> SolidTooth:
    return SolidTooth(gear=g or gear(), E=E, nu=NU, order=order, **options)


def face_integrals(solid: Solid, thickness: float, direction: int):
    """Functionals ∫ u_direction dA over the faces: tip, s = 1, s = −1, z = 0, z = b; (5, n)."""
    height, b, unit = solid.section.height, solid.width, np.eye(3)[direction]
    t, w = gauss(8)
    pairs = np.array([(p, q) for p in range(8) for q in range(8)]).T
    weight = w[pairs[0]] * w[pairs[1]]
    tip = sum(
        thickness * b * weight[k] * solid.functional(height, 2 * t[i] - 1, t[j] * b, unit)
        for k, (i, j) in enumerate(pairs.T)
    )
    sides = [height * b * weight @ solid.functional(t[pairs[0]] * height, s, t[pairs[1]] * b, unit) for s in (1, -1)]
    ends = [
        sum(
            height * thickness * weight[k] * solid.functional(t[i] * height, 2 * t[j] - 1, z, unit)
            for k, (i, j) in enumerate(pairs.T)
        )
        for z in (0.0, b)
    ]
    return np.array([tip, *sides, *ends])


@pytest.mark.parametrize("order", [(1, 1, 1), (2, 2, 2), (4, 3, 3)])
@pytest.mark.parametrize("direction", [0, 1, 2])
def test_patch_test(direction, order):
    """Tractions of a constant stress give back its linear displacement u = γ x exactly, at any order."""
    thickness = 1.5
    solid = block(thickness=thickness, order=order)
    lam, mu = lame(solid.E, solid.nu)
    faces = np.array([face_integrals(solid, thickness, k) for k in range(3)])  # (direction, face, n)
    tip, side_1, side_0, end_0, end_1 = faces.swapaxes(0, 1)
    if direction == 1:  # stretch along the height: normal stresses
        load = (lam + 2 * mu) * tip[1] + lam * (side_1 - side_0)[0] + lam * (end_1 - end_0)[2]
    elif direction == 0:  # shear between θ and R
        load = mu * (tip[0] + (side_1 - side_0)[1])
    else:  # shear between z and R
        load = mu * (tip[2] + (end_1 - end_0)[1])
    rng = np.random.default_rng(0)
    x, z, s = rng.uniform(0, 2, 9), rng.uniform(0, 3, 9), rng.uniform(-1, 1, 9)
    rows = np.array([solid.functional(x[i], s[i], z[i], np.eye(3)[k]) for i in range(9) for k in range(3)])
    moved = solid.compliance(np.vstack([rows, load]))[:-1, -1].reshape(9, 3)
    assert_allclose(moved, np.outer(x, np.eye(3)[direction]), rtol=0, atol=1e-12)


@pytest.mark.parametrize("slenderness", [5, 20, 60])
def test_slender_block_is_timoshenko_s_cantilever(slenderness):
    """ν = 0, shear on the tip spread as in the beam: F L³/3EI + 6/5 F L/GA."""
    height, width = 10.0, 1.0
    h = height / slenderness
    solid = block(height=height, thickness=h, width=width, nu=0.0, order=(4, 12, 1))
    t, w = gauss(12)
    s = 2 * t - 1
    tip = sum(
        1.5 * (1 - s[k] ** 2) * w[k] * solid.functional(height, s[k], 0.5, np.array([1.0, 0, 0])) for k in range(12)
    )
    exact = height**3 / (3 * E * width * h**3 / 12) + 1.2 * height / (E / 2 * width * h)
    # the clamp keeps the root from warping: less by h/L times something small beside the shear's (h/L)²
    assert_allclose(solid.compliance(tip[None])[0, 0], exact, rtol=0.3 / slenderness**2)


@pytest.mark.parametrize("helix", [0.0, 25.0])
def test_bound_compliance_grows_with_every_function(helix):
    """Rayleigh–Ritz: C(order) increases in the sense of quadratic forms, load and displacement being the same."""
    orders = [(2, 3, 3), (3, 3, 3), (3, 4, 3), (3, 4, 4), (4, 5, 5), (5, 7, 6)]
    matrices = []
    for order in orders:
        t = tooth(gear(helix), order, measured_at="flank", heights=3)
        q = t.flank_order[1]
        matrices.append(t.matrix.reshape(3, q, 3, q)[:, :3, :, :3].reshape(9, 9))
    for coarse, fine in pairwise(matrices):
        assert np.linalg.eigvalsh(fine - coarse).min() > -1e-14 * np.abs(fine).max()
        assert np.trace(fine) > np.trace(coarse)


@pytest.mark.parametrize("helix", [0.0, 30.0])
@pytest.mark.parametrize(("width", "teeth"), [(1.0, 25), (100.0, 25), (12.0, 10), (12.0, 150)])
@pytest.mark.parametrize("order", [(4, 5, 5), (6, 9, 8)])
def test_condition_number(helix, width, teeth, order):
    assert tooth(gear(helix, teeth=teeth, width=width), order).condition < 1e6


@pytest.mark.parametrize(("helix", "teeth"), [(0.0, 11), (15.0, 12), (0.0, 25)])
def test_default_order_knows_the_shape_of_the_section(helix, teeth):
    """Compliance of even and tilted loads on the flank within 0.7 % of many functions; 1.1 % by 6 × 7 at 11 teeth."""
    g = gear(helix, teeth=teeth, width=6.0)
    across, along, axis = solid_order(g)
    few, many = (tooth(g, order) for order in ((across, along, axis), (10, 20, axis + 2)))
    q = few.flank_order[1]
    low = np.add.outer(q * np.arange(2), np.arange(2)).ravel()
    exact = many.matrix[np.ix_(low, low)]
    assert np.linalg.norm(few.matrix[np.ix_(low, low)] - exact) < 0.007 * np.linalg.norm(exact)


def test_quadrature_is_exact_enough():
    """Panels in √x and slopes by differences agree with the outline in its exact parameters."""
    t = tooth(gear(20.0))
    section = t.solid.section
    a, b = (s.stiffness(lame(t.E, t.nu)) for s in (section, replace(section, outline=None)))
    # far below what the orders leave: the fillet is smooth in √x, not polynomial
    assert_allclose(a, b, rtol=0, atol=1e-8 * np.abs(b).max())


@pytest.mark.parametrize("helix", [0.0, 20.0])
@pytest.mark.parametrize("axis", [1, 4, 5])
def test_chains_are_all_there_is(helix, axis):
    """Every amplitude is in one class; the stiffness is zero between classes and outside the chains."""
    solid = tooth(gear(helix), order=(3, 2, axis)).build(free=True)
    inner, root = (
        np.concatenate([solid.amplitudes(c) for c in found]) for found in (solid.classes, solid.root_classes)
    )
    assert_allclose(np.sort(np.concatenate([inner, root])), np.arange(math.prod(solid.shape)))
    S, Z = solid.of_section, solid.of_axis
    full = np.einsum("abmn,abkl->mknl", S, Z).reshape(2 * (math.prod(solid.shape),))
    for chosen, other, chain in zip(solid.classes, solid.root_classes, solid.chains, strict=True):
        at, moving = solid.amplitudes(chosen), solid.amplitudes(other)
        order = np.sort(at)  # the chain takes two functions along the axis at a time
        assert_allclose(np.linalg.eigvalsh(chain.matrix()), np.linalg.eigvalsh(full[np.ix_(order, order)]), rtol=1e-9)
        assert_allclose(chain.matrix(), full[np.ix_(at, at)], rtol=0, atol=1e-12 * full.max())
        down = np.arange(axis)[::-1]
        blocks = solid.blocks(chosen, other, down[:, None], down)
        whole = np.block([[blocks.matrix(i, j) for j in range(axis)] for i in range(axis)])
        assert_allclose(whole, full[np.ix_(at, moving)], rtol=0, atol=1e-12 * full.max())
        rest = np.setdiff1d(np.arange(len(full)), np.concatenate([at, moving]))
        assert np.abs(full[np.ix_(at, rest)]).max(initial=0.0) < 1e-12 * full.max()
