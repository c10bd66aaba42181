"""The documentation builds without a warning, needs no network, and names tests and files that exist."""

from __future__ import annotations

import doctest
import importlib
import os
import re
import subprocess
import sys

import pytest

from tests.support.pages import DOCS
from tests.support.paths import ROOT

PAGES = sorted(DOCS.glob("*.md"))
CLAIMS = DOCS / "data" / "validation.csv"
#: Public functions and classes whose docstrings show how they are used.
SHOWN = (
    "gearbench.scene_file",
    "gearbench.simulation",
    "gearbench.robustness.run",
    "gearbench.geometry.pair",
    "gearbench.geometry.gear",
)
WITH_EXAMPLES = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for path in (ROOT / "gearbench").rglob("*.py")
    if "\n    >>> " in path.read_text(encoding="utf-8")
)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built strictly."""
    pytest.importorskip("sphinx")
    pytest.importorskip("myst_parser")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-b", "html", "-W", "--keep-going", "-q", "-d", folder / "trees"]
    done = subprocess.run([*command, DOCS, folder / "html"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / "html"


@pytest.mark.slow
def test_every_page_is_built_without_a_warning(site):
    assert {page.stem for page in PAGES} <= {page.stem for page in site.glob("*.html")}


@pytest.mark.slow
def test_nothing_comes_from_the_network(site):
    for page in site.glob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert not re.findall(r'<(?:script|img|iframe)[^>]+src="(?:https?:)?//', text), page.name
        assert not re.findall(r'<link[^>]+href="(?:https?:)?//', text), page.name


@pytest.mark.parametrize("page", [*PAGES, CLAIMS], ids=lambda page: page.name)
def test_files_and_tests_that_a_page_names_exist(page):
    text = page.read_text(encoding="utf-8")
    for path, test in re.findall(r"`((?:tests|studies|gearbench|examples|docs)/[\w/.]+\.\w+)(?:::(\w+))?`", text):
        if re.search(r"NN|[A-Z]{4}", path):
            continue  # NAME stands for any
        assert (ROOT / path).exists(), path
        if test:
            assert f"def {test}(" in (ROOT / path).read_text(encoding="utf-8"), f"{path}::{test}"


def test_the_equations_are_cited_and_what_is_cited_is_there():
    pages = "".join((DOCS / page).read_text(encoding="utf-8") for page in ("theory.md", "algorithms.md"))
    labels = re.findall(r"\$\$ \((\w+)\)", pages)
    assert len(labels) == len(set(labels)) > 30
    code = " ".join(" ".join(path.read_text(encoding="utf-8").split()) for path in (ROOT / "gearbench").rglob("*.py"))
    cited = set(re.findall(r"[(,] ?((?:PL|[GCBFSLRTEWDM])[12]?\d)(?=[,):]| of docs/(?:theory|algorithms)\.md)", code))
    assert cited == set(labels)


def test_the_public_functions_show_how_they_are_used():
    assert set(SHOWN) <= set(WITH_EXAMPLES)


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_examples_in_docstrings_are_true(name, monkeypatch):
    monkeypatch.chdir(ROOT)
    monkeypatch.setitem(os.environ, "NO_COLOR", "1")
    found = doctest.testmod(importlib.import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    assert found.attempted > 0
    assert found.failed == 0
