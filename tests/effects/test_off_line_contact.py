"""Contact off the line of action: continuity, balance of moments, warning of its absence."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import Scene, simulate
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.crowning import Crowning
from gearbench.effects.gear_body import GearBody
from gearbench.effects.helix_slope import HelixSlope
from gearbench.effects.hertz import Hertz
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.pair import Member, Pair
from gearbench.results.warnings import warnings
from gearbench.scene import Load, Resolution
from gearbench.solution import solve_lines, solve_scene


@lru_cache
def spur(*effects: object, torque: float = 100.0, helix: float = 0.0) -> Scene:
    """25/40 teeth of 2 mm, 20 mm wide, on bores of 25 and 40 mm; solid teeth on their bodies."""
    pair = Pair(
        normal_module=2.0,
        face_width=20.0,
        helix_angle=helix,
        centre_distance=65.0 / np.cos(np.radians(helix)),
        pinion=Member(teeth=25, bore_diameter=25.0),
        wheel=Member(teeth=40, bore_diameter=40.0),
    )
    basic = (ToothBending(model="solid"), GearBody(), Hertz())
    resolution = Resolution(gauss_points=12, segments=15)
    return Scene(pair=pair, load=Load(torque=torque), effects=(*basic, *effects), resolution=resolution)


def test_contact_on_the_line_is_said_and_named_as_a_cause_of_excessive_pressure() -> None:
    """No sign or size is claimed: what the effect changes is known only by simulating with it."""
    on_line, off_line = spur(torque=400.0), spur(OffLineContact(), torque=400.0)
    said = warnings(on_line, simulate(on_line, outputs=("flank_pressure_max",)))
    assert "add [effects.off_line_contact]" in said[0]
    assert "may be the cause: add [effects.off_line_contact]" in said[-1]
    assert not any("off_line" in line for line in warnings(off_line, simulate(off_line)))


def test_transmission_error_is_continuous_over_the_cycle() -> None:
    """A pair takes its load from zero; on the line the STE steps by 4.6 µm there."""
    scene = replace(spur(OffLineContact()), resolution=Resolution(positions=60))
    for around in (0.5, 0.66, 0.0):
        phase = around + np.linspace(0.0, 0.2, 60)
        solved = solve_lines(scene, scene_lines(scene, phase % 1.0), np.full(60, 1 / 60))
        # 4.8 µm within a tenth of a cycle
        assert np.abs(np.diff(solved.cycle.transmission_error)).max() < 0.5


def test_stiffness_is_the_derivative_of_load_with_lever_arms_and_edges() -> None:
    """k = ∂F/∂δ with the law fixed: central difference of two torques, typical load held."""
    scene = spur(OffLineContact())
    phase, weight = mesh_phases(scene)
    lines = scene_lines(scene, phase)
    here = solve_lines(scene, lines, weight)
    force, d = scene.F_bt, 1e-4
    up, down = (
        solve_lines(replace(scene, load=Load(torque=100.0 * (1 + sign * d))), lines, weight) for sign in (1, -1)
    )
    slope = 2 * d * force / (up.cycle.transmission_error - down.cycle.transmission_error)
    # phases at which a pair has just begun to touch have a kink nearby
    assert_allclose(np.median(np.abs(slope / here.cycle.mesh_stiffness - 1)), 0.0, atol=1e-6)
    assert_allclose(slope, here.cycle.mesh_stiffness, rtol=2e-3)


@pytest.mark.parametrize(("segments", "tolerance"), [(15, 4e-4), (30, 1.2e-4)])
def test_stiffness_of_partial_contact_is_the_derivative_of_load_as_segments_tell(segments, tolerance) -> None:
    """Ends of patches move with the load, k holds them: what that leaves on the line falls with the segments."""
    scene = spur(Crowning(amount=25.0))
    scene = replace(scene, resolution=Resolution(positions=12, segments=segments))
    d, names = 1e-4, ("transmission_error", "mesh_stiffness")
    up, down, here = (
        simulate(replace(scene, load=Load(torque=100.0 * factor)), outputs=names) for factor in (1 + d, 1 - d, 1.0)
    )
    slope = 2 * d * scene.F_bt / (up.transmission_error - down.transmission_error)
    assert_allclose(slope, here.mesh_stiffness, rtol=tolerance)


@pytest.mark.parametrize(("gear", "tolerance"), [("pinion", 1e-9), ("wheel", 1e-3)])
def test_helix_slopes_of_either_sign_are_mirror_images(gear: str, tolerance: float) -> None:
    """They differ by a turn of the gear, which moves contact on the line of action and at tips alike.

    A turn of the wheel also moves the phase of the mesh, by 10 µm of 6 mm. With the lever arm about the other gear the
    RMS differs by 3e-3.
    """
    found = [simulate(spur(OffLineContact(), HelixSlope(**{gear: amount}))) for amount in (10.0, -10.0)]
    for name in ("transmission_error_rms", "mesh_stiffness_rms"):
        assert_allclose(*(dataset[name] for dataset in found), rtol=tolerance)


def test_moments_of_all_segments_balance_the_torque() -> None:
    """Forces times their lever arms about the pinion, not the forces, add up to F_n."""
    scene = spur(OffLineContact(), helix=15.0)
    solved = solve_scene(scene)
    force = solved.line_load() * solved.lines.length
    assert_allclose((force * solved.lines.lever).sum(axis=(1, 2)), scene.F_bn, rtol=1e-12)
    assert np.all(solved.line_load() >= 0)
    # the outermost segments are free: lines reach as far as load does
    loaded = solved.line_load() > 0
    u = solved.lines.u[loaded]
    reach = 0.3 * scene.pair.meshing.base_pitch
    assert scene.pair.meshing.path_start - reach < u.min() < scene.pair.meshing.path_start
    assert scene.pair.meshing.path_end < u.max() < scene.pair.meshing.path_end + reach


def test_hardly_helical_gears_are_spur_gears() -> None:
    """Lines that run over a little of the path: what they change falls with the helix angle, corners included."""

    def error(helix: float) -> np.ndarray:
        scene = replace(spur(OffLineContact(), helix=helix), resolution=Resolution(positions=40, segments=15))
        return simulate(scene, outputs=("transmission_error",)).transmission_error.values

    straight = error(0.0)
    apart = [np.abs(error(helix) - straight).max() for helix in (0.02, 0.005)]
    assert apart[1] < 0.01  # of 4.8 µm peak to peak
    assert apart[0] / apart[1] == pytest.approx(4, rel=0.1)
