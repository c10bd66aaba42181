"""The Python programs of examples/ run, and say what their scenes and studies give."""

import runpy
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import pytest

from gearbench import Resolution, read_scene, simulate
from tests.support.paths import EXAMPLES

mpl.use("agg")


@pytest.fixture
def run_example(tmp_path, monkeypatch, capsys):
    """Run a program in an empty folder: its lines, and the names it leaves."""
    monkeypatch.chdir(tmp_path)

    def call(name: str) -> tuple[list[str], dict]:
        monkeypatch.setattr(sys, "argv", [name])
        names = runpy.run_path(str(EXAMPLES / name), run_name="__main__")
        return capsys.readouterr().out.splitlines(), names

    return call


def test_every_program_is_run_here():
    text = Path(__file__).read_text(encoding="utf-8")
    assert [path.name for path in EXAMPLES.glob("*.py") if f'run_example("{path.name}")' not in text] == []


def test_a_pair_is_simulated(run_example):
    lines, names = run_example("simulate_pair.py")
    assert [line.split(":")[0] for line in lines[-2:]] == ["my pair", "with tip relief"]
    again = simulate(read_scene("my_pair.toml"))
    assert again["transmission_error"].identical(names["result"]["transmission_error"])


def test_a_gear_scatters(run_example):
    lines, _ = run_example("robust_gear.py")
    assert len(lines) == 2
    assert all("most of the scatter by profile_form" in line for line in lines)
    assert Path("as_given/density.png").stat().st_size > 10_000


@pytest.mark.slow
def test_a_first_look_leaves_five_pictures_with_their_data(run_example):
    lines, _ = run_example("demo.py")
    assert [line[:3] for line in lines if line[:1].isdigit()] == [f"{number}. " for number in range(1, 6)]
    for suffix in ("png", "nc"):
        assert len(list(Path("out/demo").glob(f"[1-5]_*.{suffix}"))) == 5


def test_a_search_finds_the_smoothest(run_example):
    lines, names = run_example("optimise_pair.py")
    front = names["front"]
    feasible = front.where(front["feasible"] == 1)
    assert int(feasible["mesh_stiffness_rms_mean"].argmin("design")) == names["best"]
    assert lines[-1].startswith(f"design {names['best']}: ")


GEARS = [
    pytest.param(path, id=path.stem, marks=() if path.stem in {"hcr_spur", "thin_rim", "fzg_c"} else pytest.mark.slow)
    for path in sorted((EXAMPLES / "gears").glob("*.toml"))
]


@pytest.mark.parametrize("path", GEARS)
def test_gears_in_use_stand_on_their_bodies(path):
    """Twelve pairs of practice: wide, helical, high contact ratio, thin rims, large wheels."""
    scene = read_scene(path)
    assert scene.name == path.stem
    assert scene.effect("off_line_contact") is not None
    # ISO counts the teeth on the path of contact
    on_line = scene.without("off_line_contact")
    dataset = simulate(replace(on_line, resolution=Resolution(positions=8, segments=7)))
    assert dataset.attrs["support"] == "ring"
    # ISO 6336-1: c_γ = c' (0.75 ε_α + 0.25), c' = 14 N/(mm·µm) with 20° and bodies of average kind
    iso = 14 * (0.75 * scene.pair.meshing.transverse_contact_ratio + 0.25) * scene.pair.face_width
    assert 0.5 < float(dataset["mesh_stiffness_mean"]) / iso < 1.6
