"""Stress on the fillet from the condensed sector: plane strain by a mesh of triangles, mirrors, sums."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.refinement import Level
from fem_reference.section import Body
from gearbench.geometry.action import contact_lines
from gearbench.geometry.pair import Member, Pair
from gearbench.results.flank import loaded_root_stress
from gearbench.scene_file import read_scene
from gearbench.solution import solve_scene
from gearbench.strength.bending import RootBending
from tests.support.fillet_stress import Fillet, FilletStress, fillet_stress
from tests.support.gears import standard_gear
from tests.support.paths import EXAMPLES
from tests.support.strips import Strip, plane_root_stress, solve_strip


def test_uniform_strain_gives_its_stress_on_the_surface(steel):
    """u = e_y y: σ_yy = λ + 2μ, σ_RR = σ_θθ = λ; along outline and helix of a spur gear λ, λ + 2μ, 0."""
    section = Level(body=Body(gear=standard_gear(20), bore_radius=5.0), number=3, waves=2).section
    fillet = Fillet(section=section)
    F0, F1 = fillet.functionals(steel)
    one = np.tile([0.0, 0.0, 1.0], len(section.positions))
    lam = steel.E * steel.nu / ((1 + steel.nu) * (1 - 2 * steel.nu))
    found = (F1.T @ one).reshape(-1, 3)  # ∂u_y/∂y = 1
    assert_allclose(found, np.tile([lam, lam + steel.E / (1 + steel.nu), 0.0], (len(found), 1)), atol=1e-6 * lam)
    assert_allclose(F0.T @ one, 0, atol=1e-6 * lam)
    R = fillet.radius
    assert R.min() < section.body.gear.root_radius + 0.02
    assert R.max() > section.body.gear.form_radius - 0.02


def even_load(found: FilletStress, R: float, points: int = 40) -> np.ndarray:
    """Amplitudes of a load of 1 N/mm at radius R."""
    b = found.flank.gear.face_width
    x, w = np.polynomial.legendre.leggauss(points)
    y = 0.5 * b * (1 + x)
    return found.flank.shapes(np.full(points, R - found.flank.gear.root_radius), y).T @ (0.5 * b * w)


@pytest.mark.parametrize(
    ("teeth", "shift", "number"),
    [(17, 0.0, 4), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((25, 0.3, 4), (60, 0.0, 4)))],
)
def test_the_middle_of_a_wide_gear_is_in_plane_strain(teeth, shift, number, steel):
    """Against triangles refined at the fillet and at the contact strip, load at the outer point of single contact."""
    pair = Pair(
        normal_module=1.0, face_width=20.0, centre_distance=(teeth + 43) / 2,
        pinion=Member(teeth=teeth, profile_shift=shift), wheel=Member(teeth=43, profile_shift=-shift),
    )  # fmt: skip
    gear, bending = pair.gears[0], RootBending(pair=pair, gear=0)
    body = Body(gear=gear, bore_radius=gear.root_radius - 4, teeth=5)
    strip = Strip(radius=bending.load_radius, half_width=0.05)
    exact = plane_root_stress(solve_strip(body, steel, strip, size=0.06), steel)
    found = fillet_stress(body, steel, number, (6, 1))
    n = found.flank.neighbours
    sigma = (found.flank.blocks[n] @ even_load(found, bending.load_radius)).reshape(len(found.radius), -1, 3)
    # the free ends relieve the middle of a gear 20 modules wide by little; tangential stress is the largest
    assert sigma[:, 1, 0].max() == pytest.approx(exact, rel=0.01)
    # and ISO 6336-3, method B: Y_F Y_S is σ_F over F_t/(b m); asked for: 15 %
    factor = sigma[:, 1, 0].max() / math.cos(math.radians(pair.pressure_angle))
    assert factor == pytest.approx(bending.form_factor * bending.stress_correction, rel=0.06)


def helical_pair() -> Pair:
    gear = Member(teeth=20)
    a = 20 / math.cos(math.radians(20.0))
    return Pair(normal_module=1.0, helix_angle=20.0, face_width=6.0, centre_distance=a, pinion=gear, wheel=gear)


def test_gear_does_not_care_whether_it_is_called_driven(steel):
    pair = helical_pair()
    wheel = pair.gears[1]
    lines = contact_lines(pair, np.array([0.1, 0.6]), 12)
    ramp = np.linspace(0.2, 1.8, 12)
    force = np.where(lines.active[..., None], lines.length, 0.0) * ramp
    body = Body(gear=wheel, bore_radius=5.0)
    driving = fillet_stress(body, steel, 2, (3, 4))
    driven = replace(driving, flank=replace(driving.flank, driven=True))
    found = driven.largest(lines, force)
    # seen from the wheel: the path of contact, the face and the pairs run the other way
    turned = replace(lines, pair=pair.swapped(), u=pair.meshing.tangent_length - lines.u, y=pair.face_width - lines.y)
    order = np.arange(lines.shape[1])[::-1]
    backwards = replace(turned, u=turned.u[:, order], y=turned.y[:, order], length=lines.length[:, order])
    assert_allclose(found, driving.largest(backwards, force[:, order])[:, order], rtol=1e-9)
    assert found[lines.active].min() > 0
    # the other end of the face is not the same on a helical gear
    assert np.abs(driving.largest(lines, force)[lines.active] / found[lines.active] - 1).max() > 0.01


def test_stress_of_several_loaded_teeth_is_the_sum(steel):
    """Of the loads on the teeth before and behind, which the body carries over; alone they are some percent."""
    pair = helical_pair()
    lines = contact_lines(pair, np.array([0.3]), 12)
    force = np.where(lines.active[..., None], lines.length, 0.0)
    found = fillet_stress(Body(gear=pair.gears[0], bore_radius=7.0), steel, 2, (3, 4))
    both = found.components(lines, force)
    single = [found.components(lines, force * (np.arange(lines.shape[1]) == k)[:, None]) for k in range(lines.shape[1])]
    assert_allclose(both, sum(single), atol=1e-12 * np.abs(both).max())
    loaded = np.flatnonzero(lines.active[0])
    first, second = loaded[:2]
    assert np.abs(single[first][0, second]).max() > 0.01 * np.abs(single[first][0, first]).max()


def test_condensed_functionals_are_those_of_the_whole_solution(steel):
    """The stress blocks against K⁻¹ written out, on a tooth alone."""
    from fem_reference.circulant import tensor_stiffness
    from gearbench.compliance.bases import axis_functions, gauss

    body = Body(gear=standard_gear(18, 4.0, helix=20.0))
    found = fillet_stress(body, steel, 2, (2, 3))
    level = Level(body=body, number=2, waves=3)
    K = tensor_stiffness(level.section, level.axis, level.there, steel)
    K = (K + K.T).toarray() - np.diag(K.diagonal())
    b, count = body.gear.face_width, level.axis.count
    load = np.kron(level.section.flank_load(2)[level.section.free], level.axis.load(3))
    u = np.linalg.solve(K, load).reshape(-1, count, load.shape[1])
    values, slopes = axis_functions(count, gauss(3)[0])
    F0, F1 = (F[level.section.free] for F in Fillet(section=level.section).functionals(steel))
    exact = np.einsum("dc,yk,dka->cya", F0, values, u) + np.einsum("dc,yk,dka->cya", F1, slopes / b, u)
    exact = exact.reshape(-1, 3, 3, load.shape[1]).transpose(0, 2, 1, 3).reshape(-1, load.shape[1])
    assert_allclose(found.flank.blocks[0], exact, atol=1e-9 * np.abs(exact).max())


@pytest.mark.parametrize(
    ("name", "index"),
    [
        ("osu_50", 0),
        pytest.param("e_drive_output", 0, marks=pytest.mark.slow),
        pytest.param("e_drive_output", 1, marks=pytest.mark.slow),
    ],
)
def test_root_stress_of_the_load_found_against_finite_elements(name, index):
    """The largest over the mesh cycle, factors of ISO 6336-3 at the height of each segment (F9), spur and helical.

    −2.5 and −2.6 % on osu_50, 6.6 and 3.6 % on e_drive_output, against level 3; level 4 is 1.2 % lower on osu_50.
    """
    scene = read_scene(EXAMPLES / "gears" / f"{name}.toml")
    pair, solved = scene.pair, solve_scene(scene)
    body = Body(gear=pair.gears[index], bore_radius=pair.members[index].bore_diameter / 2)
    found = fillet_stress(body, pair.materials[index], 3, driven=index == 1)
    exact = found.largest(solved.lines, solved.solution.force / solved.lines.lever).max()
    # form and stress correction factor of the norm are good to some percent, see above
    assert float(loaded_root_stress(solved)[index]) == pytest.approx(exact, rel=0.08)
