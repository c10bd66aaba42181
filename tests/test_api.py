"""The public names: listed once, imported on first use, documented, none of them a module."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import types

import pytest

import gearbench
from gearbench import plot, plugin
from gearbench.effects.registry import EFFECTS, effect_class
from tests.support.paths import ROOT
from tests.test_architecture import MODULES

API = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
DOCUMENTED = set(re.findall(r"^\.\. auto\w+:: (\S+)$", API, flags=re.MULTILINE))
PUBLIC = {"gearbench": gearbench.__all__, "gearbench.plot": plot.__all__, "gearbench.plugin": plugin.__all__}
#: Programs that readers copy: those of the pages, of README, and examples.
SHOWN = [*(ROOT / "docs").glob("*.md"), ROOT / "README.md", *(ROOT / "examples").rglob("*.py")]


@pytest.mark.parametrize("module", PUBLIC)
def test_public_names_are_imported_and_documented(module):
    for name in PUBLIC[module]:
        found = getattr(importlib.import_module(module), name)
        assert not isinstance(found, types.ModuleType)
        assert inspect.getdoc(found), name
    # a setting of pydantic's is all that has no entry of its own
    assert {f"{module}.{name}" for name in PUBLIC[module]} - DOCUMENTED <= {"gearbench.plugin.STRICT"}


def imported(text: str) -> set[tuple[str, str]]:
    """Names that a program imports from gearbench: (module, name)."""
    nodes = list(ast.walk(ast.parse(text)))
    names = {(n.module or "", alias.name) for n in nodes if isinstance(n, ast.ImportFrom) for alias in n.names}
    modules = {(alias.name, "") for n in nodes if isinstance(n, ast.Import) for alias in n.names}
    return {found for found in names | modules if found[0].split(".")[0] in ("gearbench", "fem_reference")}


@pytest.mark.parametrize("path", SHOWN, ids=lambda path: path.name)
def test_programs_that_readers_copy_import_public_names_only(path):
    text = path.read_text(encoding="utf-8")
    programs = [text] if path.suffix == ".py" else re.findall(r"^```python\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    allowed = {(module, name) for module, names in PUBLIC.items() for name in names}
    assert set().union(*map(imported, programs)) <= allowed


def test_old_names_lead_to_their_successors():
    for name, successor in vars(gearbench)["_RENAMED"].items():
        module, _, new = successor.rpartition(".")
        with pytest.warns(DeprecationWarning, match=f"^gearbench.{name} is now {successor}$"):
            assert getattr(gearbench, name) is getattr(importlib.import_module(module), new)
        assert new in PUBLIC[module]


def test_no_module_bears_a_public_name():
    # importing it would put it in the place of the function
    assert not {f"gearbench.{name}" for name in gearbench.__all__} & set(MODULES)


def test_the_stub_lists_what_is_there():
    stub = ast.parse((ROOT / "gearbench" / "__init__.pyi").read_text(encoding="utf-8"))
    aliases = [alias for node in stub.body if isinstance(node, ast.ImportFrom) for alias in node.names]
    assert all(alias.name == alias.asname for alias in aliases)
    assert sorted(alias.name for alias in aliases) == gearbench.__all__
    assert set(gearbench.__all__) == set(dir(gearbench))


def test_every_effect_is_public():
    for name in EFFECTS:
        kind = effect_class(name)
        assert getattr(gearbench, kind.__name__) is kind


def test_types_are_marked_as_such():
    assert (ROOT / "gearbench" / "py.typed").exists()
