"""Speed against its targets and against named alternatives, as ratios within one run: ``make bench``."""

import subprocess
import sys
import time
from dataclasses import replace
from statistics import median

import numpy as np
import pytest

from gearbench.contact.assemble import assemble
from gearbench.contact.batch import ROUNDING, SCATTER
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.problem import ContactProblem, full_factor
from gearbench.contact.transitions import mesh_phases
from gearbench.effort.clock import quickest
from gearbench.library.garambois2017 import case, gear
from gearbench.robustness.montecarlo import RobustProblem, prepare_scene, respond
from gearbench.robustness.run import robust
from gearbench.scene import Resolution
from gearbench.simulation import simulate

SAMPLES = 1000


def seconds(work, repeat=7) -> float:
    """Median wall time."""
    times = []
    for _ in range(repeat):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return median(times)


def test_pair_1_with_64_positions(benchmark):
    scene = case(1, Resolution(positions=64))
    simulate(scene)
    benchmark.extra_info["target_s"] = 5e-3
    benchmark(simulate, scene)


def robust_problem(name: str, law: str = "weber_banaschek") -> tuple[RobustProblem, np.ndarray]:
    from gearbench.effects.hertz import Hertz

    scene = gear(name).scene(errors=True, resolution=Resolution(positions=32))
    effects = tuple(Hertz(law=law) if e.name == "hertz" else e for e in scene.effects)
    problem = prepare_scene(replace(scene, effects=effects))
    return problem, problem.draw(SAMPLES, 0, "sobol")


@pytest.mark.parametrize("name", ["SC", "36", "19", "7"])
@pytest.mark.parametrize("threads", [1, 2])
def test_1000_samples_at_32_positions(benchmark, name, threads):
    problem, errors = robust_problem(name)
    respond(problem, errors, threads)
    benchmark.extra_info["target_s"] = 25e-3 if threads == 2 else None
    benchmark(respond, problem, errors, threads)
    solves = SAMPLES * len(problem.weight)
    benchmark.extra_info["million_solves_per_second"] = solves / benchmark.stats.stats.min / 1e6


@pytest.mark.parametrize("name", ["SC", "7"])
def test_a_whole_run_and_samples_to_rounding_against_the_samples_alone(benchmark, name):
    """Processor times; the rest are samples on contact patches, statistics, shares of the variance and the Dataset."""
    scene = gear(name).scene(errors=True, resolution=Resolution(positions=32))
    samples, exact = (prepare_scene(scene, precision) for precision in (SCATTER, ROUNDING))
    errors = samples.draw(SAMPLES, 0, "sobol")
    works = [lambda: robust(scene, threads=1), lambda: respond(samples, errors, 1), lambda: respond(exact, errors, 1)]
    whole, alone, rounded = quickest(works, 7)
    benchmark.extra_info |= {"target_s": 12e-3, "times_the_samples": whole / alone, "to_rounding": rounded / alone}
    print(
        f"\nprocessor time {1e3 * whole:.0f} ms, × {whole / alone:.2f} of the samples, rounding × {rounded / alone:.2f}"
    )
    assert whole < 2.7 * alone
    assert rounded > 1.05 * alone
    benchmark(robust, scene)


def gaps(problem: RobustProblem, errors: np.ndarray) -> tuple[ContactProblem, np.ndarray]:
    """The contact problem at the mean errors and the gap of each sample, (sample, position, segment)."""
    scene = problem.scene
    phase, _ = mesh_phases(scene)
    lines = scene_lines(scene, phase)
    base = assemble(scene, lines)
    modes = problem.errors.modes(lines).reshape(*base.gap.shape, -1) / base.length_scale
    return base, base.gap + np.einsum("pnm,sm->spn", modes, errors - problem.mean)


def active_set(compliance: np.ndarray, gap: np.ndarray) -> np.ndarray:
    """Forces of H P + e = δ on loaded segments, ΣP = 1, by a dense active set."""
    loaded = np.ones(len(gap), dtype=bool)
    while True:
        h, e = compliance[np.ix_(loaded, loaded)], gap[loaded]
        both = np.linalg.solve(h, np.column_stack([np.ones(len(e)), e]))
        delta = (1 + both[:, 1].sum()) / both[:, 0].sum()
        force = np.zeros(len(gap))
        force[loaded] = delta * both[:, 0] - both[:, 1]
        if force.min() >= -1e-12:
            slack = compliance @ force + gap - delta
            if slack[~loaded].min(initial=0.0) >= -1e-10:
                return force
            loaded |= slack < -1e-10
        else:
            loaded &= force > 0


def test_against_a_dense_active_set_and_a_public_qp_solver(benchmark):
    """The linear law, so that all three solve the same quadratic programme; one solve per sample and position."""
    import osqp
    from scipy import sparse

    problem, errors = robust_problem("SC", "yang_sun")
    ours = seconds(lambda: respond(problem, errors, 1)) / (SAMPLES * len(problem.weight))
    base, all_gaps = gaps(problem, errors)
    position = 5
    active = base.active[position]
    psi = full_factor(base, position)
    compliance = psi @ psi.T + np.diag(base.a[position][active])
    some = all_gaps[:20, position][:, active]
    dense = seconds(lambda: [active_set(compliance, gap) for gap in some]) / len(some)

    n = len(compliance)
    solver = osqp.OSQP()
    bounds = np.append(np.zeros(n), 1.0), np.append(np.full(n, np.inf), 1.0)
    rows = sparse.vstack([sparse.eye(n), np.ones((1, n))], format="csc")
    solver.setup(
        sparse.csc_matrix(np.triu(compliance)), some[0], rows, *bounds,
        verbose=False, eps_abs=1e-9, eps_rel=1e-9, max_iter=20000, polishing=True,
    )  # fmt: skip

    def public() -> None:
        for gap in some:
            solver.update(q=gap)
            solver.solve(raise_error=True)

    qp = seconds(public, 3) / len(some)
    benchmark.extra_info |= {
        "us_per_solve": {"gearbench, one thread": 1e6 * ours, "dense active set": 1e6 * dense, "OSQP": 1e6 * qp},
        "times_faster_than_dense_active_set": dense / ours,
        "times_faster_than_osqp": qp / ours,
    }
    print(f"\nper solve: {1e6 * ours:.2f} µs; dense active set × {dense / ours:.0f}, OSQP × {qp / ours:.0f}")
    benchmark(respond, problem, errors, 1)


def python(*arguments: str, **environment: str) -> float:
    """Wall time of a fresh interpreter."""
    import os

    start = time.perf_counter()
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True, env={**os.environ, **environment})
    return time.perf_counter() - start


def test_import_of_the_package(benchmark):
    bare = min(python("-c", "pass") for _ in range(5))
    benchmark.extra_info["target_s"] = 0.3
    benchmark.pedantic(python, args=("-c", "import gearbench"), rounds=5)
    benchmark.extra_info["import_alone_s"] = benchmark.stats.stats.min - bare


@pytest.mark.parametrize("kind", ["cold", "warm"])
def test_simulate_from_the_command_line(benchmark, kind, tmp_path):
    scene = tmp_path / "case1.toml"
    scene.write_text(case(1).to_toml(), encoding="utf-8")
    command = ("-m", "gearbench", "simulate", str(scene), "-o", str(tmp_path / "out.nc"))
    benchmark.extra_info["target_s"] = 6.0 if kind == "cold" else 2.0
    fresh = iter(range(100))
    if kind == "warm":
        python(*command, NUMBA_CACHE_DIR=str(tmp_path / "warm"))

    def run() -> float:
        folder = tmp_path / (kind if kind == "warm" else f"cold{next(fresh)}")
        return python(*command, NUMBA_CACHE_DIR=str(folder))

    benchmark.pedantic(run, rounds=3)
