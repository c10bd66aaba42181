"""Contact finite elements: kinematics and meshes against closed forms, a solved phase against theory."""

from __future__ import annotations

import math
import shutil
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fem_reference.contact import calculix, phase
from fem_reference.contact.cycle import contact_cycle
from fem_reference.contact.deck import NodalLoad, Part, deck
from fem_reference.contact.mesh import Fineness, GearMesh, Seat, gear_mesh, half_width
from fem_reference.contact.phase import Settings, solve_phase
from fem_reference.contact.placement import Placement, Touch
from fem_reference.contact.profile import Profile
from fem_reference.contact.strip import slice_at
from fem_reference.environment import MissingDependencyError
from gearbench.effects.base import GapEffect
from gearbench.effects.tip_relief import TipRelief
from gearbench.errors import InputError
from gearbench.geometry.cutter import Cutter
from gearbench.geometry.pair import Member, Pair
from gearbench.geometry.separation import separation
from gearbench.geometry.support import Support
from studies.s08_contact.data import scene

PAIR = Pair(
    normal_module=2.0,
    face_width=20.0,
    centre_distance=65.0,
    pinion=Member(teeth=25, bore_diameter=25.0),
    wheel=Member(teeth=40, bore_diameter=40.0),
)
SHIFTED = Pair(
    normal_module=1.0,
    pressure_angle=22.5,
    face_width=8.0,
    centre_distance=30.4,
    pinion=Member(teeth=17, profile_shift=0.3, bore_diameter=8.0),
    wheel=Member(teeth=43, bore_diameter=20.0),
)
RING = Pair(
    normal_module=2.0,
    face_width=14.0,
    centre_distance=60.0,
    pinion=Member(teeth=39, profile_shift=0.2, bore_diameter=44.0),
    wheel=Member(
        teeth=-99, addendum=0.85, outer_diameter=211.0, cutter=Cutter(teeth=50), support=Support(radial=0, tangential=0)
    ),
)


def placed(pair: Pair, phase: float, *gaps: GapEffect) -> Placement:
    pinion, wheel = (Profile(pair=pair, gear=index, effects=gaps) for index in (0, 1))
    return Placement(pair=pair, phase=phase, profiles=(pinion, wheel))


def meshed(placement: Placement, index: int, touches: list[Touch], fineness: Fineness, load=(100.0, 100.0)) -> GearMesh:
    """Mesh of a gear in one mesh."""
    return gear_mesh([Seat(placement=placement, index=index, touches=touches)], load, fineness)


def parts(pair: Pair, meshes: tuple[GearMesh, ...]) -> list[Part]:
    """Pinion, turning, and wheel."""
    own = zip(meshes, pair.materials, (0.0, pair.centre_distance), (pair.gears[0].base_radius, None), strict=True)
    return [Part(name=f"G{i}", mesh=m, material=s, axis=(0.0, y), base_radius=r) for i, (m, s, y, r) in enumerate(own)]


@pytest.mark.parametrize("pair", [PAIR, SHIFTED, RING])
@pytest.mark.parametrize("phase", [0.05, 0.35, 0.8])
def test_unmodified_flanks_touch_on_the_line_of_action(pair, phase):
    placement = placed(pair, phase)
    meshing = pair.meshing
    inside = [k for k in range(3) if meshing.path_start < placement.path_position(k) < meshing.path_end]
    assert inside
    for k in inside:
        touch = placement.touch(k)
        assert abs(touch.gap) < 2e-7  # interpolation between 4000 points
        u = np.array(placement.path_position(k))
        # where flanks are conjugate the least separation is flat: s²/2ρ
        np.testing.assert_allclose(touch.radii, [float(R) for R in meshing.radii(u)], atol=2e-3)


def test_beyond_the_path_the_corner_comes_near_with_zero_slope():
    meshing = PAIR.meshing
    end = meshing.transverse_contact_ratio
    gaps = [placed(PAIR, end + x - 1).touch(1) for x in (0.01, 0.02)]
    assert gaps[0].gap > 0
    assert gaps[1].gap / gaps[0].gap == pytest.approx(4.0, rel=0.1)
    assert gaps[0].radii[0] == pytest.approx(PAIR.gears[0].tip_radius, abs=1e-9)


@pytest.mark.parametrize("share", [-0.2, 0.3, 0.95, 1.15])
def test_relieved_flanks_of_a_ring_touch_where_the_fast_model_has_them(share):
    """A search over points agrees with tabulated curves of first touch, on, before and after the path of contact."""
    relief, meshing = TipRelief(amount=12.0, length=0.6), RING.meshing
    phase = share * meshing.transverse_contact_ratio
    section = slice_at(RING, (relief,), phase - math.floor(phase), math.floor(phase), 0.0)
    u = meshing.path_start + phase * meshing.base_pitch + section.gap / 2
    touch = separation(RING, relief.modifications(RING))(np.array(u))
    assert section.gap == pytest.approx(float(touch.gap), abs=1e-6)
    assert section.lever == pytest.approx(float(touch.levers[0]), abs=1e-3)


def test_the_outside_of_a_free_ring_is_held_as_a_rigid_body():
    """All teeth are meshed without inverted elements; three equations exclude exactly the rigid-body motions."""
    placement = placed(RING, 0.3)
    touches = [touch for touch in placement.touches() if touch.gap < 0.03]
    coarse = Fineness(contact=2.0, size=0.8, growth=0.8)
    pinion, wheel = (meshed(placement, index, touches, coarse) for index in (0, 1))
    x, y = wheel.points[:, wheel.triangles[:3]]
    assert np.all((x[1] - x[0]) * (y[2] - y[0]) > (x[2] - x[0]) * (y[1] - y[0]))
    assert wheel.free is not None
    assert wheel.free.sum() == pytest.approx(math.pi * 211.0, rel=2e-3)
    text = deck(parts(RING, (pinion, wheel)), [], [NodalLoad(force=1.0)], penalty=1e6)
    block = text.split("*EQUATION\n")[2].split("*SURFACE")[0].splitlines()
    equations, at = [], 0
    while at < len(block):
        count = int(block[at])
        equations.append(np.array([row.split(",") for row in block[at + 1 : at + 1 + count]], dtype=float))
        at += count + 1
    across, up = wheel.points - np.array([[0.0], [RING.centre_distance]])
    motions = [(1 + 0 * up, 0 * up), (0 * up, 1 + 0 * up), (-up, across)]
    first = pinion.points.shape[1] + 1
    work = [[sum(f * m[int(dof) - 1][int(i) - first] for i, dof, f in eq) for m in motions] for eq in equations]
    work = np.array(work) / np.diag(work)[:, None]
    np.testing.assert_allclose(work / [[1, 1, 105.5], [1, 1, 105.5], [1 / 105.5, 1 / 105.5, 1]], np.eye(3), atol=2e-3)


@pytest.mark.parametrize("contact", [1.0, 0.35])
@pytest.mark.parametrize("phase", [0.3, 0.725])
def test_mesh_lies_on_the_flank_that_was_made(phase, contact):
    """This holds even if elements are as small as the missing material."""
    relief = TipRelief(amount=20.0, length=1.0)
    placement = placed(PAIR, phase, relief)
    touches = [touch for touch in placement.touches() if touch.gap < 0.05]
    mesh = meshed(placement, 0, touches, Fineness(contact=contact, size=0.5, growth=0.6))
    x, y = mesh.points[:, mesh.triangles[:3]]
    assert np.all((x[1] - x[0]) * (y[2] - y[0]) > (x[2] - x[0]) * (y[1] - y[0]))
    start, end = mesh.points[:, mesh.triangles[[0, 1, 2]]], mesh.points[:, mesh.triangles[[1, 2, 0]]]
    bow = np.linalg.norm(mesh.points[:, mesh.triangles[3:]] - (start + end) / 2, axis=0)
    assert (bow / np.linalg.norm(end - start, axis=0)).max() < 0.2  # each middle belongs to its edge
    gear, profile = PAIR.gears[0], placement.profiles[0]
    for k, edges in zip((touch.pair for touch in touches), mesh.surfaces.values(), strict=True):
        t, e = edges.T
        nodes = np.unique([mesh.triangles[e, t], mesh.triangles[(e + 1) % 3, t], mesh.triangles[3 + e, t]])
        R, angle = np.hypot(*mesh.points[:, nodes]), np.arctan2(*mesh.points[:, nodes])
        on_flank = (gear.form_radius + 1e-6 < R) & (gear.tip_radius - 1e-6 > R)
        centre = placement.rotations[0] + 2 * np.pi / gear.teeth * placement.tooth(0, k)
        made = profile.angle(R[on_flank], k)
        np.testing.assert_allclose(angle[on_flank] - centre, made, atol=1e-9)
        assert on_flank.sum() > 10
        assert profile.missing(R[on_flank], k).max() > 0.01


def test_triangles_are_small_where_a_tip_touches():
    """A sixteenth of those in the strip of the pair that touches amid its flanks."""
    fineness, load = Fineness(contact=0.5, size=0.5, growth=0.6), 100.0
    placement = placed(PAIR, PAIR.meshing.transverse_contact_ratio % 1 + 0.03)
    touches = [touch for touch in placement.touches() if touch.gap < 0.01]
    (at_tip,) = (touch for touch in touches if touch.radii[0] > PAIR.gears[0].tip_radius - 1e-9)
    for index in (0, 1):
        mesh = meshed(placement, index, touches, fineness)
        corners = mesh.points[:, mesh.triangles[:3]]
        sides = np.hypot(*(corners - np.roll(corners, 1, axis=1)))
        usual = fineness.contact * half_width(placement, at_tip, load)
        assert sides.min() == pytest.approx(usual / 16, rel=0.4)


def test_bore_of_the_pinion_turns_as_one_body():
    placement = placed(PAIR, 0.3)
    touches = [touch for touch in placement.touches() if touch.gap < 0.05]
    coarse = Fineness(contact=2.0, size=0.8, growth=0.8)
    pinion, wheel = (meshed(placement, index, touches, coarse) for index in (0, 1))
    lines = deck(parts(PAIR, (pinion, wheel)), [], [NodalLoad(force=1.0)], penalty=1e6).splitlines()
    q = pinion.points.shape[1] + wheel.points.shape[1] + 1
    moved = np.zeros((2, pinion.points.shape[1]))
    for node, turn in pairwise(line.split(",") for line in lines):
        if turn[:2] == [str(q), " 1"] and len(turn) == len(node) == 3:
            moved[int(node[1]) - 1, int(node[0]) - 1] = -float(turn[2])
    x, y = pinion.points[:, pinion.bore]
    np.testing.assert_allclose(moved[:, pinion.bore], np.array([y, -x]) / PAIR.gears[0].base_radius, atol=1e-12)
    assert np.count_nonzero(np.abs(moved).sum(axis=0)) == len(pinion.bore)
    assert np.allclose(np.hypot(x, y), 12.5)


PRINTED = """
 displacements (vx,vy,vz) for set MOTION and time  0.1000000E+01

     18544  9.707483E-03  0.000000E+00  0.000000E+00
     18545 -2.500000E-03  0.000000E+00  0.000000E+00
     18546  1.400000E-03 -3.100000E-04  0.000000E+00


 statistics for slave set PINIONP0, master set WHEELP0 and time  0.1000000E+01

   total surface force (fx,fy,fz) and moment about the origin (mx,my,mz)

   -1.935225E+03 -7.059036E+02  1.832088E-16  1.416820E-06 -3.877113E-06  4.839123E+04

   center of gravity and mean normal

   -3.084538E+00  2.388100E+01  5.289601E-14  9.394598E-01  3.426522E-01  1.978575E-18
"""


def test_what_calculix_prints_is_read():
    (step,) = calculix.read(PRINTED, ["P0"])
    assert step.rotation == 9.707483e-3
    assert step.motions[1:] == [(-2.5e-3, 0.0), (1.4e-3, -3.1e-4)]
    assert step.force == {"P0": (-1935.225, -705.9036)}
    assert step.moment == {"P0": 48391.23}
    assert step.centre == {"P0": (-3.084538, 23.881)}
    assert calculix.read(PRINTED, ["P0", "P1"]) == []


def test_parts_of_a_load_step_are_not_taken_for_steps():
    part = PRINTED.replace("time  0.1000000E+01", "time  0.2500000E+00").replace("9.707483E-03", "2.000000E-03")
    nearly = part.replace("time  0.2500000E+00", "time  0.1000000E+01")
    assert [step.rotation for step in calculix.read(part + nearly + PRINTED, ["P0"])] == [9.707483e-3]


def test_calculix_that_is_not_installed_is_named(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(MissingDependencyError, match="apt-get install calculix-ccx"):
        calculix.executable()


def test_elements_suit_each_load_they_carry(monkeypatch, tmp_path):
    """Torques on one mesh differ by a factor of five at most; elements suit the least and reach for the greatest."""
    meshes: list[tuple[float, float]] = []

    def solved(forces: list[float], pairs: list[str]) -> list[calculix.StepResult]:
        moment, nothing = dict.fromkeys(pairs, 1.0), dict.fromkeys(pairs, (0.0, 0.0))
        return [
            calculix.StepResult(motions=[(1e-6 * f, 0.0)], force=nothing, moment=moment, centre=nothing) for f in forces
        ]

    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path))
    monkeypatch.setattr(phase, "version", lambda: "none")
    monkeypatch.setattr(phase, "gear_mesh", lambda *given: meshes.append(given[1]))
    monkeypatch.setattr(phase, "deck", lambda own, contacts, steps, **_: [step.force for step in steps])
    monkeypatch.setattr(phase, "run", solved)
    torques = (10.0, 50.0, 60.0, 200.0)
    found = solve_phase(PAIR, (), 0.3, torques, Settings())
    loads = [0.5e3 * torque / PAIR.gears[0].base_radius / PAIR.face_width for torque in torques]
    np.testing.assert_allclose(meshes, [loads[:2]] * 2 + [loads[2:]] * 2)
    np.testing.assert_allclose(found.stiffness, 1e6)
    np.testing.assert_allclose([sum(each) for each in zip(*found.share.values(), strict=True)], 1)

    placement = placed(PAIR, 0.3)
    a, wide = (half_width(placement, placement.touch(0), q) for q in (10.0, 40.0))
    mesh = meshed(placement, 0, placement.touches()[:1], Settings().fineness, (10.0, 40.0))
    k, edges = placement.touches()[0].pair, next(iter(mesh.surfaces.values()))
    ends = np.array([[mesh.triangles[(edge + i) % 3, t] for i in range(2)] for t, edge in edges])
    middle = mesh.points[:, ends].mean(axis=2)
    length = np.hypot(*np.diff(mesh.points[:, ends], axis=2)[..., 0])
    near = np.abs(np.hypot(*middle) - placement.touch(k).radii[0]) < wide / 2
    assert near.any()
    # gmsh makes edges a quarter longer than it is asked to
    assert length[near].max() < 1.3 * Settings().fineness.contact * a


def test_bad_input_is_refused():
    spur = scene()
    helical = replace(spur, pair=replace(spur.pair, helix_angle=1.0, centre_distance=65.1))
    with pytest.raises(InputError, match="plane strain"):
        contact_cycle(helical, settings=Settings())
    sprung = replace(RING.wheel, support=Support(radial=1.0, tangential=1.0))
    with pytest.raises(InputError, match="firm or a free"):
        contact_cycle(replace(spur, pair=replace(RING, wheel=sprung)), settings=Settings())
    with pytest.raises(InputError, match="rise"):
        contact_cycle(spur, torques=(100.0, 50.0))


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
def test_a_phase_with_contact_on_the_line(tmp_path, monkeypatch):
    """In double contact all contact is on the line of action, so 3D teeth with contact on the line are right there."""
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path))
    coarse = Settings(fineness=Fineness(contact=0.5, size=0.5, growth=0.5))
    found = solve_phase(PAIR, (), 0.3, (100.0,), coarse)
    # solid teeth on their bodies, 9.93 µm, less the free faces (1.0278)
    assert 1e3 * found.approach[0] == pytest.approx(9.93 / 1.0278, rel=0.01)
    assert sum(share[0] for share in found.share.values()) == pytest.approx(1.0)
    for k in (0, 1):
        u = PAIR.meshing.path_start + (0.3 + k) * PAIR.meshing.base_pitch
        assert found.radius[k][0] == pytest.approx(np.hypot(PAIR.gears[0].base_radius, u), abs=0.02)
    # forces add to the torque: the stiffness is that of a law that hardens a little
    mean = 1e5 / PAIR.gears[0].base_radius / found.approach[0]
    assert 1.0 < found.stiffness[0] / mean < 1.15
    assert len(list(tmp_path.glob("contact-*.json"))) == 1
    monkeypatch.setattr("fem_reference.contact.phase.run", None)
    assert solve_phase(PAIR, (), 0.3, (100.0,), coarse) == found
