"""The mesh: exact boundary, volumes, names, files, refusals; and gmsh under awkward conditions."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference import tooth_mesh as module
from fem_reference.elasticity import Space, surface_points
from fem_reference.flank import Flank
from fem_reference.tooth_mesh import Body, Cells, MeshingError, tooth_mesh
from gearbench.errors import InputError
from gearbench.geometry.gear import Gear
from gearbench.library.garambois2017 import case
from tests.support.gears import standard_gear
from tests.support.node_positions import node_positions
from tests.support.plain_meshes import mesh_cells

CELLS = Cells(thickness=4, flank=4, fillet=3, width=3, foot=2, land=1, rim=4, rest=(2, 4))


def volume(space: Space) -> float:
    from skfem.quadrature import get_quadrature

    X, w = get_quadrature(space.element.refdom, 6)
    return float(np.sum(space.gradients(X)[1] * w))


def section_area(gear: Gear) -> float:
    """Area of one tooth above the root circle, ∫ 2ψ R dR, substituted so that the root is smooth."""
    total = 0.0
    for low, high in ((gear.root_radius, gear.form_radius), (gear.form_radius, gear.tip_radius)):
        x, w = np.polynomial.legendre.leggauss(60)
        t = 0.5 * (x + 1)
        R = low + (high - low) * t**2
        total += float(np.sum(2 * gear.half_angle(R) * R * (high - low) * 2 * t * 0.5 * w))
    return total


GEARS = [
    standard_gear(),
    standard_gear(helix=25.0),
    standard_gear(teeth=9),
    standard_gear(teeth=60, profile_shift=0.4),
    standard_gear(fillet_radius=0.0),
    standard_gear(41, fillet_radius=0.47),
]


@pytest.mark.parametrize("gear", GEARS)
@pytest.mark.parametrize("kind", ["hex8", "hex20", "tet10"])
def test_boundary_nodes_lie_on_the_exact_flank(gear, kind):
    mesh = tooth_mesh(Body(gear=gear), CELLS, kind).mesh
    space = Space(mesh, kind)
    turn = math.tan(gear.beta) / gear.pitch_radius
    for name, side in (("right", 1), ("left", -1)):
        nodes = np.unique(np.concatenate([space.boundary_nodes(f"{name}_{part}") for part in ("flank", "fillet")]))
        x, y, z = node_positions(space)[nodes].T
        R = np.clip(np.hypot(x, y), gear.root_radius, gear.tip_radius)
        section = np.arctan2(x, y) - turn * z
        error = R * np.abs(section - side * gear.half_angle(R))
        # the ψ of a fillet starts like √(R − r_f): rounding of R by 1e-15 is 1e-8 there. In the cusp at the clamped
        # root some edges of tetrahedra stay straight
        if kind == "tet10":
            assert np.quantile(error, 0.8) < 1e-6
            assert error.max() < 0.02
        else:
            assert error.max() < 3e-7


@pytest.mark.parametrize("gear", GEARS)
def test_volume_of_a_tooth(gear):
    tooth = tooth_mesh(Body(gear=gear), Cells(thickness=4, flank=6, fillet=8, width=1))
    # quadratic edges follow the flank to O(h⁴)
    assert_allclose(volume(tooth.space), section_area(gear) * gear.face_width, rtol=3e-4)
    assert tooth.quality > 0


@pytest.mark.parametrize("helix", [0.0, 25.0])
def test_whole_gear_has_the_volume_of_a_gear(helix):
    gear = standard_gear(teeth=9, helix=helix)
    tooth = tooth_mesh(Body(gear=gear, bore_radius=2.0, teeth=9), CELLS)
    expected = gear.face_width * (9 * section_area(gear) + math.pi * (gear.root_radius**2 - 2.0**2))
    assert_allclose(volume(tooth.space), expected, rtol=3e-4)
    assert "cut_left" not in tooth.mesh.boundaries


def test_boundaries_of_a_sector_are_closed_and_named():
    gear = standard_gear(teeth=30, helix=15.0)
    for rest in ("ring", "clamped", "free"):
        tooth = tooth_mesh(Body(gear=gear, bore_radius=8.0, teeth=3, rest=rest), CELLS)
        named = np.concatenate(list(tooth.mesh.boundaries.values()))
        assert_allclose(np.sort(named), np.sort(tooth.mesh.boundary_facets()))
        names = {"right_flank", "left_flank+1", "tip-1", "right_fillet", "root", "bore", "front", "back"}
        assert names <= set(tooth.mesh.boundaries)
        assert ("cut_left" in tooth.mesh.boundaries) == (rest != "ring")
        # the areas of the flanks of all teeth are the same, and that of an involute helicoid
        R = np.linspace(gear.form_radius, gear.tip_radius, 2001)
        exact = gear.face_width * np.trapezoid(Flank(gear).stretch(R), R)
        for name in ("right_flank", "right_flank-1", "left_flank+1"):
            assert_allclose(surface_points(tooth.space, tooth.mesh.boundaries[name]).weight.sum(), exact, rtol=1e-3)


def test_contact_climbs_with_y_on_the_right_flank():
    """u = u₀ + y tan β_b along a contact line: the normals there are parallel (``geometry.action``)."""
    gear = standard_gear(teeth=20, helix=20.0)
    y = np.linspace(0.0, gear.face_width / 8, 5)
    R = np.hypot(gear.base_radius, 3.0 + y * math.tan(gear.beta_b))
    normals = Flank(gear).normal(R, y)
    assert_allclose(normals, np.broadcast_to(normals[0], normals.shape), atol=1e-12)
    # and the points lie in one plane across that normal: the line is straight, in the plane of action
    assert_allclose((Flank(gear).position(R, y) - Flank(gear).position(R[:1], y[:1])) @ normals[0], 0, atol=1e-12)


@pytest.mark.parametrize(("suffix", "kind"), [(".vtu", "hex20"), (".msh", "hex8"), (".vtu", "tet10")])
def test_files_can_be_read_back(tmp_path, suffix, kind):
    import meshio

    tooth = tooth_mesh(Body(gear=standard_gear()), CELLS, kind)
    path = tmp_path / f"tooth{suffix}"
    nodes = tooth.mesh.doflocs.shape[1]
    tooth.write(path, displacement=np.zeros((nodes, 3)))
    back = meshio.read(path)
    assert_allclose(back.points, tooth.mesh.doflocs.T, atol=1e-12)
    assert sum(len(block.data) for block in back.cells) == tooth.mesh.nelements


def test_bodies_that_do_not_exist_are_refused():
    gear = standard_gear()
    with pytest.raises(InputError, match="bore_radius"):
        Body(gear=gear, bore_radius=8.0)
    with pytest.raises(InputError, match="teeth"):
        Body(gear=gear, bore_radius=4.0, teeth=4)
    with pytest.raises(InputError, match="teeth"):
        Body(gear=gear, teeth=3)


class Crossing:
    """A gear whose flanks cross below the tip: not made by ``Gear``, but by a damaged one."""

    def __init__(self, gear: Gear) -> None:
        self.gear = gear

    def __getattr__(self, name):
        return getattr(self.gear, name)

    def half_angle(self, radius):
        return self.gear.half_angle(radius) - 0.05


def test_self_intersecting_section_is_refused():
    with pytest.raises(MeshingError, match="flanks of the tooth cross at R"):
        tooth_mesh(Body(gear=Crossing(standard_gear())), CELLS)  # type: ignore[arg-type]


def test_elements_turned_inside_out_are_refused(monkeypatch):
    def fold(mesh, body):
        points = mesh.doflocs.copy()
        points[2, :40] += 3.0
        return replace(mesh, doflocs=points)

    monkeypatch.setattr(module, "screw", fold)
    with pytest.raises(MeshingError, match="inside out"):
        tooth_mesh(Body(gear=standard_gear()), CELLS)


@pytest.mark.parametrize("m", [5, 6])
def test_tetrahedra_beside_the_clamped_root_are_not_turned_inside_out(m):
    """Meshes that had one such element in the cusp of fillet and root circle, seen where matrices are integrated."""
    for gear in case(1).pair.gears:
        body = Body(gear=gear)
        assert tooth_mesh(body, mesh_cells(body, m), "tet10").quality > 0
