"""The section of a sector: quadrilaterals that cannot be turned inside out, and the exact outline."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.section import Body
from fem_reference.sector import Grain, Outline, Section, lagrange, lobatto
from gearbench.compliance.bases import gauss
from gearbench.errors import InputError
from gearbench.geometry.gear import Gear
from tests.support.gears import standard_gear
from tests.support.jacobians import jacobians


def random_gears(count: int, seed: int = 5) -> list[Gear]:
    """Gears that the geometry accepts: undercut and nearly pointed ones, sharp racks, helices up to 45°."""
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        teeth = int(np.exp(rng.uniform(math.log(5), math.log(300))))
        alpha, dedendum = rng.uniform(14.5, 28.0), rng.uniform(1.0, 1.7)
        keys = {
            "teeth": teeth, "normal_module": math.exp(rng.uniform(math.log(0.1), math.log(50.0))),
            "pressure_angle": alpha, "helix_angle": rng.choice([0.0, rng.uniform(0, 45)]), "dedendum": dedendum,
            "profile_shift": rng.uniform(-0.8, 1.0), "addendum": rng.uniform(0.5, 1.5),
            "fillet_radius": rng.choice([0.0, rng.uniform(0, 0.5)]),
        }  # fmt: skip
        try:
            gear = Gear(face_width=keys["normal_module"] * rng.uniform(1, 30), **keys)
        except InputError:
            continue
        found.append(gear)
    return found


def bodies(gear: Gear, rng: np.random.Generator) -> list[Body]:
    """The tooth alone, a thin rim, a body of any depth."""
    rim = gear.root_radius - 1.5 * gear.normal_module
    deep = gear.root_radius * rng.uniform(0.05, 0.95)
    return [Body(gear=gear), *(Body(gear=gear, bore_radius=bore) for bore in (rim, deep) if bore > 0)]


@pytest.mark.parametrize("count", [60, pytest.param(200, marks=pytest.mark.slow)])
def test_no_quadrilateral_of_random_gears_is_turned_inside_out(count):
    rng, least = np.random.default_rng(1), math.inf
    gears = random_gears(count)
    assert sum(gear.is_undercut for gear in gears) > 0.05 * count
    for gear in gears:
        for body in bodies(gear, rng):
            section = Section(body=body, grain=Grain(degree=3))
            jacobian = jacobians(section, 7)
            least = min(least, float((jacobian.min(axis=1) / jacobian.max(axis=1)).min()))
            assert jacobian.min() > 0, gear
            # each point is covered once: the area is that under the outline
            points, weights = gauss(7)
            radius = np.array([at(*map(np.ravel, np.meshgrid(points, points)))[0] for at in section.maps])
            area = float(np.sum(jacobian * radius * np.outer(weights, weights).ravel()))
            assert area == pytest.approx(exact_area(body), rel=2e-3), gear
    assert least > 0


def exact_area(body: Body) -> float:
    """∫ ψ d(R²) of a tooth above the root circle by its own parameters, and the sector below."""
    gear = body.gear
    phi = np.linspace(0.0, float(gear.fillet.parameter(gear.form_radius)), 2001)
    R = np.concatenate([gear.fillet.radius(phi), np.linspace(gear.form_radius, gear.tip_radius, 2001)])
    psi = np.concatenate(
        [gear.fillet.half_angle(phi), gear.involute_half_angle(np.linspace(gear.form_radius, gear.tip_radius, 2001))]
    )
    tooth = float(np.trapezoid(psi, R**2))
    return tooth + (
        0.0 if body.bore_radius is None else math.pi / gear.teeth * (gear.root_radius**2 - body.bore_radius**2)
    )


@pytest.mark.parametrize(
    "gear", [standard_gear(), standard_gear(9), standard_gear(25, helix=30.0), standard_gear(fillet_radius=0.0)]
)
def test_outline_and_its_slopes_are_those_of_the_gear(gear):
    outline = Outline(gear=gear)
    start = float(outline.fillet(np.array(outline.junction))[0])
    R = np.linspace(start * (1 + 1e-6), gear.tip_radius * (1 - 1e-6), 400)
    psi, slope = outline.half_angle(R)
    assert_allclose(psi, gear.half_angle(R), atol=1e-9)
    h = 1e-6 * gear.normal_module
    away = np.abs(R - gear.form_radius) > 0.02 * gear.normal_module  # the slope has a kink or a root there
    assert_allclose(
        slope[away], ((gear.half_angle(R + h) - gear.half_angle(R - h)) / (2 * h))[away], atol=1e-5 / gear.normal_module
    )


def test_lagrange_polynomials_of_the_lobatto_points():
    x = lobatto(5)
    value, _ = lagrange(5, x)
    assert_allclose(value, np.eye(6), atol=1e-13)
    at = np.linspace(0, 1, 9)
    value, slope = lagrange(5, at)
    assert_allclose(value @ x**5, at**5, atol=1e-13)
    assert_allclose(slope @ x**5, 5 * at**4, atol=1e-12)


@pytest.mark.parametrize("helix", [0.0, 30.0])
def test_rigid_motions_cost_no_energy(helix, steel):
    """Moved along the axis, turned about it, and shifted across: the last one as far as polynomials make sin θ."""
    gear = standard_gear(30, 4.0, helix=helix)
    section = Section(body=Body(gear=gear, bore_radius=9.0), grain=Grain(degree=5))
    A00, A01, A11 = section.stiffness(steel, ~section.of_web)
    R, theta = section.positions.T
    zero, one = np.zeros_like(R), np.ones_like(R)
    for u, scale in (((zero, zero, one), 1e-12), ((zero, R, zero), 1e-9)):
        field = np.stack(u, axis=1).ravel()
        assert abs(field @ A00 @ field) < scale * np.abs(A00).max() * np.abs(field).max() ** 2
    turned = math.tan(gear.beta) / gear.pitch_radius
    # u = e_x in the frame that turns: u_R = sin(θ + τy), u_θ = cos(θ + τy); at y = 0, ∂u/∂y = τ (cos θ, −sin θ)
    u = np.stack([np.sin(theta), np.cos(theta), zero], axis=1).ravel()
    v = turned * np.stack([np.cos(theta), -np.sin(theta), zero], axis=1).ravel()
    energy = u @ A00 @ u + 2 * u @ A01 @ v + v @ A11 @ v
    assert abs(energy) < 1e-9 * (u @ (abs(A00) @ np.abs(u)))


def test_bodies_that_do_not_exist_are_refused():
    gear = standard_gear()
    with pytest.raises(InputError, match="bore_radius"):
        Body(gear=gear, bore_radius=8.0)
    with pytest.raises(InputError, match="teeth"):
        Body(gear=gear, bore_radius=4.0, teeth=4)
    with pytest.raises(InputError, match="teeth"):
        Body(gear=gear, teeth=3)
