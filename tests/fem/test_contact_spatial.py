"""Contact finite elements of finite width: strips by closed forms, fine teeth, phases by plane strain and by lines."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fem_reference.contact import result
from fem_reference.contact.cycle import contact_cycle
from fem_reference.contact.phase import Settings
from fem_reference.contact.spatial import Fineness, SpatialSettings, lay_strips, solve_spatial
from fem_reference.contact.strip import slice_at
from fem_reference.contact.tooth import FineTooth, Grading
from fem_reference.flank import Flank
from gearbench.effects.crowning import Crowning
from gearbench.effects.gear_body import GearBody
from gearbench.effects.hertz import Hertz
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.tip_relief import TipRelief
from gearbench.effects.tooth_bending import ToothBending
from gearbench.errors import InputError
from gearbench.geometry.pair import Member, Pair
from gearbench.geometry.separation import separation
from gearbench.scene import Load, Resolution, Scene
from gearbench.simulation import simulate
from studies.s08_contact.data import scene

HELICAL = Pair(
    normal_module=2.0,
    helix_angle=22.0,
    face_width=12.0,
    centre_distance=45.5,
    pinion=Member(teeth=17, profile_shift=0.25, bore_diameter=20.0),
    wheel=Member(teeth=25, bore_diameter=30.0),
)
#: 2 % in the strips, enough for an answer good to 0.5 %.
COARSE = SpatialSettings(fineness=Fineness().coarser().coarser(), accuracy=0.01)


@pytest.mark.parametrize("y", [0.0, 7.0])
def test_conjugate_flanks_part_like_a_parabola(y):
    """x²/(2ρ) of the transverse profiles, at the nominal point, with the lever of the line of action."""
    meshing = HELICAL.meshing
    section = slice_at(HELICAL, (), 0.5, 0, y)
    u = meshing.path_start + 0.5 * meshing.base_pitch + y * math.tan(meshing.beta_b)
    rho = u * (meshing.tangent_length - u) / meshing.tangent_length
    x = np.linspace(-0.1, 0.1, 9)
    np.testing.assert_allclose(section.separation(x), x**2 / (2 * rho), atol=0.012 * 0.1**2 / (2 * rho))
    assert section.lever == pytest.approx(1, abs=1e-4)
    # the normals are those of the flank
    for role, gear in enumerate(HELICAL.gears):
        R = np.array([section.radii[role]])
        own = Flank(gear).normal(R, np.zeros(1))[0, :2] / math.cos(gear.beta_b)
        np.testing.assert_allclose(section.normals[role], own, atol=2e-4)


@pytest.mark.parametrize("share", [-0.2, 0.3, 0.95, 1.15])
def test_strips_lie_where_the_fast_model_has_flanks_touch(share):
    """Two kinematics of their own: a search over points, and curves of first touch in tables."""
    relief = TipRelief(amount=12.0, length=0.6)
    meshing = HELICAL.meshing
    path = meshing.path_end - meshing.path_start
    phase = share * path / meshing.base_pitch
    section = slice_at(HELICAL, (relief,), phase - math.floor(phase), math.floor(phase), 0.0)
    # here the pinion alone turns until they touch, there both do
    u = meshing.path_start + share * path + section.gap / 2
    touch = separation(HELICAL, relief.modifications(HELICAL))(np.array(u))
    assert section.gap == pytest.approx(float(touch.gap), abs=2e-7)
    assert section.lever == pytest.approx(float(touch.levers[0]), abs=1e-3)
    low, high = section.window(1.0)
    assert (abs(high) < 1e-6) == (touch.edge == 0)
    assert (abs(low) < 1e-6) == (touch.edge == 1)


def a_tooth(strip: np.ndarray, layers: np.ndarray) -> FineTooth:
    return FineTooth(gear=HELICAL.gears[0], layers=layers, strip=strip, grading=Grading(near=0.04, far=0.6, growth=0.5))


def test_a_fine_tooth_bears_strips_that_jump_and_knows_its_points():
    gear = HELICAL.gears[0]
    layers = np.array([0.0, 1.0, 4.0, 8.0, 12.0])
    R = np.array([gear.form_radius, gear.form_radius, gear.tip_radius, gear.tip_radius, gear.form_radius])
    tooth = a_tooth(np.stack([R - 0.02, R + 0.02]), layers)
    rng = np.random.default_rng(0)
    at, y = rng.uniform(gear.form_radius, gear.tip_radius, 200), rng.uniform(0, 12, 200)
    interpolation = tooth.interpolation(at, y)
    np.testing.assert_allclose(interpolation @ np.ones(tooth.space.n_nodes), 1, rtol=1e-12)
    # the flank is curved: quadratic elements pass its points by little
    np.testing.assert_allclose(interpolation @ tooth.space.node_positions, Flank(gear).position(at, y), atol=0.03)
    _, determinant = tooth.space.gradients(np.full((3, 1), 0.5))
    assert determinant.min() > 0


def test_strips_reach_where_flanks_deflect_to():
    strips = lay_strips(HELICAL, (), 0.2, 5e3, Fineness())
    assert {strip.k for strip in strips} >= {0, 1}
    for strip in strips:
        points = strip.points
        assert points.weight.sum() > 0
        # the functions of the pressure add up to one where all of a layer is near
        total = np.asarray(points.hats.sum(axis=1)).ravel()
        assert total.max() == pytest.approx(1)
        assert (np.diff(strip.layers) > 0).all()


@pytest.fixture(scope="module")
def loaded() -> Scene:
    effects = (ToothBending(model="finite_elements"), GearBody(), Hertz(), OffLineContact(), Crowning(amount=4.0))
    return Scene(pair=HELICAL, load=Load(torque=60.0), effects=effects, resolution=Resolution(positions=8, segments=60))


@pytest.mark.slow
def test_helical_phases_deflect_as_much_as_finite_elements_on_lines(loaded):
    """Within the error of the strips: one model assumes lines and a law of contact, the other neither."""
    lines = simulate(loaded, outputs=("transmission_error", "mesh_stiffness"))
    found = contact_cycle(loaded, phases=list(lines.mesh_phase.values[[1, 5]]), settings=COARSE)
    np.testing.assert_allclose(found.transmission_error, lines.transmission_error[[1, 5]], rtol=0.005)
    np.testing.assert_allclose(found.mesh_stiffness, lines.mesh_stiffness[[1, 5]], rtol=0.03)
    np.testing.assert_allclose(found.load_share.sum("pair"), 1, rtol=1e-9)
    assert found.transmission_error_uncertainty < 0.01 * found.transmission_error.mean()


@pytest.mark.slow
def test_a_spur_pair_deflects_as_much_as_another_program_finds():
    """Plane strain by CalculiX at τ = 0.325 times 1.0278, its ratio of three dimensions to two: 9.96 µm."""
    one = scene("spur")
    found = solve_spatial(one.pair, (), 0.325, (100.0,), COARSE)
    assert 1e3 * found.approach[0] == pytest.approx(9.96, rel=0.006)
    assert sum(each[0] for each in found.share.values()) == pytest.approx(1)


def test_bad_input_is_named(loaded):
    with pytest.raises(InputError, match="helix_angle"):
        contact_cycle(loaded, 1, settings=Settings())
    with pytest.raises(InputError, match="width_factor"):
        contact_cycle(loaded, 1, width_factor=1.03)
    bare = replace(loaded.pair, pinion=replace(loaded.pair.pinion, bore_diameter=None))
    fast = tuple(effect for effect in loaded.effects if effect.name == "hertz")
    with pytest.raises(InputError, match="bore_diameter"):
        contact_cycle(replace(loaded, pair=bare, effects=fast), 1)


def test_results_are_kept(tmp_path, monkeypatch):
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path))
    one = result.PhaseResult(approach=[1.0], stiffness=[2.0], share={-1: [1.0]}, radius={-1: [math.nan]})
    assert result.kept(["a", 1], lambda: one) is one
    again = result.kept(["a", 1], lambda: pytest.fail("computed twice"))
    assert again.share == one.share
    assert again.approach == one.approach
    (path,) = tmp_path.glob("*.json")
    for damaged in (b"{broken", path.read_bytes().replace(b"2.0", b"3.0")):
        path.write_bytes(damaged)
        assert result.kept(["a", 1], lambda: one) is one
