"""Every study has its four parts, runs in its quick size, and its checks hold."""

import re
import tomllib
from importlib import import_module
from pkgutil import iter_modules

import numpy as np
import pytest

import studies
from gearbench.results.netcdf import open_result, save
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene
from tests.support.paths import ROOT
from tests.support.stored import stored

ALL = sorted(module.name for module in iter_modules(studies.__path__) if module.ispkg)
#: Studies whose quick size takes seconds; those of the fronts and of finite elements have tests of their own.
QUICK = ("s03_error_modes",)
SLOW = ("s01_table2", "s02_sampling", "s04_paper_validation", "s13_planetary_phasing")
LONGER = [pytest.param(name, marks=pytest.mark.slow) for name in SLOW]


@pytest.mark.parametrize("name", ALL)
def test_a_study_has_its_four_parts(name):
    study = import_module(f"studies.{name}")
    assert study.QUESTION.endswith("?")
    assert isinstance(study.scene(), Scene)
    assert all(callable(part) for part in (study.compute, study.checks, study.figures))
    assert all(part.__module__.startswith(f"studies.{name}.") for part in (study.compute, study.checks, study.figures))


@pytest.mark.parametrize("name", [*QUICK, *LONGER])
def test_study(name, tmp_path):
    study = import_module(f"studies.{name}")
    path = save(study.compute(quick=True), tmp_path / f"{name}.nc")
    dataset = open_result(path)
    study.figures(dataset, tmp_path)
    assert list(tmp_path.glob("*.png"))
    checks = study.checks(dataset)
    assert checks
    for text, holds in checks:
        assert holds, text


@pytest.mark.parametrize(
    ("name", "limits"),
    [("s05_tooth_models", 10), ("s08_contact", 28), ("s10_fronts_on_bodies", 6), ("s12_fronts_off_line", 8)],
)
def test_stored_numbers_keep_their_limits(name, limits):
    found = import_module(f"studies.{name}").checks(stored(name))
    assert len(found) == limits
    for text, holds in found:
        assert holds, text


@pytest.mark.parametrize(
    ("name", "files"),
    [
        pytest.param(
            "s05_tooth_models", "accuracy_and_time.png errors_clamped.png errors_rim.png", marks=pytest.mark.slow
        ),
        ("s08_contact", "curves.png"),
        pytest.param("s09_contact_in_use", "curves.png residual.png", marks=pytest.mark.slow),
        ("s10_fronts_on_bodies", "fronts.png report.md table_2.png"),
        pytest.param("s12_fronts_off_line", "fronts.png report.md table_2.png", marks=pytest.mark.slow),
        pytest.param("s13_planetary_phasing", "load_factor.png phasing.png report.md", marks=pytest.mark.slow),
    ],
)
def test_figures_come_from_the_stored_dataset(name, files, tmp_path):
    import_module(f"studies.{name}").figures(stored(name), tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == files.split()


@pytest.fixture
def kept():
    return stored("s05_tooth_models")


def test_the_page_claims_no_more_than_the_stored_pairs_show(kept):
    page = (ROOT / "docs" / "results_teeth.md").read_text(encoding="utf-8")
    claims = re.findall(r"^\| solid[^|]*\| ([\d.]+) %, ([\d.]+) %", page, flags=re.MULTILINE)[:2]
    assert len(claims) == 2
    for (support, model), claimed in zip((("clamped", "solid"), ("rim", "solid + ring")), claims, strict=True):
        here = kept.sel({f"{support}_model": model})
        for name, claim in zip(("transmission_error", "mesh_stiffness"), claimed, strict=True):
            assert float(abs(here[f"{support}_{name}_mean_error"]).max()) < float(claim) + 0.05  # as rounded


def test_the_stored_pairs_are_the_first_that_are_drawn(kept):
    from studies.s05_tooth_models.data import MODELS, scene

    for i in (0, 1, kept.sizes["design"] - 1):
        assert parse_scene(tomllib.loads(str(kept["scene"].values[i]))) == scene(i)
    for support, models in MODELS.items():
        assert list(kept[f"{support}_model"].values) == list(models)


def test_finite_elements_are_much_nearer_than_the_limits(kept):
    """The reference is accurate enough to tell: its own error is a third of the smallest limit at most."""
    assert np.all(kept["clamped_reference_error"] <= 0.01)
    assert np.all(kept["rim_reference_error"] <= 0.015)
