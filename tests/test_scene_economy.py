"""A scene simulates only the effects that it names; others are not imported, so they take neither time nor memory."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import tomli_w
import xarray as xr

from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.gaps import total_gap
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.base import ComplianceEffect, GapEffect
from gearbench.effects.registry import EFFECTS, effect_class
from gearbench.errors import InputError
from gearbench.results.outputs import OUTPUTS
from gearbench.scene import Operation, Scene
from gearbench.scene_file import parse_scene
from gearbench.simulation import simulate
from tests.support.paths import ROOT

GRID = ROOT / "tests" / "data" / "economy_grid.csv"

BASE: dict[str, Any] = {
    "pair": {
        "normal_module": 3.0,
        "helix_angle": 12.0,
        "face_width": 24.0,
        "centre_distance": 92.2,
        "pinion": {"teeth": 24, "bore_diameter": 20.0},
        "wheel": {"teeth": 36, "bore_diameter": 30.0},
    },
    "load": {"torque": 150.0},
    "resolution": {"positions": 6, "segments": 5},
}
#: A table of each effect; a new effect is entered here.
TABLES: dict[str, dict[str, Any]] = {
    "tooth_bending": {"basis": "paper"},
    "gear_body": {},
    "off_line_contact": {},
    "hertz": {},
    "crowning": {"amount": 4.0},
    "tip_relief": {"amount": 6.0, "length": 0.9},
    "root_relief": {"amount": 3.0, "length": 0.5},
    "end_relief": {"amount": 5.0, "length": 2.5},
    "profile_slope": {"pinion": 2.0, "wheel": -3.0},
    "profile_crowning": {"pinion": 4.0, "wheel": 2.0},
    "profile_curve": {"pinion": {"polynomial": [0.0, 2.0, 6.0]}},
    "helix_curve": {"wheel": {"at": [0.0, 6.0, 24.0], "deviation": [5.0, 0.0, 3.0]}},
    "flank_twist": {"pinion": 6.0},
    "helix_slope": {"pinion": 5.0},
    "manufacturing_errors": {"preset": "garambois2017"},
    "topography": {"pinion": str(GRID)},
    "pitch_errors": {"pinion": [float(n % 5) for n in range(24)], "pinion_tooth": 3},
    "random_pitch": {"wheel": {"iso_class": 7, "seed": 3}, "wheel_tooth": 2},
    "waviness": {"pinion": [{"order": 1, "amplitude": 8.0}], "wheel": [{"order": 7, "amplitude": 0.5}]},
    "misalignment": {"inclination": 4.0, "deviation": 6.0},
}
#: Those that can be dropped: without a contact law hardly any scene is complete.
LIGHT = tuple(name for name in EFFECTS if name != "hertz")
DROPPED = pytest.mark.parametrize("name", LIGHT)
#: All at once, but one whose lines reach as far as all the others together deflect.
FULL = tuple(name for name in EFFECTS if name != "off_line_contact")


def full_with(name: str) -> tuple[str, ...]:
    return FULL if name in FULL else tuple(EFFECTS)


def without(dropped: str) -> tuple[str, ...]:
    """The full scene without an effect."""
    return tuple(name for name in full_with(dropped) if name != dropped)


def tables(names: Iterable[str]) -> dict[str, Any]:
    return {**BASE, "effects": {name: TABLES[name] for name in names}}


@cache
def scene(*names: str) -> Scene:
    return parse_scene(tables(names))


def test_every_effect_is_entered_here():
    assert set(TABLES) == set(EFFECTS)


# -- nothing is imported ----------------------------------------------------------------------------------------------
#: Each case runs in a fork of a process that has imported the program, but no effect.
RUNNER = """
import json, os, sys, warnings
import numpy as np, scipy.linalg, scipy.optimize, scipy.special, xarray
warnings.simplefilter("ignore")
from gearbench.results import provenance
from gearbench.contact.problem import ContactProblem
from gearbench.contact.solver import solve
from gearbench.scene_file import parse_scene
from gearbench.simulation import simulate
row, block = np.ones((1, 2)), np.zeros(2, int)
solve(ContactProblem(gap=0 * row, a=row, h=row / 9, sigma=0 * row, active=row > 0, factor=np.ones((1, 2, 1)),
                     block=block, blocks=1, force=1.0, length_scale=1.0, shape=(1, 1, 2)))
xarray.Dataset({"x": ("p", [0.0])})  # imports dask where it is installed
provenance.git_revision(), provenance.versions()
effects = {f"gearbench.effects.{name}" for name in json.loads(sys.argv[1])}
assert not effects & set(sys.modules)
assert not [m for m in sys.modules if m.startswith(("gearbench.accuracy", "gearbench.system", "gearbench.dynamics"))]
for line in sys.stdin:
    case = json.loads(line)
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        before, asked = set(sys.modules), set()
        sys.addaudithook(lambda event, args: asked.add(args[0]) if event == "import" else None)
        simulate(parse_scene(case))
        found = sorted((set(sys.modules) - before) | (asked - before))
        os.write(writer, json.dumps(found).encode() + b"\\n")
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as answer:
        print(answer.readline().strip() or "null", flush=True)
    os.waitpid(child, 0)
"""


def with_law(names: Iterable[str]) -> tuple[str, ...]:
    """Effects with the contact law, in the order of the registry."""
    return tuple(name for name in EFFECTS if name in {*names, "hertz"})


ALONE = {name: with_law([name]) for name in EFFECTS}
#: Halves of the effects: any two stand apart in some of them, and together in others.
HALVES = [with_law(n for i, n in enumerate(LIGHT) if i >> bit & 1 == side) for bit in range(5) for side in (0, 1)]


@pytest.fixture(scope="module")
def imported() -> dict[tuple[str, ...], set[str]]:
    """Modules that a simulation of each case imports or looks for, in addition to the program without effects."""
    cases = [*ALONE.values(), *HALVES]
    lines = "\n".join(json.dumps(tables(case)) for case in cases)
    command = [sys.executable, "-c", RUNNER, json.dumps(list(EFFECTS))]
    done = subprocess.run(command, input=lines, capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr[-2000:]
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert all(answers), done.stderr[-2000:]
    return {case: set(modules) for case, modules in zip(cases, answers, strict=True)}


@DROPPED
def test_nothing_of_an_effect_is_imported_where_it_is_not_named(name, imported):
    """Its module, and what it brings with it when alone, but for what the effects named bring."""
    own = {each: imported[case] - imported[ALONE["hertz"]] for each, case in ALONE.items()}
    module = EFFECTS[name][0]
    assert module in own[name]
    for case, found in imported.items():
        if name not in case:
            assert module not in found, case
            assert not own[name].difference(*(own[each] for each in case)) & found, case


def test_a_scene_of_one_effect_imports_one_effect(imported):
    found = imported[ALONE["hertz"]]
    assert {m for m in found if m.startswith("gearbench.effects.")} == {"gearbench.effects.hertz"}
    assert not {m for m in found if m.split(".")[0] in {"fem_reference", "skfem", "gmsh", "matplotlib", "sympy"}}
    others = {"accuracy", "compliance", "dynamics", "optimisation", "robustness", "system"}
    assert not {m for m in found if m.startswith("gearbench.") and m.split(".")[1] in others}


# -- nothing is mentioned ---------------------------------------------------------------------------------------------
@cache
def whole(*names: str) -> xr.Dataset:
    return simulate(scene(*names))


@DROPPED
def test_no_variable_mentions_a_dropped_effect_and_the_result_is_another(name):
    rest = replace(scene(*without(name)), operation=Operation(speed=1000.0, friction_coefficient=0.05))
    out = simulate(rest, outputs=tuple(OUTPUTS))
    assert not np.array_equal(out.transmission_error, whole(*full_with(name)).transmission_error)
    words = {name, name.replace("_", " "), effect_class(name).__name__}
    texts = [str(v) for v in (*out.variables, *out.dims)]
    texts += [f"{k} {v}" for x in (out, *out.variables.values()) for k, v in x.attrs.items() if k != "scene_sha256"]
    for text in texts:
        # crowning is not profile_crowning
        assert not [w for w in words if re.search(rf"(?<![A-Za-z_]){w}(?![A-Za-z_])", text)], text
    kept = {variable for effect in rest.effects for variable in effect.kept()}
    assert kept <= set(out.data_vars)
    assert set(out.data_vars) - set(OUTPUTS) - kept <= {
        "equilibrium_residual", "minimum_force", "complementarity_residual", "newton_steps",
    }  # fmt: skip


# -- what is left stays as it was -------------------------------------------------------------------------------------
@DROPPED
def test_the_other_terms_are_bit_identical(name):
    whole, rest = scene(*full_with(name)), scene(*without(name))
    # on the same lines: uniform phases do not depend on the effects
    assert np.array_equal(mesh_phases(whole)[0], mesh_phases(rest)[0])
    lines = scene_lines(rest, mesh_phases(rest)[0])
    sum_of_gaps = np.zeros(lines.shape)
    for effect in rest.effects:
        before = whole.effect(effect.name)
        if isinstance(effect, GapEffect):
            assert isinstance(before, GapEffect)
            gap = effect.gap(lines)
            assert np.array_equal(gap, before.gap(lines))
            sum_of_gaps = sum_of_gaps + gap
        elif isinstance(effect, ComplianceEffect):
            assert isinstance(before, ComplianceEffect)
            one, other = (e.compliance(lines, s.effects_by_name) for e, s in ((effect, rest), (before, whole)))
            assert type(one) is type(other)
            for key, value in vars(one).items():
                assert np.array_equal(value, getattr(other, key)), key
    assert np.array_equal(total_gap(rest.acting_effects, lines), sum_of_gaps)


# -- prerequisites ----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("name", "required"), [(n, r) for n in EFFECTS for r in effect_class(n).requires])
def test_a_missing_prerequisite_is_refused_naming_both(name, required):
    with pytest.raises(InputError) as refusal:
        parse_scene(tables([name]))
    assert {f"effects.{name}", f"effects.{required}"} <= set(re.findall(r"effects\.\w+", str(refusal.value)))


def test_a_scene_is_the_same_whether_from_a_file_or_from_tables(tmp_path):
    from gearbench.scene_file import read_scene

    file = tmp_path / "scene.toml"
    file.write_text(tomli_w.dumps(tables(FULL)), encoding="utf-8")
    assert read_scene(file).digest == scene(*FULL).digest
