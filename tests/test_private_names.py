"""Tests look at the program from outside: they touch no private names, but compiled kernels beside their twins."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from tests.support.paths import ROOT

OWN = ("gearbench", "fem_reference", "studies")
PRIVATE = re.compile(r"(.*\.)?_[a-zA-Z]\w*[a-zA-Z]|_[a-z]")


def names(tree: ast.AST) -> Iterator[str]:
    """Names of the project that a test imports, attributes it reads or replaces."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] in OWN:
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.Attribute) and ast.unparse(node.value).split(".")[0] not in {"self", "cls", "os"}:
            yield node.attr
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("setattr"):
            yield from (a.value for a in node.args[:2] if isinstance(a, ast.Constant) and isinstance(a.value, str))


def test_tests_touch_no_private_names():
    for path in (ROOT / "tests").rglob("*.py"):
        found = set(names(ast.parse(path.read_text(encoding="utf-8"))))
        assert {name for name in found if PRIVATE.fullmatch(name) and not name.endswith("kernels")} == set(), path
