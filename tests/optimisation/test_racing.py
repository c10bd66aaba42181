"""Racing: a design stops where the front clearly beats it, and the front is that of all samples."""

from dataclasses import replace

import numpy as np
import pytest

from gearbench import optimise, read_study
from gearbench.optimisation.constraints import ROUGH, constrained, decided
from gearbench.optimisation.designs import Designs
from gearbench.optimisation.front import non_dominated
from gearbench.optimisation.numbers import largest_pressure
from gearbench.optimisation.problem import evaluate
from gearbench.optimisation.racing import FIRST, Incumbents, stages, statistics
from gearbench.optimisation.study import Algorithm, Limit, Objective, OptimisationStudy, Robustness
from gearbench.optimisation.variables import Variable
from gearbench.solution import solve_scene
from tests.support.paths import EXAMPLES

SAMPLES = 1000
K, STE = "mesh_stiffness_rms", "transmission_error_rms"


def synthetic(*objectives: dict[str, float]) -> OptimisationStudy:
    """A study whose responses are made here; its variable is of no account."""
    return OptimisationStudy(
        base={},
        variables=(Variable(name="x", paths=("pair.helix_angle",), min=0.0, max=1.0),),
        objectives=tuple(Objective(weights=weights) for weights in objectives),
        robustness=Robustness(samples=SAMPLES, racing=True),
    )


def responses(rng: np.random.Generator, level: tuple[float, float], own: float = 0.3) -> np.ndarray:
    """Two responses to all samples, (2, sample): a part that all designs share, and one of the design."""
    shared = np.random.default_rng(1).gamma(2.0, 0.5, (2, SAMPLES))
    return np.array(level)[:, None] * (1 + shared) + own * rng.gamma(2.0, 0.5, (2, SAMPLES))


def rivals_of(study: OptimisationStudy, *front: np.ndarray) -> Incumbents | None:
    return Incumbents.of(study, front, [tuple(statistics(values)) for values in front])


MEANS = synthetic({f"{K}_mean": 1.0}, {f"{STE}_mean": 1.0})


# -- the rule, on responses whose truth is known -----------------------------------------------------------------------
def test_stages_grow_to_all_samples():
    assert stages(MEANS) == (128, 256, 512, 1000)
    few = replace(MEANS, robustness=Robustness(samples=FIRST, racing=True))
    assert stages(few) == (FIRST,)
    assert rivals_of(few, np.ones((2, FIRST))) is None
    assert stages(replace(MEANS, robustness=Robustness(samples=SAMPLES))) == (SAMPLES,)


@pytest.mark.parametrize("n", [FIRST, 512])
@pytest.mark.parametrize("statistic", ["mean", "std"])
def test_the_standard_error_is_that_of_the_difference(statistic, n):
    """A score is D̂ over its standard error: by simulation, D̂ scatters about the true difference by one of those."""
    study = synthetic({f"{K}_{statistic}": 1.0})
    compute = {"mean": np.mean, "std": lambda x: np.std(x, ddof=1)}[statistic]
    scores = []
    for seed in range(400):
        rng = np.random.default_rng(seed)
        mine, theirs = responses(rng, (1.0, 1.0)), responses(rng, (1.0, 1.0))
        # random order: the first samples are a random draw of all
        order = rng.permutation(SAMPLES)
        mine, theirs = mine[:, order], theirs[:, order]
        incumbents = rivals_of(study, theirs)
        D, s = incumbents.difference(study.objectives[0], mine[:, :n])
        scores.append((D[0] - (compute(mine[0]) - compute(theirs[0]))) / s[0])
    # of 400 normal numbers the standard deviation is known to 3.5 %; skewed responses add as much
    assert np.std(scores) == pytest.approx(1.0, abs=0.12)
    assert abs(np.mean(scores)) < 0.2


def test_a_design_of_the_front_is_not_stopped():
    """Equal in one objective and worse in the other, as bad as a design of the front can look: 3 in 100 000."""
    stopped = 0
    for seed in range(1000):
        rng = np.random.default_rng(seed)
        incumbent = responses(rng, (1.0, 1.0))
        mine = responses(rng, (1.0, 2.0))
        mine[0] += incumbent[0].mean() - mine[0].mean()
        incumbents = rivals_of(MEANS, incumbent)
        stopped += any(incumbents.beating(mine[:, :n]) is not None for n in stages(MEANS)[:-1])
    assert stopped <= 1


def test_a_design_that_is_clearly_beaten_stops_and_one_that_nearly_is_does_not():
    rng = np.random.default_rng(0)
    front = [responses(rng, (1.0, 3.0)), responses(rng, (2.0, 2.0)), responses(rng, (3.0, 1.0))]
    incumbents = rivals_of(MEANS, *front)
    beaten = responses(rng, (2.2, 2.2))
    by = incumbents.beating(beaten[:, :FIRST])
    assert by == 1
    assert incumbents.beating(responses(rng, (1.4, 2.4))[:, :FIRST]) is None  # between two of the front
    assert incumbents.beating(front[1][:, :FIRST]) is None  # itself
    # far more standard errors than asked for: better in one objective alone does not do
    assert incumbents.beating(responses(rng, (9.0, 0.9))[:, :FIRST]) is None


def test_the_maximum_is_a_bound():
    """A design whose largest value over all samples is below the incumbent's never stops, however few were seen."""
    study = synthetic({f"{K}_max": 1.0})
    for seed in range(200):
        rng = np.random.default_rng(seed)
        incumbent, mine = responses(rng, (1.0, 1.0)), responses(rng, (1.0, 1.0))
        mine[0] *= 0.999 * incumbent[0].max() / mine[0].max()
        assert rivals_of(study, incumbent).beating(mine[:, :FIRST]) is None
    mine[0] *= 1.2 * incumbent[0].max() / mine[0, :FIRST].max()
    assert rivals_of(study, incumbent).beating(mine[:, :FIRST]) == 0


@pytest.mark.parametrize("names", [("mean", "mean"), ("std", "max")])
def test_what_a_stopped_design_is_taken_to_have_is_dominated(names):
    study = synthetic({f"{K}_{names[0]}": 1.0}, {f"{STE}_mean": 0.5, f"{STE}_{names[1]}": 0.5})
    rng = np.random.default_rng(2)
    incumbent, mine = responses(rng, (1.0, 1.0)), 2.0 * responses(rng, (1.0, 1.0))
    incumbents = rivals_of(study, incumbent)
    assert incumbents.beating(mine[:, :FIRST]) == 0
    known, found, truth = (
        dict(zip(study.statistics, s, strict=True))
        for s in (statistics(incumbent), incumbents.estimate(mine[:, :FIRST], 0), statistics(mine))
    )
    for objective in study.objectives:
        assert objective.value(found) > objective.value(known)
    for name in (f"{K}_mean", f"{STE}_mean"):
        n = study.responses.index(name.removesuffix("_mean"))
        D = (mine - incumbent)[n]
        # within four standard errors of the difference, and nearer than the mean of the same few samples in most cases
        assert abs(found[name] - truth[name]) < 4 * D[:FIRST].std() * np.sqrt(1 / FIRST - 1 / SAMPLES)


# -- a study -----------------------------------------------------------------------------------------------------------
STUDY = replace(
    read_study(EXAMPLES / "optimise_small.toml"),
    algorithm=Algorithm(population=12, generations=8, seed=2),
    robustness=Robustness(samples=512, racing=True),
)


@pytest.fixture(scope="module")
def raced():
    return optimise(STUDY, threads=1)


@pytest.mark.slow
def test_the_front_of_a_race_has_all_samples_and_is_that_of_the_whole(raced):
    n, on_front, feasible = (raced[name].values for name in ("evaluated_samples", "on_front", "feasible"))
    assert np.all(n[on_front == 1] == 512)
    assert set(n[feasible == 1]) > {FIRST}
    assert np.all(n[feasible == 0] == 0)
    F = raced["objective"].values[feasible == 1]
    np.testing.assert_array_equal(non_dominated(F), on_front[feasible == 1] == 1)
    # each design evaluated with all samples: none of those that stopped belongs to the front
    whole = replace(STUDY, robustness=Robustness(samples=512))
    designs = [tuple(map(int, code)) for code in raced["code"].values[feasible == 1]]
    G = np.array([evaluate(whole, design).objectives(whole) for design in designs])
    np.testing.assert_array_equal(F[n[feasible == 1] == 512], G[n[feasible == 1] == 512])
    np.testing.assert_array_equal(non_dominated(G), non_dominated(F))
    stopped = n[feasible == 1] < 512
    assert np.abs(F / G - 1)[stopped].max() < 0.05


@pytest.mark.slow
def test_threads_and_interruptions_do_not_change_a_race(raced, tmp_path):
    optimise(STUDY, directory=tmp_path, threads=2)
    for generation in (6, 7, 8):
        (tmp_path / f"generation_{generation:04d}.nc").unlink()
    again = optimise(STUDY, directory=tmp_path, resume=True, threads=3)
    assert again.equals(raced)


def test_the_rough_pressure_of_a_stopped_design_is_near(raced):
    """Far nearer than the margin at which it decides, and the verdicts are those of the exact one."""
    designs, n = Designs(raced), raced["evaluated_samples"].values
    stopped = np.flatnonzero((raced["feasible"].values == 1) & (n < 512))[:8]
    for number in stopped:
        exact = largest_pressure(solve_scene(designs.scene(int(number))))
        assert raced["contact_pressure"].values[number] == pytest.approx(exact, rel=0.3 * ROUGH)
    limits = {"contact_pressure": Limit(max=1000.0)}
    assert [decided({"contact_pressure": p}, limits) for p in (880.0, 950.0, 1050.0, 1120.0)] == [
        True,
        False,
        False,
        True,
    ]


def test_cheap_limits_come_first():
    """A broken limit of the geometry, or of the nominal root stress, spares the solution of the contact."""
    scene = Designs(optimise(replace(STUDY, algorithm=Algorithm(population=12, generations=1)))).scene(0)

    def solved():
        raise AssertionError("solved")

    limits = {"contact_pressure": Limit(max=9.0), "root_stress": Limit(max=1.0), "overlap_ratio": Limit(max=9.0)}
    values = constrained(scene, limits, solved)
    assert values["root_stress"] > 1.0
    assert "contact_pressure" not in values
    with pytest.raises(AssertionError, match="solved"):
        constrained(scene, limits | {"root_stress": Limit(max=1e4)}, solved)
