"""The public names: listed once, imported on first use, documented, none of them a module."""

from __future__ import annotations

import ast
import inspect
import re
import subprocess
import sys
import types

import pytest

import gearbench
from gearbench.effects.registry import EFFECTS, effect_class
from tests.support.paths import ROOT
from tests.test_architecture import MODULES

API = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
DOCUMENTED = set(re.findall(r"^\.\. auto\w+:: (\S+)$", API, flags=re.MULTILINE))


def test_public_names_are_imported_and_documented():
    for name in gearbench.__all__:
        found = getattr(gearbench, name)
        assert not isinstance(found, types.ModuleType)
        assert inspect.getdoc(found), name
        assert {f"{found.__module__}.{found.__qualname__}", found.__module__} & DOCUMENTED, name


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


def test_what_is_not_public_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = gearbench.no_such_name


def test_a_function_stays_one_whatever_is_imported():
    code = (
        "import gearbench, importlib, pkgutil\n"
        "names = [m.name for m in pkgutil.iter_modules(gearbench.__path__, 'gearbench.') if '__main__' not in m.name]\n"
        "list(map(importlib.import_module, names))\n"
        "import types\n"
        "print([n for n in gearbench.__all__ if isinstance(getattr(gearbench, n), types.ModuleType)])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "[]"


def test_types_are_marked_as_such():
    assert (ROOT / "gearbench" / "py.typed").exists()
