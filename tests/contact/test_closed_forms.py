"""Contact problems with a closed solution, from the scene's effects to forces, approach and stiffness."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.problem import ContactProblem, ContactSolution
from gearbench.contact.solver import solve
from gearbench.effects.base import ComplianceEffect, Dense, Effect, Effects, LineLaw, LowRank
from gearbench.effects.crowning import Crowning
from gearbench.effects.helix_slope import HelixSlope
from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Member, Pair
from gearbench.scene import Load, Resolution, Scene

SPUR = Pair(normal_module=3.0, face_width=24.0, centre_distance=90.0, pinion=Member(teeth=24), wheel=Member(teeth=36))
HELICAL = replace(SPUR, helix_angle=18.0, centre_distance=94.6)
SINGLE, DOUBLE = 0.8, 0.2  # mesh phases of the spur pair with one and with two tooth pairs in contact
WINKLER = Hertz(law="yang_sun")  # an elastic foundation: deflection = c · line load
C = 4 * (1 - 0.3**2) / (math.pi * 210e3)


def scene(*effects: Effect, torque: float = 100.0, segments: int = 40, pair: Pair = SPUR) -> Scene:
    return Scene(pair=pair, load=Load(torque=torque), effects=effects, resolution=Resolution(segments=segments))


def solution(scene: Scene, *phases: float) -> ContactSolution:
    return solve(assemble(scene, scene_lines(scene, np.array(phases))))


def problem(gap: list[float], a: list[float], h: list[float], psi: list[list[float]]) -> ContactProblem:
    n = len(gap)
    return ContactProblem(
        gap=np.array([gap]),
        a=np.array([a]),
        h=np.array([h]),
        sigma=np.zeros((1, n)),
        active=np.ones((1, n), dtype=bool),
        factor=np.array(psi).reshape(1, n, -1),
        block=np.zeros(n, dtype=np.int64),
        blocks=1,
        force=1.0,
        length_scale=1.0,
        shape=(1, 1, n),
    )


def test_one_segment():
    s = solve(problem([0.3], [2.0], [0.5], [[0.4, -0.6]]))
    assert_allclose(s.approach[0], 0.3 + 2.0 + 0.4**2 + 0.6**2, rtol=1e-15)  # e + g(1) + |ψ|², ln 1 = 0
    assert_allclose(s.stiffness[0], 1 / (2.0 - 0.5 + 0.4**2 + 0.6**2), rtol=1e-14)  # dg/dP = a − h at P = 1


def test_two_segments_whose_gaps_exceed_the_deflection_a_million_times():
    # flanks that nearly part: the distance of the second segment has no more digits than its gap
    gap, a, x, y = 4e8, (7e9, 125.0), 1.1, 1.2
    s = solve(problem([0.0, gap], list(a), [0.0, 0.0], [[x], [y]]))
    # δ = a₁ P₁ + x (x P₁ + y P₂) = e + a₂ P₂ + y (x P₁ + y P₂), P₁ + P₂ = 1
    first = (gap + a[1] + y * (y - x)) / (a[0] + a[1] + (y - x) ** 2)
    assert_allclose(s.force.ravel(), [first, 1 - first], rtol=1e-9)
    assert_allclose(s.approach[0], a[0] * first + x * (x * first + y * (1 - first)), rtol=1e-12)


@pytest.mark.parametrize(("phase", "teeth"), [(SINGLE, 1), (DOUBLE, 2)])
@pytest.mark.parametrize("loaded", [1, 13, 40])
def test_linear_gap_on_an_elastic_foundation(phase, teeth, loaded):
    """F = θℓ²/2c, δ = θℓ for a contact length ℓ ≤ b; exact on whole segments. Stiffness ℓ/c."""
    n, b, slope = 40, 24.0, 30e-3 / 24.0
    length = loaded * b / n
    force = teeth * slope * length**2 / (2 * C)
    torque = force * SPUR.gears[0].base_radius / 1e3
    s = solution(scene(HelixSlope(pinion=10.0, wheel=20.0), WINKLER, torque=torque, segments=n), phase)
    assert_allclose(s.approach[0], slope * length, rtol=1e-13)
    y = (np.arange(n) + 0.5) * b / n
    expected = np.maximum(slope * (length - y), 0) / C * b / n
    carrying = s.force[0][s.force[0].sum(axis=1) > 0]
    assert carrying.shape[0] == teeth
    for forces in carrying:
        assert_allclose(forces, expected, rtol=1e-12, atol=1e-12 * force)
    assert_allclose(s.stiffness[0], teeth * length / C, rtol=1e-12)


def test_crowning_on_an_elastic_foundation():
    """Parabola C_β(2y/b − 1)² in partial contact of half-length s: δ = C_β(2s/b)², F = (16/3) C_β s³/(c b²)."""
    b, amount, half = 24.0, 12e-3, 7.3
    force = 16 / 3 * amount * half**3 / (C * b**2)
    torque = force * SPUR.gears[0].base_radius / 1e3
    s = solution(scene(Crowning(amount=12.0), WINKLER, torque=torque, segments=2000), SINGLE)
    # midpoint rule on 1217 loaded segments, the outermost cut anywhere: relative error below 1/1217²
    assert_allclose(s.approach[0], amount * (2 * half / b) ** 2, rtol=7e-7)
    # the edge falls somewhere within a segment at either end
    assert_allclose(s.stiffness[0], 2 * half / C, rtol=1 / 1217)
    load = s.force[0].max(axis=0) / (b / 2000)
    assert_allclose(load.max(), amount * (2 * half / b) ** 2 / C, rtol=1e-6)


@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
def test_constant_stiffness_is_proportional_to_the_length_in_contact(pair):
    s = scene(WINKLER, pair=pair)
    lines = scene_lines(s, np.linspace(0, 0.99, 23))
    found = solve(assemble(s, lines))
    length = lines.length.sum(axis=(1, 2))
    assert_allclose(found.stiffness, length / C, rtol=1e-13)
    assert_allclose(found.approach, s.F_bn * C / length, rtol=1e-13)


# -- compliances in other forms than the structured one ---------------------------------------------------------------
@dataclass(frozen=True)
class DenseOf(ComplianceEffect):
    """Dense compliance from the factors of other effects and a linear law c, in the form that finite elements give."""

    smooth: tuple[ComplianceEffect, ...]
    linear: float = 0.0
    rubbish: bool = False

    name: ClassVar[str] = "dense"

    def compliance(self, lines: ContactLines, effects: Effects) -> Dense:
        positions, pairs, segments = lines.shape
        n = pairs * segments
        matrix = np.zeros((positions, n, n))
        same = np.equal.outer(*[np.repeat(np.arange(pairs), segments)] * 2)
        for part in (effect.compliance(lines, {}) for effect in self.smooth):
            assert isinstance(part, LowRank)
            psi = part.factor.reshape(positions, n, -1)
            matrix += psi @ np.swapaxes(psi, 1, 2) * (same | part.coupled)
        length = np.where(lines.length > 0, lines.length, 1.0)
        matrix += np.eye(n) * (self.linear / length).reshape(positions, 1, n)
        absent = ~np.repeat(lines.active, segments, axis=1)
        matrix[absent] = np.nan if self.rubbish else matrix[absent]
        return Dense(matrix=matrix)


@dataclass(frozen=True)
class Coupled(ComplianceEffect):
    """Compliance whose columns all tooth pairs share."""

    name: ClassVar[str] = "coupled"

    def compliance(self, lines: ContactLines, effects: Effects) -> LowRank:
        smooth = np.stack([np.cos(lines.u / 5), np.sin(lines.y / 9 + lines.u / 7)], axis=-1)
        return LowRank(factor=1e-3 * smooth, coupled=True)


def same(one: ContactSolution, other: ContactSolution) -> None:
    """Assert equality up to the rounding of factorising a matrix with eigenvalues over five decades."""
    assert_allclose(one.force, other.force, atol=1e-9 * other.force.max())
    assert_allclose(one.approach, other.approach, rtol=1e-10)
    assert_allclose(one.stiffness, other.stiffness, rtol=1e-9)


PHASES = np.array([0.05, 0.3, 0.55, 0.72, 0.9])


@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
def test_dense_compliance_equals_the_structured_one(pair):
    base = scene(ToothBending(), Hertz(), Crowning(amount=8.0), pair=pair, segments=9)
    lines = scene_lines(base, PHASES)
    matrix = DenseOf((ToothBending(),), rubbish=True)
    dense = replace(base, effects=(matrix, Hertz(), Crowning(amount=8.0)))
    same(*(solve(assemble(s, lines, truncation=0.0)) for s in (dense, base)))


@pytest.mark.parametrize("bending", [(), (ToothBending(),)], ids=["alone", "with own columns"])
def test_coupled_columns_equal_their_matrix(bending):
    base = scene(*bending, Coupled(), Hertz(), Crowning(amount=8.0), segments=9)
    lines = scene_lines(base, PHASES)
    other = scene(DenseOf((*bending, Coupled())), Hertz(), Crowning(amount=8.0), segments=9)
    same(*(solve(assemble(s, lines, truncation=0.0)) for s in (base, other)))
    uncoupled = scene(*bending, Hertz(), Crowning(amount=8.0), segments=9)
    assert solution(uncoupled, *PHASES).approach[0] < solution(base, *PHASES).approach[0]


def test_a_pair_of_laws_is_their_sum():
    """Two compliances in series add, a = a₁ + a₂; the same law twice is a law of half the stiffness."""

    @dataclass(frozen=True)
    class Film(ComplianceEffect):
        name: ClassVar[str] = "film"

        def compliance(self, lines: ContactLines, effects: Effects) -> LineLaw:
            return LineLaw(a=np.full(lines.shape, C), h=np.zeros(lines.shape))

    lines = scene_lines(scene(WINKLER), PHASES)
    one, two = (solve(assemble(s, lines)) for s in (scene(WINKLER), scene(WINKLER, Film())))
    assert_allclose(two.stiffness, one.stiffness / 2, rtol=1e-13)


def test_compliance_that_does_not_determine_the_loads_is_refused():
    with pytest.raises(InputError, match="add hertz"):
        solution(scene(Coupled()), SINGLE)


# -- mesh stiffness is the derivative ---------------------------------------------------------------------------------
def central(s: Scene, phases: NDArray, step: float) -> NDArray:
    lines = scene_lines(s, phases)
    high, low = (
        solve(assemble(replace(s, load=Load(torque=s.load.torque * (1 + x))), lines)).approach for x in (step, -step)
    )
    return 2 * step * s.F_bn / (high - low)


@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
@pytest.mark.parametrize("law", ["yang_sun", "weber_banaschek"])
@pytest.mark.parametrize(
    "gaps", [(), (Crowning(amount=20.0),), (HelixSlope(wheel=60.0),)], ids=["none", "crown", "lead"]
)
def test_stiffness_is_the_derivative_of_force_by_approach(pair, law, gaps):
    """By Richardson's extrapolation of central differences at ±ε and ±ε/2, with the error ε⁴ and rounding 1e-13/ε."""
    s = scene(ToothBending(), Hertz(law=law), *gaps, pair=pair, torque=60.0, segments=15)
    phases = np.linspace(0.03, 0.97, 17)
    coarse, fine = central(s, phases, 2e-3), central(s, phases, 1e-3)
    exact = 1 / ((4 / fine - 1 / coarse) / 3)
    found = solution(s, *phases).stiffness
    # where a segment joins the contact near this load the derivative jumps (linear law) or its own derivative is
    # logarithmically infinite, and differences do not converge: leave those positions out, but not most of them
    lines = scene_lines(s, phases)
    near = [solve(assemble(replace(s, load=Load(torque=60.0 * x)), lines)).force > 0 for x in (0.97, 1.03)]
    smooth = np.all(near[0] == near[1], axis=(1, 2))
    assert smooth.sum() >= 7
    assert_allclose(found[smooth], exact[smooth], rtol=2e-9)
