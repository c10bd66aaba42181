"""Several loads with weights: every result that knows them is made of those of single loads."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import hunting_cycle, read_scene, response, robust, simulate, sweep
from gearbench.accuracy.measure import COVERED, relative_errors
from gearbench.errors import InputError
from gearbench.explore.model import without_scatter
from gearbench.optimisation.constraints import constrained
from gearbench.optimisation.problem import evaluate, scene_of
from gearbench.optimisation.study import Limit
from gearbench.optimisation.study_file import parse_study
from gearbench.scene_file import parse_scene
from gearbench.sweeps import loads as group_of_loads
from tests.accuracy.test_accuracy import with_resolution
from tests.optimisation.test_problem import GOOD, SMALL
from tests.support.paths import ROOT
from tests.sweeps.test_sweep import example, with_tables

LOADS = [{"torque": 230.0, "weight": 2.0}, {"torque": 90.0}, {"torque": -60.0, "weight": 0.5}]
#: Torques ascending, and their shares.
TORQUES, SHARES = (-60.0, 90.0, 230.0), np.array([0.5, 1.0, 2.0]) / 3.5
RELIEVED = with_tables(example(), tip_relief={"amount": 20.0, "length": 0.6}).to_mapping()
ERRORS = {"manufacturing_errors": {"preset": "garambois2017"}}


def several(loads=LOADS, **more):
    tables = {name: table for name, table in RELIEVED.items() if name != "load"}
    effects = {**tables["effects"], **more.pop("effects", {})}
    return parse_scene({**tables, "loads": loads, "effects": effects, **more})


def test_a_scene_of_several_loads_is_written_and_read_back(tmp_path):
    scene = several()
    path = tmp_path / "several.toml"
    path.write_text(scene.to_toml(), encoding="utf-8")
    assert read_scene(path) == scene
    assert read_scene(path).digest == scene.digest
    assert scene.load.torque == 230.0
    assert [each.load.torque for each in scene.each_load] == list(TORQUES)
    assert tomllib.loads(scene.to_toml())["loads"][1] == {"torque": 90.0}


def test_simulate_is_the_sweep_of_the_torques_with_mean_and_greatest():
    found = simulate(several())
    alone = sweep(parse_scene({**RELIEVED, "load": {"torque": 230.0}}), torque=TORQUES)
    for name in ("transmission_error", "line_load", "transmission_error_rms"):
        assert_allclose(found[name].values, alone[name].values, rtol=1e-12, equal_nan=True)
    assert found["torque"].values.tolist() == list(TORQUES)
    assert_allclose(found["load_weight"], SHARES, rtol=1e-15)
    rms = alone["transmission_error_rms"].values
    assert float(found["transmission_error_rms_load_mean"]) == pytest.approx(rms @ SHARES, rel=1e-12)
    assert float(found["transmission_error_rms_load_max"]) == pytest.approx(rms.max(), rel=1e-12)
    assert found["transmission_error_rms_load_mean"].attrs["units"] == "µm"


def test_the_compliance_of_a_flank_is_made_once(monkeypatch):
    calls, assemble = [], group_of_loads.assemble
    monkeypatch.setattr(group_of_loads, "assemble", lambda *a: calls.append(a[0].load.coast) or assemble(*a))
    simulate(several(resolution={"positions": 24}))
    assert sorted(calls) == [False, True]


def test_robust_is_that_of_each_load_and_reduced_sample_by_sample():
    found = robust(several(effects=ERRORS), samples=32, seed=3)
    rms = []
    for torque in TORQUES:
        tables = {**RELIEVED, "load": {"torque": torque}, "effects": {**RELIEVED["effects"], **ERRORS}}
        single = robust(parse_scene(tables), samples=32, seed=3)
        rms.append(single["transmission_error_rms"].values)
        at = found.sel(torque=torque)
        # samples are good to 1e-5; the last Newton step leaves a few percent of its residual, in the units of each load
        assert_allclose(at["transmission_error_rms"], rms[-1], rtol=1e-8)
        assert float(at["transmission_error_rms_std"]) == pytest.approx(float(single["transmission_error_rms_std"]))
    mean, most = SHARES @ rms, np.max(rms, axis=0)
    assert_allclose(found["transmission_error_rms_load_mean"], mean, rtol=1e-8)
    assert_allclose(found["transmission_error_rms_load_max"], most, rtol=1e-8)
    assert float(found["transmission_error_rms_load_mean_std"]) == pytest.approx(mean.std(ddof=1), rel=1e-9)
    assert float(found["transmission_error_rms_load_max_max"]) == pytest.approx(most.max(), rel=1e-9)


def test_another_key_is_swept_under_all_loads_and_torques_in_their_place():
    key = "effects.tip_relief.amount"
    found = sweep(several(), {key: [10.0, 20.0]})
    assert found["transmission_error_rms"].dims == (key, "torque")
    assert found["transmission_error_rms_load_mean"].dims == (key,)
    own = simulate(several())["transmission_error_rms"]
    assert_allclose(found["transmission_error_rms"].sel({key: 20.0}), own, rtol=1e-11)
    instead = sweep(several(), torque=[50.0, 100.0])
    assert "load_weight" not in instead.coords
    assert "transmission_error_rms_load_mean" not in instead


def study(**more):
    base = {name: table for name, table in SMALL["base"].items() if name != "load"}
    return parse_study(
        {**SMALL, "base": {**base, "loads": [{"torque": 15.0, "weight": 3.0}, {"torque": 40.0}]}, **more}
    )


@pytest.mark.parametrize("over", ["mean", "max"])
@pytest.mark.parametrize("samples", [0, 16])
def test_objectives_are_reduced_over_the_loads(samples, over):
    made = study(over_loads=over, robustness={"samples": samples}, constraints={})
    known = dict(zip(made.statistics, evaluate(made, GOOD).statistics, strict=True))
    found = []
    for torque in (15.0, 40.0):
        one = {**SMALL, "base": {**SMALL["base"], "load": {"torque": torque}}, "constraints": {}}
        one = parse_study({**one, "robustness": {"samples": 16}})
        scene = scene_of(one, GOOD)
        data = robust(scene, samples=16) if samples else sweep(scene, torque=[torque])
        found.append(data["transmission_error_rms"].values.ravel())
    values = np.max(found, axis=0) if over == "max" else np.average(found, axis=0, weights=[3.0, 1.0])
    assert known["transmission_error_rms_mean"] == pytest.approx(values.mean(), rel=1e-9)
    if samples:
        assert known["transmission_error_rms_std"] == pytest.approx(values.std(ddof=1), rel=1e-9)


def test_limits_hold_under_every_load():
    scene = several()
    each = [constrained(one, {"contact_pressure": Limit(max=1.0)})["contact_pressure"] for one in scene.each_load]
    limit, least = Limit(max=sorted(each)[1]), Limit(min=1.0)
    assert constrained(scene, {"contact_pressure": limit})["contact_pressure"] == max(each)
    assert constrained(scene, {"contact_pressure": least})["contact_pressure"] == min(each)


def test_an_accuracy_is_met_under_every_load():
    loads, wanted = [{"torque": 230.0}, {"torque": 60.0}], 0.02
    found = simulate(several(loads, resolution={"accuracy": wanted}), outputs=COVERED)
    fine = simulate(with_resolution(several(loads), segments=80, gauss_points=16), outputs=COVERED)
    values, exact = (np.array([data[name].values for name in COVERED]).T for data in (found, fine))
    assert relative_errors(values, exact).max() <= wanted
    assert found.attrs["accuracy_estimated"] <= wanted
    both = robust(several(loads, resolution={"accuracy": 0.1}, effects=ERRORS))
    assert both.attrs["accuracy_estimated"] <= 0.1
    assert both["transmission_error_rms"].dims == ("torque", "sample")


def test_a_picture_is_of_the_greatest_load():
    assert without_scatter(several())[0].scene.load.torque == 230.0


def test_results_of_one_load_refuse_several():
    for refused in (lambda: hunting_cycle(several()), lambda: response(several(), speed=[1000.0])):
        with pytest.raises(InputError, match=r"^loads = 3 loads: are for simulate, sweep, robust and optimise"):
            refused()


@pytest.mark.parametrize(
    ("tables", "line"),
    [
        ({"loads": []}, r"loads = \[\]: must be one or more tables: \[\[loads\]\]"),
        ({"loads": {"torque": 1.0}}, r"loads = .*: must be one or more tables"),
        ({"loads": [{"torque": 0.0}]}, r"loads\.0\.torque = 0.*: must not be 0"),
        ({"loads": [{"weight": 1.0}]}, r"loads\.0\.torque = missing: is required"),
        ({"loads": [{"torque": 9.0, "weight": 0.0}]}, r"loads\.0\.weight = 0\.0: must be greater than 0"),
        ({"loads": [{"torque": 9.0}, {"torque": 9.0}]}, r"loads = .*: must have different torques"),
        ({"loads": [{"torque": 9.0}], "load": {"torque": 9.0}}, r"loads = given: conflicts with load"),
    ],
)
def test_bad_values_are_one_line(tables, line):
    given = {name: table for name, table in RELIEVED.items() if name != "load"}
    with pytest.raises(InputError, match=rf"^{line}"):
        parse_scene({**given, **tables})


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda t: t["base"].update(loads=[{"torque": 5.0, "weight": -1}]), r"base\.loads\.0\.weight = "),
        (lambda t: t["base"].update(loads=[{"torque": 5.0}]), r"base\.loads = given: conflicts with base\.load"),
        (lambda t: t.update(over_loads="max"), r"over_loads = max: needs base\.loads"),
        (lambda t: t.update(over_loads="sum"), r"over_loads = 'sum': must be 'mean' or 'max'"),
    ],
)
def test_bad_studies_are_one_line(change, line):
    tables = tomllib.loads((ROOT / "examples" / "optimise_small.toml").read_text(encoding="utf-8"))
    change(tables)
    with pytest.raises(InputError, match=line):
        parse_study(tables)


def test_a_study_keeps_its_loads():
    made = study(over_loads="max")
    assert parse_study(tomllib.loads(made.to_toml())) == made
    varied = {**SMALL["variables"], "load.torque": {"min": 5.0, "max": 9.0, "step": 1.0}}
    with pytest.raises(InputError, match=r"load\.torque: conflicts with base\.loads"):
        study(variables=varied)
