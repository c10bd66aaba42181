"""Rings by finite elements, and solid teeth on their ring against them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.refinement import Level, blocks_of, default_order
from fem_reference.section import Body
from fem_reference.sector import Grain, Section
from gearbench import simulate
from gearbench.compliance.gear_body import ToothedRing
from gearbench.effects.teeth import solid_tooth
from gearbench.geometry.material import Material
from gearbench.scene_file import parse_scene
from tests.geometry.test_internal import drawn, example, internal


def ring(helix: float = 0.0):
    wheel = {"addendum": 0.85}
    a = 48.0 if not helix else 51.0
    return internal(24, 72, a=a, helix_angle=helix, wheel=wheel, pinion={"profile_shift": 0.0}).gears[1]


def finite_elements(gear, rim: float, support=None) -> np.ndarray:
    """Blocks between a tooth and its neighbours."""
    body = Body(gear=gear, bore_radius=gear.root_radius - rim * gear.normal_module, teeth=3, support=support)
    return blocks_of(Level(body=body, number=3, waves=default_order(gear)[1]), Material(), default_order(gear))


def solid(gear, rim: float, neighbours: int, support=None) -> np.ndarray:
    tooth = solid_tooth(gear, Material(), None, True)
    body = ToothedRing(tooth=tooth, bore_radius=gear.root_radius - rim * gear.normal_module, support=support)
    blocks = body.blocks(neighbours)
    blocks[neighbours] += tooth.matrix
    return blocks


def test_random_rings_are_not_inverted_and_have_their_area():
    rng = np.random.default_rng(33)
    for gear in (drawn(rng) for _ in range(12)):
        body = Body(gear=gear, bore_radius=1.05 * gear.root_radius, teeth=3)
        section = Section(body=body, grain=Grain(degree=4))
        assert (section.jacobians(6) * np.sign(gear.teeth)).min() > 0


@pytest.mark.parametrize(
    ("helix", "rim", "support"),
    [
        (0.0, 1.2, None),
        pytest.param(0.0, 1.5, (0.0, 1.0), marks=pytest.mark.slow),
        (0.0, 2.8, (0.0, 2000.0)),
        pytest.param(20.0, 3.0, None, marks=pytest.mark.slow),
        pytest.param(20.0, 1.5, (0.0, 1.0), marks=pytest.mark.slow),
    ],
)
def test_solid_teeth_on_their_ring_are_those_of_finite_elements(helix, rim, support):
    """An even load on a flank, its neighbour, and three teeth on; ring of little rim on springs: it ovalises."""
    gear = ring(helix)
    exact = finite_elements(gear, rim, support)[:, 0, 0]
    found = solid(gear, rim, len(exact) // 2, support)[:, 0, 0]
    middle = len(exact) // 2
    assert found[middle] == pytest.approx(exact[middle], rel=0.01)
    assert_allclose(found, exact, rtol=0, atol=0.01 * exact[middle])


@pytest.mark.slow
def test_a_free_ring_ovalises_alike():
    """Rim of 1.5 modules: under opposite loads what a loaded tooth yields more than one a quarter further."""
    gear = ring()
    import fem_reference.refinement as refinement

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(refinement, "NEIGHBOURS", 35)
        exact = finite_elements(gear, 1.5, (0.0, 0.1))[:, 0, 0]
    found = solid(gear, 1.5, 35, (0.0, 0.1))[:, 0, 0]
    oval = [C[35] + C[70] - C[35 + 18] - C[35 - 17] for C in (found, exact)]
    assert oval[0] == pytest.approx(oval[1], rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("support", [None, {"radial": 500.0, "tangential": 5000.0}])
def test_a_pair_with_a_ring_is_that_of_finite_elements(support):
    tables = example(pair__wheel__outer_diameter=211.0, resolution={"positions": 24, "segments": 15})
    if support is not None:
        tables["pair"]["wheel"]["support"] = support
    found = simulate(parse_scene(tables))
    tables["effects"]["tooth_bending"] = {"model": "finite_elements"}
    exact = simulate(parse_scene(tables))
    for name, limit in (("mesh_stiffness_mean", 0.01), ("transmission_error_mean", 0.01)):
        assert float(found[name]) == pytest.approx(float(exact[name]), rel=limit)
    name = "transmission_error_peak_to_peak"
    assert float(found[name]) == pytest.approx(float(exact[name]), rel=0.03)
