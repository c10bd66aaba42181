"""Stepped planets: two gears on each pin, meshes of two frequencies; against closed forms and the meshes alone."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import hunting_cycle, robust, simulate
from gearbench.errors import InputError
from gearbench.exchange.rexs_write import write_rexs
from gearbench.optimisation.numbers import mass
from gearbench.scene_file import parse_scene
from gearbench.trains.solve import solve_train
from tests.test_planetary import tables

#: Sun, planet at the sun and at the ring, ring: 3 mesh periods of the sun while the ring has 2.
TEETH = (24, 36, 24, 84)
ELASTIC = {"tooth_bending": {}, "hertz": {}}


def stepped(teeth=TEETH, **keys):
    """A set of module 2, whose ring has other angles than its sun."""
    sun, planet, second, ring = teeth
    at_ring = {"teeth": second, "pressure_angle": 22.5} | keys.pop("at_ring", {})
    return tables((sun, planet, ring), planet_at_ring=at_ring, **keys)


def solved(*args, **keys):
    return solve_train(parse_scene(stepped(*args, **keys)))


@pytest.mark.parametrize("held", ["ring", "carrier", "sun"])
def test_speeds_follow_from_willis_and_power_in_is_power_out(held):
    scene = parse_scene(stepped(held=held))
    n = {name: float(rate) for name, rate in scene.geometry.rates.items()}
    ratio = 36 * 84 / (24 * 24)
    assert n["sun"] - n["carrier"] == pytest.approx(-ratio * (n["ring"] - n["carrier"]))
    assert n[held] == 0.0
    whole = simulate(scene, outputs=["transmission_error"])
    torque = whole["member_torque"].transpose("member", ...)
    assert_allclose(torque.sel(member="ring"), -200.0 * ratio, rtol=1e-12)
    # of the meshes on the members; planets are in balance
    power = sum(n[name] * torque.sel(member=name) for name in ("sun", "ring", "carrier"))
    assert_allclose(power, 0.0, atol=1e-9 * 200.0)
    assert_allclose(torque.sel(member=["planet 1", "planet 2", "planet 3"]), 0.0, atol=1e-9 * 200.0)


@pytest.mark.parametrize("helix", [0.0, 20.0])
def test_equal_steps_are_a_simple_set(helix):
    own = {"planets": 3, "effects": {**ELASTIC, "off_line_contact": {}}, "helix_angle": helix}
    own["centre_distance"] = 68.0 / math.cos(math.radians(helix))
    teeth, relief = (37, 31, 99), {"tip_relief": {"amount": 10.0, "length": 0.8}}
    found = []
    for more in ({}, {"planet_at_ring": {"teeth": 31, **relief}}):
        given = tables(teeth, **own, **more)
        given["planetary"]["planet"] |= relief
        found.append(solve_train(parse_scene(given | {"resolution": {"gauss_points": 3}})))
    one, two = found
    assert_allclose(two.phases.phase, one.phases.phase, atol=1e-12)
    assert_allclose(two.balance.force, one.balance.force, rtol=1e-10)
    assert_allclose(two.cycle.transmission_error, one.cycle.transmission_error, rtol=1e-10)


def middles(train, name, phase):
    """Polar angle of the middle of a planet's tooth in contact, from the point of contact on the line of action."""
    mesh = train[name]
    pair, internal = mesh.pair, mesh.pair.is_internal
    planet = pair.gears[0 if internal else 1]
    axis = train.places[train.shaft(mesh.driver if internal else mesh.driven)]
    out = axis / np.linalg.norm(axis)
    ahead, alpha = np.array([-out[1], out[0]]), pair.meshing.alpha_wt
    pitch = axis + out * planet.base_radius / math.cos(alpha) * (1 if internal else -1)
    push = out * math.sin(alpha) + ahead * math.cos(alpha) * (-1 if internal else 1)
    u = pair.meshing.path_start + phase * pair.meshing.base_pitch - pair.gears[0].base_radius * math.tan(alpha)
    x, y = pitch + u * push - axis
    # a planet turns against the sun: the tooth is ahead of the flank that the sun pushes, behind the one at the ring
    half = float(planet.half_angle(math.hypot(x, y)))
    return math.atan2(y, x) + (half if internal else -half)


@pytest.mark.parametrize("positions", [None, [0, 1001 * 360 / 3660, 2501 * 360 / 3660]])
def test_phases_keep_teeth_of_both_gears_in_line_on_all_planets(positions):
    keys = {} if positions is None else {"positions": positions}
    teeth = (23, 37, 24, 84)
    train = parse_scene(stepped(teeth, **keys)).geometry
    phases, angles = train.phases(), 37 * 24  # angles between teeth of 37 and 24
    for n in (1, 2, 3):
        names = f"sun to planet {n}", f"planet {n} at ring to ring"
        one, two = (middles(train, name, phases[name]) for name in names)
        apart = angles * (one - two) / (2 * math.pi)
        assert apart == pytest.approx(round(apart), abs=1e-6)
    assert train.periods["sun to planet 1"] == 37
    assert train.periods["planet 1 at ring to ring"] == 24


@pytest.mark.parametrize(("teeth", "steps"), [((24, 36, 24, 84), 300), ((23, 37, 24, 84), 3660)])
def test_planets_fit_at_steps_of_the_tooth_numbers(teeth, steps):
    """(z_s z_q + |z_r| z_p)/gcd(z_p, z_q), see M5."""
    keys = {"phases": 1}
    solve_at = [0.0, (steps // 3 + 7) * 360 / steps]
    parse_scene(stepped(teeth, positions=solve_at, **keys)).geometry.check_assembly()
    off = [0.0, (steps // 3 + 7.4) * 360 / steps]
    with pytest.raises(InputError, match=r"planet 2 at ring: does not assemble"):
        parse_scene(stepped(teeth, positions=off, **keys)).geometry.check_assembly()
    with pytest.raises(InputError, match=f"planetary.positions = .* they fit at steps of 360°/{steps} ="):
        simulate(parse_scene(stepped(teeth, positions=off, **keys)))


def test_planets_in_phase_share_alike_and_are_one_planet_under_its_part_of_the_torque():
    one, four = (solved(planets=n, torque=50.0 * n, effects=ELASTIC) for n in (1, 4))
    assert_allclose(four.balance.force, np.repeat(one.balance.force, 4, axis=1), rtol=1e-10)
    assert_allclose(four.balance.force / four.even, 1.0, rtol=1e-10)
    assert_allclose(four.cycle.input_turn, one.cycle.input_turn, rtol=1e-10)


def test_turning_the_set_and_the_order_of_planets_change_nothing():
    errors, other = [0.0, 12.0, 5.0, -7.0], [0, 3, 1, 2]
    base = solved(planets=4, planet_timing=errors, pin_stiffness=150.0)
    assert (base.balance.force / base.even).max() > 1.01
    keys = {"planet_timing": [errors[i] for i in other], "pin_stiffness": 150.0}
    for turn in (0.0, 25 * 360.0 / 300):
        found = solved(positions=[90.0 * i + turn for i in other], **keys)
        assert_allclose(found.balance.force[:, :4], base.balance.force[:, other], rtol=1e-9)


def test_transmission_error_is_the_sum_of_both_meshes_at_their_own_frequencies():
    """Rigid planets in phase: Δ = δ_s + ρ δ_r with ρ = r_bp/r_bq, each mesh at its own phase."""
    scene = parse_scene(stepped(planets=3, effects={**ELASTIC, "off_line_contact": {}}) | {"resolution": {}})
    whole = simulate(scene)
    sun, ring = (scene.meshes[name] for name in ("sun to planet 1", "planet 1 at ring to ring"))
    rho = sun.pair.gears[1].base_radius / ring.pair.gears[0].base_radius
    amplitude = whole["train_transmission_error_amplitude"]
    one, two = (simulate(own) for own in (sun, ring))
    assert_allclose(
        whole["train_transmission_error_mean"],
        one["transmission_error_mean"] + rho * two["transmission_error_mean"],
        rtol=1e-5,
    )
    for n in (1, 2, 4, 5):  # the third order of the ring's meshes is the second of the sun's
        floor = 3 * float(amplitude.max()) * 1e-3
        if n != 2 and n != 4:
            wanted = float(one["transmission_error_amplitude"].sel(harmonic=n))
            assert float(amplitude.sel(harmonic=n)) == pytest.approx(wanted, abs=floor)
        wanted = rho * float(two["transmission_error_amplitude"].sel(harmonic=n))
        assert float(amplitude.sel(harmonic=n * 2 / 3, method="nearest")) == pytest.approx(wanted, abs=floor)


@pytest.mark.parametrize("torsion", [None, 1e6])
def test_timing_errors_and_torsion_act_as_in_a_chain_of_springs(torsion):
    """s = F/k_s + r_p² F/k_t + ρ (ρ F/k_r − e), the same for both planets, with (F_1 + F_2) r_s = T."""
    f = 2.0
    keys = {} if torsion is None else {"planet_torsional_stiffness": torsion}
    found = solved(planets=2, planet_timing=[f, 0.0], torque=200.0, **keys)
    sun, ring = (found.linkage.train[name].pair for name in ("sun to planet 1", "planet 1 at ring to ring"))
    r_s, r_p, r_q = sun.gears[0].base_radius, sun.gears[1].base_radius, ring.gears[0].base_radius
    k_s, k_r = (1e3 * list(found.meshes.values())[m].cycle.mesh_stiffness for m in (0, 2))
    rho, e = r_p / r_q, 1e-3 * f * math.cos(ring.gears[0].alpha_t)
    path = 1 / k_s + rho**2 / k_r + (0.0 if torsion is None else r_p**2 / (1e3 * torsion))
    F = found.balance.force
    assert_allclose(F[:, 0] + F[:, 1], 200e3 / r_s, rtol=1e-10)
    assert_allclose(F[:, 0] - F[:, 1], rho * e / path, rtol=1e-6)
    assert F[:, 0].min() > 1.05 * F[:, 1].max()
    assert_allclose(F[:, 2:], rho * F[:, :2], rtol=1e-10)


def test_samples_are_solved_as_single_sets_are():
    scene = parse_scene(stepped(planets=4, pin_stiffness=300.0, scatter={"planet_timing": 15.0}))
    found = robust(scene, samples=4, seed=1)
    for n in (0, 3):
        own = found["error"].isel(sample=n).values.tolist()
        alone = simulate(parse_scene(stepped(planets=4, pin_stiffness=300.0, planet_timing=own)), outputs=[])
        # a table of 32 levels
        assert_allclose(found["mesh_load_factor"].isel(sample=n), alone["mesh_load_factor"], rtol=1e-5)


def test_an_eccentric_sun_passes_planet_after_planet():
    """A quarter turn of the sun is a whole number of mesh periods of sun and ring, 6 and 4."""
    scene = parse_scene(stepped(planets=4, run_out={"sun": 10.0}, pin_stiffness=100.0, phases=4))
    found = hunting_cycle(scene)
    # 84 teeth of the ring, two of them in a cycle of 3 mesh periods of the sun
    assert found.sizes["cycle"] == 8 * 42 // math.gcd(8, 42)
    load = found["load_sharing"].values.reshape(8, -1)
    assert np.ptp(load[0]) > 0.02
    for planet in range(4):
        assert_allclose(load[planet], np.roll(load[0], 4 * planet * 24 // 4), atol=1e-8)
    order, amplitude = (found[f"{name}"] for name in ("mesh_order", "load_sharing_order_amplitude"))
    assert 24 * float(order[np.argmax(amplitude.values[0])]) == pytest.approx(1.0)


REFUSED = {
    "planet_timing": ({"planet_timing": [1.0, 0.0, 0.0]}, "planetary.planet_timing"),
    "torsion": ({"planet_torsional_stiffness": 1e5}, "planetary.planet_torsional_stiffness"),
    "scatter": ({"scatter": {"planet_timing": 5.0}}, "planetary.scatter.planet_timing"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_keys_of_stepped_planets_need_them(case):
    keys, key = REFUSED[case]
    with pytest.raises(InputError, match=r"is for stepped planets: give planetary.planet_at_ring too") as caught:
        parse_scene(tables(**keys))
    assert caught.value.key == key


def test_errors_name_the_table_of_the_second_gear():
    for more, key in (
        ({"teeth": "x"}, "planetary.planet_at_ring.teeth"),
        ({"helix_angle": 90.0}, "planetary.planet_at_ring.helix_angle"),
        ({"addendum": "x"}, "planetary.planet_at_ring.addendum"),
    ):
        with pytest.raises(InputError) as caught:
            parse_scene(stepped(at_ring=more))
        assert caught.value.key == key


def test_large_second_gears_collide_too():
    with pytest.raises(InputError, match="planets collide: their tips overlap by"):
        parse_scene(stepped((48, 12, 60, 120), planets=4))


def test_unlike_teeth_are_refused():
    given = stepped()
    given["planetary"]["sun"]["pitch_errors"] = [1.0] * 23 + [0.0]
    with pytest.raises(InputError, match=r"effects.pitch_errors = given: differs from tooth to tooth"):
        simulate(parse_scene(given))


def test_all_gears_of_the_planets_have_mass():
    def cylinder(mesh, gear):
        own = mesh.pair.gears[gear]
        return 7.85e-6 * math.pi * own.pitch_radius**2 * own.face_width

    scene = parse_scene(stepped(planets=3))
    one, two = list(scene.meshes.values())[::3]
    ring = two.pair.gears[1]
    rim = 7.85e-6 * math.pi * ring.face_width * (ring.root_radius**2 - ring.pitch_radius**2)
    assert mass(scene) == pytest.approx(cylinder(one, 0) + 3 * (cylinder(one, 1) + cylinder(two, 0)) + rim, rel=0.02)


def test_rexs_has_no_stepped_planets(tmp_path):
    with pytest.raises(
        InputError, match=r"planetary.planet_at_ring = given: sets with stepped planets cannot be written"
    ):
        write_rexs(parse_scene(stepped()), tmp_path / "set.rexs")
