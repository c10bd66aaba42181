"""The batch solver: every sample the answer of the single-scene solver, whatever the lanes, batches and threads."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from gearbench.contact import batch as batching
from gearbench.contact._batch_kernels import Blocks, schur_complements, solve_chunk
from gearbench.contact._lane_kernels import LANES, POINT, Gaps, LaneResults, Lanes, apply_laws, steepen
from gearbench.contact.assemble import assemble
from gearbench.contact.batch import ROUNDING, SCATTER, GapModes
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.law import inverse, kernel_coefficients
from gearbench.contact.patches import solve_patches
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.hertz import Hertz
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.tooth_bending import ToothBending
from gearbench.library.garambois2017 import gear
from gearbench.robustness.cells import cell_warning
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.robustness.run import robust
from gearbench.scene import Resolution, Scene
from tests.support.batches import solve_batch
from tests.support.compiled import callable_part
from tests.support.samples import single, stiffness_slopes


def robust_scene(name: str, *others) -> Scene:
    scene = gear(name).scene(errors=True, resolution=Resolution(positions=8))
    effects = tuple(next((o for o in others if o.name == e.name), e) for e in scene.effects)
    return replace(scene, effects=effects)


SCENES = {
    "spur": robust_scene("SC"),
    "helical, three pairs": robust_scene("7"),
    "helical with relief": robust_scene("55"),
    "crowned": robust_scene("1"),
    "linear law": robust_scene("19", Hertz(law="yang_sun")),
    "high order": robust_scene("19", ToothBending(order=(4, 4))),
    "rigid teeth": replace(robust_scene("19"), effects=(Hertz(), ManufacturingErrors(preset="garambois2017"))),
}


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES.keys())
def test_every_sample_is_the_answer_of_the_single_scene_solver(scene):
    problem = prepare_scene(scene, ROUNDING)
    errors = problem.draw(40, 3, "random")
    solution = solve_batch(problem.batch, errors - problem.mean)

    for i in range(len(errors)):
        approach, stiffness = single(problem.batch, errors[i] - problem.mean)
        # the promise of the batch: 1e-9 on every sample
        assert_allclose(solution.approach[:, i], approach, rtol=1e-9)
        assert_allclose(solution.stiffness[:, i], stiffness, rtol=1e-9)


@pytest.mark.parametrize("name", ["helical with relief", "crowned", "off the line of action"])
def test_without_errors_samples_are_the_mesh_cycle_of_a_single_scene(name):
    """What cells miss is known there: ends of patches are those of ``simulate``."""
    scene = SCENES.get(name) or replace(SCENES["crowned"], effects=(*SCENES["crowned"].effects, OffLineContact()))
    lines = scene_lines(scene, mesh_phases(scene)[0])
    exact = solve_patches(assemble(scene, lines))
    gaps = GapModes.on(lines, lambda each: np.ones((*each.shape, 1)))
    found = solve_batch(batching.prepare(assemble(scene, lines), gaps), np.zeros((1, 1)))
    assert_allclose(found.approach[:, 0], exact.approach, rtol=1e-9)
    # a rough solution's is that before its last step, at a residual of 1e-6
    assert_allclose(found.stiffness[:, 0], exact.stiffness, rtol=1e-6)


@pytest.mark.parametrize("name", ["36", "7"])
def test_what_cells_leave_of_a_mean_is_in_the_result(name):
    """15 segments against 60, of the same samples: an estimate from eight samples is good to a factor of 2.5."""
    scene = gear(name).scene(errors=True)
    finer = replace(scene, resolution=replace(scene.resolution, segments=60))
    found, expected = (robust(each, samples=LANES, threads=1, shares=False) for each in (scene, finer))
    for response in ("transmission_error_rms_mean", "mesh_stiffness_rms_mean"):
        miss = abs(float(found[response] - expected[response]))
        stated = float(found[f"{response}_cell_error"])
        assert miss < max(2.5 * stated, float(found[f"{response}_standard_error"]))
        assert stated < 0.01 * float(found[response])
    # the stiffness itself is known better: at 15 segments cells as C7 has them were off by 0.05 % to 0.25 % on bodies
    assert_allclose(found["mesh_stiffness_mean"].mean(), expected["mesh_stiffness_mean"].mean(), rtol=1e-3)


def test_errors_that_cells_leave_are_warned_of_where_samples_leave_less():
    variables = {f"mesh_stiffness_rms_mean{end}": ((), x) for end, x in (("", 2.0), ("_cell_error", 0.05))}
    for standard, loud in ((0.01, True), (0.06, False)):
        line = cell_warning({**variables, "mesh_stiffness_rms_mean_standard_error": ((), standard)})
        assert (line is not None) == loud
        assert line is None or "mesh_stiffness_rms_mean 2.5 %" in line


def test_samples_of_a_scatter_are_good_to_a_hundred_thousandth():
    """Samples computed to rounding are exact, see above; by default they save steps and columns."""
    exact, problem = (prepare_scene(SCENES["helical with relief"], each) for each in (ROUNDING, SCATTER))
    assert problem.batch.rank < exact.batch.rank
    draws = problem.draw(LANES, 2, "sobol") - problem.mean
    found, expected = solve_batch(problem.batch, draws), solve_batch(exact.batch, draws)
    assert_allclose(found.approach, expected.approach, rtol=1e-5)
    assert_allclose(found.stiffness, expected.stiffness, rtol=1e-5)
    assert np.abs(found.stiffness / expected.stiffness - 1).max() > 1e-9


def test_a_sample_is_bit_for_bit_the_same_in_any_batch_and_on_any_number_of_threads():
    problem = prepare_scene(SCENES["helical with relief"], ROUNDING)
    errors = problem.draw(3 * LANES + 5, 0, "sobol")
    whole, _ = respond(problem, errors, threads=1)
    threaded, _ = respond(problem, errors, threads=2)
    assert_array_equal(whole["transmission_error_rms"], threaded["transmission_error_rms"])
    assert_array_equal(whole["mesh_stiffness_rms"], threaded["mesh_stiffness_rms"])
    for start, stop in ((0, 1), (LANES - 3, LANES + 4), (17, 18), (5, 3 * LANES)):
        part, _ = respond(problem, errors[start:stop], threads=1)
        assert_array_equal(part["transmission_error_rms"], whole["transmission_error_rms"][start:stop])
        assert_array_equal(part["mesh_stiffness_rms"], whole["mesh_stiffness_rms"][start:stop])


def test_what_the_first_guess_missed_at_the_positions_before_saves_steps():
    """The same answers; guesses lie on the straight line through two positions, not beyond the next one."""
    problem = prepare_scene(gear("24").scene(errors=True), ROUNDING)
    b, draws = problem.batch, np.ascontiguousarray(problem.expansion.amounts(problem.draw(LANES, 0, "sobol")).T)
    found = []
    blocks = Blocks(b.firsts, b.blocks, b.ranks, b.factor, b.product, b.start, b.guess)
    for extrapolation in (np.zeros_like(b.extrapolation), b.extrapolation):
        delta, stiffness, done = np.empty((3, len(b.count), LANES))
        nothing = np.empty((0, b.gap.shape[1], LANES))
        gaps = Gaps(b.count, extrapolation, b.gap, b.tilt, b.modes, b.tilts, b.laws)
        answers = LaneResults(delta, stiffness, done, nothing, nothing)
        work = Lanes.of(b.gap.shape[1], np.ones(delta.shape))
        steps = solve_chunk(gaps, blocks, draws, work, b.precision.newton, batching.NEWTON_LIMIT, answers)
        assert done.all()
        found.append((steps, delta, stiffness))
    assert found[1][0] < 0.9 * found[0][0]
    # an approach near zero has the rounding of the others: all are of some µm
    assert_allclose(found[1][1], found[0][1], rtol=1e-12, atol=1e-14)
    assert_allclose(found[1][2], found[0][2], rtol=1e-8)
    active, phase = problem.batch.problem.active, problem.phases.phase
    line = np.where(
        (b.extrapolation[:, 1] < 0)[2:],
        b.extrapolation[2:, 0] * phase[1:-1] + b.extrapolation[2:, 1] * phase[:-2],
        phase[2:],
    )
    assert np.all(line <= phase[2:] + 1e-12)
    assert not b.extrapolation[1:][(active[1:] != active[:-1]).any(axis=1)].any()


def test_samples_that_newton_does_not_reach_go_to_the_solver_with_line_search(monkeypatch):
    problem = prepare_scene(SCENES["spur"], ROUNDING)
    errors = problem.draw(10, 0, "sobol")
    plain = solve_batch(problem.batch, errors - problem.mean)
    assert plain.rescued == 0
    monkeypatch.setattr(batching, "NEWTON_LIMIT", 1)
    rescued = solve_batch(problem.batch, errors - problem.mean)
    assert rescued.rescued > 0
    assert_allclose(rescued.approach, plain.approach, rtol=1e-9)
    assert_allclose(rescued.stiffness, plain.stiffness, rtol=1e-9)


@pytest.mark.parametrize("level", [6.0, 10.0, 20.0])
def test_slopes_of_cells_are_those_of_the_mean_of_the_law(level):
    """Of a compression that runs straight along a cell, or the part t of it: differences of g⁻¹ in closed form."""
    t = np.array([0.05, 0.2, 0.5, 0.9, 0.999, 1.001, 1.1, 1.5, 3.0, 20.0])
    sigma, h = np.full(t.shape, 0.3), np.full(t.shape, 0.02)
    a, s = h * (level + np.log(0.3 / (0.02 * level))), 2 * sigma * t  # L = level under the compression σ
    expected = (inverse(s, a, h)[0] - inverse(s - 2 * sigma, a, h)[0]) / (2 * sigma)
    slope = inverse(s, a, h, sigma)[1]
    miss, before = (np.abs(each / expected - 1).max() for each in (stiffness_slopes(s, a, h, sigma), slope))
    assert miss < 1.2 / level**2 < before / 4


@pytest.mark.parametrize("sigma", [0.0, 0.5])
@pytest.mark.parametrize("h", [0.0, 0.03, 2.0])
def test_the_law_of_the_lanes_is_that_of_its_readable_twin(h, sigma):
    rng = np.random.default_rng(0)
    a = np.array([0.4, 1.0, 3.0]) + 8 * h
    s = np.concatenate([10.0 ** rng.uniform(-14, 3, (3, LANES - 2)), [[0.0, -1.0]] * 3], axis=1)
    laws, lanes = kernel_coefficients(a[None], np.full((1, 3), h))[0], Lanes.of(3, np.ones((1, LANES)))
    lanes.s[:], lanes.sigma[0], lanes.sigma[1] = s, max(sigma, POINT), 0.5 / max(sigma, POINT)
    a, h, sigma = np.broadcast_to(a[:, None], s.shape), np.full(s.shape, h), np.full(s.shape, sigma)
    force, slope, _ = inverse(s, a, h, sigma)
    callable_part(apply_laws)(3, laws, lanes)
    # one Halley step from a guess good to 1e-4 leaves a few units of 1e-13
    assert_allclose(lanes.p, force, rtol=2e-12)
    assert_allclose(lanes.w, slope, rtol=2e-12)
    callable_part(steepen)(3, laws, lanes)
    assert_allclose(lanes.w, stiffness_slopes(s, a, h, sigma), rtol=4e-12)


def test_reducing_the_rank_does_not_change_the_compliance():
    scene = SCENES["helical with relief"]
    phase, _ = mesh_phases(scene)
    problem = assemble(scene, scene_lines(scene, phase))
    reduced = batching.reduce_rank(problem)
    both = problem.active[:, :, None] & problem.active[:, None, :]
    same_pair = both & (problem.block[:, None] == problem.block)
    before, after = (np.where(same_pair, p.factor @ np.swapaxes(p.factor, 1, 2), 0.0) for p in (problem, reduced))
    assert_allclose(after, before, atol=1e-12 * np.max(np.abs(before)))
    assert batching.reduce_rank(assemble(SCENES["spur"], scene_lines(SCENES["spur"], phase))).factor.shape[2] == 2


def test_progress_counts_the_samples_and_an_interruption_keeps_what_is_done():
    problem = prepare_scene(SCENES["spur"], ROUNDING)
    errors = problem.draw(3 * LANES, 0, "sobol")
    seen = []
    respond(problem, errors, threads=1, progress=seen.append)
    assert seen == [LANES, 2 * LANES, 3 * LANES]

    def interrupt(done: int) -> None:
        if done == 2 * LANES:
            raise KeyboardInterrupt

    answer, complete = respond(problem, errors, threads=1, progress=interrupt)
    whole, _ = respond(problem, errors, threads=1)
    assert not complete
    assert len(answer) == 2 * LANES
    assert_array_equal(answer["transmission_error_rms"], whole["transmission_error_rms"][: 2 * LANES])


def test_the_dataset_says_whether_it_is_complete():
    run = partial(robust, SCENES["spur"], samples=2 * LANES, seed=5, threads=1)
    dataset = run()
    assert dataset.attrs["complete"] == 1
    assert dataset.sizes["sample"] == 2 * LANES
    assert dataset.attrs["seed"] == 5
    assert_allclose(dataset["transmission_error_rms_mean"], dataset["transmission_error_rms"].mean(), rtol=1e-14)
    assert_array_equal(dataset["mesh_stiffness_rms_max"], dataset["mesh_stiffness_rms"].max())

    def interrupt(_: int) -> None:
        raise KeyboardInterrupt

    partial_run = run(progress=interrupt)
    assert partial_run.attrs["complete"] == 0
    assert partial_run.sizes["sample"] == LANES


def test_compiled_schur_complements_are_those_of_numpy():
    """S = D − C A⁻¹ Cᵀ of the last rows, of random positive definite matrices, one in each lane."""
    size, rows = 7, 3
    draws = np.random.default_rng(4).normal(size=(LANES, size, size))
    whole = draws @ np.swapaxes(draws, 1, 2) + np.eye(size)
    A, C, D = whole[:, :-rows, :-rows], whole[:, -rows:, :-rows], whole[:, -rows:, -rows:]
    i, j = np.tril_indices(size)
    found = np.empty((rows, rows, LANES))
    schur_complements(np.ascontiguousarray(whole[:, i, j].T), size, rows, found)
    expected = D - C @ np.linalg.solve(A, np.swapaxes(C, 1, 2))
    assert_allclose(np.moveaxis(found, -1, 0), expected, rtol=1e-10, atol=1e-12)
