"""Strength numbers of a scene: Hertz pressure of the solved load, sliding, limits."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.material import Material
from gearbench.library.garambois2017 import case, gear, table_2
from gearbench.optimisation.constraints import constrained, judge
from gearbench.optimisation.numbers import largest_pressure
from gearbench.optimisation.study import Limit
from gearbench.scene import Resolution
from gearbench.solution import solve_scene
from gearbench.strength.rating import GEOMETRIC, contact_pressure, root_stress


def test_pressure_in_single_contact_is_that_of_two_cylinders():
    scene = replace(case(1), pair=replace(case(1).pair, material=Material(youngs_modulus=206.0)))
    solved = solve_scene(scene)
    single = solved.lines.active.sum(axis=1) == 1
    assert single.any()
    pressure = contact_pressure(solved.lines, solved.solution.force).max(axis=(1, 2))
    middle = solved.lines.u[..., 7].max(axis=1, where=solved.lines.active, initial=0.0)
    rho1, rho2 = middle, scene.pair.meshing.tangent_length - middle
    q = scene.F_bn / scene.pair.face_width
    # Z_E of steel on steel in ISO 6336-2, for E = 206 GPa, ν = 0.3; the load of a spur pair is even over the face
    by_hand = 189.8117 * np.sqrt(q * (1 / rho1 + 1 / rho2))
    assert_allclose(pressure[single], by_hand[single], rtol=1e-6)


def test_pressure_belongs_to_the_half_width_of_the_hertz_law():
    solved = solve_scene(case(2))
    pair, lines = solved.scene.pair, solved.lines
    nu, E = pair.material.nu, pair.material.E
    q = solved.line_load()
    rho = (
        lines.u * (pair.meshing.tangent_length - lines.u) / pair.meshing.tangent_length / math.cos(pair.meshing.beta_b)
    )
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
    assert pressure_of(more) == pytest.approx(2 * pressure_of(base), rel=1e-9)
    assert_allclose(root_stress(more), 4 * np.array(root_stress(base)), rtol=1e-12)


def pressure_of(scene):
    return largest_pressure(solve_scene(scene))


def sliding(scene):
    return GEOMETRIC["specific_sliding"](scene.pair)


def test_more_segments_and_phases_converge():
    pressure = [
        pressure_of(gear("22").scene(resolution=Resolution(segments=n, gauss_points=g)))
        for n, g in ((15, 8), (60, 16), (120, 24))
    ]
    # the maximum sits at the end of a line, of which segments see the middle: first order in both
    assert pressure[0] == pytest.approx(pressure[2], rel=0.03)
    assert pressure[1] == pytest.approx(pressure[2], rel=0.01)


def test_specific_sliding_is_that_of_the_velocities():
    pair = case(1).pair
    worst = 0.0
    for u in (pair.meshing.path_start, pair.meshing.path_end):
        # rolling velocities of pinion and wheel along the flank, for unit speed of the base circles
        v1 = u / pair.gears[0].base_radius
        v2 = (pair.meshing.tangent_length - u) / pair.gears[1].base_radius
        worst = max(worst, abs((v1 - v2) / v1), abs((v1 - v2) / v2))
    assert sliding(case(1)) == pytest.approx(worst, rel=1e-12)


@pytest.mark.parametrize("row", table_2(), ids=lambda row: row.gear)
def test_gears_of_the_paper_obey_the_limits_of_the_paper(row):
    # its constraints: total contact ratio > 1.1, specific sliding < 2.5; gear 34 comes as near as 2.490
    limits = {"total_contact_ratio": Limit(min=1.1), "specific_sliding": Limit(max=2.5)}
    assert judge(constrained(row.scene(), limits), limits) == (0, "")
