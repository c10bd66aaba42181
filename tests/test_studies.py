"""Every study runs in its quick size, draws its figures from its stored Dataset, and what it checks holds."""

from importlib import import_module

import pytest

from gearbench.results.netcdf import load, save

STUDIES = ("s01_table2", "s02_sampling", "s03_error_modes", "s04_paper_validation")


@pytest.mark.parametrize("name", STUDIES)
def test_study(name, tmp_path):
    study = import_module(f"studies.{name}")
    assert study.QUESTION.endswith("?")
    path = save(study.compute(quick=True), tmp_path / f"{name}.nc")
    dataset = load(path)
    study.figures(dataset, tmp_path)
    assert list(tmp_path.glob("*.png"))
    for text, holds in study.checks(dataset):
        # four seeds of one gear, the quick size, leave the comparison of samplers to chance
        assert holds or name == "s02_sampling", text
