"""What every hard case must hold, and how many digits of it survive."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from gearbench.contact._law_kernels import law
from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.problem import ContactProblem, ContactSolution
from gearbench.contact.solver import solve
from gearbench.contact.transitions import mesh_phases
from gearbench.scene import Load, Scene
from gearbench.simulation import simulate
from tests.stability.catalogue import CASES, SPUR, HardCase
from tests.stability.measure import compare
from tests.support.compiled import callable_part
from tests.support.contact_invariants import assert_solved

#: Most Newton steps that any case of the catalogue may take.
STEPS = 30
EVERY = pytest.mark.parametrize(
    "case", [pytest.param(c, marks=[pytest.mark.slow] if c.slow else [], id=c.name) for c in CASES.values()]
)


@cache
def built(name: str) -> Scene:
    return CASES[name].build()


def phases(scene: Scene, count: int = 24) -> NDArray:
    """Phases all over the cycle: the scene's own, thinned, and both sides of every transition."""
    own, _ = mesh_phases(scene)
    edges = np.array(scene.pair.meshing.transition_phases)
    return np.unique(np.concatenate([own[:: max(1, own.size // count)], edges, (edges + 1e-9) % 1, (edges - 1e-9) % 1]))


def answer(scene: Scene, tau: NDArray) -> tuple[ContactProblem, ContactSolution]:
    problem = assemble(scene, scene_lines(scene, tau))
    return problem, solve(problem)


@EVERY
def test_solved(case: HardCase):
    """Finite, P ≥ 0, equilibrium and complementarity to 1e-9, k > 0, a bounded number of steps."""
    scene = built(case.name)
    _, s = answer(scene, phases(scene))
    assert_solved(s, steps=STEPS)
    assert_allclose(s.force.sum(axis=(1, 2)), scene.F_bn, rtol=1e-9)
    out = simulate(scene)
    assert int(out.newton_steps.max()) <= STEPS
    for name in out.variables:
        if name != "mesh_stiffness_rms" or float(out.mesh_stiffness_mean) > 0:
            assert np.all(np.isfinite(out[name].values)), name


@EVERY
def test_more_load_deflects_more_and_little_more_only_little(case: HardCase):
    scene = built(case.name)
    tau = phases(scene)[::5]
    torque = scene.load.torque
    # up to the load of the case, which may be the greatest there is
    steps = [1 / 1.5, 1 / 1.01, 1 - 1e-7, 1.0]
    delta = np.array([answer(replace(scene, load=Load(torque=torque * x)), tau)[1].approach for x in steps])
    base = answer(scene, tau)[1]
    assert np.all(np.diff(delta, axis=0) > 0)
    # dδ = dF / k, with k between its values at both ends
    assert_allclose(delta[3] - delta[2], 1e-7 * scene.F_bn / base.stiffness, rtol=1e-4, atol=4e-16 * abs(delta).max())


@EVERY
def test_continuous_in_the_phase(case: HardCase):
    """A step of 1e-9 in the phase changes δ by that order: inside a panel, and for a helical pair across its end."""
    scene = built(case.name)
    pair = scene.pair
    edges = np.append(pair.meshing.transition_phases, pair.meshing.transition_phases[0] + 1)
    wide = np.diff(edges) > 1e-4
    middle = (edges[:-1][wide] + 0.37 * np.diff(edges)[wide]) % 1.0
    step = 1e-9
    a, b = answer(scene, middle)[1].approach, answer(scene, middle + step)[1].approach
    # all that changes may change within one panel
    assert np.all(np.abs(a - b) <= 100 * step / np.diff(edges)[wide] * np.maximum(np.abs(a), np.abs(b)))
    if pair.meshing.overlap_ratio < 1e-3:
        return
    edge = np.array(pair.meshing.transition_phases)
    (_, a), (_, b) = (answer(scene, (edge + d) % 1.0) for d in (-step, step))
    # δ of a pair that is about to lose its last line grows like the inverse of the length that is left
    left = scene_lines(scene, (edge - step) % 1.0).length, scene_lines(scene, (edge + step) % 1.0).length
    reach = np.minimum(*(x.sum(axis=(1, 2)) / pair.face_width for x in left))
    most = np.maximum(np.abs(a.approach), np.abs(b.approach))
    shortest = np.minimum(reach, min(pair.meshing.overlap_ratio, 1.0))
    assert np.all(np.abs(a.approach - b.approach) <= 100 * step / shortest * most)


def inside(scene: Scene, count: int = 7) -> NDArray:
    """Phases well inside the panels between transitions, where rounding does not decide which lines there are."""
    edges = np.append(scene.pair.meshing.transition_phases, scene.pair.meshing.transition_phases[0] + 1)
    wide = np.diff(edges) > 1e-3
    return np.concatenate([edges[:-1][wide] + x * np.diff(edges)[wide] for x in (0.21, 0.66)])[:count] % 1.0


@EVERY
def test_digits_against_extended_precision(case: HardCase):
    found = compare(built(case.name), case.phases)
    least = min(found.approach, found.stiffness, found.force)
    assert least >= case.digits, found


def test_the_law_at_vanishing_load():
    """Weber–Banaschek: P and slope are finite, positive and monotone down to compressions of 1e-300."""
    s = np.geomspace(1e-300, 1.0, 400)
    P, slope, energy = np.array([callable_part(law)(x, 5.0, 0.5) for x in s]).T
    assert np.all(np.isfinite(P) & np.isfinite(slope) & np.isfinite(energy))
    assert np.all(np.diff(P) > 0)
    assert np.all(slope > 0)
    assert callable_part(law)(0.0, 5.0, 0.5) == (0.0, 0.0, 0.0)


def test_a_pair_that_does_not_touch_is_refused_not_solved():
    with pytest.raises(ValueError, match="contact ratio"):
        replace(SPUR, pinion=replace(SPUR.pinion, addendum=0.3), wheel=replace(SPUR.wheel, addendum=0.3))


def test_nominal_steps_are_few():
    """The bound above is for hard cases; an ordinary one takes a handful."""
    _, s = answer(built("no gap at all, weber_banaschek"), np.arange(16) / 16)
    assert s.iterations.max() <= 6
    assert math.isfinite(float(s.approach[0]))
