"""Refined fronts: problems whose optimum is known, and a small study from end to end."""

from dataclasses import replace

import numpy as np
import pytest

from gearbench import optimise, read_study
from gearbench.errors import InputError
from gearbench.optimisation import refinement
from gearbench.optimisation.designs import Designs
from gearbench.optimisation.problem import Evaluation, evaluate
from gearbench.optimisation.refinement import continuous, polish, refine_design
from gearbench.optimisation.study import Algorithm, Objective, OptimisationStudy, Robustness
from gearbench.optimisation.variables import Variable
from tests.support.paths import STUDY

NAMES = ("mesh_stiffness_rms_mean", "transmission_error_rms_mean")
SMALL = read_study(STUDY)


def plane() -> OptimisationStudy:
    """x and y real, n whole."""
    return OptimisationStudy(
        base={},
        variables=(
            Variable(name="x", paths=("a",), min=-1.0, max=3.0),
            Variable(name="y", paths=("b",), min=0.0, max=1.0),
            Variable(name="n", paths=("c",), min=0, max=3),
        ),
        objectives=tuple(Objective(weights={n: 1.0}) for n in NAMES),
        robustness=Robustness(samples=0),
    )


@pytest.fixture
def schaffer(monkeypatch):
    """f = (x² + r, (x − 2)² + r) with r = (y − 0.3)² + n; x + y ≤ 1.2 is a limit."""

    def answer(study, design):
        x, y, n = design
        r, over = (y - 0.3) ** 2 + n, max(0.0, x + y - 1.2)
        nothing = (np.nan,) * 6
        if over:
            return Evaluation(violation=over, reason="no", constraints=(), statistics=nothing)
        f = (x**2 + r, (x - 2) ** 2 + r)
        return Evaluation(violation=0.0, reason="", constraints=(), statistics=(f[0], 0.0, 0.0, f[1], 0.0, 0.0))

    monkeypatch.setattr(refinement, "evaluate", answer)


@pytest.mark.parametrize("start", [(0.6, 0.0, 1), (0.0, 0.9, 0), (0.5, 0.7, 2)])
def test_the_optimum_of_a_known_problem_is_found(schaffer, start):
    """The design that is found is on the front but for n, which is whole, and dominates the one it began with."""
    study = plane()
    design, after, before = refine_design(study, start, extent=np.array([4.0, 4.0]), evaluations=80)
    assert design[2] == start[2]
    assert design[1] == pytest.approx(0.3, abs=0.01)
    assert -1e-3 <= design[0] <= 0.9 + 1e-9
    assert np.all(np.array(after.objectives(study)) <= np.array(before.objectives(study)))
    assert after.feasible


def test_a_design_of_the_front_stays(schaffer):
    study = plane()
    design, after, before = refine_design(study, (0.5, 0.3, 0), extent=np.array([4.0, 4.0]), evaluations=60)
    np.testing.assert_allclose(design, (0.5, 0.3, 0), atol=1e-3)
    np.testing.assert_allclose(after.objectives(study), before.objectives(study), atol=1e-6)


def test_decimals_become_real_and_whole_numbers_do_not():
    study = continuous(replace(SMALL, robustness=replace(SMALL.robustness, racing=True)))
    kinds = {v.name: v.kind for v in study.variables}
    assert kinds.pop("teeth") == "ordered"
    assert set(kinds.values()) == {"real"}
    assert not study.robustness.racing
    with pytest.raises(InputError, match="nothing to refine"):
        continuous(replace(SMALL, variables=SMALL.variables[:1]))


@pytest.mark.slow
def test_a_front_is_refined_and_opened_again(run, tmp_path):
    study = replace(SMALL, algorithm=Algorithm(population=8, generations=3, seed=2), robustness=Robustness(samples=8))
    front = optimise(study, directory=tmp_path / "front")
    refined = polish(Designs(front), evaluations=12, threads=2)
    F, G = refined["objective_before"].values, refined["objective"].values
    on_front = np.flatnonzero(front["on_front"].values)
    np.testing.assert_array_equal(F, front["objective"].values[on_front])
    assert np.all(G <= F * (1 + 1e-9))
    assert np.any(G < F)
    assert refined.attrs["hypervolume_after"] > refined.attrs["hypervolume_before"]
    assert refined.attrs["hypervolume_before"] == pytest.approx(float(front["hypervolume"][-1]), rel=1e-12)
    designs = Designs(refined)
    again = evaluate(designs.study, designs.design(0))
    assert again.objectives(designs.study) == tuple(G[0])
    code, out, err = run("polish", tmp_path / "front", "-o", tmp_path / "polished.nc", "--evaluations", "12")
    assert code == 0, err
    assert "designs improved, hypervolume" in out
    assert run("select", tmp_path / "polished.nc")[0] == 0
