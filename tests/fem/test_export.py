"""The loaded tooth as a VTU file."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.compliance import flank_load
from fem_reference.export import line_load, total_force, von_mises, write_loaded_tooth
from fem_reference.flank import Flank
from fem_reference.tooth_mesh import Body, Cells, tooth_mesh
from gearbench.errors import InputError
from gearbench.library.garambois2017 import case
from gearbench.simulation import simulate
from tests.support.node_positions import node_positions

CELLS = Cells(thickness=3, flank=5, fillet=3, width=5)


@pytest.fixture(scope="module")
def scene():
    return case(2)


@pytest.fixture(scope="module")
def result(scene):
    return simulate(scene)


@pytest.mark.parametrize("gear", [0, 1])
def test_the_file_holds_the_deformed_tooth(scene, result, tmp_path, gear):
    path = tmp_path / "tooth.vtu"
    solution = write_loaded_tooth(scene.pair, result, path, gear=gear, cells=CELLS)
    back = meshio.read(path)
    mesh = solution.tooth.mesh
    assert_allclose(back.points, mesh.doflocs.T, atol=1e-12)
    assert set(back.point_data) == {"displacement", "von_mises"}
    displacement, stress = back.point_data["displacement"], back.point_data["von_mises"]
    clamp = solution.tooth.space.boundary_nodes("clamp")
    assert_allclose(displacement[clamp], 0)
    # the load pushes the tip along the inward normal, to negative x; the static transmission error holds two teeth,
    # their contact, and is shared by several pairs
    tip = displacement[solution.tooth.space.boundary_nodes("tip")]
    assert np.all(tip[:, 0] < 0)
    assert 0.1 < -1e3 * tip[:, 0].min() / float(result["transmission_error"].max()) < 1.5
    assert np.all(stress > 0)
    # nominal bending stress of a cantilever, F h / (b s²/6), is exceeded at the fillet, by less than 5
    body = scene.pair.gears[gear]
    force = float((result["line_load"] * result["segment_length"]).sum("segment").max())
    thickness = float(body.normal_thickness(body.form_radius))
    nominal = 6 * force * (body.tip_radius - body.form_radius) / (body.face_width * thickness**2)
    fillet = stress[solution.tooth.space.boundary_nodes("right_fillet")].max()
    assert 0.5 < fillet / nominal < 5


@pytest.mark.parametrize("gear", [0, 1])
def test_the_load_is_the_simulations(scene, result, gear):
    line = line_load(scene.pair, result, gear, None, CELLS)
    tooth = tooth_mesh(Body(gear=scene.pair.gears[gear]), CELLS, "hex27")
    loads = (result["line_load"] * result["segment_length"]).sum("segment")
    assert_allclose(line.force.sum(), loads.max(), rtol=1e-12)
    # the edges of the flank cut off part of the strip of a line that ends there
    total = total_force(tooth, line)
    assert 0.85 < total / line.force.sum() < 1.02
    # the consistent nodal forces add up to it, along the mean normal of the contact line
    flank = Flank(tooth.body.gear)
    normal = np.average(flank.normal(line.radius, line.y), axis=0, weights=line.force)
    vector = flank_load(tooth, line).reshape(-1, 3).sum(axis=0)
    assert_allclose(vector @ normal / (normal @ normal), total, rtol=0.02)


def test_on_the_driven_gear_the_line_runs_the_other_way(scene, result):
    pinion, wheel = (line_load(scene.pair, result, gear, 5, CELLS) for gear in (0, 1))
    # seen from its loaded flank, contact climbs towards the tip with y on the driving gear, and on the driven gear
    # with y counted from the other face, as both are meshed
    assert np.all(np.diff(pinion.radius) > 0)
    assert np.all(np.diff(wheel.radius) > 0)
    assert_allclose(wheel.y, scene.pair.face_width - pinion.y[::-1], rtol=1e-12)
    assert_allclose(wheel.force, pinion.force[::-1])


def test_von_mises_of_uniform_tension_is_exact(scene):
    tooth = tooth_mesh(Body(gear=scene.pair.gears[0]), CELLS, "hex27")
    E, nu = scene.pair.material.E, scene.pair.material.nu
    strain = np.diag([-nu, -nu, 1.0]) * 1e-3
    displacement = node_positions(tooth.space) @ strain
    assert_allclose(von_mises(tooth, scene.pair.material, displacement), E * 1e-3, rtol=1e-10)
    # a rotation strains nothing
    turn = np.array([[0, 1e-3, 0], [-1e-3, 0, 0], [0, 0, 0]])
    rotated = von_mises(tooth, scene.pair.material, node_positions(tooth.space) @ turn)
    assert_allclose(rotated, 0, atol=1e-7 * E * 1e-3)


def test_positions_that_do_not_exist(scene, result):
    with pytest.raises(InputError, match="position"):
        line_load(scene.pair, result, 0, 10_000, CELLS)
