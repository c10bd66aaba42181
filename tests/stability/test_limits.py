"""Limits with a known answer: contact problems, awkward sample counts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.contact.batch import ROUNDING
from gearbench.contact.solver import solve
from gearbench.effects.manufacturing_errors import ErrorKind, ManufacturingErrors
from gearbench.errors import GearbenchError
from gearbench.robustness.montecarlo import prepare_scene
from gearbench.robustness.sampling import unit_samples
from tests.stability.catalogue import CASES
from tests.stability.measure import compare_problem
from tests.stability.problems import PROBLEMS, duplicated, no_law, ordinary, stiff_law, tied
from tests.support.batches import solve_batch
from tests.support.samples import single

#: Steps that correcting may take.
CORRECTING = 210
EVERY = pytest.mark.parametrize("case", [pytest.param(p, id=p.name) for p in PROBLEMS.values()])


@EVERY
def test_contact_problem_keeps_its_digits(case):
    """Rounding alone decides whether a residual close to the limit is corrected; if so, more digits are right."""
    found = compare_problem(case.build())
    assert found.least >= (max(case.digits, 12) if found.correcting else case.digits), found
    assert found.steps - found.correcting <= case.steps, found
    assert found.correcting <= CORRECTING, found


def test_duplicated_segments_answer_like_single_ones():
    one, two = solve(ordinary()), solve(duplicated())
    assert_allclose(two.approach, one.approach, rtol=1e-13)
    assert_allclose(two.stiffness, one.stiffness, rtol=1e-13)
    assert_allclose(two.force.reshape(*one.force.shape, 2).sum(axis=3), one.force, atol=1e-12 * one.force.sum())


def test_a_corrected_answer_says_so():
    """Where rounding spoils the residual the position is solved again, and the solution records it."""
    assert solve(ordinary()).corrected == 0
    assert solve(stiff_law(1e-9)).corrected == 1


def test_exactly_touching_segments_carry_nothing():
    s = solve(tied(0.125))
    assert_allclose(s.approach, 0.125, rtol=1e-15)
    assert_allclose(s.force.ravel()[::3], 0.0, atol=1e-15)


def test_a_singular_compliance_without_law_is_solved_to_its_residual_or_an_error():
    """δ is determined, the shares of the load are not: whatever is returned satisfies the equations."""
    try:
        s = solve(no_law(1e40))
    except GearbenchError:
        return
    assert s.complementarity.max() <= 1e-9
    assert s.equilibrium.max() <= 1e-9
    assert s.force.min() >= 0


# -- many samples -----------------------------------------------------------------------------------------------------
BATCHES = [
    *("undercut, z = 5", "teeth nearly pointed", "β = 0.01°", "β = 45°", "ε_γ just above 1, helical", "b/m = 0.5"),
    *("x at its lower limit", "torque × 1e-09", "torque at its upper limit", "1 segments"),
    *("gaps of 1000 deflections, yang_sun", "gaps of 1000 deflections, weber_banaschek"),
    "contact on one segment, weber_banaschek",
]
#: Those of which some samples need the line search.
RESCUED = {"torque × 1e-09", "contact on one segment, weber_banaschek"}


@pytest.mark.parametrize("name", BATCHES)
def test_a_batch_of_samples_answers_like_single_solves_and_counts_its_rescues(name):
    """Errors of 8 µm on a hard scene: samples need the line search only under a vanishing load or on one segment."""
    base = CASES[name].build()
    kinds = {n: ErrorKind(amplitude=8.0) for n in ("profile_slope", "helix_slope", "helix_form")}
    effects = (*base.effects, ManufacturingErrors(**kinds))
    hard = replace(base, effects=effects, resolution=replace(base.resolution, positions=8))
    problem = prepare_scene(hard, ROUNDING)
    draws = problem.errors.draw(unit_samples("sobol", 64, len(problem.names), 1), hard.pair) - problem.mean
    batch = solve_batch(problem.batch, draws)
    assert (batch.rescued > 0) == (name in RESCUED)
    for j in range(0, 64, 9):
        approach, stiffness = single(problem.batch, draws[j])
        assert_allclose(batch.approach[:, j], approach, rtol=1e-9)
        assert_allclose(batch.stiffness[:, j], stiffness, rtol=1e-7)


def test_awkward_counts_reach_the_statistics():
    from gearbench.library.garambois2017 import gear
    from gearbench.robustness.run import robust
    from gearbench.scene import Resolution

    scene = gear("36").scene(errors=True, resolution=Resolution(positions=4, segments=5))
    whole = robust(scene, samples=130, threads=1)
    for count in (1, 2, 3, 129):
        out = robust(scene, samples=count, threads=1)
        assert out.attrs["rescued"] == 0
        assert np.array_equal(out.mesh_stiffness_rms.values, whole.mesh_stiffness_rms.values[:count])
        for name in out.data_vars:
            if not name.endswith(("_first_order", "_total", "_tightened", "_standard_error")):  # too few samples
                assert np.all(np.isfinite(out[name].values)), name
