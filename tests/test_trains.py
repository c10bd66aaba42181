"""Trains whose meshes are one contact problem: limits with known solutions, and invariants."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench import robust, simulate, sweep
from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.equilibrium import MeshAt, Statics, balance
from gearbench.contact.patches import solve_patches
from gearbench.errors import InputError
from gearbench.results.origin import single_mesh
from gearbench.robustness.montecarlo import prepare_batch, prepare_phases, respond
from gearbench.scene_file import parse_scene
from gearbench.trains.solve import solve_train

GEAR = {"normal_module": 2.0, "face_width": 20.0}


def tables(angles, torque=60.0, teeth=(21, 43), helix=0.0, **more):
    """A sun that drives a coaxial second one through idlers at ``angles`` [°]; by default both have the same teeth."""
    sun, idler, *other = teeth
    distance = (sun + idler) / math.cos(math.radians(helix)) + 0.4
    own = {**GEAR, "helix_angle": helix}
    first, last = {"axial_offset": -11.0}, {"axial_offset": 11.0}  # side by side on wide idlers
    gears = {"sun": {**own, **first, "teeth": sun, "profile_shift": 0.2}}
    gears["out"] = {**own, **last, "teeth": other[0]} if other else {**gears["sun"], **last}
    gears |= {f"idler {n}": {**own, "teeth": idler, "face_width": 42.0} for n in range(len(angles))}
    way = [
        {"driver": "sun", "driven": f"idler {n}", "centre_distance": distance, "direction": angle}
        for n, angle in enumerate(angles)
    ]
    back = [
        {"driver": f"idler {n}", "driven": "out", "centre_distance": distance, "direction": (angle + 180.0) % 360.0}
        for n, angle in enumerate(angles)
    ]
    effects = {"tooth_bending": {}, "hertz": {}}
    return {"gears": gears, "meshes": way + back, "load": {"torque": torque}, "effects": effects} | more


def solved(*args, **kwargs):
    """Forces (position, mesh) and angle of the sun (position,) of the train of ``tables``."""
    found = solve_train(parse_scene(tables(*args, **kwargs)))
    return found.balance.force, found.cycle.input_turn


@pytest.mark.parametrize("extra", [{}, {"crowning": {"amount": 5.0}}])
def test_one_mesh_is_the_pair_to_the_bit(extra):
    gears = {"pinion": {"teeth": 19}, "wheel": {"teeth": 31}}
    scene = parse_scene(
        {"pair": {**GEAR, "helix_angle": 17.0, "centre_distance": 52.7, **gears}, "load": {"torque": 50.0}}
        | {"effects": {"tooth_bending": {}, "hertz": {}, **extra}}
    )
    problem = assemble(scene, scene_lines(scene, np.linspace(0, 1, 8, endpoint=False)))
    cos_b, one = math.cos(scene.pair.meshing.beta_b), np.ones((1, 1))
    mesh = MeshAt(problem=problem, nominal=scene.F_bt, cos_b=cos_b)
    statics = Statics(rows=one, stiffness=0 * one, force=np.array([scene.F_bt]), offset=np.zeros(1))
    found, own = balance([mesh], statics), solve_patches(problem)
    for name in ("force", "approach", "stiffness"):
        np.testing.assert_array_equal(getattr(found.solutions[0], name), getattr(own, name))
    assert_allclose(found.motion[:, 0], own.approach / cos_b, rtol=1e-12)


def test_a_chain_is_two_springs_in_series():
    # both idlers of the other tests in a row: torques follow from the balance, and no mesh knows of the other
    scene = parse_scene(tables([10.0]))
    whole = solve_train(scene)
    k, found = np.zeros((2, len(whole.phases.phase))), 0.0
    for n, own in enumerate(whole.meshes.values()):
        assert_allclose(whole.balance.force[:, n], scene.meshes[list(scene.meshes)[n]].F_bt, rtol=1e-12)
        alone = own.problem
        solution = solve_patches(alone)
        found, k[n] = found + solution.approach, solution.stiffness
    r_b = whole.meshes[next(iter(whole.meshes))].scene.pair.gears[0].base_radius
    assert_allclose(whole.cycle.input_turn * r_b, found, rtol=1e-12)
    assert_allclose(whole.input_stiffness / r_b**2, 1 / (1 / k).sum(axis=0), rtol=1e-9)


def test_the_dataset_holds_each_mesh_and_what_they_have_in_common():
    scene = parse_scene(tables([0.0, 90.0, 180.0, 270.0], resolution={"positions": 8}))
    whole = simulate(scene, outputs=["transmission_error", "line_load"])
    assert whole["load_sharing"].dims == ("mesh", "position")
    assert_allclose(whole["load_sharing"].values[:4].mean(axis=0), 1.0, rtol=1e-9)
    assert float(whole["mesh_load_factor"]) == whole["load_sharing"].values.max()
    # torque in, torque out: both turn the same way
    torque = whole["member_torque"]
    assert_allclose(torque.sel(member="sun").values, -60.0, rtol=1e-9)
    assert_allclose(torque.sel(member="out").values, 60.0, rtol=1e-9)
    assert_allclose(torque.sel(member=["idler 0", "idler 3"]).values, 0.0, atol=1e-7)
    own = single_mesh(whole, "idler 1 to out")
    total = (own["line_load"] * own["segment_length"]).sum(("pair", "segment"))
    assert_allclose(total, whole["mesh_load"].sel(mesh="idler 1 to out"), rtol=1e-9)
    swept = sweep(scene, torque=[30.0, 60.0], outputs=["transmission_error"])
    assert swept["load_sharing"].dims == ("torque", "mesh", "position")
    assert_allclose(swept["load_sharing"].values[1], whole["load_sharing"].values, rtol=1e-9)


def test_idlers_that_do_not_assemble_are_named():
    with pytest.raises(InputError, match=r"gears = .*: does not assemble: in idler 1 to out"):
        simulate(parse_scene(tables([0.0, 180.0], teeth=(21, 43, 22))))


ERRORS = {"iso_class": 6, "profile_slope": {}, "profile_form": {}, "helix_slope": {"distribution": "normal"}}


@pytest.mark.parametrize("bending", [{}, {"model": "solid"}])
def test_samples_of_one_path_are_those_of_its_pairs(bending):
    gears = {name: {"teeth": z} for name, z in {"sun": 36, "planet": 30, "ring": -96}.items()}
    one = {**gears, "normal_module": 2.0, "face_width": 20.0, "centre_distance": 66.0, "planets": 1}
    effects = {"tooth_bending": bending, "hertz": {}, "manufacturing_errors": ERRORS}
    more = {"load": {"torque": 60.0}, "resolution": {"positions": 4}}
    scene = parse_scene({"planetary": one, "effects": effects, **more})
    found = robust(scene, samples=16)
    total, whole = 0.0, solve_train(scene)
    for mesh, contact in zip(whole.meshes.values(), whole.contacts, strict=True):
        pair = prepare_phases(mesh.scene, mesh.lines.mesh_phase, mesh.weight)
        # a train removes what cells leave at the mean errors, a pair that of a few samples
        pair = replace(pair, batch=prepare_batch(mesh.scene, mesh.lines, contact.problem)[0])
        # the planet has a flank at either mesh
        driver, driven = (
            name + f", {side} flank" * (name == "planet 1")
            for name, side in zip(mesh.scene.gear_names, ("driving", "driven"), strict=True)
        )
        flanks = {"pinion": driver, "wheel": driven}
        names = [f"{kind} {flanks[gear]}" for kind, _, gear in (name.rpartition("_") for name in pair.names)]
        drawn = found["error"].sel(error_name=names).values
        total = total + respond(pair, drawn)[0]["transmission_error_mean"]
    assert_allclose(found["train_transmission_error_mean"], total, rtol=1e-5)
    assert_allclose(found["mesh_load_factor"], 1.0, rtol=1e-8)
    assert float(np.std(total)) > 0.1


def test_parallel_idlers_scatter_in_what_they_carry():
    given = tables((0.0, 180.0), resolution={"gauss_points": 2})
    given["effects"] = given["effects"] | {"manufacturing_errors": ERRORS}
    found = robust(parse_scene(given), samples=16)
    names = [name for name in found["error_name"].values if name.startswith("helix_slope")]
    flanks = [f"idler {n}, {flank} flank" for n in (0, 1) for flank in ("driving", "driven")]
    assert sorted(names) == sorted(f"helix_slope {each}" for each in ("sun", "out", *flanks))
    assert float(found["mesh_load_factor"].min()) >= 1.0
    assert float(found["mesh_load_factor"].std()) > 0.01


def test_an_accuracy_is_met():
    """Transmission error and stiffness of train and meshes agree within 0.5 % with a much finer run."""
    given = tables(
        [0.0, 130.0, 250.0],
        resolution={"accuracy": 0.005},
        effects={"hertz": {}, "tooth_bending": {}, "crowning": {"amount": 6.0}},
    )
    found = simulate(parse_scene(given))
    exact = simulate(parse_scene(given | {"resolution": {"segments": 80, "gauss_points": 12}}))
    assert found.attrs["accuracy_estimated"] <= 0.005
    for name in ("mean", "rms", "peak_to_peak"):
        for curve in ("train_transmission_error", "transmission_error"):
            assert_allclose(found[f"{curve}_{name}"], exact[f"{curve}_{name}"], rtol=0.005)
    error = np.abs(found["train_transmission_error_amplitude"] - exact["train_transmission_error_amplitude"]).values
    assert (error <= 3 * found["train_transmission_error_amplitude_noise_floor"].values + 1e-12).all()
    off = abs(float(found["train_transmission_error_peak_to_peak"] - exact["train_transmission_error_peak_to_peak"]))
    assert off <= float(found["train_transmission_error_peak_to_peak_noise_floor"])
    drawn = given | {"effects": given["effects"] | {"manufacturing_errors": ERRORS}}
    with pytest.raises(InputError, match="is for simulate, sweep and plan"):
        robust(parse_scene(drawn), samples=8)


def double_planets(angles):
    """Sun, pairs of planets that mesh with each other, and ring: 24, 18, 18 and 84 teeth."""
    inner, outer, last = 42.0, 66.0, 36.0
    ahead = math.degrees(math.acos((inner**2 + outer**2 - last**2) / (2 * inner * outer)))
    gears = {"sun": {**GEAR, "teeth": 24}, "ring": {**GEAR, "teeth": -84}}
    meshes = []
    for n, angle in enumerate(angles):
        places = [r * np.exp(1j * np.radians(a)) for r, a in ((inner, angle), (outer, angle + ahead))]
        between = float(np.degrees(np.angle(places[1] - places[0])))
        gears |= {f"inner {n}": {**GEAR, "teeth": 18}, f"outer {n}": {**GEAR, "teeth": 18}}
        for driver, driven, distance, direction in (
            ("sun", f"inner {n}", inner, angle),
            (f"inner {n}", f"outer {n}", last, between),
            (f"outer {n}", "ring", outer, angle + ahead),
        ):
            meshes.append({"driver": driver, "driven": driven, "centre_distance": distance, "direction": direction})
    effects, resolution = {"tooth_bending": {}, "hertz": {}}, {"positions": 6}
    load = {"torque": 50.0 * len(angles)}
    return parse_scene({"gears": gears, "meshes": meshes, "load": load, "effects": effects, "resolution": resolution})


def test_planets_that_mesh_in_pairs_are_a_train():
    """It is solved in the frame of the carrier; pairs of planets fit at steps of 360°/(z_r − z_s) = 6°."""
    one, two = (solve_train(double_planets(angles)) for angles in ([0.0], [0.0, 180.0]))
    assert_allclose(two.balance.force, np.tile(one.balance.force, 2), rtol=1e-10)
    torque = dict(zip(two.linkage.bodies, two.linkage.on_bodies(two.balance.force)[0, :, 2], strict=True))
    assert torque["ring"] == pytest.approx(-84 / 24 * torque["sun"])
    with pytest.raises(InputError, match=r"gears = outer 1: does not assemble.* \+0.500 pitches"):
        solve_train(double_planets([0.0, 183.0]))


def test_stepped_planets_are_a_train_of_two_mesh_frequencies():
    """The same set in its short form; the phase of the ring is that of teeth in line."""
    effects = {"hertz": {}, "tooth_bending": {}}
    own = {"normal_module": GEAR["normal_module"], "face_width": GEAR["face_width"], "centre_distance": 60.0}
    own |= {"planets": 2, "sun": {"teeth": 24}, "ring": {"teeth": -84}}
    own |= {"planet": {"teeth": 36}, "planet_at_ring": {"teeth": 24}}
    rest = {"load": {"torque": 50.0}, "effects": effects, "resolution": {"positions": 8}}
    short = solve_train(parse_scene({"planetary": own, **rest}))
    phase = short.linkage.train.phases()["planet 1 at ring to ring"]
    gears = {"sun": {**GEAR, "teeth": 24}, "ring": {**GEAR, "teeth": -84}}
    meshes = []
    for n, angle in enumerate((0.0, 180.0)):
        gears |= {
            f"{name} {n}": {**GEAR, "teeth": z, "shaft": f"planet {n}"} for name, z in (("big", 36), ("small", 24))
        }
        at = {"centre_distance": 60.0, "direction": angle}
        meshes += [{"driver": "sun", "driven": f"big {n}", **at}, {"driver": f"small {n}", "driven": "ring", **at}]
    meshes[1]["phase"] = phase
    whole = solve_train(parse_scene({"gears": gears, "meshes": meshes, **rest}))
    assert_allclose(whole.balance.force[:, [0, 2, 1, 3]], short.balance.force, rtol=1e-10)
    assert_allclose(whole.cycle.transmission_error, short.cycle.transmission_error, rtol=1e-10)
