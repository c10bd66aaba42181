"""Non-dominated sets and hypervolumes against their definitions; the search on problems with a known front."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from gearbench.optimisation.front import hypervolume, non_dominated
from gearbench.optimisation.problem import Evaluation, assignments
from gearbench.optimisation.search import Search
from gearbench.optimisation.study import Algorithm, Objective, OptimisationStudy, Robustness
from gearbench.optimisation.study_file import read_study
from gearbench.optimisation.variables import Variable
from tests.support.paths import STUDY

SMALL = read_study(STUDY)


@pytest.mark.parametrize("objectives", [1, 2, 3])
def test_non_dominated_is_its_definition(objectives):
    rng = np.random.default_rng(objectives)
    F = rng.integers(0, 6, (80, objectives)).astype(float)  # with ties and equal points
    expected = [not any(np.all(f - other >= 0) and np.any(f - other > 0) for other in F) for f in F]
    np.testing.assert_array_equal(non_dominated(F), expected)


def test_hypervolume_of_known_bodies():
    assert hypervolume(np.empty((0, 2))) == 0.0
    assert hypervolume(np.array([[0.25]])) == 0.75
    assert hypervolume(np.array([[0.5, 0.5]])) == 0.25
    # two boxes of 1/2 × 1/4 and 1/4 × 1/2 that share 1/4 × 1/4 (all exact in binary)
    assert hypervolume(np.array([[0.5, 0.75], [0.75, 0.5]])) == 0.125 + 0.125 - 0.0625
    assert hypervolume(np.array([[0.5, 0.5], [0.5, 0.5], [0.75, 0.9], [1.5, 0.1]])) == 0.25
    assert hypervolume(np.array([[0.5, 0.5, 0.5], [0.75, 0.75, 0.0]])) == pytest.approx(
        0.125 + 0.0625 - 0.03125, rel=1e-14
    )


def study(population: int, generations: int, *variables: Variable) -> OptimisationStudy:
    return OptimisationStudy(
        base={},
        variables=variables,
        objectives=tuple(
            Objective(weights={name: 1.0}) for name in ("mesh_stiffness_rms_mean", "transmission_error_rms_mean")
        ),
        algorithm=Algorithm(population=population, generations=generations, seed=3),
        robustness=Robustness(samples=0),
    )


def result(f1: float, f2: float, violation: float = 0.0) -> Evaluation:
    statistics = (f1, 0.0, 0.0, f2, 0.0, 0.0) if violation == 0 else (math.nan,) * 6
    return Evaluation(violation=violation, reason="" if violation == 0 else "no", constraints=(), statistics=statistics)


def run(problem: OptimisationStudy, function) -> tuple[Search, list]:
    search, asked = Search(problem), []
    for _ in range(problem.algorithm.generations):
        designs = search.ask()
        if not designs:
            break
        asked.append(designs)
        search.tell([function(*problem.values(design).values()) for design in designs])
    return search, asked


def test_the_search_finds_the_front_of_a_mixed_problem():
    # Schaffer's f = (x², (x − 2)²), spoiled by whole n and by a choice c: the front is x ∈ [0, 2], n = 7, c = "a"
    x = Variable(name="x", paths=("a",), min=-10.0, max=10.0)
    n = Variable(name="n", paths=("b",), min=0, max=20)
    c = Variable(name="c", paths=("c",), values=("a", "b", "c"))
    problem = study(40, 60, x, n, c)

    def schaffer(x, n, c):
        worse = abs(n - 7) + "abc".index(c)
        return result(x**2 + worse, (x - 2) ** 2 + worse)

    search, _ = run(problem, schaffer)
    values = [problem.values(design) for design in search.population]
    assert {v["n"] for v in values} == {7}
    assert {v["c"] for v in values} == {"a"}
    xs = sorted(v["x"] for v in values)
    # 40 points over [0, 2]: ends and gaps within a few spacings
    assert xs[0] == pytest.approx(0.0, abs=0.1)
    assert xs[-1] == pytest.approx(2.0, abs=0.1)
    assert max(np.diff(xs)) < 0.25


def test_the_search_keeps_to_the_feasible_designs():
    # f = (x, 100 − x) on 0 … 100, feasible above 40 only; the violation shows the way
    problem = study(12, 40, Variable(name="x", paths=("a",), min=0, max=100))
    search, _ = run(problem, lambda x: result(x, 100.0 - x, max(0.0, 40.0 - x)))
    values = [problem.values(design)["x"] for design in search.population]
    assert min(values) == 40
    assert max(values) == 100


def test_the_same_answers_are_followed_by_the_same_questions():
    _, first = run(SMALL, lambda *v: result(float(v[0]), float(v[2])))
    np.random.seed(7)  # noqa: NPY002 — the search must not draw from NumPy's global generator
    _, second = run(SMALL, lambda *v: result(float(v[0]), float(v[2])))
    assert first == second
    assert len(first) == SMALL.algorithm.generations


def test_no_generation_asks_twice_for_the_same_gear():
    _, asked = run(SMALL, lambda *v: result(float(v[0]) + v[3], float(v[2]) + v[4]))
    for designs in asked:
        assert len({assignments(SMALL, design) for design in designs}) == len(designs)


def test_an_exhausted_space_ends_the_search():
    problem = study(50, 30, Variable(name="x", paths=("a",), min=0, max=9))
    search, asked = run(problem, lambda x: result(x, 9.0 - x))
    assert len({design for designs in asked for design in designs}) == 10
    assert len(search.population) == 10
    assert len(asked) < 30


def sphere(x: list[float], count: int) -> list[float]:
    """DTLZ2 (Deb, Thiele, Laumanns & Zitzler 2002): the front is the unit sphere, all x beyond the first are ½."""
    g = sum((v - 0.5) ** 2 for v in x[count - 1 :])
    angles = [v * math.pi / 2 for v in x[: count - 1]]
    found = []
    for i in range(count):
        f = 1 + g
        for angle in angles[: count - 1 - i]:
            f *= math.cos(angle)
        found.append(f * (math.sin(angles[count - 1 - i]) if i else 1.0))
    return found


def test_nsga3_reaches_the_front_of_four_objectives_and_spreads_over_it():
    names = ("mesh_stiffness_rms", "transmission_error_rms")
    objectives = tuple(Objective(weights={f"{n}_{s}": 1.0}) for n in names for s in ("mean", "max"))
    variables = [Variable(name=f"x{i}", paths=(f"a{i}",), min=0.0, max=1.0) for i in range(8)]
    base = replace(study(36, 60, *variables), objectives=objectives, robustness=Robustness(samples=2))

    def answer(*x: float) -> Evaluation:
        f = sphere(list(x), 4)
        return Evaluation(violation=0.0, reason="", constraints=(), statistics=(f[0], 0.0, f[1], f[2], 0.0, f[3]))

    share = {}
    for method in ("nsga2", "nsga3"):
        problem = replace(base, algorithm=replace(base.algorithm, method=method))
        search, _ = run(problem, answer)
        F = np.array([sphere(list(problem.values(d).values()), 4) for d in search.population])
        share[method] = hypervolume(F / 1.2)
    assert np.median(np.linalg.norm(F, axis=1)) < 1.03
    # the 35 directions of fours that add up to 4, where they meet the sphere, are the best that the method aims at
    aims = np.array([d for d in product(range(5), repeat=4) if sum(d) == 4], dtype=float)
    aims /= np.linalg.norm(aims, axis=1)[:, None]
    assert share["nsga3"] > 0.95 * hypervolume(aims / 1.2)
    assert share["nsga3"] > share["nsga2"]


def test_nsga3_needs_objectives_to_weigh():
    with pytest.raises(ValueError, match=r"algorithm\.method = nsga3: needs two objectives or more"):
        replace(SMALL, algorithm=replace(SMALL.algorithm, method="nsga3"), objectives=SMALL.objectives[:1])
