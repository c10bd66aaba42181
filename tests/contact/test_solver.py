"""The structured Newton solver against its readable version, a dense active set and mpmath."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import mpmath
import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from gearbench.contact import dense as dense_fallback
from gearbench.contact.law import compression, inverse
from gearbench.contact.problem import ContactProblem, full_factor
from gearbench.contact.solver import ConvergenceError, complementarity_residual, solve
from tests.support.compiled import callable_part
from tests.support.contact_twin import solve_one

EXAMPLES = 240
RESIDUAL = 1e-10  # what every solution of the contact problem must hold


def random_problem(seed: int, *, linear: bool, segments: int | None = None, rank: int | None = None) -> ContactProblem:
    """Random problem of one position: 1–4 pairs, 1–120 segments, rank 0–12, coupled or not, gaps up to 1000."""
    rng = np.random.default_rng(seed)
    pairs = int(rng.integers(1, 5))
    each = segments or int(rng.integers(1, max(2, 120 // pairs + 1)))
    rank = int(rng.integers(0, 13)) if rank is None else rank
    coupled = bool(rng.integers(0, 2))
    n = pairs * each
    block = np.zeros(n, dtype=np.int64) if coupled else np.repeat(np.arange(pairs), each)
    active = np.repeat(rng.random(pairs) < 0.8, each)
    active[:each] = True
    length = np.repeat(rng.uniform(0.05, 1.0, pairs), each) / each  # share of the face width
    stiffness = rng.uniform(0.5, 2.0, n)
    h = np.zeros(n) if linear else 0.1 * stiffness / length
    # a law g = q c (L₀ − ln q), q = P/ℓ
    a = stiffness / length if linear else h * (rng.uniform(3.0, 9.0, n) + np.log(length))
    gap = rng.random(n) * 10.0 ** rng.uniform(-3, 3) if rng.random() < 0.9 else np.zeros(n)
    if rng.random() < 0.3:  # a tooth that leads or lags
        gap = gap + np.repeat(rng.uniform(-5, 5, pairs), each)
    return ContactProblem(
        gap=gap[None],
        a=a[None],
        h=h[None],
        sigma=np.zeros_like(h[None]),
        active=active[None],
        factor=rng.normal(size=(1, n, rank)) * 10.0 ** rng.uniform(-1, 0.5) / np.sqrt(max(rank, 1)),
        block=block,
        blocks=1 if coupled else pairs,
        force=1.0,
        length_scale=1.0,
        shape=(1, pairs, each),
    )


def active_set(H: NDArray, e: NDArray) -> tuple[NDArray, float]:
    """Exact P and δ with HP + e ≥ δ, P ≥ 0, ΣP = 1 and complementarity, by Lawson & Hanson's active set."""
    n = e.size
    P, loaded = np.zeros(n), np.zeros(n, dtype=bool)
    first = int(np.argmin(e))
    P[first], loaded[first] = 1.0, True
    for _ in range(20 * n + 20):
        while True:
            A = np.flatnonzero(loaded)
            inverse = np.linalg.solve(H[np.ix_(A, A)], np.column_stack([np.ones(A.size), e[A]]))
            delta = (1 + inverse[:, 1].sum()) / inverse[:, 0].sum()
            trial = delta * inverse[:, 0] - inverse[:, 1]
            if np.all(trial > 0):
                break
            falling = trial <= 0
            step = np.min(P[A][falling] / (P[A][falling] - trial[falling]))
            P[A] += step * (trial - P[A])
            loaded[A[falling & (P[A] <= 1e-14)]] = False
            P[~loaded] = 0.0
        P[A] = trial
        gap = np.where(loaded, np.inf, H @ P + e - delta)
        worst = int(np.argmin(gap))
        if gap[worst] >= -1e-13 * (1 + np.abs(e).max()):
            return P, delta
        loaded[worst] = True
    raise AssertionError("the active set cycles")


def dense(problem: ContactProblem) -> tuple[NDArray, NDArray]:
    """H, with the linear law added to its diagonal, and e of the existing segments."""
    active = problem.active[0]
    psi = full_factor(problem, 0)
    return psi @ psi.T + np.diag(problem.a[0, active]), problem.gap[0, active]


def residuals(problem: ContactProblem) -> tuple[float, float, float]:
    """|ΣP − F|/F, −min P and complementarity, from the equations of the contact problem, independent of the solver."""
    solution = solve(problem)
    active = problem.active[0]
    P, delta = solution.force.ravel()[active], float(solution.approach[0])
    a, h, e = problem.a[0, active], problem.h[0, active], problem.gap[0, active]
    psi = full_factor(problem, 0)
    gap = psi @ (psi.T @ P) + compression(P, a, h) + e - delta
    assert np.all(solution.force.ravel()[~active] == 0)
    return abs(P.sum() - 1), -P.min(), float(np.max(np.abs(np.minimum(P, gap))))


@cache
def solved(seed: int, linear: bool):
    problem = random_problem(seed, linear=linear)
    return problem, solve(problem)


@pytest.mark.parametrize("linear", [True, False], ids=["yang_sun", "weber_banaschek"])
def test_every_random_problem_is_solved_to_its_residuals(linear):
    for seed in range(EXAMPLES):
        balance, negative, complementarity = residuals(random_problem(seed, linear=linear))
        assert balance <= RESIDUAL
        assert negative <= 0
        assert complementarity <= RESIDUAL, seed


def test_solution_carries_the_residuals_it_has():
    for seed in range(20):
        problem, solution = solved(seed, False)
        balance, negative, complementarity = residuals(problem)
        assert solution.equilibrium[0] == pytest.approx(balance, abs=1e-15)
        assert solution.least_force[0] == solution.force.min() <= -negative
        assert solution.complementarity[0] == pytest.approx(complementarity, abs=1e-12)  # rounding of gaps of 1000


def test_a_wrong_answer_has_a_large_residual():
    problem, solution = solved(3, True)
    wrong = solution.force.reshape(1, -1).copy()
    wrong[0, np.argmax(wrong)] *= 1.01
    assert complementarity_residual(problem, wrong, solution.approach)[0] > 1e-3


@pytest.mark.parametrize("linear", [True, False])
def test_a_position_where_no_teeth_meet_is_refused(linear):
    problem = random_problem(3, linear=linear)
    active = problem.active.copy()
    active[-1] = False
    with pytest.raises(ConvergenceError, match="no teeth are in mesh"):
        solve(replace(problem, active=active))


def test_agrees_with_a_dense_active_set():
    for seed in range(0, EXAMPLES, 3):
        problem, solution = solved(seed, True)
        H, e = dense(problem)
        P, delta = active_set(H, e)
        # condition of H is below 1e4 and gaps below 1e3: 1e-16 · 1e3 · 1e4 and a margin
        assert_allclose(solution.force.ravel()[problem.active[0]], P, atol=1e-9, err_msg=f"seed {seed}")
        assert_allclose(solution.approach[0], delta, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("method", [dense_fallback.active_set, dense_fallback.one_at_a_time])
def test_dense_fallback_agrees_with_the_structured_solver(method):
    """Both stages agree: the whole contact set at once, and one segment at a time."""
    for seed in range(0, EXAMPLES, 4):
        problem, solution = solved(seed, True)
        P, delta, stiffness, _ = method(*dense(problem))
        assert_allclose(P, solution.force.ravel()[problem.active[0]], atol=1e-9, err_msg=f"seed {seed}")
        assert_allclose(delta, solution.approach[0], rtol=1e-11, atol=1e-11)
        assert_allclose(stiffness, solution.stiffness[0], rtol=1e-8)


@pytest.mark.parametrize("nugget", [1e-2, 1e-5, 1e-9])
@pytest.mark.parametrize("reach", [0.02, 0.1, 0.4])
def test_smooth_compliances_without_a_law_are_solved(reach, nugget):
    """Long-range surface deflection: eigenvalues over up to ten decades, pressure peaks at edges, open gaps."""
    x = np.linspace(0, 1, 25)
    H = np.exp(-(np.subtract.outer(x, x) ** 2) / reach**2) + nugget * np.eye(25)
    value, vector = np.linalg.eigh(H)
    problem = ContactProblem(
        gap=(0.7 * x)[None],
        a=np.zeros((1, 25)),
        h=np.zeros((1, 25)),
        sigma=np.zeros((1, 25)),
        active=np.ones((1, 25), dtype=bool),
        factor=(vector * np.sqrt(np.maximum(value, 0)))[None],
        block=np.zeros(25, dtype=np.int64),
        blocks=1,
        force=1.0,
        length_scale=1.0,
        shape=(1, 1, 25),
    )
    for value in residuals(problem):
        assert value <= RESIDUAL
    assert 0 < np.count_nonzero(solve(problem).force) < 25


@pytest.mark.parametrize("linear", [True, False], ids=["yang_sun", "weber_banaschek"])
@pytest.mark.parametrize("rank", [0, 1, 6, 12])
def test_compiled_solver_equals_its_twin(linear, rank):
    for seed in range(1000, 1025):
        problem = random_problem(seed, linear=linear, rank=rank)
        solution = solve(problem)
        P, delta, stiffness = solve_one(problem, 0)
        # both stop at rounding of gaps up to 1e3, amplified by the stiffness of the segments
        assert_allclose(solution.force.ravel()[problem.active[0]], P, atol=2e-11, err_msg=f"seed {seed}")
        assert_allclose(solution.approach[0], delta, rtol=1e-12, atol=1e-12)
        assert_allclose(solution.stiffness[0], stiffness, rtol=1e-8)


def test_positions_are_independent_of_each_other():
    parts = [random_problem(seed, linear=False, segments=7, rank=3) for seed in range(40)]
    parts = [p for p in parts if p.shape == parts[0].shape and p.blocks == parts[0].blocks]
    assert len(parts) > 3
    joined = {n: np.concatenate([getattr(p, n) for p in parts]) for n in ("gap", "a", "h", "sigma", "active", "factor")}
    together = solve(replace(parts[0], shape=(len(parts), *parts[0].shape[1:]), **joined))
    alone = [solve(p) for p in parts]
    for name in ("force", "approach", "stiffness"):
        assert_allclose(getattr(together, name), np.concatenate([getattr(s, name) for s in alone]), rtol=0, atol=0)


# -- the law ----------------------------------------------------------------------------------------------------------
def laws() -> tuple[NDArray, NDArray, NDArray]:
    """Loads over 60 decades, on both sides of the start of the tangent, with a and h."""
    rng = np.random.default_rng(7)
    h = 10.0 ** rng.uniform(-3, 3, 400)
    a = h * rng.uniform(-5, 30, 400)
    load = np.exp(a / h - 2 + np.concatenate([rng.uniform(-140, 0, 300), rng.uniform(0, 5, 100)]))
    return load, a, h


def compiled_law(s: NDArray, a: NDArray, h: NDArray) -> NDArray:
    from gearbench.contact._law_kernels import law as kernel

    law = callable_part(kernel)
    return np.array([law(*x) for x in zip(s.tolist(), a.tolist(), h.tolist(), strict=True)]).T


def test_law_is_inverted_exactly():
    load, a, h = laws()
    # g(P) itself is accurate to L ulp (a − h ln P cancels up to 30 h against 110 h): 5e-14 at most, 1e-14 here
    assert_allclose(compiled_law(compression(load, a, h), a, h)[0], load, rtol=1e-14)


@pytest.mark.parametrize("linear", [True, False])
def test_law_of_a_cell_is_the_mean_over_it_and_the_derivative_of_its_energy(linear):
    rng = np.random.default_rng(1)
    a, sigma = rng.uniform(1, 9, 200), 10.0 ** rng.uniform(-3, 1, 200)
    h = np.zeros(200) if linear else a / rng.uniform(4, 40, 200)
    s = sigma * rng.uniform(-0.5, 3.5, 200)
    found = inverse(s, a, h, sigma)
    loaded = found[0] > 0
    assert_allclose(compression(found[0], a, h, sigma)[loaded], s[loaded], rtol=1e-13)
    step = 1e-5 * sigma
    up, down = (inverse(s + d, a, h, sigma) for d in (step, -step))
    calm = np.abs(np.abs(s - sigma) - sigma) > 3 * step  # the slope may jump at the ends of the cell
    assert_allclose(((up[2] - down[2]) / (2 * step))[calm], found[0][calm], rtol=1e-6, atol=1e-9)
    assert_allclose(((up[0] - down[0]) / (2 * step))[calm], found[1][calm], rtol=1e-6, atol=1e-9)
    if linear:
        x, w = np.polynomial.legendre.leggauss(2000)
        mean = 0.5 * np.maximum(s[:, None] + sigma[:, None] * (x - 1), 0.0) @ w / a
        assert_allclose(found[0], mean, atol=1e-6 * sigma.max())


def test_law_is_monotone_and_smooth_where_its_tangent_takes_over():
    a, h = np.array([5.0]), np.array([0.7])
    edge = np.exp(a / h - 2)
    s_edge = 2 * h * edge  # g at L = 2
    for side in (1 - 1e-9, 1 + 1e-9):
        P, slope, _ = compiled_law(s_edge * side, a, h)
        assert_allclose(P, edge, rtol=1e-8)
        assert_allclose(slope, 1 / h, rtol=1e-8)
    s = np.geomspace(1e-12 * s_edge, 1e3 * s_edge, 4001).ravel()
    P = compiled_law(s, np.full_like(s, a[0]), np.full_like(s, h[0]))[0]
    assert np.all(np.diff(P) > 0)


def test_slope_and_energy_belong_to_the_force():
    """dE/ds = P and dP/ds = slope, by central differences of the law in 40 digits."""
    load, a, h = (x[::40] for x in laws())
    s = compression(load, a, h)
    P, slope, energy = compiled_law(s, a, h)
    for i in range(s.size):
        with mpmath.workdps(40):
            A, H = mpmath.mpf(a[i]), mpmath.mpf(h[i])
            edge = mpmath.exp(A / H - 2)

            def g(p, A=A, H=H, edge=edge):
                low = min(p, edge)
                return low * (A - H * mpmath.log(low)) + H * (p - low)

            step = mpmath.mpf(load[i]) * mpmath.mpf("1e-10")
            dg = (g(load[i] + step) - g(load[i] - step)) / (2 * step)
            by_parts = load[i] * g(load[i]) - mpmath.quad(g, [0, min(edge, load[i]), load[i]])  # ∫P ds = Ps − ∫g dP
        assert slope[i] == pytest.approx(float(1 / dg), rel=1e-12)
        assert energy[i] == pytest.approx(float(by_parts), rel=1e-8)  # quad with a logarithm at 0
        assert P[i] == pytest.approx(load[i], rel=1e-13)
