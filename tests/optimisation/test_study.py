"""Study files: what they say, and every fault as one line that names key, value and what is allowed."""

import tomllib

import pytest

from gearbench.errors import InputError
from gearbench.optimisation.problem import assignments, scene_of
from gearbench.optimisation.study import Limit, Objective
from gearbench.optimisation.study_file import parse_study, read_study
from gearbench.optimisation.variables import Variable
from tests.support.paths import ROOT

EXAMPLES = sorted((ROOT / "examples").glob("optimise_*.toml"))
SMALL = (ROOT / "examples" / "optimise_small.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_examples_are_studies_and_survive_the_way_through_a_file(path):
    study = read_study(path)
    again = parse_study(tomllib.loads(study.to_toml()))
    assert again == study
    assert again.digest == study.digest


@pytest.mark.parametrize(
    ("table", "grid", "kind"),
    [
        ({"min": 15, "max": 18}, (15, 16, 17, 18), "ordered"),
        ({"min": 15, "max": 21, "step": 3}, (15, 18, 21), "ordered"),
        ({"min": 0.0, "max": 0.5, "step": 0.1}, (0.0, 0.1, 0.2, 0.3, 0.4, 0.5), "ordered"),
        ({"min": 0.0, "max": 0.25, "step": 0.1}, (0.0, 0.1, 0.2), "ordered"),
        ({"min": 0.0, "max": 5.0}, None, "real"),
        ({"values": (1.0, 1.5, 2.0)}, (1.0, 1.5, 2.0), "ordered"),
        ({"values": ("linear", "parabolic")}, ("linear", "parabolic"), "choice"),
    ],
)
def test_values_of_a_variable(table, grid, kind):
    variable = Variable(name="v", paths=("pair.helix_angle",), **table)
    assert variable.grid == grid
    assert variable.kind == kind
    if grid is not None:
        low, high = variable.bounds
        assert tuple(variable.value(code) for code in range(low, high + 1)) == grid
        assert all(type(v) is type(grid[0]) for v in variable.grid)


def test_one_variable_drives_both_gears():
    study = parse_study(tomllib.loads(SMALL))
    scene = scene_of(study, (2, 5, 4, 0, 0, 0))
    assert scene.pair.pinion.teeth == scene.pair.wheel.teeth == 17
    assert scene.pair.pinion.addendum == scene.pair.wheel.addendum
    assert scene.pair.helix_angle == 20.0


@pytest.mark.parametrize("codes", [(0, 3, 2), (0, 0, 4), (0, 5, 0)])
def test_an_amount_or_a_length_of_zero_is_no_effect(codes):
    study = parse_study(tomllib.loads(SMALL))
    crowning, amount, length = codes
    scene = scene_of(study, (2, 5, 4, crowning, amount, length))
    assert scene.effect("crowning") is None
    assert (scene.effect("tip_relief") is not None) == (amount > 0 and length > 0)


def test_designs_that_are_the_same_gear_are_known_as_such():
    study = parse_study(tomllib.loads(SMALL))
    same = {assignments(study, (2, 5, 4, 1, amount, 0)) for amount in range(6)}
    assert same == {assignments(study, (2, 5, 4, 1, 0, length)) for length in range(6)}
    assert len(same) == 1
    assert len({assignments(study, (2, 5, 4, 1, amount, 1)) for amount in range(6)}) == 6


def test_derived_variables_mean_what_they_say():
    study = parse_study(tomllib.loads(SMALL))
    # spur: at the low end of the addendum ε_α = 1, which is less than the solver of scenes accepts by rounding alone
    low = scene_of(study, (2, 0, 4, 0, 0, 0)).pair
    assert low.meshing.transverse_contact_ratio == pytest.approx(1.0, abs=1e-10)  # tolerance of the root search
    assert scene_of(study, (2, 10, 4, 0, 0, 0)).pair.pinion.addendum == 1.0
    scene = scene_of(study, (2, 5, 4, 0, 3, 3))
    relief = scene.effect("tip_relief")
    assert relief.length == pytest.approx(0.3 * scene.pair.gears[0].tooth_height, rel=1e-12)


def test_table_2_lies_on_the_grid_of_the_addendum():
    # gears whose addendum is the one with ε_α = 1 (44 and 36 of Table 2): printed to three decimals
    from gearbench.library.garambois2017 import gear
    from gearbench.optimisation.derived import unit_contact_addendum

    for name in ("36", "44"):
        row = gear(name)
        assert unit_contact_addendum(row.scene().pair) == pytest.approx(row.addendum, abs=5e-4)


def test_objectives_are_weighted_sums():
    known = {"mesh_stiffness_rms_mean": 10.0, "mesh_stiffness_rms_std": 1.5}
    assert Objective(weights={"mesh_stiffness_rms_mean": 1.0, "mesh_stiffness_rms_std": 2.0}).value(known) == 13.0


def test_limits_are_relative_and_finite():
    assert Limit(max=400.0).violation(500.0) == 0.25
    assert Limit(min=1.1).violation(0.55) == pytest.approx(0.5, rel=1e-15)
    assert Limit(min=1.0, max=2.0).violation(1.5) == 0.0
    assert Limit(max=2.5).violation(float("inf")) == 1000.0
    assert Limit(max=0.0).violation(0.5) == 0.5


FAULTS = {
    'objectives = ["noise"]': ("objectives.noise", "transmission_error_rms_mean, "),
    'objectives = ["mesh_stiffness_rms_mean", "mesh_stiffness_rms_mean"]': ("objectives", "given twice"),
    "objectives = [{ mesh_stiffness_rms_mean = -1.0 }]": ("objectives.mesh_stiffness_rms_mean", "greater than 0"),
    "[constraints]\nsliding.max = 2.0": ("constraints.sliding", "specific_sliding"),
    "[constraints]\nspecific_sliding.most = 2.0": ("constraints.specific_sliding.most", "allowed: min, max"),
    "[variables.teeth]\npaths = []\nmin = 15\nmax = 19": ("variables.teeth.paths", "at least one key"),
    '[variables.teeth]\npaths = ["pair.pinion.tooth"]\nmin = 15\nmax = 19': ("pair.pinion.tooth", "teeth, addendum"),
    '[variables.teeth]\npaths = ["pair.pinion.teeth"]\nmin = 15.0\nmax = 19.0': ("variables.teeth", "whole number"),
    '[variables.teeth]\npaths = ["pair.pinion.teeth"]\nmin = 19\nmax = 15': ("variables.teeth.max", "below min"),
    '[variables.teeth]\npaths = ["pair.pinion.teeth"]\nmin = 15': ("variables.teeth.max", "is required"),
    '[variables.teeth]\npaths = ["pair.pinion.teeth"]\nmin = 1\nmax = 2\nstep = 0': (
        "variables.teeth.step",
        "positive",
    ),
    '[variables]\n"pair.helix_angle" = 5.0': ("variables.pair.helix_angle", "must be a table"),
    "[algorithm]\npopulation = 2": ("algorithm.population", "at least 4"),
    "[robustness]\nsampler = 'halton'": ("robustness.sampler", "'sobol', 'random' or 'latin_hypercube'"),
    "[base.resolution]\npositions = 4": ("base.resolution.gauss_points", "conflicts with positions"),
    "[base.load]\nunit = 3\n[base.pear]\nx = 1": (
        "base.pear = unknown key",
        "did you mean pair? allowed: name, pair, load",
    ),
}


@pytest.mark.parametrize("change", FAULTS, ids=range(len(FAULTS)))
def test_every_fault_is_one_line_with_key_and_what_is_allowed(change, tmp_path):
    """Put the faulty table in place of the good one."""
    key, allowed = FAULTS[change]
    path = tmp_path / "study.toml"
    path.write_text(faulty(change), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_study(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert key in message
    assert allowed in message
    assert "\n" not in message


def faulty(change: str) -> str:
    """The small study with the tables of ``change`` in place of its own."""
    import tomli_w

    tables = tomllib.loads(SMALL)
    for key, value in tomllib.loads(change).items():
        if isinstance(value, dict) and isinstance(tables.get(key), dict):
            for name, part in value.items():
                below = tables[key].get(name)
                tables[key][name] = {**below, **part} if key == "base" and isinstance(below, dict) else part
        else:
            tables[key] = value
    if "teeth" in change and key == "variables":
        tables["base"]["pair"].pop("wheel", None)
    if '"pair.helix_angle"' in change:
        tables["variables"].pop("pair")
    return tomli_w.dumps(tables)


def test_sizes_that_contradict_each_other_are_found_unless_a_variable_may_mend_them():
    tables = tomllib.loads(SMALL)
    tables["base"]["resolution"] = {"accuracy": 0.01, "segments": 15}
    with pytest.raises(InputError, match=r"base\.resolution\.segments = 15: conflicts with accuracy"):
        parse_study(tables)
    tables["base"]["resolution"] = {"accuracy": 0.01, "gauss_points": 4}
    tables["variables"]["resolution"] = {"segments": {"min": 15, "max": 20}}
    parse_study(tables)


def test_what_is_missing_may_be_a_variable():
    tables = tomllib.loads(SMALL)
    del tables["base"]["pair"]["face_width"]
    with pytest.raises(InputError, match=r"base\.pair\.face_width = missing: is required, here or as a variable"):
        parse_study(tables)
    tables["variables"]["width"] = {"paths": ["pair.face_width"], "min": 8.0, "max": 9.0}
    parse_study(tables)


def test_two_variables_must_not_change_the_same_key():
    tables = tomllib.loads(SMALL)
    tables["variables"]["other"] = {"paths": ["pair.pinion.addendum"], "min": 0.5, "max": 1.0}
    with pytest.raises(InputError, match=r"pair\.pinion\.addendum: is also changed by variables\.addendum"):
        parse_study(tables)


def test_a_variable_must_not_be_called_as_a_result():
    tables = tomllib.loads(SMALL)
    tables["variables"]["feasible"] = tables["variables"].pop("teeth")
    with pytest.raises(InputError, match=r"variables\.feasible = reserved name"):
        parse_study(tables)


def test_samples_need_errors_and_scatter_needs_samples():
    tables = tomllib.loads(SMALL)
    del tables["base"]["effects"]["manufacturing_errors"]
    with pytest.raises(InputError, match=r"robustness\.samples = 64: samples need"):
        parse_study(tables)
    tables["robustness"]["samples"] = 0
    parse_study(tables)
    tables["objectives"] = ["transmission_error_rms_max"]
    with pytest.raises(InputError, match=r"transmission_error_rms_max: needs robustness\.samples"):
        parse_study(tables)
