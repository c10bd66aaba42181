"""Default settings on gears in use: harmonics and peak-to-peak against curves ten times as fine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gearbench import load_scene
from gearbench.contact import transitions
from gearbench.contact.assemble import flank_separation, gap_kinks, scene_lines
from gearbench.contact.phases import gauss_phases
from gearbench.results.cycle import MeshCycle, Phases, coefficients, peak_to_peak
from gearbench.results.outputs import output
from gearbench.scene import Resolution, Scene
from gearbench.simulation import simulate
from gearbench.solution import solve_lines, solve_scene
from tests.test_architecture import ROOT

GEARS = sorted(path.stem for path in (ROOT / "examples" / "gears").glob("*.toml"))
FAST = ["nasa_28", "osu_50", "large_wheel"]
HIGHEST = 8


def example(name: str) -> Scene:
    return load_scene(ROOT / "examples" / "gears" / f"{name}.toml")


def fine_cycle(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> MeshCycle:
    """Twice the nodes on a line, and panels that end at uniform phases too, the denser the nearer to a birth."""
    fine = replace(scene, resolution=Resolution(segments=30))
    monkeypatch.setattr(transitions, "MORE_PHASES", 96)
    changes = transitions.transitions(fine, exact=True)
    meshing = scene.pair.meshing
    kinks, face = gap_kinks(scene, flank_separation(scene))
    known = meshing.phases_at((meshing.path_start, meshing.path_end, *kinks), face)
    steps = [sign * 10.0**-p for sign in (-1, 1) for p in (1.5, 2, 2.5, 3, 3.5, 4, 4.5)]
    near = [change.phase + step for change in changes if change.rank == 0 for step in steps]
    phase, weight = gauss_phases([*(change.phase for change in changes), *known, *np.arange(32) / 32, *near], 5)
    parts = [
        solve_lines(fine, scene_lines(fine, phase[i : i + 40]), weight[i : i + 40], 5).solution
        for i in range(0, len(phase), 40)
    ]
    approach, stiffness = (np.concatenate([getattr(p, name) for p in parts]) for name in ("approach", "stiffness"))
    return MeshCycle.of(scene, Phases(phase=phase, weight=weight, size=5), approach, stiffness)


def misses(cycle: MeshCycle, exact: MeshCycle, name: str) -> tuple[float, float]:
    """Greatest error of a harmonic over max(5 % of itself, 0.2 % of peak-to-peak); relative error of peak-to-peak."""
    found, wanted = (2 * coefficients(c.phases, getattr(c, name), HIGHEST) for c in (cycle, exact))
    # of the samples: where nodes of a spur pair touch one after the other, polynomials of tiny panels overshoot
    span = float(np.ptp(getattr(exact, name)))
    allowed = np.maximum(0.05 * np.abs(wanted), 0.002 * span)
    whole = float(peak_to_peak(cycle.phases, getattr(cycle, name)))
    return float(np.max(np.abs(found - wanted) / allowed)), abs(whole / span - 1)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in FAST else [pytest.mark.slow]) for name in GEARS]
)
def test_default_settings_resolve_gears_in_use(name, monkeypatch):
    scene = example(name)
    found = solve_scene(scene).cycle
    exact = fine_cycle(scene, monkeypatch)
    for curve in ("transmission_error", "mesh_stiffness"):
        worst, span = misses(found, exact, curve)
        assert worst <= 1.0, curve
        assert span <= 0.01, curve


@pytest.mark.parametrize("name", ["nasa_28", "hcr_spur"])
def test_spur_pairs_converge_exponentially_in_the_points_of_a_panel(name):
    """Panels end where a pair takes or leaves its load: without that the error of the mean falls like 1/n."""
    scene = example(name)

    def mean(points: int) -> float:
        solved = solve_scene(replace(scene, resolution=Resolution(gauss_points=points)))
        return float(solved.cycle.transmission_error @ solved.weight)

    exact = mean(12)
    errors = [abs(mean(points) / exact - 1) for points in (1, 2, 3, 4)]
    assert errors[3] < 1e-3 * errors[0]
    assert errors[3] < 1e-5


@pytest.mark.parametrize("name", [pytest.param(n, marks=[] if n in FAST else [pytest.mark.slow]) for n in GEARS])
def test_the_noise_floor_bounds_the_error_of_the_harmonics(name, monkeypatch):
    scene = example(name)
    solved = solve_scene(scene)
    exact = fine_cycle(scene, monkeypatch)
    for curve in ("transmission_error", "mesh_stiffness"):
        floor = output(solved, f"{curve}_amplitude_noise_floor")[1][:HIGHEST]
        found, wanted = (2 * np.abs(coefficients(c.phases, getattr(c, curve), HIGHEST)) for c in (solved.cycle, exact))
        error = np.abs(found - wanted)
        # an estimate: most of its value is that it is not far above, and next to nothing falls out of it
        assert np.all(error <= 1.5 * floor), curve
        assert np.all(floor <= 0.01 * np.ptp(getattr(exact, curve))), curve


def test_a_coarse_run_says_that_its_harmonics_are_noise(caplog):
    simulate(replace(example("nasa_28"), resolution=Resolution(positions=16)))
    (line,) = caplog.messages
    assert line.startswith("noise floor of the harmonics")
    assert "mesh_stiffness" in line
    caplog.clear()
    simulate(example("nasa_28"))
    assert not caplog.text
