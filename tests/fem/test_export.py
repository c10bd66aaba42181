"""The loaded tooth as a VTU file."""

from __future__ import annotations

import math
from dataclasses import replace

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.export import line_load, loaded_tooth, nodal_load, write_loaded_tooth
from fem_reference.flank import Flank
from gearbench.errors import InputError
from gearbench.library.garambois2017 import case
from gearbench.simulation import simulate


@pytest.fixture(scope="module")
def scene():
    return case(2)


@pytest.fixture(scope="module")
def result(scene):
    return simulate(scene)


@pytest.mark.parametrize("gear", [0, 1])
def test_the_file_holds_the_deformed_tooth(scene, result, tmp_path, gear):
    path = tmp_path / "tooth.vtu"
    tooth = write_loaded_tooth(scene.pair, result, path, gear=gear, degree=3, layers=5)
    back = meshio.read(path)
    body, R = tooth.section.body.gear, tooth.section.positions[:, 0]
    assert_allclose(back.points, tooth.points.reshape(-1, 3), atol=1e-12)
    # hexahedra with straight edges, which cut the curves of the outline short, fill the tooth
    corner = back.points[back.cells_dict["hexahedron"]].reshape(-1, 2, 4, 3)
    x, y = corner[..., 0], corner[..., 1]
    area = 0.5 * np.abs(np.sum(x * np.roll(y, -1, -1) - np.roll(x, -1, -1) * y, axis=-1)).mean(axis=1)
    radii = np.linspace(body.root_radius, body.tip_radius, 4001)
    exact = np.trapezoid(2 * body.half_angle(radii) * radii, radii) * body.face_width
    assert_allclose(area @ np.ptp(corner[..., 2], axis=(1, 2)), exact, rtol=0.01)
    assert set(back.point_data) == {"displacement", "von_mises"}
    displacement, stress = (back.point_data[name].reshape(len(R), 11, -1) for name in ("displacement", "von_mises"))
    assert_allclose(displacement[body.root_radius * (1 + 1e-9) > R], 0)
    # the load pushes the tip along the inward normal, to negative x; the static transmission error holds two teeth,
    # their contact, and is shared by several pairs
    tip = displacement[body.tip_radius * (1 - 1e-9) < R]
    assert np.all(tip[..., 0] < 0)
    assert 0.1 < -1e3 * tip[..., 0].min() / float(result["transmission_error"].max()) < 1.5
    assert np.all(stress > 0)
    # nominal bending stress of a cantilever, F h / (b s²/6), is exceeded at the fillet, by less than 5
    force = float((result["line_load"] * result["segment_length"]).sum("segment").max())
    thickness = float(body.normal_thickness(body.form_radius))
    nominal = 6 * force * (body.tip_radius - body.form_radius) / (body.face_width * thickness**2)
    fillet = stress[(body.form_radius > R) & (tooth.section.positions[:, 1] > 0)].max()
    assert 0.5 < fillet / nominal < 5


@pytest.mark.parametrize("gear", [0, 1])
def test_the_load_is_the_simulations(scene, result, gear):
    line = line_load(scene.pair, result, gear, None)
    loads = (result["line_load"] * result["segment_length"]).sum("segment")
    assert_allclose(line.force.sum(), loads.max(), rtol=1e-12)
    # the nodal forces add up to it, along the mean normal of the contact line, and to its moment about the axis
    tooth = loaded_tooth(scene.pair, line, gear, 2, 5)
    force = nodal_load(tooth.section, tooth.axis, line).reshape(-1, 3, tooth.axis.count)
    one = tooth.axis.values(tooth.stations)[0].T  # (function, station)
    resolved = np.linalg.lstsq(one.T, np.ones(len(tooth.stations)), rcond=None)[0]
    body, beta_b = tooth.section.body.gear, tooth.section.body.gear.beta_b
    around = np.sum(tooth.section.positions[:, :1] * (force[:, 1] @ resolved)[:, None])
    assert_allclose(around, -line.force.sum() * body.base_radius * math.cos(beta_b), rtol=1e-4)
    assert_allclose(np.sum(force[:, 2] @ resolved), line.force.sum() * math.sin(beta_b), rtol=1e-9)


def test_on_the_driven_gear_the_line_runs_the_other_way(scene, result):
    pinion, wheel = (line_load(scene.pair, result, gear, 5) for gear in (0, 1))
    # seen from its loaded flank, contact climbs towards the tip with y on the driving gear, and on the driven gear
    # with y counted from the other face, as both are meshed
    assert np.all(np.diff(pinion.radius) > 0)
    assert np.all(np.diff(wheel.radius) > 0)
    assert_allclose(wheel.y, scene.pair.face_width - pinion.y[::-1], rtol=1e-12)
    assert_allclose(wheel.force, pinion.force[::-1])
    # along a contact line the normals are parallel: it lies on the flank as it is meshed
    for line, gear in ((pinion, 0), (wheel, 1)):
        normals = Flank(scene.pair.gears[gear]).normal(line.radius, line.y)
        assert_allclose(normals, np.broadcast_to(normals[0], normals.shape), atol=1e-9)


def test_von_mises_of_uniform_stretching_is_exact(scene, result):
    """u_y = ε y: σ_yy − σ_RR = σ_yy − σ_θθ = 2με, on a helical tooth; a turn about the axis strains nothing."""
    tooth = loaded_tooth(scene.pair, line_load(scene.pair, result, 0, None), 0, 5, 3)
    E, nu = scene.pair.material.E, scene.pair.material.nu
    wanted = np.stack([np.ones(7), tooth.stations], axis=1)
    one, y = np.linalg.lstsq(tooth.axis.values(tooth.stations)[0], wanted, rcond=None)[0].T
    u = np.zeros_like(tooth.u)
    u[:, 2] = 1e-3 * y
    assert_allclose(replace(tooth, u=u).von_mises, E / (1 + nu) * 1e-3, rtol=1e-9)
    u = np.zeros_like(tooth.u)
    u[:, 1] = 1e-3 * tooth.section.positions[:, :1] * one
    # R is a polynomial of the reference point to 0.1 %, but for the cusp where the fillet meets the root circle
    apart = tooth.section.positions[:, 0] > tooth.section.held_radius * (1 + 1e-9)
    assert_allclose(replace(tooth, u=u).von_mises[apart], 0, atol=5e-3 * E * 1e-3)


def test_positions_that_do_not_exist(scene, result):
    with pytest.raises(InputError, match="position"):
        line_load(scene.pair, result, 0, 10_000)
