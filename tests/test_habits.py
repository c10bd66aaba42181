"""One version, one list of requirements, one set of checks."""

from __future__ import annotations

import re
import tomllib
from email.message import Message
from importlib import import_module

import pytest

from gearbench import __version__
from gearbench.errors import install_extra
from tests.support.paths import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
CHANGES = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_version_stands_in_one_file():
    assert PROJECT["project"]["dynamic"] == ["version"]
    assert PROJECT["tool"]["hatch"]["version"]["path"] == "gearbench/__init__.py"
    text = (ROOT / "gearbench" / "__init__.py").read_text(encoding="utf-8")
    # the pattern by which hatchling reads it
    assert re.findall(r'(?m)^__version__ *= *"(.+)"$', text) == [__version__]


def test_the_version_follows_the_last_release():
    version = pytest.importorskip("packaging.version")
    headings = re.findall(r"^## \[(.+?)\](.*)$", CHANGES, flags=re.MULTILINE)
    assert headings[0] == ("Unreleased", "")
    assert all(re.fullmatch(r" - \d{4}-\d{2}-\d{2}", date) for _, date in headings[1:])
    releases = [version.Version(name) for name, _ in headings[1:]]
    assert releases == sorted(releases, reverse=True)
    own = version.Version(__version__)
    assert own == releases[0] or (own.is_devrelease and own > releases[0])


@pytest.fixture
def examine(monkeypatch):
    """What doctor finds where the package's metadata asks for ``requirements``."""
    doctor = import_module("gearbench.doctor")

    def call(*requirements: str) -> dict:
        own = Message()
        own["Requires-Python"] = ">=3.11"
        own["Provides-Extra"] = "fem"
        own["Provides-Extra"] = "dev"
        for text in requirements:
            own["Requires-Dist"] = text
        monkeypatch.setattr(doctor, "metadata", lambda _: own)
        return {finding.name: finding for finding in doctor.examine()}

    return call


def test_doctor_looks_for_what_the_metadata_asks_for(examine):
    development = "pytest; extra == 'dev'"
    fem = "nowhere-to-be-found>=1; extra == 'fem'"
    found = examine("numpy>=2.0", "scipy>=999", fem, "gmsh; python_version < '3'", development)
    assert found["Python"].fine
    assert found["numpy"].fine
    assert not found["scipy"].fine
    assert found["scipy"].needed
    assert "needs >=999" in found["scipy"].remedy
    missing = found["nowhere-to-be-found"]
    assert (missing.fine, missing.needed) == (False, False)
    assert missing.remedy == install_extra("fem")
    assert "pytest" not in found
    assert "gmsh" not in found
    assert "pydantic" not in found


def test_doctor_says_so_where_gearbench_is_not_installed(examine, monkeypatch):
    doctor = import_module("gearbench.doctor")

    def missing(name: str) -> None:
        raise doctor.PackageNotFoundError(name)

    monkeypatch.setattr(doctor, "metadata", missing)
    found = {finding.name: finding for finding in doctor.examine()}
    assert not found["gearbench"].fine
