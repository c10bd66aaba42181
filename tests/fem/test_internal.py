"""Rings by finite elements, and solid teeth on their ring against them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.outside import Outside
from fem_reference.refinement import NEIGHBOURS, Level, default_order, solved
from fem_reference.section import Body
from fem_reference.sector import Grain, Section
from fem_reference.waves import wave_numbers
from gearbench import simulate
from gearbench.compliance.gear_body import ToothedRing
from gearbench.compliance.lugs import Lugs
from gearbench.effects.teeth import solid_tooth
from gearbench.geometry.material import Material
from gearbench.scene_file import parse_scene
from tests.geometry.test_internal import drawn, example, internal
from tests.support.jacobians import jacobians


def ring(helix: float = 0.0):
    wheel = {"addendum": 0.85}
    a = 48.0 if not helix else 51.0
    return internal(24, 72, a=a, helix_angle=helix, wheel=wheel, pinion={"profile_shift": 0.0}).gears[1]


def finite_elements(gear, rim: float, support=None, lugs=None, neighbours: int = NEIGHBOURS):
    """Compliance between a tooth and its neighbours."""
    outside = gear.root_radius - rim * gear.normal_module
    body = Body(gear=gear, bore_radius=outside, teeth=3, support=support, lugs=lugs)
    return solved(Level(body=body, number=3, waves=default_order(gear)[1]), Material(), default_order(gear), neighbours)


def solid(gear, rim: float, neighbours: int, support=None, lugs=None):
    tooth, outside = solid_tooth(gear, Material(), None, True), gear.root_radius - rim * gear.normal_module
    flank = ToothedRing(tooth=tooth, bore_radius=outside, support=support, lugs=lugs).flank(neighbours)
    flank.blocks[neighbours] += tooth.matrix
    return flank


@pytest.mark.parametrize("count", [12, pytest.param(60, marks=pytest.mark.slow)])
def test_no_random_ring_is_inverted(count):
    rng = np.random.default_rng(33)
    for gear in (drawn(rng) for _ in range(count)):
        body = Body(gear=gear, bore_radius=1.05 * gear.root_radius, teeth=3)
        section = Section(body=body, grain=Grain(degree=4))
        assert (jacobians(section, 6) * np.sign(gear.teeth)).min() > 0


@pytest.mark.parametrize(
    ("helix", "rim", "support"),
    [
        (0.0, 1.2, None),
        (0.0, 2.8, (0.0, 2000.0)),
        pytest.param(20.0, 1.5, (0.0, 1.0), marks=pytest.mark.slow),
    ],
)
def test_solid_teeth_on_their_ring_are_those_of_finite_elements(helix, rim, support):
    """An even load on a flank, its neighbour, and three teeth on; ring of little rim on springs: it ovalises."""
    gear = ring(helix)
    exact = finite_elements(gear, rim, support).blocks[:, 0, 0]
    found = solid(gear, rim, len(exact) // 2, support).blocks[:, 0, 0]
    middle = len(exact) // 2
    assert found[middle] == pytest.approx(exact[middle], rel=0.01)
    assert_allclose(found, exact, rtol=0, atol=0.01 * exact[middle])


def lobes(flank, loads) -> float:
    """What a loaded tooth yields more than one amid two of them, under equal ``loads`` all around."""
    z = -flank.gear.teeth
    at = [round(z * k / loads) for k in range(loads)]
    # finite elements do not tell the tooth opposite: that beside it stands for it
    C = [float(flank.at(max((d + z // 2) % z - z // 2, -((z - 1) // 2)), 0)[0, 0]) for d in range(z)]
    return sum(C[d] - C[(d + z // (2 * loads)) % z] for d in at)


@pytest.mark.slow
def test_a_free_ring_yields_alike():
    """Rim of 1.5 modules under two opposite loads, and under three, as of planets."""
    gear, free = ring(), (0.0, 0.0)
    exact, found = finite_elements(gear, 1.5, free, neighbours=36), solid(gear, 1.5, 36, free)
    for loads in (2, 3):
        assert lobes(found, loads) == pytest.approx(lobes(exact, loads), rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("helix", "angles", "springs"),
    [
        (0.0, (0.1, 1.2, 2.2, 3.2, 4.3, 5.3), None),
        (20.0, (0.2, 2.0, 4.1), (100.0, 300.0)),
    ],
)
def test_rings_on_lugs_are_those_of_finite_elements(helix, angles, springs):
    """Teeth above a lug and between two, by themselves and from one to another."""
    gear, lugs, free = ring(helix), Lugs(angles=angles, length=12.0, springs=springs), (0.0, 0.0)
    exact, found = finite_elements(gear, 1.5, free, lugs), solid(gear, 1.5, 6, free, lugs)
    for i in (0, 1, 7, 20):
        own = float(exact.at(i, i)[0, 0])
        assert float(found.at(i, i)[0, 0]) == pytest.approx(own, rel=0.012)
        for j in (i + 1, i + 2):
            assert float(found.at(j, i)[0, 0]) == pytest.approx(float(exact.at(j, i)[0, 0]), abs=0.012 * own)


@pytest.mark.slow
@pytest.mark.parametrize(
    "support",
    [
        None,
        {"radial": 0.0, "tangential": 0.0},
        {"lugs": [0.0, 60.0, 120.0, 180.0, 240.0, 300.0], "lug_length": 20.0, "tooth": 5},
    ],
)
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


@pytest.mark.parametrize("helix", [0.0, 20.0])
def test_memory_counts_the_loads_of_lugs(helix):
    """Complex compliances of all waves between them, for which the level without lugs has no room."""
    gear, lugs = ring(helix), Lugs(angles=(0.05, 1.7, 3.5), length=12.0)
    body = Body(gear=gear, bore_radius=gear.root_radius - 3.0, teeth=3, support=(0.0, 0.0), lugs=lugs)
    level = Level(body=body, number=3, waves=5)
    outside = Outside(section=level.section, axis=level.axis)
    loads = outside.functionals().shape[1] - 6
    assert loads <= outside.lug_loads <= 2 * loads
    more = level.memory - Level(body=replace(body, lugs=None), number=3, waves=5).memory
    assert more >= 16 * len(wave_numbers(abs(gear.teeth))) * loads**2
