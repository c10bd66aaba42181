"""Solid teeth on their ring against finite elements of the gear down to its bore: own and neighbouring teeth."""

from __future__ import annotations

import numpy as np
import pytest

from fem_reference.refinement import Level, refined_compliance, solved
from fem_reference.section import Body
from gearbench.compliance.flank import FlankCompliance
from gearbench.compliance.gear_body import ToothedRing
from gearbench.compliance.solid_tooth import SolidTooth
from gearbench.geometry.material import Material
from tests.support.gears import standard_gear

#: A thin rim with straight teeth, a solid gear with helical ones: helix, teeth, width, bore in root radii.
CASES = {"thin rim": (0.0, 24, 3.0, 0.8), "helical": (20.0, 18, 4.0, 0.6)}


def finite_elements(case: str) -> Body:
    helix, teeth, width, bore = CASES[case]
    gear = standard_gear(teeth, width, helix=helix)
    return Body(gear=gear, bore_radius=bore * gear.root_radius, teeth=5)


def ritz(body: Body, material: Material, order: tuple[int, int, int], along: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """Clamped tooth (p, q, p, q) and what the body adds, (5, p, q, p, q)."""
    assert body.bore_radius is not None
    tooth = SolidTooth(gear=body.gear, E=material.E, nu=material.nu, order=order, heights=4)
    shape = 2 * tooth.flank_order
    blocks = ToothedRing(tooth=tooth, bore_radius=body.bore_radius, order=along).blocks(2)
    return tooth.matrix.reshape(shape), blocks.reshape(-1, *shape)


def fe_blocks(found: FlankCompliance, count: int = 3) -> np.ndarray:
    """Low polynomials of the blocks d = −2 … 2, (5, count, count, count, count)."""
    n = found.neighbours
    blocks = found.blocks[n - 2 : n + 3].reshape(5, *found.order, *found.order)
    return blocks[:, :count, :count, :count, :count]


def low(blocks: np.ndarray, count: int = 3) -> np.ndarray:
    return blocks[..., :count, :count, :count, :count]


def norms(blocks: np.ndarray) -> np.ndarray:
    return np.linalg.norm(blocks.reshape(len(blocks), -1), axis=1)


@pytest.mark.parametrize("case", CASES)
def test_solid_on_a_ring_agrees_with_a_coarse_mesh(case, steel):
    """Own tooth, neighbours and next but one."""
    body = finite_elements(case)
    fe = fe_blocks(solved(Level(body=body, number=2, waves=5), steel, (4, 5)))
    clamped, added = ritz(body, steel, (6, 7, 6))
    mine = low(added)
    mine[2] += low(clamped)
    assert np.all(norms(mine - fe) < [0.016, 0.016, 0.02, 0.016, 0.016] * norms(fe))
    # the body is half of it or more, the neighbours' part more than the tolerance
    assert low(clamped)[0, 0, 0, 0] < 0.6 * fe[2, 0, 0, 0, 0]
    assert np.all(norms(fe) > 0.03 * norms(fe)[2])
    # and tooth + 1, before the loaded flank, moves otherwise than tooth − 1 behind it
    assert norms((mine[::-1] - fe)[[1]]) > 0.05 * norms(fe[[1]])


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_solid_on_a_ring_converges_to_the_finite_elements(case, steel):
    """Richardson's value of the meshes, and orders that grow."""
    body = finite_elements(case)
    fe = fe_blocks(refined_compliance(body, steel, 0.004, (4, 5)))
    errors = []
    for order, along in (((4, 5, 5), 6), ((6, 7, 6), 6), ((9, 13, 8), 10)):
        clamped, added = ritz(body, steel, order, along)
        mine = low(added)
        mine[2] += low(clamped)
        errors.append(norms(mine - fe) / norms(fe))
    errors = np.array(errors)
    assert errors[0, 2] > errors[1, 2] > errors[2, 2]
    assert errors[1, 2] < 0.012
    assert np.all(errors[2] < 0.005)
