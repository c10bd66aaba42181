"""Hunting cycles of planetary sets and parallel paths: teeth meet one mate after the other, planets pass the ring."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import hunting_cycle, simulate
from gearbench.errors import InputError
from gearbench.hunting.figures import draw_side_bands
from gearbench.scene_file import parse_scene
from tests.test_planetary import LINEAR, tables

#: Sun, planet and ring of few teeth; planets are not in phase, whatever their number.
TEETH = (18, 18, 54)
RNG = np.random.default_rng(5)
PITCH = {
    name: RNG.normal(0, 1.5, z).round(2).tolist() for name, z in zip(("sun", "planet", "ring"), TEETH, strict=True)
}


def made(errors, teeth=TEETH, **keys):
    """A set whose members have these pitch errors [µm]."""
    given = tables(teeth, **{"planets": 4, "torque": 600.0} | {k: v for k, v in keys.items() if k != "resolution"})
    given["resolution"] = keys.get("resolution", given["resolution"])
    for name, values in errors.items():
        given["planetary"][name]["pitch_errors"] = values
    return parse_scene(given)


def begun(errors, cycle):
    """The same errors, seen so many mesh cycles later."""
    return {name: np.roll(values, -cycle).tolist() for name, values in errors.items()}


@pytest.mark.parametrize("helix", [0.0, 20.0])
def test_each_mesh_cycle_is_the_set_simulated_with_the_teeth_that_it_has(helix):
    keys = {"floating": ["sun"], "pin_stiffness": 200.0, "phases": 5}
    if helix:
        keys |= {
            "helix_angle": helix,
            "centre_distance": 36.0 / math.cos(math.radians(helix)),
            "planets": 3,
            "positions": [0, 100, 180],
        }
    whole = hunting_cycle(made(PITCH, **keys))
    assert whole.sizes["cycle"] == 54
    for cycle in (0, 7, 53):
        alone = simulate(made(begun(PITCH, cycle), **keys), outputs=["transmission_error"])
        for name in ("train_transmission_error", "load_sharing"):
            wanted = alone[name].values
            assert_allclose(whole[name].isel(cycle=cycle), wanted, rtol=1e-8, atol=1e-8 * np.abs(wanted).max())


@pytest.mark.parametrize(("gear", "first"), [("sun", 0), ("ring", 4)])
def test_a_tooth_meets_planet_after_planet(gear, first):
    """The same dip of the load at the next planet, z/4 mesh periods later: 4½, and 13½."""
    z = dict(zip(("sun", "planet", "ring"), TEETH, strict=True))[gear]
    whole = hunting_cycle(made({gear: [8.0] + [0.0] * (z - 1)}, phases=8, pin_stiffness=300.0))
    load = whole["load_sharing"].values.reshape(8, -1)
    assert np.ptp(load) > 0.05
    for planet in range(4):
        # the sun turns towards the next planets, the ring away from them
        later = (8 * planet * z // 4) * (1 if gear == "sun" else -1)
        assert_allclose(load[first + planet], np.roll(load[first], later), atol=1e-8)


def test_a_tooth_of_a_planet_meets_the_ring_half_a_turn_after_the_sun():
    """Its driven flank is at the sun, its driving one at the ring: each of them passes once in a revolution."""
    whole = hunting_cycle(
        made({"planet": [0.0] * 17 + [-3.0]}, phases=8, planets=1, effects={"hertz": {"law": "yang_sun"}})
    )
    error = whole["train_transmission_error"].values.reshape(54, 8)
    assert_allclose(error[:18], error[18:36], atol=1e-9)
    still = simulate(made({}, phases=8, planets=1), outputs=["transmission_error"])["train_transmission_error"].values
    pushed = np.abs(error[:18] - still).ravel() > 1e-3
    # two stretches of some 1.6 mesh periods, 9 periods from middle to middle less what both lines of action differ by
    runs = np.flatnonzero(np.diff(np.append(pushed, pushed[0]).astype(int)) == 1)
    assert len(runs) == 2
    assert abs(np.diff(runs)[0] / 8 - 9.0) < 1.5


def test_side_bands_of_a_gear_are_its_orders():
    found = hunting_cycle(made({"sun": PITCH["sun"]}, phases=6))
    order = found["member_order"].sel(member="sun").values
    own = np.isclose(order, np.round(order))
    amplitude = found["train_transmission_error_order_amplitude"].values
    assert amplitude[own].max() > 0.05
    assert amplitude[~own].max() < 1e-9


def test_planets_that_pass_leave_side_bands_at_multiples_of_their_number():
    """Evenly spaced planets alike: of the orders of the carrier those that N divides are left (M3).

    With 51 teeth and four planets the mesh order itself is silent, and what is heard is 48 and 52.
    """
    found = hunting_cycle(made({}, (17, 17, 51), resolution={"gauss_points": 4}))
    assert found.sizes["cycle"] == 51
    order, amplitude = found["mesh_order"].values * 51, found["passing_force_order_amplitude"].values
    # the window has kinks of its second derivative amid the panels
    heard = {round(each) for each in order[amplitude > 1e-4 * amplitude.max()]}
    assert {48, 52} < heard
    assert not any(each % 4 for each in heard)
    assert amplitude[order.round() == 52] > 1.0


def test_the_figure_shows_both_curves_and_names_their_orders(monkeypatch, tmp_path):
    figures = []
    monkeypatch.setattr("gearbench.hunting.figures.write_figure", lambda figure, _: figures.append(figure))
    draw_side_bands(hunting_cycle(made({"sun": PITCH["sun"]}, phases=4)), tmp_path)
    error, passing = figures[0].axes
    drawn = {line.get_label() for line in (*error.get_lines(), *passing.get_lines())}
    assert drawn == {text.get_text() for text in figures[0].legends[0].get_texts()}
    assert "orders of ring" in drawn


def test_a_set_with_too_many_cycles_is_refused_by_its_teeth():
    with pytest.raises(InputError, match=r"planetary\.ring\.teeth = -97: 107670 mesh cycles"):
        hunting_cycle(made({}, (37, 30, 97), planets=3, run_out={"sun": 5.0, "planet": [5.0, 0.0, 0.0]}))


def test_teeth_that_are_alike_have_no_side_bands():
    own, coaxial = {"normal_module": 2.0, "face_width": 42.0}, {"face_width": 20.0, "teeth": 20}
    gears = {name: own | {"teeth": 30} for name in "bc"}
    gears |= {name: own | coaxial | {"axial_offset": at} for name, at in (("a", -11.0), ("d", 11.0))}
    meshes = [
        {"driver": "a", "driven": n, "centre_distance": 50.0, "direction": d} for n, d in (("b", 0.0), ("c", 180.0))
    ]
    meshes += [
        {"driver": n, "driven": "d", "centre_distance": 50.0, "direction": d} for n, d in (("b", 180.0), ("c", 0.0))
    ]
    scene = parse_scene({"gears": gears, "meshes": meshes, "load": {"torque": 50.0}, "effects": LINEAR})
    with pytest.raises(InputError, match="all teeth are alike: must have pitch_errors, random_pitch or waviness"):
        hunting_cycle(scene)
