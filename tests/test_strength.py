"""Strength numbers of a scene: Hertz pressure of the solved load, sliding, limits."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydantic import ValidationError

from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.material import Material
from gearbench.library.garambois2017 import case, gear, table_2
from gearbench.scene import Resolution
from gearbench.simulation import solve_scene
from gearbench.strength import Limits, Strength, contact_pressure, strength, violations


def test_pressure_in_single_contact_is_that_of_two_cylinders():
    scene = replace(case(1), pair=replace(case(1).pair, material=Material(youngs_modulus=206.0)))
    solved = solve_scene(scene)
    single = solved.lines.active.sum(axis=1) == 1
    assert single.any()
    pressure = contact_pressure(solved.lines, solved.solution.force).max(axis=(1, 2))
    middle = solved.lines.u[..., 7].max(axis=1, where=solved.lines.active, initial=0.0)
    rho1, rho2 = middle, scene.pair.tangent_length - middle
    q = scene.normal_force / scene.pair.face_width
    # Z_E of steel on steel in ISO 6336-2, for E = 206 GPa, ν = 0.3; the load of a spur pair is even over the face
    by_hand = 189.8117 * np.sqrt(q * (1 / rho1 + 1 / rho2))
    assert_allclose(pressure[single], by_hand[single], rtol=1e-6)


def test_pressure_belongs_to_the_half_width_of_the_hertz_law():
    solved = solve_scene(case(2))
    pair, lines = solved.scene.pair, solved.lines
    nu, E = pair.material.nu, pair.material.E
    q = solved.line_load()
    rho = lines.u * (pair.tangent_length - lines.u) / pair.tangent_length / math.cos(pair.base_helix_angle)
    half_width = np.sqrt(8 * q * rho * (1 - nu**2) / (math.pi * E))
    loaded = q > 0
    # the strip carries the line load: π/2 · p · a_H = q
    carried = math.pi / 2 * contact_pressure(lines, solved.solution.force) * half_width
    assert_allclose(carried[loaded], q[loaded], rtol=1e-12)
    assert np.all(contact_pressure(lines, solved.solution.force)[~loaded] == 0)


def test_pressure_of_a_spur_pair_grows_with_the_root_of_the_torque():
    # with a linear law and no gaps the load distribution does not depend on the load
    base = replace(case(1), effects=(ToothBending(basis="paper"), Hertz(law="yang_sun")))
    more = replace(base, load=replace(base.load, torque=4 * base.load.torque))
    assert strength(more).contact_pressure == pytest.approx(2 * strength(base).contact_pressure, rel=1e-9)
    assert_allclose(strength(more).root_stress, 4 * np.array(strength(base).root_stress), rtol=1e-12)


def test_stresses_do_not_depend_on_the_scale():
    scene = gear("2").scene()
    scene = replace(scene, effects=scene.effects[:2])
    pair = replace(scene.pair, normal_module=2.0, face_width=16.0, centre_distance=76.0)
    big = replace(scene, pair=pair, load=replace(scene.load, torque=8 * scene.load.torque))
    one, other = strength(scene), strength(big)
    assert other.contact_pressure == pytest.approx(one.contact_pressure, rel=1e-7)
    assert_allclose(other.root_stress, one.root_stress, rtol=1e-9)
    assert other.specific_sliding == pytest.approx(one.specific_sliding, rel=1e-9)


def test_more_segments_and_phases_converge():
    pressure = [
        strength(gear("22").scene(resolution=Resolution(segments=n, gauss_points=g))).contact_pressure
        for n, g in ((15, 8), (60, 16), (120, 24))
    ]
    # the maximum sits at the end of a line, of which segments see the middle: first order in both
    assert pressure[0] == pytest.approx(pressure[2], rel=0.03)
    assert pressure[1] == pytest.approx(pressure[2], rel=0.01)


def test_solved_scene_is_used_as_it_is():
    scene = gear("34").scene()
    solved = solve_scene(scene)
    assert strength(scene, solved) == strength(scene)
    half = replace(solved, solution=replace(solved.solution, force=0.25 * solved.solution.force))
    assert strength(scene, half).contact_pressure == pytest.approx(strength(scene).contact_pressure / 2, rel=1e-12)


def test_specific_sliding_is_that_of_the_velocities():
    pair = case(1).pair
    worst = 0.0
    for u in (pair.path_start, pair.path_end):
        # rolling velocities of pinion and wheel along the flank, for unit speed of the base circles
        v1 = u / pair.gears[0].base_radius
        v2 = (pair.tangent_length - u) / pair.gears[1].base_radius
        worst = max(worst, abs((v1 - v2) / v1), abs((v1 - v2) / v2))
    assert strength(case(1)).specific_sliding == pytest.approx(worst, rel=1e-12)


@pytest.mark.parametrize("row", table_2(), ids=lambda row: row.gear)
def test_gears_of_the_paper_obey_the_limits_of_the_paper(row):
    # its constraints: total contact ratio > 1.1, specific sliding < 2.5; gear 34 comes as near as 2.490
    excess = violations(strength(row.scene()), Limits())
    assert set(excess) == {"total_contact_ratio", "specific_sliding"}
    assert all(value < 0 for value in excess.values())


def test_violations_are_relative_and_only_for_limits_given():
    found = Strength(total_contact_ratio=1.65, specific_sliding=5.0, contact_pressure=900.0, root_stress=(200.0, 300.0))
    assert violations(found, Limits()) == pytest.approx({"total_contact_ratio": -0.5, "specific_sliding": 1.0})
    none = Limits(total_contact_ratio_min=None, specific_sliding_max=None)
    assert violations(found, none) == {}
    material = replace(none, contact_pressure_max=1000.0, root_stress_max=240.0)
    assert violations(found, material) == pytest.approx({"contact_pressure": -0.1, "root_stress": 0.25})


def test_infinite_sliding_is_a_finite_violation():
    found = Strength(total_contact_ratio=1.5, specific_sliding=math.inf, contact_pressure=1e3, root_stress=(1.0, 1.0))
    assert violations(found, Limits())["specific_sliding"] == 1e6


@pytest.mark.parametrize(
    "bad",
    [{"root_stress_max": -1.0}, {"contact_pressure_max": math.nan}, {"specific_sliding_max": "2.5"}, {"sliding": 2.0}],
)
def test_limits_are_strict(bad):
    with pytest.raises(ValidationError):
        Limits(**bad)
