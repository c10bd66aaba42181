"""Compiled parts of the contact solver against their readable twins."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad

from gearbench import read_scene
from gearbench.contact import _kernels, _law_kernels, solver
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.interpolation import interpolation_matrix, values_at
from gearbench.contact.law import compression, inverse
from gearbench.contact.patches import patch_nodes, patch_rules
from gearbench.contact.problem import ContactProblem, part_of
from gearbench.contact.solver import Guess, newton
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.tip_relief import TipRelief
from gearbench.geometry.quadrature import interpolation
from tests.support.compiled import callable_part
from tests.support.contact_twin import solve_one
from tests.support.patch_twin import patch_nodes as twin_nodes
from tests.support.paths import ROOT

FORCES = np.concatenate([[0.0], 10.0 ** np.linspace(-12, 2, 60)])


@pytest.mark.parametrize("sigma", [0.0, 0.4, 30.0])
@pytest.mark.parametrize("h", [0.0, 0.03, 2.0])
@pytest.mark.parametrize("stiff", [0.4, 3.0])
def test_the_compression_is_that_of_its_readable_twin(h, sigma, stiff):
    a = np.full(FORCES.shape, stiff + 8 * h)
    found = [callable_part(_kernels.compression)(p, stiff + 8 * h, h, sigma) for p in FORCES]
    assert_allclose(found, compression(FORCES, a, np.full(FORCES.shape, h), sigma), rtol=1e-14, atol=1e-300)


def segment_laws(s, a, h, sigma):
    """Forces and slopes of segments, and their sums and that of the energies."""
    constants, scratch = np.empty((_law_kernels.CONSTANTS, s.size)), np.empty((_law_kernels.SCRATCH, s.size))
    P, W = np.empty((2, s.size))
    callable_part(_law_kernels.law_constants)(a, h, sigma, constants)
    return P, W, callable_part(_law_kernels.apply_laws)(s, constants, scratch, P, W)


@pytest.mark.parametrize("linear", [False, True])
def test_the_law_of_many_segments_is_that_of_its_readable_twin(linear):
    rng = np.random.default_rng(4)
    n = 3000
    h = 10.0 ** rng.uniform(-4, 1, n)
    a = h * 10.0 ** rng.uniform(0.4, 2.7, n)
    h = 0 * h if linear else h
    sigma = np.where(rng.random(n) < 0.5, 0.0, 10.0 ** rng.uniform(-8, 1, n))
    s = 10.0 ** rng.uniform(-20, 6, n) * rng.choice([1, 1, 1, -1], n)
    P, W, sums = segment_laws(s, a, h, sigma)
    each = np.array(inverse(s, a, h, sigma))
    assert_allclose(P, each[0], rtol=1e-12)
    assert_allclose(W, each[1], rtol=1e-12)
    assert_allclose(sums, each.sum(axis=1), rtol=1e-12)


def test_values_between_the_nodes_of_pieces_are_those_of_their_polynomials():
    """Of a helical pair off the line of action, whose lines have three pieces; Legendre polynomials are the twin."""
    scene = read_scene(ROOT / "examples" / "gears" / "large_wheel.toml").without("off_line_contact")
    relief = TipRelief(amount=20.0, length=1.5)
    lines = scene_lines(replace(scene, effects=(*scene.effects, OffLineContact(), relief)), np.linspace(0.0, 0.9, 9))
    smooth_lines, rng = lines.smooth_lines(22), np.random.default_rng(6)
    assert smooth_lines.panel is not None
    assert smooth_lines.panel.max() == 2
    low, high = lines.ends
    y = low + (high - low) * rng.uniform(size=(*lines.shape[:2], 50))
    found, half = interpolation_matrix(smooth_lines, y), smooth_lines.length * np.cos(lines.pair.meshing.beta_b) / 2
    for line in zip(*np.nonzero(lines.active), strict=True):
        end = low[line][0]
        for piece in np.unique(smooth_lines.panel[line]):
            own = smooth_lines.panel[line] == piece
            reach, begin = half[line][own].sum(), end
            end = begin + 2 * reach
            there = (y[line] > begin) & (y[line] <= end)
            twin = interpolation(int(own.sum()), (y[line][there] - begin) / reach - 1)
            assert_allclose(found[line][np.ix_(there, own)], twin, rtol=0, atol=1e-11)
            assert not found[line][np.ix_(there, ~own)].any()
        assert end == pytest.approx(high[line][0], abs=1e-9)
    assert not found[~lines.active].any()


def test_patches_are_those_of_the_readable_twin():
    scene = read_scene(ROOT / "examples" / "gears" / "large_wheel.toml").without("off_line_contact")
    lines, rng = scene_lines(scene, np.linspace(0.0, 0.9, 9)), np.random.default_rng(5)
    patches = 0
    for _ in range(4):
        s = rng.normal(size=(*lines.shape, 3)).cumsum(axis=2) + rng.normal()
        s[:, :, 1:, 0] = s[:, :, :-1, 2]
        s = np.where(lines.active[..., None, None], s, -1.0)
        low, high = lines.ends
        known = (
            low + (high - low) * np.sort(rng.uniform(size=(*lines.shape[:2], 20))),
            rng.normal(size=(9, 1, 20)) + s[..., :1, 1],
        )
        (y, width), (y_twin, width_twin) = (find(lines, s, 60, known) for find in (patch_nodes, twin_nodes))
        # the bisections of both find zeros to rounding of y
        assert_allclose(y, y_twin, rtol=0, atol=1e-11)
        assert_allclose(width, width_twin, rtol=0, atol=1e-11)
        patches += np.count_nonzero(np.diff(np.sign(s.reshape(*lines.shape[:2], -1))) > 0)
    assert patches > 50


@pytest.mark.parametrize(("kind", "ends"), [(1, (1,)), (2, (-1,)), (3, (-1, 1))])
def test_points_of_a_patch_resolve_the_slope_of_the_law_at_free_ends(kind, ends):
    """There the slope rises like 1/ln(1/s)."""

    def slope(x):
        return 1 / (4 - np.log(np.prod([(1 - end * x) / 2 for end in ends], axis=0)))

    exact = sum(quad(slope, low, low + 1, epsabs=1e-13, limit=500)[0] for low in (-1, 0))
    errors = [abs(w[each, 12] @ slope(x[each, 12]) - exact) for x, w in (patch_rules(12),) for each in (kind, 0)]
    assert errors[0] < 5e-6
    assert errors[0] < 0.05 * errors[1]


@pytest.mark.parametrize("blocks", [1, 3])
def test_complementarity_is_that_of_the_equations(blocks):
    rng = np.random.default_rng(1)
    positions, n, rank = 4, 12, 5
    P = np.maximum(rng.normal(size=(positions, n)), 0.0)
    gap, a, h, sigma = (rng.uniform(0.1, 1.0, (positions, n)) for _ in range(4))
    a = a + 6 * h
    factor, active = rng.normal(size=(positions, n, rank)), rng.uniform(size=(positions, n)) > 0.2
    block, delta = np.repeat(np.arange(blocks), n // blocks), rng.uniform(size=positions)
    P, factor = np.where(active, P, 0.0), np.where(active[..., None], factor, 0.0)
    same = block[:, None] == block
    apart = np.einsum("pij,pj->pi", factor @ np.swapaxes(factor, 1, 2) * same, P) + gap - delta[:, None]
    apart += compression(P, a, h, sigma)
    found = np.empty(positions)
    arrays = _kernels.Arrays(gap, a, h, sigma, active, factor, np.tile(block, (positions, 1)))
    _kernels.complementarity(arrays, P, delta, found)
    expected = np.abs(np.where(active, np.minimum(P, apart), 0.0)).max(axis=1)
    assert_allclose(found, expected, rtol=1e-13)
    P[2, np.flatnonzero(active[2])[0]] = np.nan
    _kernels.complementarity(arrays, P, delta, found)
    assert np.isnan(found[2])
    assert np.isfinite(found[[0, 1, 3]]).all()


def coupled_problem(seed: int, rank: int, *, sigma: bool) -> ContactProblem:
    """Three positions of 24 segments that share ``rank`` amplitudes; gaps of some deflections, some segments absent."""
    rng = np.random.default_rng(seed)
    shape = (3, 24)
    active = rng.random(shape) < 0.9
    h = 0.1 * rng.uniform(0.5, 2.0, shape)
    gap = rng.random(shape) * 10.0 ** rng.uniform(-2, 1)
    return ContactProblem(
        gap=gap - np.where(active, gap, np.inf).min(axis=1)[:, None],
        a=h * rng.uniform(3.0, 9.0, shape),
        h=h,
        sigma=rng.uniform(0.0, 0.5, shape) if sigma else np.zeros(shape),
        active=active,
        factor=rng.normal(size=(*shape, rank)) / np.sqrt(rank),
        block=np.zeros(24, dtype=np.int64),
        blocks=1,
        force=1.0,
        length_scale=1.0,
        shape=(3, 1, 24),
    )


@pytest.mark.parametrize("sigma", [False, True])
@pytest.mark.parametrize("rank", [13, 40])
def test_steps_of_the_forces_are_those_of_the_amplitudes(monkeypatch, rank, sigma):
    for seed in range(6):
        problem = coupled_problem(seed, rank, sigma=sigma)
        begun = Guess.empty(problem)
        newton(problem, 2, begun)
        for steps, start in ((0, None), (1, None), (2, None), (3, None), (200, None), (200, begun)):
            found = []
            for dense in (0.0, np.inf):
                monkeypatch.setattr(solver, "DENSE", dense)
                guess = Guess.empty(problem) if start is None else Guess(q=start.q.copy(), delta=start.delta.copy())
                force, delta, stiffness, _ = newton(problem, steps, guess)
                # before the end the amplitudes of one belong to its steps, of the other to its forces
                found.append([force, delta, stiffness] + ([guess.q] if steps == 200 else []))
            # the stiffness counts each segment that is about to part
            for one, other, rtol in zip(*found, (1e-10, 1e-12, 1e-9, 1e-10), strict=False):
                assert_allclose(one, other, rtol=rtol, atol=1e-11, err_msg=f"seed {seed}, {steps} steps")
        P, delta, stiffness = solve_one(problem, 1)
        assert_allclose(force[1][problem.active[1]], P, atol=1e-11)


@pytest.mark.parametrize("dense", [0.0, np.inf], ids=["amplitudes", "forces"])
def test_a_rough_solution_is_known_to_the_square_of_its_residual(monkeypatch, dense):
    monkeypatch.setattr(solver, "DENSE", dense)
    for seed in range(6):
        problem = coupled_problem(seed, 13, sigma=False)
        rough, exact = Guess.empty(problem), Guess.empty(problem)
        approach, stiffness = solver.solve_roughly(problem, rough)
        solution = solver.solve(problem, exact)
        assert_allclose(approach, solution.approach, rtol=1e-10)
        assert_allclose(rough.q, exact.q, rtol=0, atol=1e-10)
        assert_allclose(stiffness, solution.stiffness, rtol=1e-5)


@pytest.mark.parametrize("dense", [0.0, np.inf], ids=["amplitudes", "forces"])
def test_a_rough_solution_starts_from_the_forces_of_the_previous_position(monkeypatch, dense):
    monkeypatch.setattr(solver, "DENSE", dense)
    problem = part_of(coupled_problem(1, 13, sigma=True), np.array([2, 0, 0]))
    steps = newton(problem, guess=Guess.empty(problem), tolerance=solver.ROUGH)[3]
    assert steps[2] <= 2 < steps[0]
    # a solution to rounding does not depend on the previous position
    force, *_, steps = newton(problem, guess=Guess.empty(problem))
    assert steps[2] == steps[1]
    assert_array_equal(force[2], force[1])


def test_values_at_points_are_the_products_of_rows_and_values_on_existing_lines():
    rng = np.random.default_rng(5)
    rows, values, active = rng.random((3, 2, 4, 6)), rng.random((3, 2, 6, 5)), rng.random((3, 2)) > 0.4
    expected = np.where(active[..., None, None], rows @ values, 0.0)
    assert_allclose(values_at(rows, values, active), expected, rtol=1e-13)  # rounding of sums of six terms
