"""Style of the words in the code: docstrings open with a noun or a verb."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from tests.support.paths import ROOT

FOLDERS = ("gearbench", "fem_reference", "studies", "examples", "benchmarks")
#: Openings that leave the subject of the sentence out.
OPENINGS = re.compile(r"(Of|As|What|Those|Where|How|By how|Whose|Which|Whatever|That|Such)\b")


def openings(path: Path) -> list[str]:
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    texts = [ast.get_docstring(node) or "" for node in nodes if isinstance(node, kinds)]
    return [text.splitlines()[0] for text in texts if OPENINGS.match(text)]


@pytest.mark.parametrize("folder", FOLDERS)
def test_docstrings_open_with_a_noun_or_a_verb(folder):
    found = {str(path): openings(path) for path in (ROOT / folder).rglob("*.py")}
    assert not {path: lines for path, lines in found.items() if lines}
