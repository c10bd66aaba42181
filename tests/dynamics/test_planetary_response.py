"""Response of planetary sets, against time integration and the simulation; harmonics that phasing cancels."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import root

from gearbench import response, simulate
from gearbench.dynamics import nonlinear
from gearbench.dynamics.analysis import speed_variables
from gearbench.dynamics.figures import draw_response
from gearbench.dynamics.force_curve import ForceCurve, TiltAndBending
from gearbench.dynamics.housing import housing_response
from gearbench.dynamics.modes import modes
from gearbench.dynamics.nonlinear import (
    NonlinearModel,
    integrated_modes,
    nonlinear_response,
    nonlinear_train,
    train_at_uniform_phases,
    variables_at,
)
from gearbench.dynamics.revolution import revolution_response
from gearbench.dynamics.scatter import robust_response
from gearbench.dynamics.steady import steady
from gearbench.dynamics.train_model import TrainModel, rigid_bodies, train_mechanics
from gearbench.errors import InputError
from gearbench.geometry.linkage import AXES
from gearbench.results.cycle import Phases, fourier_rows
from gearbench.scene_file import parse_scene
from gearbench.trains.scatter import sampled_train
from gearbench.trains.solve import solve_train
from tests.support.force_curves import force_at

TEETH = {"tooth_bending": {}, "hertz": {}}
#: Orders of what excites the set where it is integrated.
ORDERS = 3
ELASTIC = {"floating": ["sun"], "pin_stiffness": 300.0, "carrier_support": 500.0}


def scene(teeth=(36, 30, 96), torque=200.0, phases=32, damping=0.03, **keys):
    """A set of module 2 without profile shifts."""
    sun, planet, ring = teeth
    own = {"normal_module": 2.0, "face_width": 20.0, "centre_distance": float(sun + planet)}
    own |= {"sun": {"teeth": sun}, "planet": {"teeth": planet}, "ring": {"teeth": -ring}}
    own |= {"dynamics": {"damping_ratio": damping, "carrier": {"mass": 3.0, "inertia": 0.006}}} | keys
    more = {"load": {"torque": torque}, "effects": TEETH, "resolution": {"positions": phases}}
    return parse_scene({"planetary": own, **more})


def smooth(model, orders=ORDERS, phases=128):
    """The model with only the first orders of forces, motions and stiffness, at enough phases to be exact."""
    phase, weight = np.arange(phases) / phases, np.full(phases, 1 / phases)
    wave, length = np.exp(2j * np.pi * np.outer(phase, np.arange(1, orders + 1))), model.solved.phases.length
    rows = fourier_rows(model.solved.phases, np.arange(1, orders + 1) / length)

    def low(values):
        return values.mean(axis=0) + 2 * np.real(wave @ (rows @ values))

    own = {name: low(getattr(model.solved.balance, name)) for name in ("force", "motion", "stiffness")}
    at = Phases(phase=length * phase, weight=weight, size=None, length=length)
    solved = replace(model.solved, phases=at, balance=replace(model.solved.balance, **own))
    return TrainModel(scene=model.scene, solved=solved)


def integrated(model, speed, periods, points=64, least=-np.inf):
    """Mesh forces (point, mesh) over the last cycle, by time integration; none is below ``least``.

    DOP853 integrates M q̈ + C q̇ + K q = f − Bᵀ F with modal damping C, starting from the quasi-static motion.
    """
    solved, linkage, bodies = model.solved, model.linkage, model.bodies
    names = linkage.bodies
    # motions in this test: x, y and rotation of every body, free, held, or on springs to the carrier
    turning = [name for name in names if bodies[name].torsion < np.inf]
    T = []
    for name in turning:
        move = np.zeros((len(names), 3))
        move[names.index(name), 2] = 1.0
        for pin in linkage.carried if name == linkage.carrier else ():
            x, y = linkage.train.places[pin]
            move[names.index(pin)] += [-y, x, 0.0]
        T.append(move)
    springs = [bodies[name].torsion for name in turning]
    for motion in linkage.additional_motions:
        move = np.zeros((len(names), 3))
        for name, axis in motion.moved:
            move[names.index(name), AXES.index(axis)] = 1.0
        T.append(move)
        springs.append(motion.stiffness)
    T = np.array(T)
    weights = np.array([(bodies[name].mass,) * 2 + (bodies[name].inertia,) for name in names])
    M, K = np.einsum("iba,ba,jba->ij", T, weights, T), np.diag(springs)
    B = np.einsum("mba,iba->mi", linkage.of_bodies, T)
    k_mean = solved.balance.stiffness.mean(axis=0)
    values, modes = np.linalg.eigh(
        np.linalg.solve(L := np.linalg.cholesky(M), np.linalg.solve(L, K + B.T * k_mean @ B).T)
    )
    modes = np.linalg.solve(L.T, modes)
    damping = M @ modes @ np.diag(2 * model.damping_ratio * np.sqrt(np.maximum(values, 0.0))) @ modes.T @ M
    omega = 2 * np.pi / 60 * model.groups[0].rate * speed
    phase, n = solved.phases.phase / solved.phases.length, np.arange(ORDERS + 1)
    known = {"F": solved.balance.force, "k": solved.balance.stiffness, "x": solved.balance.motion @ linkage.rows.T}
    waves = {name: np.exp(-2j * np.pi * np.outer(n, phase)) @ array / len(phase) for name, array in known.items()}

    count, pairs = len(B), np.hstack([waves[name] * np.where(n, 2, 1)[:, None] for name in "Fkx"])

    def at(angle):
        return np.real(np.exp(1j * n * angle) @ pairs).reshape(3, count)

    # constant torques balance the mean mesh forces, and springs that are not at rest
    f = B.T @ solved.balance.force.mean(axis=0)
    f[len(turning) :] += (
        springs[len(turning) :] * solved.balance.motion.mean(axis=0)[-len(linkage.additional_motions) :]
    )
    size, F, k, x = len(M), *at(0.0)
    start = np.linalg.lstsq(K + B.T * k @ B, f - (F - k * x) @ B, rcond=1e-12)[0]
    per_f, per_q, per_v = (np.linalg.solve(M, each) for each in (B.T, K, damping))
    equivalent_force = np.linalg.solve(M, f)

    def forces(angle, q):
        F, k, x = at(angle)
        return np.maximum(F + k * (B @ q - x), least)

    def rate(t, state):
        q, v = state[:size], state[size:]
        return np.concatenate([v, equivalent_force - per_q @ q - per_v @ v - per_f @ forces(omega * t, q)])

    last = 2 * np.pi / omega * (periods + np.arange(points) / points)
    state = np.concatenate([start, np.zeros(size)])
    found = solve_ivp(rate, (0.0, last[-1]), state, "DOP853", last, rtol=1e-9, atol=1e-12)
    return np.array([forces(omega * t, q) for t, q in zip(last, found.y[:size].T, strict=True)])


#: 3 mesh periods of the sun while the ring has 2.
STEPPED = {"teeth": (24, 36, 84), "planet_at_ring": {"teeth": 24}, "phases": 8}


@pytest.mark.parametrize(
    ("speeds", "keys", "H", "tolerance"),
    [
        ([1.0], {}, 30, 1e-6),
        # from 11 on, orders that are no multiple of either mesh frequency are left out
        pytest.param([1.0], STEPPED, 10, 1e-5, marks=pytest.mark.slow),
        pytest.param([0.2, 0.45, 0.8, 1.3, 1.7, 2.6], {}, 30, 1e-6, marks=pytest.mark.slow),
    ],
    ids=["resonance", "stepped", "six"],
)
def test_the_balance_is_what_time_integration_ends_in(speeds, keys, H, tolerance):
    pins = {"pin_tangential": [8.0, 0.0, -5.0, 2.0], "ring_support": 400.0}
    whole = scene(**{"planets": 4, "phases": 16, "damping": 0.08} | ELASTIC | pins | keys)
    model = smooth(TrainModel(scene=whole, solved=solve_train(whole)))
    kept = model.groups[0].orders(H)[1:]
    first = model.modes.frequency[model.modes.frequency > 0][0] / (2 * np.pi)
    found = speed_variables(model, 60 / model.groups[0].rate * first * np.array(speeds), H)
    for number, share in enumerate(speeds):
        # the slowest mode dies away, e^{−2πζ n f/f_z}
        periods = int(np.ceil(18 / (2 * np.pi * model.damping_ratio) * share)) + 2
        forces = integrated(model, 60 / model.groups[0].rate * first * share, periods)
        orders = np.fft.rfft(forces, axis=0)[kept] / len(forces)
        own = found["mesh_force_amplitude"][1][number] / 2 * np.exp(1j * found["mesh_force_phase"][1][number])
        assert_allclose(own.T, orders, rtol=0, atol=tolerance * np.abs(orders).max())
        greatest = forces.max(axis=0) / model.solved.even
        assert_allclose(found["load_sharing_greatest"][1][number], greatest, rtol=5e-3)  # of 64 points a period here


def pushed(model, phases, least):
    """Smooth meshes with F = max(least, F_s + k (x − x_s)), to be integrated at ``phases`` of a mesh period."""
    model, curves = smooth(model, phases=phases), []
    balance, x = model.solved.balance, model.approach(model.solved.balance.motion)
    for F, k, approach in zip(balance.force.T, balance.stiffness.T, x.T, strict=True):
        none, spacing = np.zeros((len(F), 0)), F.max() / k.min()
        rigid = TiltAndBending(coupling=none, motion=none, force=none, stiffness=none[..., None])
        table = least + k[:, None] * spacing * np.arange(3)
        shape = {"begin": approach - (F - least) / k, "table": table, "spacing": spacing}
        curves.append(ForceCurve(tilt_and_bending=rigid, **shape, backlash=np.inf, back_phase=np.zeros(len(F))))
    (group,), count = model.groups, len(model.names)
    return NonlinearModel(
        model=model,
        group=group,
        curves=curves,
        mean=(x.mean(axis=0), model.force),
        kept=integrated_modes(model, group, np.inf),
        offset=np.zeros((len(x), count)),
        between=np.zeros((0, count, count)),
    )


def orders_of(sweep, speed, H):
    """Complex orders of the mesh forces (mesh, order) at one speed, as the response with loss of contact gives them."""
    (periods,), (record,) = sweep.over(np.array([speed]))
    assert periods == 1
    found = variables_at(sweep, speed, H, 1, record)
    return found["mesh_force_amplitude"][1] / 2 * np.exp(1j * found["mesh_force_phase"][1]), found


@pytest.mark.parametrize(
    ("speeds", "keys"),
    [
        ([1.0], {}),
        pytest.param([1.0], STEPPED, marks=pytest.mark.slow),
        pytest.param([0.45, 0.8, 1.3, 1.7, 2.6], {}, marks=pytest.mark.slow),
    ],
    ids=["resonance", "stepped", "five"],
)
def test_with_contact_kept_the_sweep_is_the_balance(speeds, keys, monkeypatch):
    """Errors are of second order in the steps: two step sizes give the limit."""
    # the mean deflection is a thousand times the largest order
    monkeypatch.setattr(nonlinear, "SAME", 1e-11)
    pins = {"pin_tangential": [8.0, 0.0, -5.0, 2.0], "ring_support": 400.0}
    whole = scene(**{"planets": 4, "phases": 16, "damping": 0.08} | ELASTIC | pins | keys)
    model = TrainModel(scene=whole, solved=solve_train(whole))
    rate, first = model.groups[0].rate, model.modes.frequency[model.modes.frequency > 0][0] / (2 * np.pi)
    for speed in 60 / rate * first * np.array(speeds):
        own = speed_variables(smooth(model), np.array([speed]), 10 if keys else 30)
        balanced = (own["mesh_force_amplitude"][1] / 2 * np.exp(1j * own["mesh_force_phase"][1]))[0]
        # table entries below −1e6 N are never reached
        coarse, fine = (orders_of(pushed(model, n, -1e6), speed, 10 if keys else 30)[0] for n in (1440, 2880))
        size = np.abs(balanced).max()
        assert_allclose((4 * fine - coarse) / 3, balanced, rtol=0, atol=(1e-5 if keys else 1e-6) * size)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("keys", "torque", "damping", "speed", "tolerance"),
    [
        ({"phases": 16}, 25.0, 0.03, 3.05, 5e-4),
        # the meshes at the ring are without contact for 30 % of the time
        (STEPPED, 15.0, 0.06, 3.5, 2e-4),
    ],
    ids=["simple", "stepped"],
)
def test_with_loss_of_contact_the_sweep_is_time_integration_of_our_own(keys, torque, damping, speed, tolerance):
    """Meshes that only push, F = max(0, F_s + k (x − x_s)) at smooth F_s, k and x_s, integrated by DOP853."""
    pins = {"pin_tangential": [8.0, 0.0, -5.0, 2.0], "ring_support": 400.0}
    whole = scene(**{"planets": 4, "damping": damping, "torque": torque} | ELASTIC | pins | keys)
    model = TrainModel(scene=whole, solved=solve_train(whole))
    first = model.modes.frequency[model.modes.frequency > 0][0] / (2 * np.pi)
    speed = 60 / model.groups[0].rate * first * speed
    own, found = orders_of(pushed(model, 480, 0.0), speed, 8)
    assert not found["contact_kept"][1].all()
    periods = int(np.ceil(18 / (2 * np.pi * damping) * speed * model.groups[0].rate / 60 / first)) + 2
    forces = integrated(smooth(model, phases=512), speed, periods, points=256, least=0.0)
    orders = np.fft.rfft(forces, axis=0)[model.groups[0].orders(8)[1:]] / len(forces)
    assert_allclose(own.T, orders, rtol=0, atol=tolerance * np.abs(orders).max())


BORES = {"sun": {"teeth": 36, "bore_diameter": 40.0}, "planet": {"teeth": 30, "bore_diameter": 36.0}}
BORES |= {"ring": {"teeth": -96, "addendum": 0.9, "outer_diameter": 230.0}}


@pytest.mark.parametrize("effects", [TEETH, {"hertz": {}, "gear_body": {}}], ids=["teeth", "bodies"])
def test_the_slow_response_with_loss_of_contact_is_the_simulation(effects):
    """Also where bodies connect the meshes."""
    whole = scene(planets=4, pin_tangential=[20.0, 0.0, 0.0, 0.0], torque=100.0, phases=128, **ELASTIC, **BORES)
    whole = parse_scene(whole.to_mapping() | {"effects": effects})
    slow, fixed = nonlinear_response(whole, speed=20.0, harmonics=3).isel(speed=0), simulate(whole)
    wave = np.exp(-2j * np.pi * np.outer(fixed["mesh_phase"].values, slow["harmonic"])) / fixed.sizes["position"]
    orders = 2 * fixed["mesh_load"].values @ wave
    for sweep in ("up", "down"):
        of_sweep = slow.sel(sweep=sweep)
        f = of_sweep["mesh_force_amplitude"] * np.exp(1j * of_sweep["mesh_force_phase"])
        assert_allclose(f, orders, rtol=0, atol=5e-3 * float(fixed["mesh_load"].max()))
        assert_allclose(of_sweep["load_sharing_greatest"], fixed["load_sharing"].max("position"), rtol=0.05)


def test_compiled_steps_of_a_set_are_those_of_numpy():
    """Bodies connect the meshes, and all modes but five follow at once."""
    from gearbench.dynamics._kernels import run

    whole = parse_scene(scene(**ELASTIC, **BORES).to_mapping() | {"effects": {"hertz": {}, "gear_body": {}}})
    sweep = nonlinear_train(train_at_uniform_phases(whole, 8), np.inf)
    sweep, modes_of_set = replace(sweep, kept=sweep.kept[:5]), sweep.model.modes
    (table, balance), dt = sweep.compiled, 1e-5
    r, reach = modes_of_set.frequency[sweep.kept], np.ascontiguousarray(modes_of_set.mesh[:, sweep.kept])
    free = np.array([np.cos(r * dt), np.sin(r * dt) / r, -r * np.sin(r * dt), np.cos(r * dt), 1 / r])
    state, record = np.zeros((2, 5)), np.zeros((2, len(reach), 1, sweep.steps))
    run(state, free, np.zeros((0, 0)), reach, table, balance, record, np.array([dt, 1, 1, 0.0, 0.0]))
    c, K, (mean_x, mean_f) = balance.residual_compliance, sweep.stiffness, sweep.mean
    p, v = np.zeros((2, 5))
    assert np.abs(c).max() > 1e-3 / K.max()
    for row, (g, C) in enumerate(zip(sweep.offset, sweep.between, strict=True)):

        def state_at(d, row=row, g=g, C=C):
            F = np.array(
                [force_at(curve, np.full(sweep.steps, at))[row] for curve, at in zip(sweep.curves, d, strict=True)]
            )
            x = d - g + C @ F
            return x, F, F - mean_f - K @ (x - mean_x)

        def unbalanced(d, p=p, state_at=state_at):
            x, _, excess = state_at(d)
            return 1e3 * (x + c @ excess - mean_x + reach @ p)

        x, F, excess = state_at(root(unbalanced, mean_x + g - C @ mean_f, tol=1e-13).x)
        assert_allclose(record[1, :, 0, row], F, atol=1e-7 * mean_f.max())
        assert_allclose(record[0, :, 0, row], x, atol=1e-7 * np.abs(mean_x).max())
        v = v + dt * reach.T @ excess
        p, v = free[0] * p + free[1] * v, free[2] * p + free[3] * v
    assert_allclose(state[0], p, atol=1e-6 * np.abs(p).max())


def test_force_curves_meet_the_contact_of_the_set():
    """Also where a body connects the meshes: the teeth see x + g − C F."""
    for effects in (TEETH, {"hertz": {}, "gear_body": {}}):
        whole = parse_scene(scene(**ELASTIC, **BORES).to_mapping() | {"effects": effects})
        model = train_at_uniform_phases(whole, 2)
        sweep, F = nonlinear_train(model, np.inf), model.solved.balance.force
        d = model.approach(model.solved.balance.motion) + sweep.offset
        if len(sweep.between):
            d = d - (sweep.between @ F[..., None])[..., 0]
        for curve, approach, force in zip(sweep.curves, d.T, F.T, strict=True):
            assert_allclose(force_at(curve, approach), force, rtol=1e-5)
            assert_allclose(force_at(curve, curve.begin - 1e-3), 0.0, atol=1e-9)


@pytest.mark.parametrize(
    "keys",
    [{}, STEPPED | {"phases": 32}, STEPPED | {"phases": 32, "planet_torsional_stiffness": 1e5}],
    ids=["simple", "stepped", "twisted"],
)
def test_the_slow_response_is_the_simulation(keys):
    whole = scene(**{"planets": 4, "pin_tangential": [8.0, 0.0, -5.0, 2.0]} | ELASTIC | keys)
    slow, fixed = response(whole, speed=1e-4, harmonics=7).isel(speed=0), simulate(whole)
    # 2ζ f/f_1 of the seventh order is 3e-8; the force is linear about the simulation, which is exact at rest
    n = {"harmonic": [each for each in fixed["harmonic"].values if each in slow["harmonic"].values]}
    assert len(n["harmonic"]) >= 7
    alone = ~np.isin(slow["harmonic"], fixed["harmonic"])  # combinations
    curves, phase = fixed["mesh_load"].values, fixed["mesh_phase"].values
    wave = np.exp(-2j * np.pi * np.outer(phase, slow["harmonic"])) / len(phase)
    f = slow["mesh_force_amplitude"] * np.exp(1j * slow["mesh_force_phase"])
    assert_allclose(f, 2 * curves @ wave, rtol=0, atol=1e-6 * curves.max())
    assert not alone.any() or np.abs(f.values[:, alone]).max() > 1e-6 * curves.max()
    slow = slow.sel(n)
    error = fixed["train_transmission_error_amplitude"].sel(n)
    assert_allclose(slow["train_dynamic_transmission_error_amplitude"], error, rtol=1e-6, atol=1e-6 * error.max())
    held = fixed["member_force_amplitude"].sel(n).transpose("member", "axis", "harmonic")
    size = float(held.max())
    assert size > 0.5
    assert_allclose(slow["bearing_force_amplitude"].isel(mesh=0), held, atol=1e-6 * size)
    load = fixed["member_force"].mean("position")
    assert_allclose(slow["bearing_load"], load, atol=1e-9 * float(np.abs(load).max()))
    torque = fixed["member_torque_amplitude"].sel(n)
    assert_allclose(slow["bearing_torque_amplitude"], torque, atol=1e-6 * float(fixed["member_torque"].max()))


@pytest.mark.parametrize(("planets", "ring", "sun"), [(4, 48, 16), (4, 51, 17), (4, 54, 18), (5, 52, 18), (4, 52, 18)])
def test_phasing_cancels_at_any_speed(planets, ring, sun):
    # in phase, sequential, counter phase, sequential of five, and mixed: unevenly spaced pairs
    teeth = sun, (ring - sun) // 2, ring
    keys = {
        "sun": {"teeth": sun, "profile_shift": 0.2},
        "centre_distance": (sun + ring) / 2 + 0.3,
        "pin_stiffness": 300.0,
    }
    whole = scene(teeth, planets=planets, phases=4 * planets * 5, **keys)
    found = response(whole, speed=np.linspace(2000, 30000, 8), harmonics=8)
    felt = found["bearing_force_amplitude"].isel(mesh=0)
    radial = np.hypot(felt.sel(direction="x"), felt.sel(direction="y")).sel(bearing=["sun", "ring", "carrier"])
    error, mean = found["train_dynamic_transmission_error_amplitude"], float(found["mean_force"].max())
    waves, even = found["ring_wave_amplitude"], (ring + sun) % planets == 0
    assert float(waves.max()) > 1e-2 * mean
    for order in range(1, 9):
        k, here = order * sun % planets, {"harmonic": order}
        if not even:  # opposite planets are in phase: no force
            assert radial.sel(here).max() < 1e-10 * mean
            continue
        if k != 0:
            assert error.sel(here).max() < 1e-10 * error.max()
        if k not in (1, planets - 1):
            assert radial.sel(here).max() < 1e-10 * mean
        # planets pass a point of the ring one after the other: multiples of this frequency
        passes = (order * ring + found["lobes"].values) % planets == 0
        assert waves.sel(here).values[:, ~passes].max() < 1e-10 * mean
        assert waves.sel(here).values[:, passes].max() > 1e-6 * mean
    if even and sun % planets in (1, planets - 1):
        assert radial.sel(harmonic=1).min() > 1e-3 * mean


def test_the_ring_feels_side_bands_about_the_mesh_frequency():
    found = response(scene(planets=4, phases=16), speed=3000.0, harmonics=2).isel(speed=0)
    # the ring stands still: the carrier turns with n_s z_s/(z_s + z_r), the mesh frequency is z_r times that
    carrier = 50.0 * 36 / 132
    assert_allclose(found["mesh_frequency"], 96 * carrier)
    assert_allclose(found["ring_wave_frequency"].sel(harmonic=2), carrier * (2 * 96 + found["lobes"]))


def test_bodies_that_yield_couple_the_stiffness_of_the_meshes():
    bores = {"sun": {"teeth": 36, "bore_diameter": 40.0}, "planet": {"teeth": 30, "bore_diameter": 36.0}}
    bores |= {"ring": {"teeth": -96, "addendum": 0.9, "outer_diameter": 230.0}}
    effects = {"effects": {"hertz": {}, "gear_body": {}}}
    whole = parse_scene(scene(phases=1, **ELASTIC, **bores).to_mapping() | effects)
    solved = solve_train(whole)
    K, B = TrainModel(scene=whole, solved=solved).stiffness, solved.linkage.rows
    assert np.abs(K - np.diag(np.diag(K))).max() > 1e-3 * K.max()
    # compliance of the motions under forces, as in the Newton steps of the simulation, which treats bodies as motions
    free = len(B[0])
    yields = np.linalg.inv(solved.balance.statics.matrix(solved.balance.stiffness)[0])[:free, :free]
    assert_allclose(np.linalg.inv(solved.linkage.stiffness + B.T @ K @ B), yields, rtol=1e-8, atol=1e-9 * yields.max())


def test_supports_carry_what_meshes_and_inertia_leave():
    whole = scene((35, 31, 97), planets=4, phases=16, damping=1e-9, ring_support=400.0, **ELASTIC)
    model, speeds = TrainModel(scene=whole, solved=solve_train(whole)), np.array([3100.0])
    found, names = steady(model, speeds, 3), list(model.mechanics.bearing_names)
    equivalent_force = np.moveaxis(found.equivalent_force, 1, 2)[0, 1:]
    _, motion, moved = (
        part[0] for part in model.modes.response_to_forces(found.omega[:, 1:], equivalent_force[None], model.modes.mesh)
    )
    inert = np.array([(body.mass, body.mass, body.inertia) for body in model.bodies.values()])
    left = -np.einsum("nm,mba->nba", equivalent_force + motion @ model.stiffness.T, model.linkage.of_bodies)
    left = np.moveaxis(left + found.omega[0, 1:, None, None] ** 2 * inert * moved, 0, -1)
    left[-1] += left[[names.index(name) for name in model.linkage.carried]].sum(axis=0)
    felt = speed_variables(model, speeds, 3)["bearing_force_amplitude"][1][0, 0]
    assert_allclose(felt, 2 * np.abs(left[:, :2]), atol=1e-6 * felt.max())
    assert (felt[names.index("sun")] == 0).all()
    assert felt[names.index("ring")].max() > 1e-3 * felt.max()


def test_parallel_paths_without_a_carrier_answer_too():
    gear, shift = {"normal_module": 2.0, "face_width": 20.0}, {"teeth": 21, "profile_shift": 0.2}
    gears = {name: gear | shift | {"axial_offset": at} for name, at in (("sun", -11.0), ("out", 11.0))}
    gears |= dict.fromkeys(("left", "right"), gear | {"teeth": 43, "face_width": 42.0})
    way = [("sun", "left", 0.0), ("sun", "right", 180.0), ("left", "out", 180.0), ("right", "out", 0.0)]
    meshes = [{"driver": a, "driven": b, "direction": at, "centre_distance": 64.4} for a, b, at in way]
    more = {"load": {"torque": 60.0}, "effects": TEETH, "resolution": {"positions": 16}}
    whole = parse_scene({"gears": gears, "meshes": meshes, **more})
    slow, fixed = response(whole, speed=[1e-4, 20000.0], harmonics=3), simulate(whole)
    error = fixed["train_transmission_error_amplitude"].sel(harmonic=slice(1, 3))
    assert_allclose(slow["train_dynamic_transmission_error_amplitude"][0], error, rtol=1e-6, atol=1e-6 * error.max())
    assert "lobes" not in slow.coords
    assert set(slow["mode_kind"].values) == {"rotational"}


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"dynamics": {"planet": {"torsional_stiffness": 1.0}}}, "planetary.dynamics.planet.torsional_stiffness"),
        ({"dynamics": {"sun": {"mass": -1.0}}}, "planetary.dynamics.sun.mass"),
        ({"dynamics": {"sum": {}}}, "planetary.dynamics.sum"),
        ({"dynamics": {"damping_ratio": 1.0}}, "planetary.dynamics.damping_ratio"),
    ],
)
def test_faults_are_one_line(keys, key):
    with pytest.raises(InputError) as caught:
        scene(**keys)
    assert caught.value.key == key


def test_the_turning_carrier_moves_modes_by_its_frequency_at_most():
    whole = scene(phases=8, **ELASTIC)
    model = TrainModel(scene=whole, solved=solve_train(whole))
    own, mass = model.mechanics, np.array([body.mass for body in model.bodies.values()])
    x, y = own.bearing[:, 0], own.bearing[:, 1]
    across = np.einsum("bi,b,bj->ij", x, mass, y)
    turn, rest = 2 * np.pi * 20.0, own.stiffness + own.mesh.T @ model.stiffness @ own.mesh
    # Coriolis and centrifugal forces in the frame of the carrier
    G = 2 * turn * (across.T - across)
    C = turn**2 * (np.einsum("bi,b,bj->ij", x, mass, x) + np.einsum("bi,b,bj->ij", y, mass, y))
    zero = np.zeros_like(rest)
    A = np.block([[zero, np.eye(len(rest))], [-np.linalg.solve(own.mass, np.hstack([rest - C, G]))]])
    turning = np.sort(np.linalg.eigvals(A).imag)
    still = model.modes.frequency[model.modes.frequency > 0]
    moved = np.abs(turning[turning > 1.0] - still) / turn
    assert 0.5 < moved.max() < 1.0
    note = response(whole, speed=20 * 60 * 132 / 36, harmonics=1).attrs["notes"]
    assert f"the mode at {still[0] / 2 / np.pi:.4g} Hz by up to {100 * turn / still[0]:.2g} % at" in note


@pytest.mark.slow
def test_axes_name_the_member_and_names_of_modes_do_not_overlap(tmp_path, monkeypatch):
    keep, save = {}, Figure.savefig
    monkeypatch.setattr(Figure, "savefig", lambda own, *a, **k: (keep.setdefault(len(keep), own), save(own, *a, **k)))
    for held, member in (("ring", "sun"), ("sun", "carrier")):
        found = response(scene(phases=16, planets=4, held=held, **ELASTIC), speed=[1000.0, 9000.0], harmonics=3)
        assert found["speed"].attrs["long_name"] == f"speed of {member}"
        keep.clear()
        names = [path.stem for path in draw_response(found, tmp_path)]
        figure = keep[next(i for i, name in enumerate(names) if name.startswith("campbell"))]
        assert figure.axes[0].get_xlabel() == f"speed of {member} [1/min]"
        boxes = [each.get_window_extent() for each in figure.axes[0].texts if "Hz" in each.get_text()]
        assert len(boxes) > 4
        assert all(low.y1 <= high.y0 + 1 for low, high in pairwise(boxes))


def test_gears_of_a_planet_that_twists_turn_apart():
    """Without meshes they are two wheels on a spring; a stiff spring makes them one wheel."""
    keys = {"planets": 3, **STEPPED, **ELASTIC, "phases": 1}
    inertia, found = 2e-3, {}
    keys["dynamics"] = {"planet": {"mass": 1.0, "inertia": inertia}, "carrier": {"mass": 3.0, "inertia": 0.006}}
    for torsion in (None, 1e9, 2e4):
        whole = scene(**keys, **({} if torsion is None else {"planet_torsional_stiffness": torsion}))
        linkage = whole.train.linkage(whole.geometry)
        bodies = rigid_bodies(whole.train, linkage)
        of_planet = [bodies[name] for name in bodies if name.startswith("planet 1")]
        assert sum(body.mass for body in of_planet) == pytest.approx(1e-3)
        assert sum(body.inertia for body in of_planet) == pytest.approx(1e3 * inertia)
        mechanics = train_mechanics(linkage, bodies)
        found[torsion] = modes(mechanics, 1e5 * np.eye(6), 0.0).frequency
    # meshes of almost no stiffness leave the gears of each planet alone on their spring
    alone = math.sqrt(1e3 * torsion * sum(1 / body.inertia for body in of_planet))
    assert np.isclose(modes(mechanics, 1e-3 * np.eye(6), 0.0).frequency, alone).sum() == 3
    one, stiff = found[None], found[1e9]
    assert len(stiff) == len(one) + 3
    assert_allclose(stiff[: len(one)], one, rtol=1e-3, atol=1e-3)


def test_other_answers_over_speed_are_refused_in_one_line():
    whole, unequal = scene(phases=8), {"teeth": 36, "pitch_errors": [*([1.0] * 35), 0.0]}
    with pytest.raises(InputError, match="no response over a revolution"):
        revolution_response(scene(phases=8, sun=unequal), speed=[3000.0], harmonics=1)
    with pytest.raises(InputError, match=r"planetary.scatter = missing"):
        robust_response(whole, speed=[3000.0], samples=4, harmonics=1)
    empty = xr.Dataset({"bearing_force_phase": ((), 0.0), "ring_wave_amplitude": (("lobes",), np.zeros(3))})
    with pytest.raises(InputError, match="in the frame of its carrier"):
        housing_response(empty, xr.Dataset())


@pytest.mark.parametrize("keys", [{}, STEPPED | {"phases": 32}], ids=["simple", "stepped"])
def test_samples_over_speed_are_responses_of_sets_with_these_errors(keys):
    amounts = {"pin_tangential": 12.0, "pin_radial": 8.0}
    given, speeds = {"planets": 4} | ELASTIC | keys, [1500.0, 3500.0, 6000.0]
    whole = scene(**given, scatter=amounts)
    found = robust_response(whole, speed=speeds, samples=2, harmonics=5)
    train = sampled_train(whole)
    squares = []
    for errors in train.draw(2, 0, "sobol"):
        drawn = dict(zip(train.names, errors, strict=True))
        pins = {key: [float(drawn[f"{key} planet {n}"]) for n in (1, 2, 3, 4)] for key in amounts}
        rms = response(scene(**given, **pins), speed=speeds, harmonics=5)["mesh_force_rms"]
        squares.append(rms.max("mesh").values ** 2)
    # samples are balanced until 3e-4 of the excitation is left, which a resonance amplifies
    assert_allclose(found["mesh_force"], np.sqrt(np.mean(squares, axis=1)), rtol=5e-3)
    assert_allclose(found["mesh_force_rms_max"], np.sqrt(np.max(squares, axis=0)), rtol=5e-3)
    assert float(found["mesh_force"].max() / found["mesh_force"].min()) > 1.01


def test_remarks_say_what_is_left_out_or_assumed():
    found = response(scene(phases=8, pin_stiffness=300.0, dynamics={}), speed=[3000.0], harmonics=1)
    assert "carrier: assumed to be a steel disc" in found.attrs["notes"]
    assert "gyroscopic effects of the turning carrier are left out" in found.attrs["notes"]
    star = response(scene(phases=8, held="carrier"), speed=[3000.0], harmonics=1)
    assert "carrier" not in star.attrs["notes"]
