"""docs/tutorial_effect.md does what it says: effects and responses of another package are found, used and checked.

The package is tests/plugin: its files are those of the page, its dist-info is what pip makes of the entry points.
"""

from __future__ import annotations

import re
import sys
import tomllib
from configparser import ConfigParser

import numpy as np
import pytest
from numpy.testing import assert_allclose

import gearbench as gb
from gearbench.doctor import examine
from gearbench.effects import registry
from gearbench.explore.catalogue import catalogue
from gearbench.explore.stored import open_results
from gearbench.plugin import MeshCycle, Phases
from gearbench.results import responses
from gearbench.scene_file import scene_key
from tests.support.pages import blocks, follow, run_command
from tests.support.paths import ROOT

PAGE = "tutorial_effect.md"
PLUGIN = ROOT / "tests" / "plugin"
FILES = {
    match[1]: block.text.removeprefix(match[0])
    for block in blocks(PAGE)
    if (match := re.match(r"# ([\w.]+)\n", block.text))
}
EFFECTS = ("undulation", "hinged_tooth")
MODULES = (*EFFECTS, "stiffness_modulation")
MODULATION = "mesh_stiffness_modulation"


@pytest.fixture(autouse=True)
def package(monkeypatch):
    """The other package, as pip installs it."""
    monkeypatch.syspath_prepend(PLUGIN)
    monkeypatch.setattr(responses, "KNOWN", dict(responses.KNOWN))
    forget()
    yield
    forget()
    for module in MODULES:
        sys.modules.pop(module, None)


def forget():
    """Let both registries look for entry points again."""
    registry.installed.cache_clear()
    responses.installed.cache_clear()


def tables(**effects):
    pair = {
        "normal_module": 3.0, "face_width": 24.0, "centre_distance": 90.0,
        "pinion": {"teeth": 24}, "wheel": {"teeth": 36},
    }  # fmt: skip
    resolution = {"positions": 4, "segments": 40}
    return {"pair": pair, "load": {"torque": 50.0}, "resolution": resolution, "effects": effects}


def scene(**effects):
    return gb.parse_scene(tables(**effects))


def test_the_package_is_that_of_the_page():
    assert {f"{module}.py": (PLUGIN / f"{module}.py").read_text(encoding="utf-8") for module in MODULES} == {
        name: text for name, text in FILES.items() if name.removesuffix(".py") in MODULES
    }
    build = tomllib.loads(FILES["pyproject.toml"])
    # setuptools refuses to choose among several modules
    assert set(build["tool"]["setuptools"]["py-modules"]) == set(MODULES)
    project = build["project"]
    stored = ConfigParser()
    stored.read(PLUGIN / f"{project['name']}-{project['version']}.dist-info" / "entry_points.txt")
    assert {name: dict(stored[name]) for name in stored.sections()} == project["entry-points"]


def test_the_registry_lists_effects_of_other_packages_and_those_of_gearbench_first():
    names = registry.effect_names()
    assert names[: len(registry.EFFECTS)] == tuple(registry.EFFECTS)
    assert set(names[len(registry.EFFECTS) :]) == set(EFFECTS)
    found = {finding.name: finding.found for finding in examine()}
    assert found["effect undulation"] == "of wavy_gears 1.0"


def test_a_gap_is_simulated_where_a_scene_names_it():
    plain = gb.simulate(scene(tooth_bending={}, hertz={}))
    assert "undulation" not in sys.modules
    wavy = gb.simulate(scene(tooth_bending={}, hertz={}, undulation={"amplitude": 0.5, "waves": 4}))
    assert np.all(wavy.transmission_error > plain.transmission_error)
    assert gb.parse_scene(tomllib.loads(wavy.attrs["scene"])).effect("undulation") is not None


def test_a_tooth_is_simulated_as_its_closed_form_says():
    # hardly any other compliance, loads on lines of one height (spur): STE = F Σ h²/(c b) for a single pair in contact
    given = scene(hinged_tooth={"stiffness": 1e3}, hertz={"law": "yang_sun"})
    result = gb.simulate(given)
    lines = gb.contact_lines(given.pair, result.mesh_phase.values, 1)
    gears = given.pair.gears
    alone = np.flatnonzero(lines.active.sum(axis=1) == 1)
    assert alone.size > 0
    for i in alone:
        k = int(np.argmax(lines.active[i]))
        h = [float(radius[i, k, 0]) - gear.root_radius for radius, gear in zip(lines.radii, gears, strict=True)]
        expected = 1e3 * given.F_bn * sum(x**2 for x in h) / (1e3 * given.pair.face_width)
        # Hertz adds some tenths of a per mille to a tooth this soft
        assert_allclose(result.transmission_error[i], expected, rtol=1e-3)


def test_robust_optimise_plan_and_explorer_take_all_three(tmp_path):
    effects = {"hinged_tooth": {"stiffness": 2e6}, "hertz": {}, "undulation": {"amplitude": 0.5, "waves": 2}}
    errors = {"manufacturing_errors": {"preset": "garambois2017"}}
    rough = gb.robust(scene(**effects, **errors), samples=8, responses=[MODULATION])
    smooth = gb.robust(scene(**{n: t for n, t in effects.items() if n != "undulation"}, **errors), samples=8)
    assert not np.allclose(rough.transmission_error_rms, smooth.transmission_error_rms, rtol=1e-6)
    assert {"hinged_tooth", "undulation"} <= {part.name for part in gb.plan(scene(**effects)).parts}
    study = gb.parse_study(
        {
            "base": tables(**effects),
            "variables": {"effects.undulation.waves": {"min": 1, "max": 3}},
            "objectives": ["transmission_error_rms_mean", f"{MODULATION}_mean"],
            "algorithm": {"population": 4, "generations": 1},
            "robustness": {"samples": 0},
        }
    )
    front = gb.optimise(study, directory=tmp_path / "front", threads=1)
    assert set(front["effects.undulation.waves"].values) <= {1, 2, 3}
    assert np.all(front["feasible"] == 1)
    for design in range(front.sizes["design"]):
        alone = gb.simulate(gb.design_scene(front, design), outputs=[MODULATION])
        assert float(front[f"{MODULATION}_mean"][design]) == pytest.approx(float(alone[MODULATION]), rel=1e-9)
    gb.save(rough, tmp_path / "rough.nc")
    shown = catalogue(open_results([tmp_path / "front", tmp_path / "rough.nc"]))
    column = next(column for column in shown.columns if column.name == f"{MODULATION}_mean")
    assert column.title == "mean mod k [%]"
    assert set(column.values) == {*front[f"{MODULATION}_mean"].values, float(rough[f"{MODULATION}_mean"])}


def test_a_response_is_what_its_equation_says():
    run = gb.simulate(scene(tooth_bending={}, hertz={}), outputs=["mesh_stiffness", MODULATION])
    k = run.mesh_stiffness.values
    assert float(run[MODULATION]) == pytest.approx(100 * (k.max() - k.min()) / (k.max() + k.min()), rel=1e-12)
    assert run[MODULATION].attrs["units"] == "%"
    # k = 1 + a cos 2πτ: a
    tau = np.arange(8) / 8
    phases = Phases(phase=tau, weight=np.full(8, 1 / 8), size=None)
    curve = 1 + np.array([[0.1], [0.3]]) * np.cos(2 * np.pi * tau)
    cycle = MeshCycle(phases=phases, transmission_error=curve, mesh_stiffness=curve)
    assert_allclose(responses.response(MODULATION).reduce(cycle), [10.0, 30.0], rtol=1e-12)


def test_what_does_not_fit_is_refused():
    with pytest.raises(gb.InputError, match=r"effects\.undulation\.waves = 40: must be at most 32"):
        scene(hertz={}, undulation={"amplitude": 0.5, "waves": 40})
    with pytest.raises(gb.InputError, match="unknown key"):
        scene(hertz={}, undulation={"amplitude": 0.5, "wave": 4})
    with pytest.raises(gb.InputError, match=r"effects\.hinged_tooth = given: conflicts with effects\.tooth_bending"):
        scene(tooth_bending={}, hertz={}, hinged_tooth={"stiffness": 2e6})
    key = scene_key("effects.undulation.amplitude")
    assert key is not None
    assert key.unit == "µm"


@pytest.fixture
def noise(tmp_path, monkeypatch):
    """Install a package of these entry points."""

    def install(entry_points: str) -> None:
        folder = tmp_path / "noise-2.0.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: noise\nVersion: 2.0\n")
        (folder / "entry_points.txt").write_text(entry_points)
        monkeypatch.syspath_prepend(tmp_path)
        forget()

    return install


@pytest.mark.parametrize(
    ("line", "fault"),
    [
        ("noise = undulation:Undulation", "must be a subclass of Effect with the name"),
        ("noise = undulation:Noise", "cannot be imported"),
        ("noise = nowhere:Noise", "cannot be imported"),
    ],
)
def test_an_entry_point_that_leads_nowhere_is_one_line(line, fault, noise):
    noise(f"[gearbench.effects]\n{line}\nhertz = undulation:Undulation\n")
    with pytest.raises(gb.InputError, match=fault):
        scene(hertz={}, noise={})
    assert scene(hertz={}).effect("hertz") == gb.Hertz()
    assert [finding.fine for finding in examine() if finding.name == "effect noise"] == [False]


@pytest.mark.parametrize(
    ("target", "fault"),
    [
        (
            "nowhere:NOISE",
            r"gearbench\.metrics\.noise = nowhere:NOISE: cannot be imported: No module named 'nowhere'",
        ),
        ("stiffness_modulation:NOISE", "cannot be imported"),
        ("stiffness_modulation:modulation", "must be a Metric, or a sequence of them"),
    ],
)
def test_a_response_that_leads_nowhere_is_one_line(target, fault, noise, capsys):
    noise(f"[gearbench.metrics]\nnoise = {target}\n")
    with pytest.raises(gb.InputError, match=fault):
        gb.simulate(scene(tooth_bending={}, hertz={}), outputs=[MODULATION])
    file = ROOT / "examples" / "gear55_robust.toml"
    assert run_command(f"gearbench robust {file} --samples 2 --response noise") == 2
    printed = capsys.readouterr().err
    assert re.search(fault, printed.replace("\n", " "))
    assert "Traceback" not in printed
    assert len(printed.strip().splitlines()) == 1


def test_its_test_passes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wavy.toml").write_text(FILES["wavy.toml"], encoding="utf-8")
    space: dict = {}
    exec(compile(FILES["test_undulation.py"], "test_undulation.py", "exec"), space)
    tests = [value for name, value in space.items() if name.startswith("test_")]
    assert tests
    for test in tests:
        test()


def test_the_commands_of_the_page_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    done = list(follow(PAGE, programs=False))
    assert [block.language for block in done].count("sh") == 1
    assert (tmp_path / "wavy.nc").exists()
