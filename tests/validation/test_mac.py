"""Deflection shapes compared: the criterion in closed form, shapes against the plate they come from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.hertz import Hertz
from gearbench.effects.teeth import plate_tooth
from gearbench.effects.tooth_bending import ToothBending
from gearbench.library.garambois2017 import case
from gearbench.validation.mac import (
    LOADS,
    RESPONSES,
    deflection_shapes,
    flank_grid,
    line_shapes,
    mac,
)


def with_teeth(number: int, **teeth: object):
    return replace(case(number), effects=(ToothBending(**teeth), Hertz()))


def test_mac_does_not_see_scale_or_sign():
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(2, 30, 4))
    # squares of the smallest would underflow if they were formed as they are
    scale = np.array([1e-200, -3.0, 1e150, 7e-9])
    assert_allclose(mac(scale * a, b), mac(a, b), rtol=1e-13)


def test_mac_is_the_square_of_the_cosine_between_the_shapes():
    angle = np.array([0.1, 0.7, 1.3])
    a = np.array([np.ones(3), np.zeros(3)])
    assert_allclose(mac(a, [np.cos(angle), np.sin(angle)]), np.cos(angle) ** 2, rtol=1e-13)


def test_the_active_flank_ends_at_the_tip_circles():
    """Or where the mate's involute does: the pinion of case 2 is undercut, the tips of its wheel stay unused."""
    pair = case(1).pair
    for k, gear in enumerate(pair.gears):
        low, high = pair.meshing.active_radii[k]
        assert high == pytest.approx(gear.tip_radius, rel=1e-12)
        assert gear.form_radius < low < gear.pitch_radius
    pair = case(2).pair
    (low, high), (_, wheel_high) = pair.meshing.active_radii
    assert low == pytest.approx(pair.gears[0].form_radius, rel=1e-12)
    assert high == pytest.approx(pair.gears[0].tip_radius, rel=1e-12)
    assert wheel_high < pair.gears[1].tip_radius


def test_grid_points_stand_for_equal_parts_of_the_flank():
    """The midpoint rule integrates R² to 1/(4n²) of what the flank's height adds, and any linear function exactly."""
    pair = case(1).pair
    low, high = pair.meshing.active_radii[0]
    grid = flank_grid(pair, 0, (50, 7))
    assert grid.radius.mean() == pytest.approx((low + high) / 2, rel=1e-14)
    assert grid.y.mean() == pytest.approx(pair.face_width / 2, rel=1e-14)
    exact = (high**3 - low**3) / (3 * (high - low))
    assert exact - (grid.radius**2).mean() == pytest.approx((high - low) ** 2 / 12 / 50**2, rel=1e-6)


@pytest.mark.parametrize("k", [0, 1])
def test_shapes_are_the_deflections_of_the_plate(k):
    scene = with_teeth(2, order=(3, 2))
    gear = scene.pair.gears[k]
    plate = plate_tooth(gear, scene.pair.material, (3, 2), False)
    (h, y), (h0, y0) = (flank_grid(scene.pair, k, cells).points(gear.root_radius) for cells in (RESPONSES, LOADS))
    expected = plate.deflection(h[:, None], y[:, None], h0, y0)
    # deflections that all but vanish between two lobes are differences of larger ones
    assert_allclose(deflection_shapes(scene, k), expected, rtol=1e-12, atol=1e-14 * expected.max())


@pytest.mark.parametrize("k", [0, 1])
def test_a_line_load_is_the_mean_of_the_point_loads_along_it(k):
    scene = with_teeth(2)
    lines = scene_lines(scene, mesh_phases(scene)[0][:3])
    gear, found = scene.pair.gears[k], line_shapes(scene, k, lines)
    plate = plate_tooth(gear, scene.pair.material, None, False)
    h, y = flank_grid(scene.pair, k, RESPONSES).points(gear.root_radius)
    for i, (p, pair) in enumerate(np.argwhere(lines.active)):
        height = lines.radii[k][p, pair] - gear.root_radius
        points = plate.deflection(h[:, None], y[:, None], height, lines.y[p, pair])
        assert_allclose(found[:, i], np.average(points, axis=1, weights=lines.length[p, pair]), rtol=1e-11)
    assert found.shape[1] == lines.active.sum()
