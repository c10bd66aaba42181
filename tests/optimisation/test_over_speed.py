"""The force over speed in the search: the numbers of ``robust_response``, torques, runs that resume, faults."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.contact.batch import chunks, solve_one_chunk
from gearbench.dynamics.analysis import response
from gearbench.dynamics.balance import solve
from gearbench.dynamics.loaded_mesh import FlankState
from gearbench.dynamics.model import Model
from gearbench.dynamics.waves import rms
from gearbench.errors import InputError
from gearbench.optimisation.problem import evaluate, scene_of
from gearbench.optimisation.study_file import parse_study
from gearbench.results.cycle import fourier_rows
from gearbench.robustness.montecarlo import prepare_scene
from tests.support.systems import shafts, spur_scene

ENDS = [{"position": p, "radial_stiffness": 200.0, "axial_stiffness": 80.0} for p in (0.0, 200.0)]
SPEEDS = {"lowest": 600.0, "highest": 4200.0, "count": 7, "harmonics": 5}
STATISTICS = ["mesh_force_mean", "mesh_force_std", "mesh_force_max"]


def tables(*, on_shafts=False, samples=16, objectives=STATISTICS, **speeds):
    system = shafts({"bearings": ENDS}) if on_shafts else {"damping_ratio": 0.05}
    base = spur_scene(
        system,
        helix=15.0,
        effects={"hertz": {"law": "yang_sun"}, "manufacturing_errors": {"preset": "garambois2017"}},
        segments=8,
        gauss_points=12,
    ).to_mapping()
    return {
        "objectives": list(objectives),
        "base": base,
        "variables": {"effects": {"tip_relief": {"amount": {"min": 1.0, "max": 9.0}, "length": {"values": [1.0]}}}},
        "robustness": {"samples": samples},
        "speeds": SPEEDS | speeds,
    }


def numbers(study, design=(4.0, 0.0)):
    found = evaluate(study, design)
    assert found.feasible, found.reason
    return dict(zip(study.statistics, found.statistics, strict=True))


def forces_one_by_one(scene, speeds):
    """RMS over speeds of each of 16 samples, on the panels of ``robust``, each by its own harmonic balance."""
    problem, model, found = prepare_scene(scene), Model(scene=scene), []
    draws = next(chunks(problem.expansion.amounts(problem.draw(16, 0, "sobol"))))
    solution = solve_one_chunk(problem.batch, draws, segments=True)
    h = model.receptances(model.groups[0], speeds, np.arange(6))
    flanks = model.loaded_meshes[0].samples(problem.batch, problem.lines, solution)
    rows = np.concatenate([problem.phases.weight[None], fourier_rows(problem.phases, np.arange(1, 11))])
    for i in range(16):
        one = FlankState(force=flanks.force[i], motion=flanks.motion[i], stiffness=flanks.stiffness[i])
        drive = one.excitation(rows)
        found.append(np.sqrt((rms(solve(drive, h, model.stiffness)[1])[:, 0] ** 2).mean()))
    return np.array(found)


@pytest.mark.parametrize("on_shafts", [False, True])
def test_numbers_are_those_of_the_scatter(on_shafts):
    """The contact of the other responses serves, sample by sample."""
    study = parse_study(tables(on_shafts=on_shafts))
    found = numbers(study)
    each = forces_one_by_one(scene_of(study, (4.0, 0.0)), study.speeds.values)
    wanted = [each.mean(), each.std(ddof=1), each.max()]
    # samples are solved together to a residual of 3e-4
    assert_allclose([found[name] for name in STATISTICS], wanted, rtol=1e-3)


def under(*torques, samples=0, over="mean"):
    given = tables(samples=samples, objectives=["mesh_force_mean"])
    del given["base"]["load"]
    given["base"]["loads"] = [{"torque": torque} for torque in torques]
    return parse_study(given | ({} if over == "mean" else {"over_loads": over}))


@pytest.mark.parametrize("samples", [0, 8])
def test_several_torques_count_as_of_any_response(samples):
    """Mean or greatest over the loads; without errors that of one torque is the response's own."""
    one, two, both = (
        numbers(under(*torques, samples=samples))["mesh_force_mean"] for torques in ([150.0], [300.0], [300.0, 150.0])
    )
    worst = numbers(under(150.0, 300.0, samples=samples, over="max"))["mesh_force_mean"]
    assert_allclose(both, (one + two) / 2, rtol=1e-9)
    assert worst >= max(one, two) * (1 - 1e-12)
    if not samples:
        study = parse_study(tables(samples=0, objectives=["mesh_force_mean"]))
        data = response(scene_of(study, (4.0, 0.0)), speed=study.speeds.values, harmonics=5)
        assert_allclose(two, np.sqrt((data["mesh_force_rms"].values ** 2).mean()), rtol=1e-3)


def test_limit_of_the_force():
    """The scene itself, without its errors, as all limits; designs above it are told by how much."""
    given = tables(samples=0, objectives=["transmission_error_rms_mean"]) | {
        "constraints": {"mesh_force": {"max": 1.0}}
    }
    study = parse_study(given)
    found = evaluate(study, (4.0, 0.0))
    force = numbers(parse_study(tables(samples=0, objectives=["mesh_force_mean"])))["mesh_force_mean"]
    assert_allclose(found.constraints[0], force, rtol=1e-12)
    assert_allclose(found.violation, force - 1, rtol=1e-12)
    assert f"mesh_force {force:.4g} above 1" in found.reason


def test_unsteady_designs_are_no_answer():
    given = tables(samples=0, objectives=["mesh_force_mean"], lowest=15000.0, highest=60000.0, count=60)
    given["base"]["system"] = {"damping_ratio": 0.0005}
    given["base"]["pair"]["helix_angle"] = 0.0
    given["base"]["pair"]["centre_distance"] = 97.5
    found = evaluate(parse_study(given), (4.0, 0.0))
    assert not found.feasible
    assert "no steady response at" in found.reason


OTHER = "mesh_stiffness_rms_mean"
FAULTS = {
    r"speeds = missing: mesh_force needs \[speeds\]": lambda t: t.pop("speeds"),
    r"base.system = missing": lambda t: t["base"].pop("system"),
    r"speeds = given: need an objective": lambda t: t.update(objectives=[OTHER]),
    r"speeds.highest = 100: must be at least lowest, 600": lambda t: t["speeds"].update(highest=100.0),
    r"speeds.step = unknown key: allowed: lowest": lambda t: t["speeds"].update(step=1.0),
    r"positions = 16: must be more than 20": lambda t: t["base"].update(resolution={"positions": 16}),
}


@pytest.mark.parametrize("line", FAULTS)
def test_faults_of_a_study_are_one_line(line):
    given = tables()
    FAULTS[line](given)
    with pytest.raises(InputError, match=line):
        parse_study(given)


def test_scene_alone_has_no_force_over_speed():
    from gearbench import simulate

    with pytest.raises(InputError, match=r"mesh_force = no speeds: is for studies with \[speeds\]"):
        simulate(spur_scene({}), outputs=["mesh_force"])
