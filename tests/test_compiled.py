"""The process that compiles the kernels gets the bits of those that find them compiled: ``gearbench/compiled.py``."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
import tomllib
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from gearbench import nonlinear_response, revolution_response, robust, robust_response, simulate, sweep
from gearbench.effects.teeth import clear_tooth_cache
from gearbench.library.garambois2017 import case
from gearbench.scene import Resolution, Scene
from gearbench.scene_file import parse_scene
from tests.support.paths import ROOT
from tests.support.systems import spur_scene
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


def without_order(value: Any) -> bool:
    """Whether ``value`` holds an array that is not C-contiguous."""
    if isinstance(value, tuple):
        return any(map(without_order, value))
    return isinstance(value, np.ndarray) and not value.flags.c_contiguous


@pytest.fixture
def calls(monkeypatch) -> dict[str, set[int]]:
    """Of each entry that is called, which of its arguments were arrays that are not contiguous."""
    found: dict[str, set[int]] = {}

    def watch(module: str, name: str) -> None:
        own = getattr(import_module(module), name)

        def watched(*arguments: Any, **more: Any) -> Any:
            found[name] = found.get(name, set()) | {
                i for i, value in enumerate((*arguments, *more.values())) if without_order(value)
            }
            return own(*arguments, **more)

        monkeypatch.setattr(import_module(module), name, watched)

    for at in ENTRIES:
        watch(*at)
    return found


def small(name: str, **effects: Any) -> Scene:
    """An example with more effects, at few phases."""
    given = tomllib.loads((ROOT / "examples" / name).read_text(encoding="utf-8"))
    return parse_scene(given | {"effects": given["effects"] | effects, "resolution": {"positions": 6, "segments": 9}})


def test_entries_are_called_with_contiguous_arrays(calls):
    clear_tooth_cache()  # of tests before: they are built by compiled code too
    errors = {"manufacturing_errors": {"preset": "garambois2017"}}
    simulate(case(2, Resolution(positions=4)))
    for scene in (small("sc.toml", **errors), small("gears/hcr_spur.toml", gear_body={}, **errors)):
        simulate(scene)
        robust(scene, samples=3)
    spur = small("gears/hcr_spur.toml", gear_body={})
    sweep(spur, torque=[50.0, 60.0])
    wheel = replace(spur.pair.wheel, rim_thickness=6.0, web_thickness=8.0)
    simulate(replace(spur, pair=replace(spur.pair, wheel=wheel)))
    driven = spur_scene({}, effects={"hertz": {"law": "yang_sun"}} | errors, segments=4, gauss_points=2)
    for scene in (driven, small("shafts.toml", **errors)):
        robust_response(scene, speed=900.0, harmonics=1, samples=2)
    driven = replace(driven, pair=replace(driven.pair, backlash=0.15), effects=driven.effects[:1])
    nonlinear_response(driven, speed=[900.0], harmonics=1)
    pitch = {"pitch_errors": {"pinion": [0.0, 1.0] * 12 + [0.0]}}
    driven = spur_scene({}, effects={"hertz": {}} | pitch, segments=4, gauss_points=2)
    revolution_response(driven, speed=900.0, harmonics=1)
    assert set(calls) == {name for _, name in ENTRIES}
    assert {name: loose for name, loose in calls.items() if loose} == {}


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
