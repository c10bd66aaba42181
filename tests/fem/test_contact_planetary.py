"""One planet between sun and ring by contact finite elements, against the coupled contact problem of a set."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from fem_reference.contact.mesh import Fineness, gear_mesh
from fem_reference.contact.phase import Settings
from fem_reference.section import Side
from gearbench.scene_file import parse_scene
from gearbench.trains.solve import solve_train
from tests.support.planetary_contact import seated, solve_set

#: Load of the sun [N·m/mm], stiffness of the pin [N/µm per mm of face width].
LOAD, PIN = 5.0, 30.0


def planetary(width: float):
    """Spur set 24/30/−84 with one planet; the ring's tips stay clear of the planet's fillets."""
    own = {"normal_module": 2.0, "face_width": width, "planets": 1, "pin_stiffness": PIN * width}
    gears = {"sun": {"teeth": 24, "bore_diameter": 20.0}, "planet": {"teeth": 30, "bore_diameter": 24.0}}
    ring = {"teeth": -84, "addendum": 0.7, "outer_diameter": 196.0}
    effects = {"tooth_bending": {"model": "solid"}, "gear_body": {}, "hertz": {}, "off_line_contact": {}}
    more = {"load": {"torque": LOAD * width}, "resolution": {"positions": 48, "segments": 15}}
    return parse_scene({"planetary": {**own, **gears, "ring": ring}, "effects": effects, **more})


def pairs():
    sun_planet, planet_ring = (mesh.pair for mesh in planetary(10.0).geometry.meshes)
    return sun_planet, planet_ring


@pytest.mark.slow
@pytest.mark.parametrize("phase", [0.1, 0.7])
def test_one_planet_lies_between_sun_and_ring(phase):
    """Both flanks of its teeth meet those of its mates, its bore is at its axis, and no element is inverted."""
    seats = seated(pairs(), phase, 200.0)
    assert seats[2].side is Side.LEFT
    coarse = Fineness(contact=2.0, size=0.8, growth=0.8)
    sun, planet, ring = (gear_mesh(own, (100.0, 100.0), coarse) for own in (seats[:1], seats[1:3], seats[3:]))
    for mesh in (sun, planet, ring):
        x, y = mesh.points[:, mesh.triangles[:3]]
        assert np.all((x[1] - x[0]) * (y[2] - y[0]) > (x[2] - x[0]) * (y[1] - y[0]))
    np.testing.assert_allclose(np.hypot(*(planet.points[:, planet.bore] - [[0.0], [54.0]])), 12.0, rtol=1e-9)
    for seat, mate in ((seats[0], sun), (seats[3], ring)):
        for touch in seat.touches:
            own, other = (
                mesh.points[:, np.unique(mesh.triangles[:, mesh.surfaces[seat.label(touch.pair)][:, 0]])]
                for mesh in (planet, mate)
            )
            apart = np.linalg.norm(own[:, :, None] - other[:, None], axis=0).min()
            assert apart < touch.gap + 0.1  # corners of elements of a fifth of a module


@pytest.mark.parametrize("phase", [0.1, 0.7])
def test_phases_of_both_meshes_are_those_of_the_train(phase):
    seats, train = seated(pairs(), phase, 200.0), planetary(10.0).geometry
    inside, outside = seats[0].placement, seats[3].placement
    pitch = inside.pair.meshing.base_pitch
    shift = inside.phase - outside.advance / pitch - phase
    sun, ring = train.phases(coast=False).values()
    assert (shift - (sun - ring) + 0.5) % 1.0 - 0.5 == pytest.approx(0.0, abs=1e-9)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
def test_a_set_is_that_of_contact_finite_elements():
    """Rotations of sun and planet, pin and forces; gears so wide that they are in plane strain.

    Phases are compared half-way between ring and sun, as for pairs.
    """
    wide = solve_train(planetary(500.0))
    phases, (sun, planet, _, pin) = wide.phases.phase, wide.cycle.motion.T
    gears, found = pairs(), []
    settings = Settings(fineness=Fineness(contact=0.5, size=0.5, growth=0.5))
    for phase in (0.0, 0.25, 0.625, 0.75):
        one = solve_set(gears, phase, 10.0 * LOAD, pin=1e4 * PIN, settings=settings)
        at = one.phase[0] + one.sun / 2 / gears[0].meshing.base_pitch
        r_s, r_p = (gear.base_radius for gear in gears[0].gears)
        fast = [np.interp(at, phases, curve, period=1.0) for curve in (r_s * sun, -r_p * planet, pin)]
        found.append([one.sun, one.planet, one.pin[0], *fast])
        np.testing.assert_allclose(one.force, 1e4 * LOAD / r_s, rtol=3e-3)  # small elements at tips that touch
    exact, fast = np.array(found).reshape(-1, 2, 3).swapaxes(0, 1)
    np.testing.assert_allclose(fast, exact, rtol=0.006)
