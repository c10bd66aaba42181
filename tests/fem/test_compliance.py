"""Flank compliance: invariants, agreement of elements, refinement with its error bar."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.compliance import solve_flank
from fem_reference.section import Body
from fem_reference.tooth_mesh import Cells, tooth_mesh
from gearbench.compliance.flank import flank_polynomials
from tests.support.gears import standard_gear
from tests.support.node_positions import node_positions
from tests.support.plain_meshes import flank_compliance, mesh_cells, unknowns
from tests.support.strips import OutsideError, interior_points

COARSE = Cells(thickness=4, flank=5, fillet=4, width=6)


@pytest.fixture(scope="module")
def tooth(spur):
    return tooth_mesh(Body(gear=spur), COARSE)


@pytest.fixture(scope="module")
def helical():
    return standard_gear(20, helix=25.0)


def test_linear_fields_are_interpolated_exactly_inside(tooth):
    rng = np.random.default_rng(5)
    gear = tooth.body.gear
    R, psi = rng.uniform(7.5, 9.4, 50), rng.uniform(-0.9, 0.9, 50)
    theta = psi * gear.half_angle(R)
    place = np.column_stack([R * np.sin(theta), R * np.cos(theta), rng.uniform(0, gear.face_width, 50)])
    A = rng.standard_normal((3, 3))
    u = (node_positions(tooth.space) @ A.T).reshape(-1, 1)
    direction = rng.standard_normal((50, 3))
    found = interior_points(tooth.space, place).displacement(u, direction)[:, 0]
    # isoparametric: linear fields up to the O(h⁴) of a serendipity element on curved cells
    assert_allclose(found, np.einsum("pi,ij,pj->p", direction, A, place), atol=2e-3)
    b = gear.face_width
    for outside in ((0.0, gear.tip_radius + 0.2, 1.0), (0.0, 8.5, -0.3), (0.0, 8.5, b + 0.3), (1.5, 8.5, 1.0)):
        with pytest.raises(OutsideError):
            interior_points(tooth.space, np.array([outside]))


def test_flank_compliance_is_symmetric_and_positive(tooth, steel):
    basis = partial(flank_polynomials, tooth.body.gear, (4, 5))
    solution = solve_flank(tooth, steel, basis)
    C = solution.surface(basis)
    assert_allclose(C, C.T, atol=1e-12 * np.abs(C).max())  # Maxwell–Betti, to rounding
    assert np.linalg.eigvalsh(C).min() > 0
    # mirror symmetry of a spur tooth: even and odd polynomials across the width do not couple
    C = C.reshape(4, 5, 4, 5)
    assert_allclose(C[:, ::2, :, 1::2], 0, atol=1e-10 * np.abs(C).max())


def test_factor_reproduces_the_compliance(tooth, steel):
    found = flank_compliance(tooth, steel, (4, 4))
    rng = np.random.default_rng(0)
    height, y = rng.uniform(0.8, 2.2, 30), rng.uniform(0, 4, 30)
    psi = found.factor(height, y)
    shapes = found.shapes(height, y)
    direct = shapes @ found.block(0) @ shapes.T
    # negative eigenvalues of the remainder are dropped: 1 % of the largest entry
    assert_allclose(psi @ psi.T, direct, atol=0.01 * direct.max())
    assert_allclose(found.deflection(height[:, None], y[:, None], height, y), psi @ psi.T, atol=1e-10 * direct.max())


@pytest.mark.parametrize("kind", ["hex27", "tet10"])
def test_elements_agree_on_a_helical_tooth(helical, steel, kind):
    basis = partial(flank_polynomials, helical, (3, 4))
    found = {}
    for name, cells in {"hex20": COARSE, kind: Cells(thickness=4, flank=6, fillet=4, width=6)}.items():
        found[name] = solve_flank(tooth_mesh(Body(gear=helical), cells, name), steel, basis).surface(basis)
    # both within 1.5 % of the exact value (meshes of this size against fine ones)
    assert np.linalg.norm(found[kind] - found["hex20"]) < 0.02 * np.linalg.norm(found["hex20"])


@pytest.mark.slow
def test_neighbours_on_a_rim(steel):
    gear = standard_gear(24, 3.0)
    cells = Cells(thickness=4, flank=4, fillet=2, width=3, foot=1, land=1, rim=4, rest=(2, 5))
    thin = {}
    for teeth in (3, 24):
        body = Body(gear=gear, bore_radius=7.0, teeth=teeth)
        thin[teeth] = flank_compliance(tooth_mesh(body, cells), steel, (3, 3))
    # a ring without teeth in place of the other 21: nothing changes where the load is
    n3, n24 = thin[3].neighbours, thin[24].neighbours
    assert_allclose(thin[3].blocks[n3], thin[24].blocks[n24], atol=0.004 * np.abs(thin[24].blocks[n24]).max())
    assert_allclose(thin[3].blocks[n3 + 1], thin[24].blocks[n24 + 1], atol=0.004 * np.abs(thin[24].blocks[n24]).max())
    C = thin[24].blocks
    assert_allclose(C[n24 - 1], C[n24 + 1].T)
    root = thin[3].root(3)
    assert root.shape[0] == 3
    found = np.einsum("iar,jbr->iajb", root, root)
    # tooth 2 sees tooth 1 as tooth 1 sees tooth 0
    assert_allclose(found[2, :, 1], thin[3].blocks[n3 + 1], atol=0.02 * np.abs(C[n24]).max())
    assert_allclose(found[0, :, 1], thin[3].blocks[n3 - 1], atol=0.02 * np.abs(C[n24]).max())


def test_unknowns_are_estimated(spur):
    for body in (Body(gear=spur), Body(gear=spur, bore_radius=3.0, teeth=3)):
        cells = mesh_cells(body, 4)
        actual = 3 * tooth_mesh(body, cells).space.n_nodes
        assert 0.6 < unknowns(body, cells) / actual < 1.5
