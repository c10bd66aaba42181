"""Choosing among the designs of a stored optimisation: conditions, ranking, lists, export."""

from __future__ import annotations

import csv
import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from gearbench.errors import InputError
from gearbench.optimisation.conditions import Condition, parse_condition, parse_range, parse_ranking
from gearbench.optimisation.designs import Designs
from gearbench.optimisation.run import optimise
from gearbench.optimisation.select import Resonance, chosen_scene, csv_text, markdown_text, open_designs, select
from gearbench.optimisation.study import Algorithm, Robustness
from gearbench.optimisation.study_file import parse_study, read_study
from gearbench.results.netcdf import save
from gearbench.robustness.run import robust
from gearbench.scene_file import read_scene
from tests.support.paths import STUDY


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A small finished optimisation; the contact law is one of its variables, so that values may be texts."""
    mapping = read_study(STUDY).to_mapping()
    mapping["variables"]["law"] = {"paths": ["effects.hertz.law"], "values": ["weber_banaschek", "yang_sun"]}
    # some designs without any micro-geometry
    mapping["variables"]["effects.crowning.amount"] = {"values": [0.0, 3.0]}
    mapping["variables"]["effects.tip_relief.amount"] = {"values": [0.0, 4.0]}
    mapping["variables"]["addendum"]["step"] = 0.5
    # few helix angles, so that some designs are spur gears that keep the constraints
    mapping["variables"]["pair.helix_angle"] = {"values": [0.0, 10.0, 20.0]}
    study = replace(
        parse_study(mapping),
        algorithm=Algorithm(population=40, generations=3, seed=2),
        robustness=Robustness(samples=8),
    )
    path = tmp_path_factory.mktemp("select") / "front"
    optimise(study, directory=path, threads=1)
    return path


@pytest.fixture(scope="module")
def designs(folder):
    return open_designs(folder)


def value(designs: Designs, name: str) -> np.ndarray:
    return designs.dataset[name].values


# -- the grammar ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "name", "comparison", "limit"),
    [
        ("helix_angle<=15", "helix_angle", "<=", 15.0),
        (" effects.crowning.amount != 2.5e0 ", "effects.crowning.amount", "!=", 2.5),
        ("x<-3", "x", "<", -3.0),
        ("law == 'yang_sun'", "law", "==", "yang_sun"),
    ],
)
def test_conditions_are_read(text, name, comparison, limit):
    assert parse_condition(text) == Condition(name=name, comparison=comparison, limit=limit)


@pytest.mark.parametrize("text", ["", "x", "x<", "<3", "x=3", "3<x", "x<=nan", "x<inf", "f(x)<3", "x[0]<3", "a b<3"])
def test_what_is_no_condition_is_refused(text):
    with pytest.raises(InputError):
        parse_condition(text)


@settings(max_examples=50)
@given(st.text(max_size=40))
def test_any_text_is_a_condition_or_refused(text):
    for parse in (parse_condition, parse_ranking, lambda t: parse_range("avoid", t)):
        try:
            parse(text)
        except InputError:
            continue


def test_comparisons_forgive_the_rounding_of_decimals_and_nothing_else():
    x = np.array([0.1 + 0.2, 0.3, 0.3001, 0.2999, math.nan])
    expected = {
        "<=": [1, 1, 0, 1, 0], ">=": [1, 1, 1, 0, 0], "<": [0, 0, 0, 1, 0], ">": [0, 0, 1, 0, 0],
        "==": [1, 1, 0, 0, 0], "!=": [0, 0, 1, 1, 0],
    }  # fmt: skip
    for comparison, holds in expected.items():
        condition = Condition(name="x", comparison=comparison, limit=0.3)
        assert_array_equal(condition.holds(x), np.array(holds, dtype=bool), err_msg=comparison)

    just_below = np.array([0.7 + 0.1])
    assert just_below[0] < 0.8
    assert not Condition(name="x", comparison="<", limit=0.8).holds(just_below)[0]
    texts = np.array(["a", "b"], dtype=object)
    assert_array_equal(Condition(name="x", comparison="!=", limit="a").holds(texts), [False, True])


def test_rankings_are_read():
    assert parse_ranking("a + 2*b.c - 0.5 d") == {"a": 1.0, "b.c": 2.0, "d": -0.5}
    assert parse_ranking("-a") == {"a": -1.0}
    for bad in ("", "a b", "a +", "3*", "a + a", "0*a", "a*2", "1e999*a"):
        with pytest.raises(InputError):
            parse_ranking(bad)


def test_bands_are_read():
    assert parse_range("avoid", " 900 : 1.1e3 ") == (900.0, 1100.0)
    for bad in ("900", "3:2", "-1:2", "1:inf", "a:b"):
        with pytest.raises(InputError):
            parse_range("avoid", bad)


# -- selection --------------------------------------------------------------------------------------------------------


def test_what_is_left_is_what_meets_the_conditions(designs):
    found = select(designs, where=[parse_condition("helix_angle<=15"), parse_condition("law==yang_sun")])
    meets = (value(designs, "pair.helix_angle") <= 15) & (value(designs, "law") == "yang_sun")
    feasible = value(designs, "feasible") == 1
    assert set(found.numbers) == set(np.flatnonzero(meets & feasible))
    assert 0 < len(found.numbers) < feasible.sum()
    assert found.steps[0] == ("feasible", feasible.sum())
    assert found.steps[-1] == ("law == yang_sun", len(found.numbers))


def test_what_must_be_computed_is_asked_last(designs):
    found = select(designs, where=[parse_condition("axial_force<=150"), parse_condition("teeth>=17")])
    assert [text for text, _ in found.steps] == ["feasible", "teeth >= 17", "axial_force <= 150"]


def test_default_ranking_weighs_the_objectives_alike(designs):
    found = select(designs)
    front = value(designs, "on_front") == 1
    score = np.zeros(len(front))
    for name in ("mesh_stiffness_rms_mean", "transmission_error_rms_mean"):
        x = value(designs, name)
        score += 0.5 * (x - x[front].min()) / (x[front].max() - x[front].min())
    feasible = np.flatnonzero(value(designs, "feasible"))
    assert_array_equal(found.numbers, feasible[np.argsort(score[feasible], kind="stable")])
    assert_allclose(found.score, score[found.numbers], rtol=1e-12, atol=1e-15)
    assert value(designs, "on_front")[found.numbers[0]] == 1  # nothing dominated can be first


def test_one_term_sorts_by_it_and_counts_from_0_to_1_on_the_front(designs):
    on_front = [parse_condition("on_front==1")]
    up = select(designs, rank={"transmission_error_rms_mean": 3.0}, where=on_front)
    assert np.all(np.diff(value(designs, "transmission_error_rms_mean")[up.numbers]) >= 0)
    assert (up.score[0], up.score[-1]) == pytest.approx((0.0, 1.0))
    down = select(designs, rank={"transmission_error_rms_mean": -1.0}, where=on_front)
    assert_array_equal(down.numbers, up.numbers[::-1])
    assert (down.score[0], down.score[-1]) == pytest.approx((0.0, 1.0))


def test_worst_case_ranks_by_the_maxima(designs):
    found = select(designs, worst_case=True)
    assert dict(found.ranking) == {"mesh_stiffness_rms_max": 1.0, "transmission_error_rms_max": 1.0}
    same = select(designs, rank={"mesh_stiffness_rms_max": 1.0, "transmission_error_rms_max": 1.0})
    assert_array_equal(found.numbers, same.numbers)
    merged = select(designs, rank={"mesh_stiffness_rms_mean": 1.0, "mesh_stiffness_rms_std": 2.0}, worst_case=True)
    assert dict(merged.ranking) == {"mesh_stiffness_rms_max": 3.0}


def test_axial_force_is_the_axial_part_of_the_normal_force(designs):
    numbers = select(designs).numbers[:20]
    force = designs.values("axial_force", numbers)
    for number, found in zip(numbers, force, strict=True):
        scene = designs.scene(int(number))
        assert found == pytest.approx(scene.F_bn * math.sin(scene.pair.meshing.beta_b), rel=1e-12)
    spur = select(designs, where=[parse_condition("helix_angle==0")])
    none = select(designs, where=[parse_condition("axial_force<=0")])
    assert_array_equal(spur.numbers, none.numbers)
    assert len(spur.numbers) > 0


def test_designs_without_micro_geometry_and_with_standard_addendum(designs):
    found = select(designs, where=[parse_condition("modifications==0")]).numbers
    plain = value(designs, "effects.crowning.amount") == 0
    plain &= (value(designs, "effects.tip_relief.amount") == 0) | (
        value(designs, "effects.tip_relief.length_fraction") == 0
    )
    assert set(found) == set(np.flatnonzero(plain & (value(designs, "feasible") == 1)))
    assert len(found) > 0
    standard = select(designs, where=[parse_condition("pinion_addendum==1"), parse_condition("wheel_addendum==1")])
    feasible = value(designs, "feasible") == 1
    assert set(standard.numbers) == set(np.flatnonzero((value(designs, "addendum") == 1) & feasible))
    assert len(standard.numbers) > 0


def test_no_relief_is_listed_with_an_amount_but_no_length(designs):
    amount, fraction = (value(designs, f"effects.tip_relief.{key}") for key in ("amount", "length_fraction"))
    assert_array_equal(amount == 0, fraction == 0)
    assert 0 < np.sum(amount == 0) < len(amount)
    # the search went there, and the codes are kept unchanged
    column = [v.name for v in designs.study.variables].index("effects.tip_relief.amount")
    assert np.any(value(designs, "code")[amount == 0, column] > 0)
    numbers = select(designs).numbers
    has = [designs.scene(int(number)).effect("tip_relief") is not None for number in numbers]
    assert_array_equal(designs.values("effects.tip_relief.amount", numbers) > 0, has)


def test_mesh_frequencies_stay_outside_what_is_avoided(designs):
    teeth = np.array([16, 17, 18])
    # at 1500 1/min 400, 425 and 450 Hz
    avoid = Resonance(frequency=(410.0, 440.0), speed=(1500.0, 1500.0))
    assert_array_equal(avoid.avoided(teeth), [True, False, True])
    # a range of speeds sweeps over the band, though neither of its ends lies in it
    assert not Resonance(frequency=(410.0, 412.0), speed=(1000.0, 2000.0)).avoided(teeth).any()
    # the second order of 400 Hz, but not its first
    assert_array_equal(replace(avoid, frequency=(790.0, 810.0)).avoided(teeth), [True] * 3)
    assert_array_equal(replace(avoid, frequency=(790.0, 810.0), orders=2).avoided(teeth), [False, True, True])
    found = select(designs, avoid=[avoid])
    assert 17 not in value(designs, "teeth")[found.numbers]
    assert len(found.numbers) == np.sum((value(designs, "teeth") != 17) & (value(designs, "feasible") == 1))


def test_names_are_found_by_their_last_parts(designs):
    assert designs.find("where", "helix_angle") == "pair.helix_angle"
    assert designs.find("where", "crowning.amount") == "effects.crowning.amount"
    with pytest.raises(InputError, match=r"effects\.crowning\.amount or effects\.tip_relief\.amount"):
        designs.find("where", "amount")
    with pytest.raises(InputError, match="unknown quantity"):
        designs.find("where", "angle")


@pytest.mark.parametrize("condition", ["law<=3", "law>yang_sun", "teeth==many"])
def test_texts_and_numbers_are_not_compared(designs, condition):
    with pytest.raises(InputError):
        select(designs, where=[parse_condition(condition)])


# -- export -----------------------------------------------------------------------------------------------------------


def test_exported_scene_gives_the_stored_result(run, folder, designs, tmp_path):
    number = int(select(designs).numbers[0])
    target = tmp_path / "chosen.toml"
    code, out, err = run("select", folder, "--export", number, target)
    assert (code, err) == (0, "")
    assert str(target) in out
    scene = read_scene(target)
    assert scene == chosen_scene(designs, number)
    assert scene.name == f"small, design {number}"
    found = robust(scene, samples=8, seed=0)
    for name in ("mesh_stiffness_rms", "transmission_error_rms"):
        # the same samples, the same scene
        assert float(found[f"{name}_mean"]) == pytest.approx(value(designs, f"{name}_mean")[number], rel=1e-12)
    assert run("simulate", target, "-q")[0] == 0


def test_only_feasible_designs_are_exported(designs):
    bad = int(np.flatnonzero(value(designs, "feasible") == 0)[0])
    with pytest.raises(InputError, match="not feasible"):
        chosen_scene(designs, bad)
    for none in (-1, designs.dataset.sizes["design"]):
        with pytest.raises(InputError, match="number of a design"):
            chosen_scene(designs, none)


def test_a_design_that_a_condition_excludes_is_not_exported(run, folder, designs, tmp_path):
    dominated = np.flatnonzero((value(designs, "feasible") == 1) & (value(designs, "on_front") == 0))[0]
    code, out, err = run("select", folder, "--where", "on_front==1", "--export", dominated, tmp_path / "a.toml")
    assert (code, out) == (2, "")
    assert err == f"gearbench: export = {dominated}: is excluded by the condition on_front == 1\n"
    assert not list(tmp_path.iterdir())
    every = Resonance(frequency=(1.0, 1e9), speed=(1000.0, 2000.0))
    with pytest.raises(InputError, match="excluded by the condition mesh frequency outside"):
        select(designs, avoid=[every]).scene(int(dominated))


def test_csv_holds_all_that_is_left_to_full_precision(designs):
    selection = select(designs, where=[parse_condition("on_front==1")])
    rows = list(csv.DictReader(csv_text(selection).splitlines()))
    assert [int(row["design"]) for row in rows] == selection.numbers.tolist()
    for name in ("transmission_error_rms_max", "pair.helix_angle", "contact_pressure"):
        assert_array_equal([float(row[name]) for row in rows], value(designs, name)[selection.numbers])
    assert [row["law"] for row in rows] == value(designs, "law")[selection.numbers].tolist()
    assert_array_equal([float(r["axial_force"]) for r in rows], designs.values("axial_force", selection.numbers))


def test_markdown_is_a_table_with_units(designs):
    selection = select(designs, where=[parse_condition("helix_angle<=20")])
    lines = markdown_text(selection, top=3).splitlines()
    table = [line for line in lines if line.startswith("|")]
    assert len(table) == 2 + 3
    assert {line.count("|") for line in table} == {table[0].count("|")}
    assert "axial_force [N]" in table[0]
    assert "transmission_error_rms_mean [µm]" in table[0]
    assert f"- pair.helix_angle <= 20: {len(selection.numbers)} designs left" in lines
    assert table[2].split("|")[1].strip() == str(selection.numbers[0])


# -- command line -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1"])
def test_text_is_no_formula_in_a_spreadsheet(designs, text):
    dataset = designs.dataset.assign(law=designs.dataset["law"].astype(object).where(False, text))
    rows = list(csv.DictReader(csv_text(select(Designs(dataset))).splitlines()))
    assert {row["law"] for row in rows} == {f"'{text}"}


def test_list_is_printed_and_written(run, folder, designs, tmp_path):
    table, text = tmp_path / "list.csv", tmp_path / "list.md"
    options = ("--where", "helix_angle<=20", "--where", "axial_force<=150", "--worst-case", "--top", 2)
    code, out, err = run("select", folder, *options, "--csv", table, "--markdown", text)
    assert (code, err) == (0, "")
    selection = select(
        designs, where=[parse_condition("helix_angle<=20"), parse_condition("axial_force<=150")], worst_case=True
    )
    assert re.search(rf"{len(selection.numbers)}\s+axial_force <= 150", out)
    assert len(re.findall(r"^ +\d+ +-?\d[\d.e-]* ", out, flags=re.MULTILINE)) == 2
    assert "…" not in out
    assert len(table.read_text(encoding="utf-8").splitlines()) == 1 + len(selection.numbers)
    assert text.read_text(encoding="utf-8") == markdown_text(selection, 2)


def test_machine_readable_list(run, folder, designs):
    code, out, err = run(
        "select", folder / "front.nc", "--rank", "mesh_stiffness_rms_max-2*total_contact_ratio", "--json"
    )
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert found["ranking"] == {"mesh_stiffness_rms_max": 1.0, "total_contact_ratio": -2.0}
    assert len(found["designs"]) == 10
    number = found["designs"][0]["design"]
    assert found["designs"][0]["teeth"] == value(designs, "teeth")[number]


def test_nothing_left_is_an_answer(run, folder):
    code, out, err = run("select", folder, "--avoid", "1:100000", "--speed", "1000:2000")
    assert (code, err) == (0, "")
    assert "no design is left" in out
    assert run("select", folder, "--avoid", "1:1e5", "--speed", "1000:2000", "-q") == (0, "", "")


@pytest.mark.parametrize(
    "options",
    [
        ("--where", "helix<=15"),
        ("--where", "__import__('os').system('true')<=15"),
        ("--where", "amount>1"),
        ("--where", "reason<3"),
        ("--rank", "3*"),
        ("--rank", "speed_of_light"),
        ("--avoid", "3:2", "--speed", "1:2"),
        ("--avoid", "1:2"),
        ("--speed", "1:2"),
        ("--export", 9999, "scene.toml"),
        ("--csv", "missing/list.csv"),
    ],
)
def test_bad_input_is_one_line(refused, folder, monkeypatch, tmp_path, options):
    monkeypatch.chdir(tmp_path)
    err = refused("select", folder, *options)
    assert err.startswith("gearbench: ")
    assert not list(tmp_path.iterdir())


def test_what_is_no_finished_optimisation_is_refused(run, folder, tmp_path, designs):
    assert "no optimisation" in run("select", tmp_path)[2]
    (tmp_path / "study.toml").write_text((folder / "study.toml").read_text(encoding="utf-8"), encoding="utf-8")
    code, _, err = run("select", tmp_path)
    assert code == 2
    assert "not finished" in err
    save(designs.dataset[["teeth"]].drop_attrs(), tmp_path / "other.nc")
    code, _, err = run("select", tmp_path / "other.nc")
    assert (code, err.count("\n")) == (2, 1)
    assert run("select", tmp_path / "none.nc")[0] == 2
