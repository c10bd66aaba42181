"""The local part of the compliance is counted once: real contact strips."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.elasticity import Lame, Space, free_dofs
from fem_reference.flank import Flank
from fem_reference.section import Body
from fem_reference.solver import solve
from gearbench.compliance.flank import flank_polynomials
from gearbench.compliance.local import half_space_compression
from studies.s08_contact.data import scene
from tests.support.strips import Strip, plane_mesh, solve_strip
from tests.support.surface_points import surface_points


def plane_compliance(body: Body, steel, p: int) -> np.ndarray:
    """Surface compliance projected onto p Legendre polynomials over the height, plane strain."""
    gear = body.gear
    mesh = plane_mesh(
        body, Strip(radius=0.5 * (gear.form_radius + gear.tip_radius), half_width=gear.normal_module), 0.12
    )
    space = Space(mesh, "tri6")
    free = np.ones(space.n_nodes, dtype=bool)
    free[space.boundary_nodes(body.held)] = False
    points = surface_points(space, mesh.boundaries["right_flank"], 14)
    R = np.maximum(np.hypot(*points.position.T), gear.base_radius)
    density = shapes(gear, R, p) / Flank(gear).stretch(R)[:, None]
    normal = Flank(gear).normal(R, np.zeros_like(R))[:, :2]
    force = points.load(normal[:, :, None] * density[:, None, :], space)
    dofs = free_dofs(free, 2)
    u = solve(space.stiffness(Lame.of(steel.E, steel.nu), free), force[dofs]).x
    return force[dofs].T @ u


def shapes(gear, R: np.ndarray, p: int) -> np.ndarray:
    return flank_polynomials(gear, (p, 1), R, np.zeros_like(R)) * math.sqrt(gear.face_width)


@pytest.mark.parametrize("on_rim", [False, True])
def test_smooth_part_and_contact_law_give_back_a_real_contact_strip(spur, steel, law, on_rim):
    """Displacement of the flank under a Hertzian strip = smooth compliance + Weber–Banaschek, all from FE."""
    body = Body(gear=spur, bore_radius=spur.root_radius / 1.4, teeth=3, rest="free") if on_rim else Body(gear=spur)
    low, high = spur.form_radius, spur.tip_radius
    R = low + (high - low) * np.array([0.1, 0.5, 0.9])
    a = 0.01
    pressed = law(spur.flank_depth(R), a)
    strips = np.array([solve_strip(body, steel, Strip(radius=r, half_width=a)) for r in R])
    total = np.array([s.surface for s in strips])
    p = 5
    local = half_space_compression(spur, steel.E, steel.nu, (p, 1), points=24)
    smooth = np.einsum("ai,ij,aj->a", shapes(spur, R, p), plane_compliance(body, steel, p) - local, shapes(spur, R, p))
    # five polynomials over the height: within 0.6 % of the total
    assert_allclose(smooth + pressed, total, rtol=6e-3)
    # the displacement of the centre line alone, the other usual definition, leaves out what the tooth itself does
    # between its flank and its centre line
    centre = np.array([s.smooth for s in strips])
    assert np.all(centre + pressed < total * (1 - 0.008))


def test_a_tip_bends_less_under_a_force_turned_towards_its_root(steel):
    """2 χ C_tn is what the contact law of a tip under the tilt χ is too soft by, 36 χ c₁.

    "Tips in the contact law" of docs/theory.md; between the centre line of the tooth and 0.35 mm below the flank.
    """
    gear = scene("spur").pair.gears[0]
    R, c = np.array([gear.tip_radius - 0.1]), (1 - steel.nu**2) / (math.pi * steel.E)
    found = solve_strip(Body(gear=gear, bore_radius=12.5, teeth=7), steel, Strip(radius=float(R[0]), half_width=0.05))
    flank = Flank(gear)
    n = flank.normal(R, np.zeros(1))[:, :2]
    t = np.stack([-n[:, 1], n[:, 0]], axis=-1)
    assert t[0, 1] < 0  # towards the root
    deep, shallow = flank.below(R, np.zeros(1))[:, :2], flank.position(R, np.zeros(1))[:, :2] + 0.35 * n
    least, most = (2 * found.at(point, t) / c for point in (deep, shallow))
    assert most < -36 < least < -30
    assert most > -50
