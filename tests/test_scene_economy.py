"""A scene simulates only the effects that it names; others are not imported, so they take neither time nor memory."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import replace
from functools import cache
from itertools import permutations
from typing import Any

import numpy as np
import pytest
import tomli_w

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
    "waviness": {"pinion": [{"order": 1, "amplitude": 8.0}], "wheel": [{"order": 7, "amplitude": 0.5}]},
    "misalignment": {"inclination": 4.0, "deviation": 6.0},
}
EVERY = pytest.mark.parametrize("name", EFFECTS)
#: Those that can be dropped: without a contact law hardly any scene is complete.
DROPPED = pytest.mark.parametrize("name", [n for n in EFFECTS if n != "hertz"])


def compatible(name: str, others: list[str]) -> bool:
    mine = effect_class(name)
    return all(name not in effect_class(o).conflicts and o not in mine.conflicts for o in others)


def full_with(name: str) -> list[str]:
    """Effects that are compatible with ``name`` and with each other, taken in the order of the registry."""
    taken = [name]
    for other in EFFECTS:
        if other == "off_line_contact":  # its lines reach as far as all the others together deflect
            continue
        if other not in taken and compatible(other, taken):
            taken.append(other)
    return [n for n in EFFECTS if n in taken]


def without(names: list[str], dropped: str) -> list[str]:
    """``names`` without ``dropped`` and without the effects that require it."""
    return [n for n in names if n != dropped and dropped not in effect_class(n).requires]


def tables(names: list[str]) -> dict[str, Any]:
    return {**BASE, "effects": {n: TABLES[n] for n in names}}


@cache
def scene(*names: str) -> Scene:
    return parse_scene(tables(list(names)))


def test_every_effect_is_entered_here():
    assert set(TABLES) >= set(EFFECTS)


@EVERY
def test_the_full_scene_is_full(name):
    assert name in full_with(name)
    assert len(full_with(name)) >= 10


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


@cache
def imported(*cases: tuple[str, ...]) -> dict[tuple[str, ...], set[str]]:
    """Modules that a simulation of each case imports or looks for, in addition to the program without effects."""
    lines = "\n".join(json.dumps(tables(list(case))) for case in cases)
    command = [sys.executable, "-c", RUNNER, json.dumps(list(EFFECTS))]
    done = subprocess.run(command, input=lines, capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr[-2000:]
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert all(answers), done.stderr[-2000:]
    return {case: set(modules) for case, modules in zip(cases, answers, strict=True)}


def alone(name: str) -> tuple[str, ...]:
    """The smallest scene with the effect."""
    return tuple(n for n in EFFECTS if n in {name, "hertz", *effect_class(name).requires})


LIGHT = tuple(n for n in EFFECTS if n != "hertz")


@pytest.mark.parametrize("name", LIGHT)
def test_nothing_of_a_dropped_effect_is_imported(name):
    cases = {alone(n) for n in LIGHT} | {tuple(without(full_with(n), n)) for n in LIGHT} | {("hertz",)}
    cases |= {tuple(full_with(n)) for n in LIGHT}
    found = imported(*sorted(cases))
    module = EFFECTS[name][0]
    assert module in found[tuple(full_with(name))]
    left = tuple(without(full_with(name), name))
    assert module not in found[left]
    # its own helpers too: what it brings with it when alone, and no other effect that is left does
    own = found[alone(name)] - found["hertz",]
    others = set().union(*(found[alone(n)] for n in left if n != "hertz"))
    assert not (own - others) & found[left]


def test_a_scene_of_one_effect_imports_one_effect():
    found = imported(("hertz",))["hertz",]
    effects = {m for m in found if m.startswith("gearbench.effects.")}
    assert effects == {"gearbench.effects.hertz"}
    assert not {m for m in found if m.split(".")[0] in {"fem_reference", "skfem", "gmsh", "matplotlib", "sympy"}}
    assert not {
        m for m in found if m.startswith(("gearbench.robustness", "gearbench.optimisation", "gearbench.compliance"))
    }


# -- nothing is mentioned ---------------------------------------------------------------------------------------------
@DROPPED
def test_no_variable_mentions_a_dropped_effect(name):
    rest = scene(*without(full_with(name), name))
    rest = replace(rest, operation=Operation(speed=1000.0, friction_coefficient=0.05))
    out = simulate(rest, outputs=tuple(OUTPUTS))
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
    everything = full_with(name)
    whole, rest = scene(*everything), scene(*without(everything, name))
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


@DROPPED
def test_the_effect_matters(name):
    """With the effect the result differs; otherwise the tests above would prove nothing."""
    everything = full_with(name)
    a, b = simulate(scene(*everything)), simulate(scene(*without(everything, name)))
    assert not np.array_equal(a.transmission_error, b.transmission_error)


# -- prerequisites and conflicts --------------------------------------------------------------------------------------
def refused(names: list[str]) -> str:
    with pytest.raises(InputError) as refusal:
        parse_scene(tables(names))
    return str(refusal.value)


REQUIRED = [(n, r) for n in EFFECTS for r in effect_class(n).requires]
CONFLICTS = sorted({tuple(sorted((n, c))) for n in EFFECTS for c in effect_class(n).conflicts})


@pytest.mark.parametrize(("name", "required"), REQUIRED)
def test_a_missing_prerequisite_is_refused_naming_both(name, required):
    assert required in EFFECTS
    message = refused([name])
    assert f"effects.{name}" in message
    assert any(f"effects.{r}" in message for r in effect_class(name).requires)
    others = [r for r in effect_class(name).requires if r != required]
    assert f"effects.{required}" in refused([name, *others])


@pytest.mark.parametrize(("one", "other"), CONFLICTS)
def test_conflicting_effects_are_refused_naming_both(one, other):
    assert {one, other} <= set(EFFECTS)
    needed = {*effect_class(one).requires, *effect_class(other).requires}
    for pair in permutations((one, other)):
        message = refused([*needed, *pair])
        assert f"effects.{one}" in message
        assert f"effects.{other}" in message


def test_a_scene_is_the_same_whether_from_a_file_or_from_tables(tmp_path):
    from gearbench.scene_file import read_scene

    file = tmp_path / "scene.toml"
    names = full_with("tooth_bending")
    file.write_text(tomli_w.dumps(tables(names)), encoding="utf-8")
    assert read_scene(file).digest == scene(*names).digest
