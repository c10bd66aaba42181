"""The batch solver of coupled problems: conjugate gradients against its readable twin and the single-scene solver."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from gearbench.contact import batch as batching
from gearbench.contact._lane_kernels import LANES
from gearbench.contact.batch import ROUNDING, Batch
from gearbench.contact.law import inverse
from gearbench.effects.gear_body import GearBody
from gearbench.effects.hertz import Hertz
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.effects.tooth_bending import ToothBending
from gearbench.library.garambois2017 import gear
from gearbench.robustness.montecarlo import RobustProblem, prepare_scene
from gearbench.scene import Resolution, Scene
from tests.support.batches import solve_batch
from tests.support.samples import single, stiffness_slopes


def on_its_body(name: str, law: str = "weber_banaschek") -> Scene:
    scene = gear(name).scene(errors=True, resolution=Resolution(positions=5))
    members = [
        replace(member, bore_diameter=1.2 * g.root_radius)
        for member, g in zip((scene.pair.pinion, scene.pair.wheel), scene.pair.gears, strict=True)
    ]
    teeth = (ToothBending(model="solid", order=(4, 5, 7)), GearBody(), Hertz(law=law))
    return replace(
        scene,
        pair=replace(scene.pair, pinion=members[0], wheel=members[1]),
        effects=(*teeth, ManufacturingErrors(preset="garambois2017")),
    )


SCENES = {"spur": on_its_body("SC"), "helical": on_its_body("7"), "linear law": on_its_body("7", "yang_sun")}
EACH = pytest.mark.parametrize("name", SCENES)


@lru_cache
def prepared(name: str) -> RobustProblem:
    problem = prepare_scene(SCENES[name], ROUNDING)
    assert problem.batch.reference is not None
    return problem


def twin(batch: Batch, position: int, draw: np.ndarray) -> tuple[float, float]:
    """δ and ∂F/∂δ of one sample: Newton's method on (B2), its systems solved directly."""
    r, m = batch.reference, batch.count[position]
    assert r is not None
    own, mean = (batch.arrays(each, slice(position, position + 1)) for each in (draw, np.zeros(len(draw))))
    e, a, h, sigma = (each[0, :m] for each in (own.gap, own.a, own.h, own.sigma))
    begin = int((batch.count[:position] ** 2).sum())
    G, W0, rise = r.response[begin : begin + m * m].reshape(m, m), r.weight[position, :m], r.rise[position, :m]
    u = r.start[position, :m] + W0 * (e - mean.gap[0, :m])
    for _ in range(40):
        z = rise + G @ u
        P, W, _ = inverse(z - e, a, h, sigma)
        F = u + P - W0 * z
        if np.abs(F).sum() < 1e-13:
            break
        u = u - np.linalg.solve(np.eye(m) + (W - W0)[:, None] * G, F)
    W = stiffness_slopes(z - e, a, h, sigma)
    compliance = r.flexibility[position] - rise @ np.linalg.solve(np.eye(m) + (W - W0)[:, None] * G, (W - W0) * rise)
    return float(r.flexibility[position] + rise @ u), 1 / float(compliance)


@EACH
@pytest.mark.parametrize("times", [1, 30])
def test_the_lanes_give_the_answers_of_the_readable_twin(name, times):
    problem = prepared(name)
    draws = times * problem.draw(6, 5, "random") - problem.mean
    found = solve_batch(problem.batch, draws)
    assert found.rescued == 0
    p, (more, share) = problem.batch.problem, problem.batch.cell_correction
    for t in range(len(problem.batch.count)):
        for j, draw in enumerate(draws):
            delta, stiffness = twin(problem.batch, t, draw)
            # tolerance of the residual; the stiffness is good to the square of 3e-6
            assert_allclose(found.approach[t, j], p.length_scale * delta + more[t], rtol=1e-10)
            assert_allclose(found.stiffness[t, j], p.force / p.length_scale * stiffness * share[t], rtol=2e-10)


@EACH
def test_every_sample_is_the_answer_of_the_single_scene_solver(name):
    problem = prepared(name)
    errors = problem.draw(25, 3, "random")
    solution = solve_batch(problem.batch, errors - problem.mean)
    for i in range(len(errors)):
        approach, stiffness = single(problem.batch, errors[i] - problem.mean)
        # the promise of the batch: 1e-9 on every sample
        assert_allclose(solution.approach[:, i], approach, rtol=1e-9)
        assert_allclose(solution.stiffness[:, i], stiffness, rtol=1e-9)


@pytest.mark.parametrize("times", [1.0, 1000.0])
def test_both_kernels_give_the_same_answers(monkeypatch, times):
    """The one that eliminates the amplitudes, and conjugate gradients; errors up to a thousand deflections."""
    problem = prepared("helical")
    errors = times * problem.draw(LANES, 1, "sobol") - problem.mean
    one = solve_batch(problem.batch, errors)
    monkeypatch.setattr(batching, "COUPLED_RANK", 1000)
    other = prepare_scene(SCENES["helical"], ROUNDING)
    assert other.batch.reference is None
    two = solve_batch(other.batch, errors)
    assert one.rescued == two.rescued == 0
    assert_allclose(one.approach, two.approach, rtol=1e-9)
    assert_allclose(one.stiffness, two.stiffness, rtol=2e-9)


@pytest.mark.parametrize("rank", [batching.COUPLED_RANK, 1000], ids=["conjugate gradients", "elimination"])
def test_samples_that_begin_once_more_do_not_change_their_neighbours(monkeypatch, rank):
    """Of errors of many deflections some begin too far away with what the positions before missed, and begin again."""
    monkeypatch.setattr(batching, "COUPLED_RANK", rank)
    problem = prepare_scene(SCENES["helical"], ROUNDING)
    errors = 30 * problem.draw(LANES, 5, "random") - problem.mean
    whole = solve_batch(problem.batch, errors)
    for i in range(0, LANES, 16):
        alone = solve_batch(problem.batch, errors[i : i + 1])
        assert_array_equal(alone.approach[:, 0], whole.approach[:, i])
        assert_array_equal(alone.stiffness[:, 0], whole.stiffness[:, i])
