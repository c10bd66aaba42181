"""Compliance of flanks: polynomials, roots of the blocks of neighbouring teeth, the mirror image of the driven gear."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.compliance.bases import gauss
from gearbench.compliance.flank import FlankCompliance, flank_factor, flank_matrix, flank_polynomials, joined
from gearbench.geometry.action import contact_lines
from tests.effects.test_gear_body import scene
from tests.support.gears import standard_gear

GEAR = standard_gear(20, 6.0, helix=15.0)


def flank(C: np.ndarray, **options: Any) -> FlankCompliance:
    size = C.shape[1]
    return FlankCompliance(gear=GEAR, order=(2, size // 2), blocks=C, **options)


def test_polynomials_are_orthonormal_on_the_flank():
    (R, along), (y, across) = gauss(5, GEAR.form_radius, GEAR.tip_radius), gauss(6, 0.0, GEAR.face_width)
    R, y = (grid.ravel() for grid in np.meshgrid(R, y, indexing="ij"))
    weight = np.outer(along, across).ravel()
    phi = flank_polynomials(GEAR, (4, 5), R, y)
    assert_allclose(phi.T @ (weight[:, None] * phi), np.eye(20), rtol=0, atol=1e-13)
    assert weight.sum() == pytest.approx((GEAR.tip_radius - GEAR.form_radius) * GEAR.face_width, rel=1e-14)
    # beyond the flank the nearest point counts
    edge, beyond = (flank_polynomials(GEAR, (4, 5), np.array(GEAR.tip_radius + d), np.array(2.0)) for d in (0.0, 0.1))
    assert_allclose(beyond, edge, rtol=1e-14)


def blocks(far: int, size: int = 4, seed: int = 2) -> np.ndarray:
    """C_d = Σ A_{d+k} A_kᵀ, a convolution square: any row of teeth is semidefinite; C_−d = C_dᵀ."""
    A = np.random.default_rng(seed).standard_normal((far + 1, size, size))
    C = np.zeros((2 * far + 1, size, size))
    for i in range(far + 1):
        for j in range(far + 1):
            C[far + i - j] += A[i] @ A[j].T
    return C


@pytest.mark.parametrize("driven", [False, True])
@pytest.mark.parametrize(("far", "teeth"), [(0, 1), (0, 3), (1, 2), (2, 2), (1, 4), (3, 3)])
def test_root_is_a_square_root_of_all_teeth(far, teeth, driven):
    C = blocks(far)
    root = flank(C, driven=driven).root(teeth)
    product = np.einsum("iar,jbr->ijab", root, root)
    for i in range(teeth):
        for j in range(teeth):
            d = j - i if driven else i - j
            expected = C[far + d] if abs(d) <= far else np.zeros_like(C[0])
            assert_allclose(product[i, j], expected, rtol=0, atol=1e-12 * np.abs(C).max())


def test_root_drops_what_is_not_positive():
    """A symmetric block with one negative and one tiny eigenvalue: the others are kept as they are."""
    Q, _ = np.linalg.qr(np.random.default_rng(3).standard_normal((4, 4)))
    value = np.array([2.0, 0.5, 1e-14, -0.1])
    root = flank((Q * value @ Q.T)[None]).root()
    assert root.shape == (1, 4, 2)
    assert_allclose(root[0] @ root[0].T, Q[:, :2] * value[:2] @ Q[:, :2].T, rtol=0, atol=1e-14)
    # deflections are those of the factor
    found = flank((Q * value @ Q.T)[None])
    direct = found.factor(1.9, 1.0) @ found.factor(1.4, 3.5)
    assert found.deflection(1.9, 1.0, 1.4, 3.5) == pytest.approx(direct, rel=1e-12)
    assert flank((Q * value @ Q.T)[None], rank_tolerance=0.5).root().shape[-1] == 1


@pytest.mark.parametrize("d", [-1, 0, 1])
def test_driven_gear_is_the_mirror_image(d):
    """Of the deflection at a due to a force at b the faces are swapped, and the neighbour is the other one."""
    driving, driven = flank(blocks(1)), flank(blocks(1), driven=True)
    b = GEAR.face_width
    found = driven.deflection(1.9, b - 1.0, 1.4, b - 3.5, d)
    assert found == pytest.approx(driving.deflection(1.9, 1.0, 1.4, 3.5, -d), rel=1e-13)
    assert abs(driven.deflection(1.9, 1.0, 1.4, 3.5, d) / found - 1) > 0.01
    beyond = flank(blocks(1)).deflection(1.9, 1.0, 1.4, 3.5, 2)
    assert beyond == 0.0


@pytest.mark.parametrize("coupled", [False, True])
def test_both_flanks_on_contact_lines_are_their_factors_side_by_side(coupled):
    pair = scene("helical").pair
    lines = contact_lines(pair, np.array([0.1, 0.6]), 4)
    count = lines.shape[1]
    own = [FlankCompliance(gear=g, order=(2, 2), blocks=blocks(1), driven=k == 1) for k, g in enumerate(pair.gears)]
    height = [R - gear.root_radius for R, gear in zip(lines.radii, pair.gears, strict=True)]
    factors = []
    for i in range(count):
        row = (i, count) if coupled else (0, 1)
        parts = [f.factor(height[k][:, i], lines.y[:, i], *row) for k, f in enumerate(own)]
        factors.append(np.where(lines.active[:, i, None, None], np.concatenate(parts, axis=-1), 0.0))
    expected = np.stack(factors, axis=1)
    if not coupled:
        assert_allclose(flank_factor(own, lines), expected, rtol=0, atol=1e-14 * np.abs(expected).max())
        return
    psi = expected.reshape(2, count * 4, -1)
    H = psi @ np.swapaxes(psi, 1, 2)
    assert_allclose(flank_matrix(own, lines), H, rtol=0, atol=1e-13 * H.max())


@pytest.mark.parametrize("neighbours", [0, 1])
def test_joined_compliances_are_their_sum_less_what_is_negative_of_it(neighbours, monkeypatch):
    """Teeth with a negative direction that their bodies fill, and one that they do not; a few positions at a time."""
    pair = scene("helical").pair
    lines = contact_lines(pair, np.array([0.1, 0.35, 0.6]), 4)
    body = blocks(neighbours)
    value, Q = np.linalg.eigh(body[neighbours])
    both = []
    for k, gear in enumerate(pair.gears):
        teeth, bodies = (
            FlankCompliance(gear=gear, order=(2, 2), blocks=b, driven=k == 1)
            for b in ((Q * [-0.9 * value[0], -1.4 * value[1], 0.5, 2.0] @ Q.T)[None], body)
        )
        both.append((teeth, bodies, joined(teeth, bodies)))
    sums = [total for _, _, total in both]
    H = body.copy()
    H[neighbours] += Q * [-0.9 * value[0], -value[1], 0.5, 2.0] @ Q.T
    n = lines.shape[1]
    expected = np.zeros((3, n, 4, n, 4))
    for k, flank in enumerate(sums):
        phi = flank.shapes(lines.radii[k] - flank.gear.root_radius, lines.gear_y(k)) * lines.active[:, :, None, None]
        for i, j in product(range(n), range(n)):
            if abs(i - j) <= neighbours:
                block = H[neighbours + (j - i if k == 1 else i - j)]
                expected[:, i, :, j] += phi[:, i] @ block @ np.swapaxes(phi[:, j], 1, 2)
    expected = expected.reshape(3, 4 * n, -1)
    for together in (1, 10**6):
        monkeypatch.setattr("gearbench.compliance.flank.TOGETHER", together)
        assert_allclose(flank_matrix(sums, lines), expected, rtol=0, atol=1e-13 * expected.max())
    with pytest.raises(ValueError, match="same polynomials"):
        joined(both[0][0], replace(both[0][1], driven=True))


def test_a_matrix_that_is_negative_somewhere_loses_that_part():
    """Blocks that say more of the neighbours than of the tooth itself: not a compliance."""
    C = blocks(1)
    C[[0, 2]] *= 1.2 * np.linalg.norm(C[1], 2) / np.linalg.norm(C[0], 2)
    found = flank(C)
    basis, matrix = found.between(3)
    wide = matrix.reshape(2 * (3 * basis.shape[1],))
    assert np.linalg.eigvalsh(wide)[0] > -1e-12 * np.linalg.norm(wide)
    psi = found.root(3).reshape(3 * len(C[0]), -1)
    whole = np.block([[basis @ matrix[i, :, j] @ basis.T for j in range(3)] for i in range(3)])
    assert_allclose(whole, psi @ psi.T, rtol=0, atol=1e-12 * np.abs(whole).max())
    exact = np.block([[found.block(i - j) for j in range(3)] for i in range(3)])
    assert np.linalg.eigvalsh(exact)[0] < -0.1 * np.linalg.eigvalsh(exact)[-1]


def test_neighbours_deflect_each_other_in_few_directions():
    C = blocks(1)
    some = np.linalg.eigh(C[1])[1][:, -2:]  # with small coupling here, the matrix of all teeth is positive
    C[0] = 0.1 * some @ (some.T @ C[0] @ some) @ some.T
    C[2] = C[0].T
    found = flank(C)
    basis, matrix = found.coupling(3)
    assert basis.shape == (len(C[0]), 2)
    for i, j in ((0, 1), (1, 0), (1, 2), (2, 0)):
        # the teeth of ``blocks(1)`` deflect only the next ones
        assert_allclose(basis @ matrix[i, :, j] @ basis.T, found.block(i - j), rtol=0, atol=1e-12 * C[1].max())
