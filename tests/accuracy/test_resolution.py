"""Default settings on gears in use: harmonics and peak-to-peak against curves ten times as fine."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import islice

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import read_scene
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.transitions import loaded_phases, transitions
from gearbench.effects.gear_body import GearBody
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.results.cycle import MeshCycle, coefficients
from gearbench.results.outputs import output
from gearbench.scene import Load, Resolution, Scene
from gearbench.simulation import simulate
from gearbench.solution import solve_lines, solve_scene
from studies.s05_tooth_models.pairs import draw, in_use
from tests.support.default_curves import HIGHEST, converged, drawn_scenes, missed, misses
from tests.support.paths import ROOT

GEARS = sorted(path.stem for path in (ROOT / "examples" / "gears").glob("*.toml"))
FAST = ["nasa_28", "osu_50", "large_wheel"]


def example(name: str) -> Scene:
    return read_scene(ROOT / "examples" / "gears" / f"{name}.toml").without("off_line_contact")


@cache
def resolved(name: str) -> MeshCycle:
    return converged(example(name), 30)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in FAST else [pytest.mark.slow]) for name in GEARS]
)
def test_default_settings_resolve_gears_in_use(name):
    scene = example(name)
    found = solve_scene(scene).cycle
    exact = resolved(name)
    for curve in ("transmission_error", "mesh_stiffness"):
        worst, span = misses(found, exact, curve)
        assert worst <= 1.0, curve
        assert span <= 0.01, curve


@pytest.mark.parametrize(
    ("name", "share"),
    [
        ("large_wheel", 0.2),
        ("e_drive_input", 0.1),
        *(pytest.param("nrel_5mw_stage3", s, marks=pytest.mark.slow) for s in (0.2, 1.0)),
    ],
)
def test_patches_and_deflections_off_the_line_are_those_of_four_times_the_cells(name, share):
    """Ends known from parabolas in 15 cells left 11 and 4 % in k, few points on the widest piece 6 % in the STE.

    A patch that begins at the corner of a relief, shorter than a cell, left 9 % in k.
    """
    scene = example(name)
    scene = replace(scene, effects=(*scene.effects, OffLineContact()), load=Load(torque=share * scene.load.torque))
    phase, weight, size = loaded_phases(scene)
    found, fine = (
        solve_lines(each, scene_lines(each, phase), weight, size).cycle
        for each in (scene, replace(scene, resolution=Resolution(segments=60)))
    )
    for curve in ("transmission_error", "mesh_stiffness"):
        exact = getattr(fine, curve)
        assert_allclose(getattr(found, curve), exact, rtol=0, atol=0.02 * np.ptp(exact))


def test_few_points_resolve_patches_with_free_ends():
    """Gauss points left 0.1 % of peak-to-peak in k, because its contributions rise like 1/ln(1/s) at free ends."""
    scene = example("e_drive_output")
    scene = replace(scene, load=Load(torque=0.5 * scene.load.torque))
    phase = np.arange(12) / 12
    found, fine = (
        solve_lines(each, scene_lines(each, phase), np.full(12, 1 / 12)).solution.stiffness
        for each in (replace(scene, resolution=Resolution(segments=n)) for n in (15, 60))
    )
    assert np.sqrt(np.mean((found - fine) ** 2)) < 4e-4 * np.ptp(fine)


@pytest.mark.parametrize("share", [0.1, 0.2])
def test_the_noise_floor_sees_how_few_points_resolve_the_deflections(share):
    """On lines of three and five pieces; both curves are at the same phases, so that only the lines differ."""
    scene = example("e_drive_input")
    scene = replace(scene, effects=(*scene.effects, OffLineContact()), load=Load(torque=share * scene.load.torque))
    solved = solve_scene(scene)
    lines = scene_lines(replace(scene, resolution=Resolution(segments=60)), solved.lines.mesh_phase)
    fine = solve_lines(scene, lines, solved.weight, solved.size).cycle
    for curve in ("transmission_error", "mesh_stiffness"):
        error = np.sqrt(np.mean((getattr(solved.cycle, curve) - getattr(fine, curve)) ** 2))
        # an estimate from four phases
        assert 0.4 < error / solved.unresolved[curve] < 2.5, curve
        assert np.all(output(solved, f"{curve}_amplitude_noise_floor")[1] >= solved.unresolved[curve]), curve


@pytest.mark.slow
def test_the_noise_floor_on_shafts_sees_how_few_points_resolve_the_patches():
    solved = solve_scene(scene := read_scene(ROOT / "examples" / "shafts.toml"))
    lines = scene_lines(replace(scene, resolution=Resolution(segments=60)), solved.lines.mesh_phase)
    fine = solve_lines(scene, lines, solved.weight, solved.size).cycle
    for curve in ("transmission_error", "mesh_stiffness"):
        error = np.sqrt((getattr(solved.cycle, curve) - getattr(fine, curve)) ** 2 @ solved.weight)
        assert 0.4 < error / solved.unresolved[curve] < 2.5, curve


def test_a_load_transfer_next_to_an_end_of_the_path_ends_a_panel():
    """A thousandth of the cycle apart, both were one, and k jumped within a panel."""
    scene = example("nasa_28")
    scene = replace(scene, effects=(*scene.effects, OffLineContact()), load=Load(torque=1.381 * scene.load.torque))
    found, exact = (solve_scene(replace(scene, resolution=Resolution(gauss_points=n))).cycle for n in (5, 12))
    assert misses(found, exact, "mesh_stiffness")[0] < 0.6


@pytest.mark.parametrize("share", [0.3, pytest.param(0.2, marks=pytest.mark.slow)])
def test_stiffness_bends_where_a_patch_passes_an_end_of_the_path_or_the_corner_of_a_relief(share):
    """Without panels that end there, its peak-to-peak value was 3 to 6 % too small."""
    scene = example("nrel_5mw_stage3")
    scene = replace(scene, effects=(*scene.effects, OffLineContact()), load=Load(torque=share * scene.load.torque))
    solved = solve_scene(scene)
    transfers = [change for change in transitions(replace(scene, resolution=Resolution())) if change.side]
    # least stiffness: next to a load transfer, on the side on which the curve is flat
    phase = np.sort([*np.arange(20) / 20, *((change.phase - 1e-4 * change.side) % 1 for change in transfers)])
    fine = replace(scene, resolution=Resolution(positions=len(phase)))
    fine = solve_lines(fine, scene_lines(fine, phase), np.full(len(phase), 1.0))
    span = np.ptp(fine.cycle.mesh_stiffness)
    error = abs(solved.cycle.curves["mesh_stiffness"].peak_to_peak - span)
    assert error < min(0.01 * span, output(solved, "mesh_stiffness_peak_to_peak_noise_floor")[1])


def test_wide_flanks_that_touch_all_along_have_the_nodes_that_their_teeth_need():
    """15 Gauss points on lines over a face of 24 modules missed peak-to-peak of STE by a fifth."""
    bending, hertz = (scene := next(islice(draw(in_use, 73), 6, None))).effects
    wide = replace(scene, effects=(bending, GearBody(), hertz))
    assert wide.pair.face_width > 24 * wide.pair.normal_module
    found, exact = (solve_scene(s).cycle for s in (wide, replace(wide, resolution=Resolution(segments=30))))
    for curve in ("transmission_error", "mesh_stiffness"):
        assert misses(found, exact, curve)[0] <= 0.3, curve
        near, fine = (c.curves[curve].peak_to_peak for c in (found, exact))
        assert_allclose(near, fine, rtol=2e-3)


@pytest.mark.slow
def test_default_settings_resolve_modified_pairs_that_nobody_tuned_for(tmp_path):
    """A fifth of the scenes of ``support/default_curves.py``; on a bilinear grid each of its lines is a kink."""
    some = islice(drawn_scenes(tmp_path, 73), None, None, 5)
    held = {name: missed(scene, converged(scene)) <= 1.0 for name, scene in some}
    smooth = [found for name, found in held.items() if not name.endswith("grid")]
    assert np.mean(smooth) >= 0.92
    assert np.mean(list(held.values())) >= 0.87


@pytest.mark.parametrize("name", ["nasa_28", "hcr_spur"])
def test_spur_pairs_converge_exponentially_in_the_points_of_a_panel(name):
    """Panels end where a pair takes up or sheds its load: without that the error of the mean falls like 1/n."""
    scene = example(name)

    def mean(points: int) -> float:
        solved = solve_scene(replace(scene, resolution=Resolution(gauss_points=points)))
        return float(solved.cycle.transmission_error @ solved.weight)

    exact = mean(12)
    errors = [abs(mean(points) / exact - 1) for points in (1, 2, 3, 4)]
    assert errors[3] < 1e-3 * errors[0]
    assert errors[3] < 1e-5


@pytest.mark.parametrize("name", [pytest.param(n, marks=[] if n in FAST else [pytest.mark.slow]) for n in GEARS])
def test_the_noise_floor_bounds_the_error_of_the_harmonics(name):
    scene = example(name)
    solved = solve_scene(scene)
    exact = resolved(name)
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
