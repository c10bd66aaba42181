"""Invariants of a simulation (units, driving gear, order of effects), and exact special cases."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.problem import ContactSolution
from gearbench.contact.solver import solve
from gearbench.effects.base import Effect
from gearbench.effects.crowning import Crowning
from gearbench.effects.end_relief import EndRelief
from gearbench.effects.helix_slope import HelixSlope
from gearbench.effects.hertz import Hertz
from gearbench.effects.misalignment import Misalignment
from gearbench.effects.profile_slope import ProfileSlope
from gearbench.effects.root_relief import RootRelief
from gearbench.effects.tip_relief import TipRelief
from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.material import Material
from gearbench.geometry.pair import Member, Pair
from gearbench.scene import Load, Resolution, Scene
from gearbench.simulation import simulate
from tests.support.contact_invariants import mirrored
from tests.support.gears import swapped

SPUR = Pair(normal_module=3.0, face_width=24.0, centre_distance=90.4, pinion=Member(teeth=24), wheel=Member(teeth=36))
HELICAL = replace(SPUR, helix_angle=18.0, centre_distance=94.9)
PAIRS = pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
LAWS = pytest.mark.parametrize("law", ["yang_sun", "weber_banaschek"])
PHASES = (np.arange(29) + 0.31) / 29


def gaps(x: float = 1.0, swap: bool = False) -> tuple[Effect, ...]:
    """All effects that add gap, with lengths × x, or for the wheel driving (y from the other end of the face)."""
    pinion, wheel = ("wheel", "pinion") if swap else ("pinion", "wheel")
    turn = -1.0 if swap else 1.0
    return (
        Crowning(amount=4 * x),
        TipRelief(amount=6 * x, length=0.9 * x, gear=pinion),
        RootRelief(amount=3 * x, length=0.5 * x, shape="parabolic", gear=wheel),
        EndRelief(amount=5 * x, length=2.5 * x),
        ProfileSlope(**{pinion: 2 * x, wheel: -3 * x}),
        HelixSlope(**{pinion: 5 * x * turn, wheel: 3 * x * turn}),
        Misalignment(inclination=4 * x * turn, deviation=6 * x * turn),
    )


def scene(pair: Pair, *effects: Effect, torque: float = 150.0, **resolution: int) -> Scene:
    return Scene(pair=pair, load=Load(torque=torque), effects=effects, resolution=Resolution(**resolution))


def solution(scene: Scene, phases: NDArray) -> ContactSolution:
    return solve(assemble(scene, scene_lines(scene, phases)))


# -- units ------------------------------------------------------------------------------------------------------------
def scaled(pair: Pair, s: float) -> Pair:
    return replace(
        pair,
        normal_module=s * pair.normal_module,
        face_width=s * pair.face_width,
        centre_distance=s * pair.centre_distance,
        material=Material(youngs_modulus=pair.material.youngs_modulus / s**2),
    )


@PAIRS
@LAWS
@pytest.mark.parametrize("resolution", [{}, {"positions": 32}], ids=["gauss", "uniform"])
def test_another_unit_of_length_scales_the_answer(pair, law, resolution):
    """All lengths × s, moduli / s², torque (a length too) × s: the same forces, δ × s, k / s."""
    s, bending = 25.4, (ToothBending(), Hertz(law=law))
    one = simulate(scene(pair, *bending, *gaps(), **resolution))
    other = simulate(scene(scaled(pair, s), *bending, *gaps(s), torque=150.0 * s, **resolution))
    # a segment whose load just vanishes is as sensitive as contact problems are: 1e-10 as the project promises
    assert_allclose(other.mesh_phase, one.mesh_phase, atol=1e-12)
    assert_allclose(other.transmission_error, one.transmission_error * s, rtol=1e-10)
    assert_allclose(other.mesh_stiffness, one.mesh_stiffness / s, rtol=1e-10)
    assert_allclose(other.line_load * s, one.line_load, atol=1e-10 * float(one.line_load.max()))
    for name in ("mesh_stiffness_rms", "mesh_stiffness_mean", "transmission_error_rms"):
        factor = {"mesh_stiffness_rms": 1.0, "mesh_stiffness_mean": 1 / s, "transmission_error_rms": s}[name]
        assert_allclose(float(other[name]), float(one[name]) * factor, rtol=1e-10)


# -- which gear drives ------------------------------------------------------------------------------------------------


@PAIRS
@LAWS
def test_swapping_pinion_and_wheel_mirrors_the_cycle(pair, law):
    bending = (ToothBending(), Hertz(law=law))
    ratio = pair.wheel.teeth / pair.pinion.teeth
    one = scene(pair, *bending, *gaps())
    other = scene(swapped(pair), *bending, *gaps(swap=True), torque=150.0 * ratio)
    a, b = solution(one, PHASES), solution(other, mirrored(pair, PHASES))
    # slopes over the face are zero at y = 0, that is at the other end: a rigid offset
    alpha = pair.meshing.alpha_wt
    tilt = 4 * math.sin(alpha) + 6 * math.cos(alpha)
    offset = 1e-3 * (8 + tilt * math.cos(pair.meshing.beta_b))
    assert_allclose(b.approach, a.approach - offset, rtol=1e-10)
    assert_allclose(b.stiffness, a.stiffness, rtol=1e-10)


def test_transmission_error_and_stiffness_are_those_along_the_transverse_line_of_action():
    """δ = δ_n / cos β_b; k = ∂F_t/∂δ by differences of the torque, F_t = T / r_b1."""
    torques = 150.0 * np.array([1 - 1e-4, 1.0, 1 + 1e-4])
    runs = [simulate(scene(HELICAL, ToothBending(), Hertz(), torque=float(t), positions=5)) for t in torques]
    delta = np.array([r.transmission_error for r in runs])
    force = 1e3 * torques / HELICAL.gears[0].base_radius
    assert_allclose(runs[1].mesh_stiffness, (force[2] - force[0]) / (delta[2] - delta[0]), rtol=1e-6)  # step² = 1e-8
    at = runs[1]
    total = (at.line_load * at.segment_length).sum(["pair", "segment"])
    assert_allclose(total * math.cos(HELICAL.meshing.beta_b), force[1], rtol=1e-12)


def test_finer_segments_converge_with_second_order():
    """Constant line load on segments and equations at their middles: order 2 if whole lines are loaded."""
    s = scene(HELICAL, ToothBending(), Hertz(), Crowning(amount=1.0))
    phases = PHASES[::7]

    def at(segments: int) -> NDArray:
        found = solution(replace(s, resolution=Resolution(segments=segments)), phases)
        return np.append(found.approach * found.stiffness.mean(), found.stiffness)

    exact = at(1000)
    counts = np.array([5, 10, 20, 40])
    errors = [np.abs(at(int(n)) / exact - 1).max() for n in counts]
    assert np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(-2, abs=0.2)


def test_residuals_are_reported_and_small():
    for pair in (SPUR, HELICAL):
        out = simulate(scene(pair, ToothBending(), Hertz(), *gaps()))
        assert float(out.equilibrium_residual.max()) <= 1e-10
        assert float(out.complementarity_residual.max()) <= 1e-10
        assert float(out.minimum_force.min()) >= 0


@PAIRS
def test_the_order_of_effects_does_not_matter(pair):
    effects = (ToothBending(), Hertz(), *gaps())
    one = scene(pair, *effects)
    a, b = (solution(each, PHASES[::4]) for each in (one, replace(one, effects=effects[4:] + effects[:4])))
    # gaps summed in another order differ in the last bit of the largest
    assert_allclose(b.approach, a.approach, rtol=1e-13)
    assert_allclose(b.force, a.force, atol=1e-11 * one.F_bn)
