"""A stored front evaluated again with finite elements: against an independent path, and with the answer known."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import spearmanr

from gearbench.contact.smooth import clear_compliance_cache
from gearbench.effects.tooth_bending import ToothBending
from gearbench.errors import GearbenchError, InputError
from gearbench.optimisation.designs import Designs
from gearbench.optimisation.run import optimise
from gearbench.optimisation.select import open_designs
from gearbench.optimisation.study import Algorithm, Robustness
from gearbench.optimisation.study_file import parse_study, read_study
from gearbench.optimisation.verify import rank_correlation, reference_study, verify
from gearbench.results.netcdf import open_result, save
from gearbench.robustness.run import robust
from gearbench.validation.verification import findings
from tests.support.paths import STUDY

EXAMPLE = STUDY
PAPER = ToothBending(basis="paper")
#: How a tooth answers where no test says otherwise.
PLATE = ToothBending.compliance


@pytest.fixture(scope="module")
def stored(tmp_path_factory) -> Path:
    study = replace(
        read_study(EXAMPLE),
        name="small",
        algorithm=Algorithm(population=20, generations=3, seed=2),
        robustness=Robustness(samples=8),
    )
    return save(optimise(study, threads=1), tmp_path_factory.mktemp("verify") / "front.nc")


@pytest.fixture
def designs(stored) -> Designs:
    return open_designs(stored)


@pytest.fixture
def plate_for_finite_elements(monkeypatch):
    """Finite elements that answer as the plate does; the pairs they were asked for."""
    asked = []
    monkeypatch.setattr(ToothBending, "flank", lambda _, pair, k, beside: asked.append((pair, k)))
    answer(monkeypatch, lambda lines: PLATE(PAPER, lines, {}))
    return asked


def answer(monkeypatch, compliance) -> None:
    """Let finite elements answer with ``compliance(lines)``; plates answer as ever."""
    monkeypatch.setattr(ToothBending, "flank_compliances", lambda *_: None)

    def chosen(tooth, lines, beside):
        return compliance(lines) if tooth.by_finite_elements else PLATE(tooth, lines, beside)

    monkeypatch.setattr(ToothBending, "compliance", chosen)
    clear_compliance_cache()  # those of another answer


def mapping(**effects) -> dict:
    tables = read_study(EXAMPLE).to_mapping()
    tables["base"]["effects"] |= effects
    return tables


# -- truth -------------------------------------------------------------------------------------------------------------
def test_the_same_compliance_moves_nothing(designs, plate_for_finite_elements):
    found = verify(designs, threads=1)
    # nothing but the compliance is replaced: same gaps, errors, samples, in the same order of operations
    assert_array_equal(found["objective_verified"], found["objective"])
    assert_array_equal(found["shift"], 0)
    assert np.all(found["on_front_verified"] == 1)
    assert_allclose(found["rank_correlation"], 1, rtol=1e-12)  # rounding of the correlation
    assert found.sizes["design"] == int(designs.dataset["on_front"].sum()) > 3


def test_one_model_for_each_macro_geometry(designs, plate_for_finite_elements):
    found = verify(designs, numbers=np.flatnonzero(designs.dataset["feasible"].values)[:8].tolist(), threads=1)
    names = ("teeth", "addendum", "pair.helix_angle")
    pairs = {tuple(float(found[name][i]) for name in names) for i in range(found.sizes["design"])}
    assert found.attrs["macro_geometries"] == len(pairs) < found.sizes["design"]
    assert len(plate_for_finite_elements) == 2 * len(pairs)


def test_finite_elements_as_in_a_robust_scene(designs, tmp_path, monkeypatch):
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path))
    number = int(np.flatnonzero(designs.dataset["on_front"].values)[0])
    found = verify(designs, numbers=[number], accuracy=0.1)
    scene = designs.scene(number)
    kept = tuple(effect for effect in scene.effects if effect.name != "tooth_bending")
    other = replace(scene, effects=(*kept, ToothBending(model="finite_elements", accuracy=0.1)))
    answer = robust(other, samples=8, seed=designs.study.robustness.seed)
    for i, name in enumerate(("mesh_stiffness_rms_mean", "transmission_error_rms_mean")):
        # the same sums in another order of the compliances
        assert_allclose(found["objective_verified"][0, i], answer[name], rtol=1e-9)
        assert_allclose(found[f"{name}_verified"][0], answer[name], rtol=1e-9)
        shift = 100 * (float(answer[name]) / float(designs.dataset[name][number]) - 1)
        assert_allclose(found["shift"][0, i], shift, rtol=1e-6)  # a small difference of such numbers
    # the plate has another compliance: the answer is not the stored one
    assert np.all(np.abs(found["shift"]) > 0.01)
    assert list(tmp_path.glob("flank-*.npz"))


def test_rank_correlation_is_spearmans():
    rng = np.random.default_rng(3)
    a, b = rng.integers(0, 6, 40).astype(float), rng.integers(0, 6, 40).astype(float)  # with ties
    assert_allclose(rank_correlation(a, b), spearmanr(a, b).statistic, rtol=1e-12)
    assert rank_correlation(np.arange(5.0), -np.arange(5.0)) == pytest.approx(-1)
    unknown = np.where(np.arange(40) % 7 == 0, np.nan, b)
    assert_allclose(rank_correlation(a, unknown), spearmanr(a, unknown, nan_policy="omit").statistic, rtol=1e-12)
    assert np.isnan(rank_correlation(np.ones(5), np.arange(5.0)))
    assert np.isnan(rank_correlation(np.arange(2.0), np.arange(2.0)))


# -- what is replaced --------------------------------------------------------------------------------------------------
def test_limits_are_left_out_and_the_tooth_replaced():
    found = reference_study(read_study(EXAMPLE), 0.02)
    assert found.constraints == {}
    assert found.base["effects"]["tooth_bending"] == {"model": "finite_elements", "accuracy": 0.02}
    assert read_study(EXAMPLE).base["effects"].keys() == found.base["effects"].keys()


def test_a_study_with_a_gear_body_is_verified_on_its_rim():
    tables = mapping(gear_body={"model": "sainsot_velex"})
    tables["base"]["pair"] |= {name: {"bore_diameter": 20.0} for name in ("pinion", "wheel")}
    effects = reference_study(parse_study(tables), 0.01).base["effects"]
    assert effects["tooth_bending"]["model"] == "finite_elements"
    assert effects["gear_body"] == {}


def test_what_cannot_be_replaced_is_refused(designs):
    tables = mapping()
    del tables["base"]["effects"]["tooth_bending"]
    with pytest.raises(InputError, match=r"base\.effects\.tooth_bending = missing"):
        reference_study(parse_study(tables), 0.01)
    tables = mapping(tooth_bending={})
    tables["variables"]["fillet"] = {"paths": ["effects.tooth_bending.fillet"], "values": [False, True]}
    with pytest.raises(InputError, match=r"variables\.fillet"):
        reference_study(parse_study(tables), 0.01)
    infeasible = int(np.flatnonzero(designs.dataset["feasible"].values == 0)[0])
    for number in (-1, designs.dataset.sizes["design"], infeasible):
        with pytest.raises(InputError, match=r"number of a design|is not feasible"):
            verify(designs, numbers=[number])


def test_a_design_without_answer_is_reported_with_its_reason(designs, plate_for_finite_elements, monkeypatch):
    pairs = []

    def compliance(lines):
        pairs.append(lines.pair)
        if lines.pair == pairs[0]:
            raise GearbenchError("no mesh")
        return PLATE(PAPER, lines, {})

    answer(monkeypatch, compliance)
    found = verify(designs, threads=1)
    failed = found["verified"].values == 0
    assert 0 < failed.sum() < failed.size
    assert set(found["reason"].values[failed]) == {"no mesh"}
    assert np.all(np.isnan(found["shift"].values[failed]))
    assert not np.any(found["on_front_verified"].values[failed])
    assert_allclose(found["rank_correlation"], 1, rtol=1e-12)
    assert f"{failed.sum()} designs could not" in findings(found)[-1]


def test_no_answer_at_all_is_an_error(designs, plate_for_finite_elements, monkeypatch):
    def compliance(lines):
        raise GearbenchError("no mesh")

    answer(monkeypatch, compliance)
    with pytest.raises(GearbenchError, match="for the first because: no mesh"):
        verify(designs)


# -- command -----------------------------------------------------------------------------------------------------------
def test_command(stored, tmp_path, monkeypatch, run, plate_for_finite_elements):
    monkeypatch.setenv("MPLBACKEND", "agg")
    table, data = tmp_path / "table.md", tmp_path / "verified.nc"
    code, out, _ = run("verify", stored, "-o", data, "--markdown", table, "--plots", tmp_path / "plots")
    assert code == 0
    assert "mean RMS k: rank correlation 1.000, shift +0.0 to +0.0 %" in out
    assert (tmp_path / "plots" / "verification.png").stat().st_size > 10_000
    found = open_result(data)
    assert table.read_text(encoding="utf-8").count("(+0.0 %)") == 2 * found.sizes["design"]
    assert found.attrs["study_sha256"] == open_designs(stored).dataset.attrs["study_sha256"]
    code, out, _ = run("verify", stored, "--json")
    assert code == 0
    answer = json.loads(out)
    assert answer["number"] == found["number"].values.tolist()
    # rounding of the correlation
    assert answer["rank_correlation"] == pytest.approx({str(name): 1.0 for name in found["objective_name"].values})
