"""One declaration of a response: from there it is an output, a robust answer, an objective, a limit and a column."""

import importlib.metadata
import tomllib

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.effects.registry import EFFECTS
from gearbench.errors import InputError
from gearbench.explore.catalogue import catalogue
from gearbench.explore.stored import of_run, open_results
from gearbench.optimisation.problem import evaluate, scene_of
from gearbench.optimisation.study_file import changed_keys, parse_study
from gearbench.optimisation.variables import Variable
from gearbench.results import responses as module
from gearbench.results.cycle import coefficients
from gearbench.results.netcdf import save
from gearbench.results.outputs import DEFAULT_OUTPUTS
from gearbench.results.quantities import KEYS, QUANTITIES, Quantity
from gearbench.results.responses import Metric, quantity, register, response, responses, split_statistic
from gearbench.robustness.run import robust
from gearbench.scene_file import read_scene
from gearbench.simulation import simulate
from gearbench.solution import solve_scene
from tests.support.paths import EXAMPLES

STUDY = tomllib.loads((EXAMPLES / "optimise_small.toml").read_text(encoding="utf-8")) | {"robustness": {"samples": 16}}
GOOD = (2, 10, 4, 2, 3, 3)
SOFTEST = Metric(
    name="mesh_stiffness_least",
    quantity=Quantity("N/µm", "min k", "least mesh stiffness"),
    reduce=lambda cycle: cycle.mesh_stiffness.min(axis=-1),
)


@pytest.fixture
def softest(monkeypatch):
    monkeypatch.setattr(module, "KNOWN", dict(module.KNOWN))
    register(SOFTEST)


@pytest.fixture(scope="module")
def scene():
    return read_scene(EXAMPLES / "gear55_robust.toml")


@pytest.mark.usefixtures("softest")
def test_a_new_response_is_one_declaration(scene, tmp_path):
    run = simulate(scene, outputs=["mesh_stiffness", "mesh_stiffness_least"])
    assert float(run["mesh_stiffness_least"]) == run["mesh_stiffness"].values.min()
    assert run["mesh_stiffness_least"].attrs == SOFTEST.quantity.attrs
    answers = robust(scene, samples=16, threads=1, responses=["mesh_stiffness_least"])
    assert np.all(answers["mesh_stiffness_least"] < answers["mesh_stiffness_mean"])
    assert float(answers["mesh_stiffness_least_max"]) == float(answers["mesh_stiffness_least"].max())
    column = next(c for c in of_run(answers, "run").columns if c.name == "mesh_stiffness_least_mean")
    assert (column.title, column.values[0]) == ("mean min k [N/µm]", float(answers["mesh_stiffness_least_mean"]))
    save(answers, tmp_path / "run.nc")
    assert "mesh_stiffness_least_std" in [c.name for c in catalogue(open_results([tmp_path / "run.nc"])).columns]


@pytest.mark.usefixtures("softest")
def test_a_new_response_is_an_objective_and_a_limit():
    limits = {"mesh_stiffness_least": {"min": 1.0}}
    study = parse_study(STUDY | {"objectives": ["mesh_stiffness_rms_mean", "mesh_stiffness_least_std"]})
    found = evaluate(study, GOOD)
    assert study.statistics[-3:] == tuple(f"mesh_stiffness_least_{s}" for s in ("mean", "std", "max"))
    expected = robust(scene_of(study, GOOD), samples=16, threads=1, responses=["mesh_stiffness_least"])
    assert found.objectives(study)[1] == float(expected["mesh_stiffness_least_std"])
    limited = parse_study(STUDY | {"constraints": limits})
    least = float(simulate(scene_of(limited, GOOD), outputs=["mesh_stiffness_least"])["mesh_stiffness_least"])
    assert evaluate(limited, GOOD).constraints == (least,)
    limits["mesh_stiffness_least"]["min"] = 2 * least
    broken = evaluate(parse_study(STUDY | {"constraints": limits}), GOOD)
    assert broken.violation == pytest.approx(0.5, rel=1e-12)


def test_responses_of_other_packages_come_by_entry_point(monkeypatch):
    monkeypatch.setattr(module, "KNOWN", dict(module.KNOWN))
    entry = importlib.metadata.EntryPoint(name="soft", value=f"{__name__}:SOFTEST", group=module.GROUP)
    monkeypatch.setattr(module, "entry_points", lambda group: [entry] if group == module.GROUP else [])
    module.installed.cache_clear()
    try:
        assert split_statistic("mesh_stiffness_least_max") == ("mesh_stiffness_least", "max")
        assert responses()["mesh_stiffness_least"] is SOFTEST
    finally:
        module.installed.cache_clear()


def test_faults_of_declarations_and_names_are_named(scene):
    with pytest.raises(InputError, match="lower-case identifier"):
        Metric(name="Peak", quantity=SOFTEST.quantity, reduce=SOFTEST.reduce)
    with pytest.raises(InputError, match="another quantity"):
        Metric(name="load_share", quantity=SOFTEST.quantity, reduce=SOFTEST.reduce)
    with pytest.raises(InputError, match="declared already"):
        register(Metric(name="mesh_stiffness_rms", quantity=SOFTEST.quantity, reduce=SOFTEST.reduce))
    meant = "mesh_stifness_rms: did you mean mesh_stiffness_rms[?] allowed: "
    with pytest.raises(InputError, match=f"outputs = {meant}transmission_error, "):
        simulate(scene, outputs=["mesh_stifness_rms"])
    with pytest.raises(InputError, match=f"responses = {meant}.*mesh_stiffness_rms, "):
        robust(scene, samples=4, responses=["mesh_stifness_rms"])
    for key, given in (("objectives", ["mesh_stiffness_rms_median"]), ("constraints", {"stiffness": {"max": 1.0}})):
        with pytest.raises(InputError, match="mesh_stiffness_rms"):
            parse_study(STUDY | {key: given})


def test_every_simulation_holds_its_harmonics_with_their_phase(scene):
    run = simulate(scene)
    cycle = solve_scene(scene).cycle
    tau = run["mesh_phase"].values
    assert set(DEFAULT_OUTPUTS) <= set(run.data_vars)
    for name in ("transmission_error", "mesh_stiffness"):
        amplitude, phase = run[f"{name}_amplitude"], run[f"{name}_phase"]
        assert (amplitude.dims, phase.units, amplitude.units) == (("harmonic",), "rad", run[name].units)
        c = coefficients(cycle.phases, run[name].values, 100)
        assert_allclose(2 * np.abs(c[:10]), amplitude, rtol=1e-10, atol=1e-12 * np.ptp(run[name].values))
        assert float(response(f"{name}_amplitude_3").reduce(cycle)) == pytest.approx(float(amplitude[2]), rel=1e-10)
        # the sum of the harmonics is the curve; Parseval's theorem
        c[:10] = amplitude / 2 * np.exp(1j * phase)
        mean, weight = float(run[f"{name}_mean"]), run["phase_weight"].values
        series = mean + 2 * np.real(np.exp(2j * np.pi * np.outer(tau, np.arange(1, 101))) @ c)
        assert np.sqrt((series - run[name].values) ** 2 @ weight) < 0.03 * np.ptp(run[name].values)
        assert 2 * np.sum(np.abs(c) ** 2) == pytest.approx((run[name].values - mean) ** 2 @ weight, rel=1e-2)
    assert run.attrs["support"] == "clamped"


@pytest.mark.parametrize("key", KEYS)
def test_every_labelled_key_is_one_of_a_scene(key):
    heads = ("pair", "pair.pinion", "load", "effects")
    effects = [f"{name}.{key}" for name in EFFECTS]
    for path in [f"{head}.{key}" for head in heads] + [f"effects.{path}" for path in effects]:
        try:
            changed_keys(Variable(name="x", paths=(path,), min=1, max=2))
        except InputError:
            continue
        return
    pytest.fail(f"no scene has the key {key}")


def test_names_that_follow_from_others_say_so():
    found = quantity("mesh_stiffness_rms_std_standard_error")
    assert found is not None
    assert found.long_name.startswith("standard error of the standard deviation over the error samples of the RMS")
    assert quantity("transmission_error_mean_error") == Quantity(
        "%", "error of mean δ", "error of the mean static transmission error against the reference"
    )
    assert quantity("transmission_error") == QUANTITIES["transmission_error"]
    assert quantity("something") is None
