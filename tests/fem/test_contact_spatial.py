"""Contact finite elements of finite width, against closed forms, fine meshes, plane strain and contact lines."""

from __future__ import annotations

import math
import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fem_reference.contact import result
from fem_reference.contact.cycle import contact_cycle
from fem_reference.contact.laying import Fineness, LineLoad, first_laying, lay_strips, nearest
from fem_reference.contact.phase import Settings, solve_phase
from fem_reference.contact.spatial import SpatialSettings, StripError, solve_spatial
from fem_reference.contact.strip import slice_at
from fem_reference.contact.tooth import FineTooth, Grading
from fem_reference.flank import Flank
from gearbench.effects.base import GapEffect
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
from gearbench.scene_file import parse_scene
from gearbench.simulation import simulate
from gearbench.validation.contact import model_cycle
from studies.s08_contact.data import scene
from tests.geometry.test_internal import example
from tests.support.node_positions import node_positions

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
    for index, gear in enumerate(HELICAL.gears):
        R = np.array([section.radii[index]])
        own = Flank(gear).normal(R, np.zeros(1))[0, :2] / math.cos(gear.beta_b)
        np.testing.assert_allclose(section.normals[index], own, atol=2e-4)


@pytest.mark.parametrize("share", [-0.2, 0.3, 0.95, 1.15])
def test_strips_lie_where_the_fast_model_has_flanks_touch(share):
    """Two independent kinematics agree: a search over points, and tabulated curves of first touch."""
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


@pytest.mark.parametrize(("share", "small"), [(0.5, 1.0), (-0.1, 1 / 16), (1.1, 1 / 16)])
def test_cells_are_small_at_an_edge_that_touches(share, small):
    meshing = HELICAL.meshing
    phase = share * (meshing.path_end - meshing.path_start) / meshing.base_pitch
    section = slice_at(HELICAL, (), phase - math.floor(phase), math.floor(phase), 0.0)
    ends = section.cells(0.5, 24)
    assert (ends[0], ends[-1]) == pytest.approx(section.window(0.5))
    # the window is half as long as amid the flank and has as many cells
    usual, size = 1.0 / 24, np.diff(ends)
    assert size.min() / usual == pytest.approx(small, rel=0.3)
    assert size.max() < 1.01 * usual
    assert (size[1:] / size[:-1]).max() < 1.6
    assert (size[:-1] / size[1:]).max() < 1.6


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
    np.testing.assert_allclose(interpolation @ node_positions(tooth.space), Flank(gear).position(at, y), atol=0.03)
    _, determinant = tooth.space.gradients(np.full((3, 1), 0.5))
    assert determinant.min() > 0


def line_load(low: float, high: float, count: int = 9, q: float = 100.0) -> LineLoad:
    y = np.linspace(0.0, 12.0, count)
    return LineLoad(y=y, q=np.where((y > low) & (y < high), q, 0.0))


def test_a_laying_that_suffices_stays_and_one_that_does_not_is_corrected():
    laying, sections = first_laying(HELICAL, (), 0.2, 5e3)
    least = nearest(sections)
    assert least == pytest.approx(0, abs=2e-7)
    whole = {0: line_load(-1, 13)}
    assert laying.corrected(laying.reach, whole, Fineness(), least) == laying
    deeper = laying.corrected(1.5 * laying.reach, whole, Fineness(), least)
    assert deeper.reach > 1.5 * laying.reach
    # a strip of two half-widths holds one of 1.67
    wider = laying.corrected(laying.reach, {0: line_load(-1, 13, q=3.0 * laying.load)}, Fineness(), least)
    assert (wider.load, wider.reach) == (3.0 * laying.load, laying.reach)
    short = laying.corrected(laying.reach, {0: line_load(5, 7), 1: line_load(0, 1, q=5.0)}, Fineness(), least)
    assert short.patches == {0: (4.5, 7.5)}


def test_layers_end_where_lines_cross_the_beginning_of_a_relief():
    """The load has a kink there; a layer across it would make the gears too compliant."""
    relief, meshing = TipRelief(amount=10.0, length=0.5), HELICAL.meshing
    laying, sections = first_laying(HELICAL, (relief,), 0.2, 2000.0)
    seen = 0
    for strip in lay_strips(HELICAL, (relief,), 0.2, laying, sections, Fineness()):
        start = meshing.path_start + (0.2 + strip.k) * meshing.base_pitch
        for y in (np.array(relief.kinks(HELICAL)) - start) / math.tan(meshing.beta_b):
            if 0.5 < y < HELICAL.face_width - 0.5:
                i, seen = int(np.argmin(np.abs(strip.layers - y))), seen + 1
                assert strip.layers[i] == pytest.approx(y, abs=1e-9)
                assert np.diff(strip.layers)[i - 1 : i + 1].max() < 0.6 * Fineness().layer * HELICAL.normal_module
    assert seen


def test_layers_crowd_where_a_patch_is_short():
    """Inner ends of layers resolve the patch, no layer is thicker than before, and both faces remain."""
    laying, sections = first_laying(HELICAL, (), 0.5, 5e3)
    fine, coarse = Fineness(), Fineness().coarser()
    before = {strip.k: strip.layers for strip in lay_strips(HELICAL, (), 0.5, laying, sections, fine)}
    there = replace(laying, patches={0: (4.5, 6.0)})
    after = {strip.k: strip.layers for strip in lay_strips(HELICAL, (), 0.5, there, sections, fine)}
    inside = {name: int(((y >= 4.5) & (y <= 6.0)).sum()) for name, y in (("before", before[0]), ("after", after[0]))}
    assert inside["before"] <= 2
    assert inside["after"] >= 13
    assert (after[0][0], after[0][-1]) == (0.0, 12.0)
    assert np.diff(after[0]).max() <= 1.2 * np.diff(before[0]).max()
    some = next(strip for strip in lay_strips(HELICAL, (), 0.5, there, sections, coarse) if strip.k == 0)
    assert np.diff(some.layers).min() == pytest.approx(math.sqrt(2) * np.diff(after[0]).min(), rel=0.1)


def test_strips_that_never_suffice_are_told(tmp_path, monkeypatch):
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path))
    monkeypatch.setattr("fem_reference.contact.spatial.bodies_of", lambda pair, accuracy: None)
    monkeypatch.setattr("fem_reference.contact.spatial.strip_compliance", lambda strips, bodies, fineness: None)
    monkeypatch.setattr("fem_reference.contact.spatial.balance", lambda pair, strips, C, force: _far(strips))
    with pytest.raises(StripError, match=r"mesh phase 0\.2: .* after 5 attempts"):
        solve_spatial(HELICAL, (), 0.2, (100.0,), COARSE)


def _far(strips):
    """Flanks whose approach always exceeds the one for which strips were made."""
    return SimpleNamespace(approach=2 * strips[0].reach, loads={0: line_load(-1, 13, q=1.0)})


def test_meshes_are_refined_until_the_error_bar_is_met(monkeypatch, loaded):
    """With meshes off by 4 % and bodies by 1/40 of their accuracy, only meshes are refined, twice by √2."""
    asked = []

    def solve(pair, gaps, phase, torques, settings):
        asked.append((phase, settings))
        q = 0.01 * (1 - 0.04 * (settings.fineness.size / 0.3) ** 2 - 0.025 * settings.accuracy)
        return result.PhaseResult(approach=[q], stiffness=[1e5], share={0: [1.0]}, radius={0: [17.0]})

    monkeypatch.setattr("fem_reference.contact.cycle.solve_spatial", solve)
    start = SpatialSettings(fineness=Fineness())
    found = contact_cycle(loaded, 4, settings=start, error_bar=0.02)
    assert asked[-1][1].fineness.size == pytest.approx(0.15)
    assert asked[-1][1].accuracy == start.accuracy
    bar = float(found.transmission_error_uncertainty / found.transmission_error.mean())
    assert bar == pytest.approx(0.0102 / 0.98995, rel=1e-6)
    # phases other than the three that tell the error are solved on the last mesh alone
    assert len(asked) == 3 * 3 * 3 + 4
    asked.clear()
    rough = contact_cycle(loaded, 4, settings=start, error_bar=1e-9)
    assert float(rough.transmission_error_uncertainty) > 0
    assert len(asked) == 4 * 3 * 3 + 4


@pytest.fixture(scope="module")
def loaded() -> Scene:
    effects = (ToothBending(model="finite_elements"), GearBody(), Hertz(), OffLineContact(), Crowning(amount=4.0))
    return Scene(pair=HELICAL, load=Load(torque=60.0), effects=effects, resolution=Resolution(positions=8, segments=60))


@pytest.mark.slow
def test_helical_phases_deflect_as_much_as_finite_elements_on_lines(loaded):
    """They agree within the error of the strips, although only one model assumes contact lines and a contact law."""
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


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
def test_a_strip_on_a_kink_is_pressed_in_as_much_as_in_plane_strain():
    """From amid the flank to where a relief begins under a tenth of the load: CalculiX on a mesh fine enough for it.

    Pressures on a third as many cells have 5 % more.
    """
    one = scene("spur_relief")
    gaps = tuple(effect for effect in one.flank_effects if isinstance(effect, GapEffect))
    strips = SpatialSettings(fineness=Fineness(layer=3.0))
    q = [solve_spatial(one.pair, gaps, phase, (10.0,), strips).approach[0] for phase in (0.65625, 0.40625)]
    plane = [solve_phase(one.pair, gaps, phase, (10.0,), Settings()).approach[0] for phase in (0.65625, 0.40625)]
    # both in units of what the tooth is pressed in amid the flank
    assert q[1] / q[0] - 1 == pytest.approx(plane[1] / plane[0] - 1, rel=0.02)


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
    path.write_bytes(path.read_bytes()[:-5])
    assert result.kept(["a", 1], lambda: one) is one


def ring_pair(width: float, torque: float, **more) -> Scene:
    """Planet and ring of ``examples/ring.toml`` with other sizes (pair__…) if given; without relief if not."""
    tables = example(pair__face_width=width, load__torque=torque, **more)
    if not any(key.startswith("effects") for key in more):
        tables["effects"].pop("tip_relief")
    return parse_scene(tables)


FREE = {"pair__wheel__outer_diameter": 210.0, "pair__wheel__support": {"radial": 0.0, "tangential": 0.0}}
INCLINED = {"pair__helix_angle": 15.0, "pair__centre_distance": 62.1, "pair__wheel__outer_diameter": 226.0}
RELIEVED = {"effects__tip_relief": {"amount": 12.0, "length": 0.7}}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("more", "torque", "phase", "tolerance"),
    [
        ({}, 150.0, 0.34, 0.003),
        ({}, 168.0, 0.8125, 0.005),
        (INCLINED, 150.0, 0.45, 0.003),
        (FREE, 100.0, 0.1, 0.01),
        (RELIEVED, 168.0, 0.3, 0.008),
    ],
)
def test_internal_pairs_deflect_as_much_as_fast_teeth_off_the_line(more, torque, phase, tolerance):
    """Spur, also where tips of both gears touch, helical, spur with a free rim of 1.5 modules, and relieved.

    Half-way between the phases of both gears.
    """
    one = ring_pair(14.0, torque, **more)
    gaps = tuple(effect for effect in one.flank_effects if isinstance(effect, GapEffect))
    found = solve_spatial(
        one.pair, gaps, phase, (torque,), SpatialSettings(fineness=Fineness().coarser(), accuracy=0.005)
    )
    ahead = found.approach[0] / one.pair.meshing.base_pitch
    # as many segments as by default: five are too few for even loads on wide faces
    fast = model_cycle(replace(one, resolution=Resolution(positions=6)), np.array([phase + ahead / 2]))
    assert 1e3 * found.approach[0] == pytest.approx(fast.transmission_error[0], rel=tolerance)
