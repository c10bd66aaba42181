"""The process that compiles the kernels gets the bits of those that find them compiled: ``gearbench/compiled.py``."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from importlib import import_module
from typing import Any

import numba
import pytest

from tests.support import kernels
from tests.support.paths import ROOT
from tests.test_architecture import MODULES

KERNELS = {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in MODULES.items() if "_kernels" in name}
FUNCTIONS = {
    (module, node.name): node
    for module, tree in KERNELS.items()
    for node in tree.body
    if isinstance(node, ast.FunctionDef)
}


def kind(node: ast.FunctionDef) -> str:
    [decorator] = node.decorator_list
    assert isinstance(decorator, ast.Call)
    return ast.unparse(decorator.func)


ENTRIES = {at for at, node in FUNCTIONS.items() if kind(node) == "entry"}


def test_every_compiled_function_is_an_entry_or_a_part():
    assert {kind(node) for node in FUNCTIONS.values()} == {"entry", "part"}


def test_no_compiled_function_calls_an_entry():
    names = {name for _, name in ENTRIES}
    for at, node in FUNCTIONS.items():
        called = {found.id for found in ast.walk(node) if isinstance(found, ast.Name)}
        assert not called & names, at


def test_python_calls_entries_and_nothing_else_that_is_compiled():
    seen = set()
    for module, path in MODULES.items():
        if module in KERNELS:
            continue
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "_kernels" in text else ():
            if isinstance(node, ast.Import):
                assert not any("_kernels" in name.name for name in node.names), module
            if isinstance(node, ast.ImportFrom) and node.module in KERNELS:
                seen |= {(node.module, name.name) for name in node.names} & set(FUNCTIONS)
    assert seen == ENTRIES


@pytest.fixture
def calls(monkeypatch) -> dict[str, set[str]]:
    """Of each entry that is called, the types of its arguments."""
    found: dict[str, set[str]] = {}

    def watch(module: str, name: str) -> None:
        own = getattr(import_module(module), name)

        def watched(*arguments: Any) -> Any:
            found.setdefault(name, set()).add(str(numba.typeof(arguments)))
            return own(*arguments)

        monkeypatch.setattr(import_module(module), name, watched)

    for at in ENTRIES:
        watch(*at)
    return found


def test_entries_are_called_with_contiguous_arrays_and_compiled_once(calls):
    for job in kernels.JOBS:
        kernels.run(job)
    assert set(calls) == {name for _, name in ENTRIES}
    assert {name: types for name, types in calls.items() if len(types) > 1} == {}
    assert {name: types for name, types in calls.items() if re.search(r"readonly|, [AF]\)", str(types))} == {}


BITS = """
import hashlib, numpy as np
from gearbench import read_scene, robust, simulate
for name in ("sc", "gears/e_drive_input", "gears/osu_50"):
    data = simulate(read_scene(f"examples/{name}.toml"))
    print(hashlib.sha256(b"".join(np.ascontiguousarray(data[key].values).tobytes() for key in data)).hexdigest())
data = robust(read_scene("examples/gear55_robust.toml"), samples=200)
print(hashlib.sha256(b"".join(np.ascontiguousarray(data[key].values).tobytes() for key in data)).hexdigest())
"""


@pytest.mark.slow
def test_a_process_that_compiles_gets_the_bits_of_one_that_does_not(tmp_path):
    """Without parts in the code of their callers transmission errors differ by 1e-15 of themselves."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    runs = [
        subprocess.run([sys.executable, "-c", BITS], env=environment, cwd=ROOT, capture_output=True, text=True)
        for _ in range(2)
    ]
    assert [run.returncode for run in runs] == [0, 0], runs[0].stderr
    assert len(set(runs[0].stdout.split())) == 4
    assert runs[0].stdout == runs[1].stdout


PART = """
from typing import NamedTuple
from gearbench.compiled import part
class {kind}(NamedTuple):
    x: float
Pair = {kind}
@part()
def g(a):
    return a.x + {number}
"""
ENTRY = """
from gearbench.compiled import entry
from _part_kernels import Pair, g
@entry()
def f(a):
    return g(a)
"""


def test_stored_code_is_compiled_again_if_a_part_or_a_type_in_another_file_changes(tmp_path):
    (tmp_path / "_entry_kernels.py").write_text(ENTRY)
    for kind, number in (("Old", 1.0), ("Old", 2.0), ("New", 2.0)):
        (tmp_path / "_part_kernels.py").write_text(PART.format(kind=kind, number=number))
        code = f"import sys; sys.path[:0] = {sys.path}; from _entry_kernels import f, Pair; print(f(Pair(1.0)))"
        command = [sys.executable, "-B", "-c", code]
        run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert run.stdout.split() == [str(1.0 + number)], run.stderr
