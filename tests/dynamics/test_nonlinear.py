"""Loss of contact: sweeps against time integration of our own, doubled periods, limits without it."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.solver import solve
from gearbench.dynamics.analysis import response
from gearbench.dynamics.model import Model
from gearbench.dynamics.nonlinear import nonlinear_pair, nonlinear_response
from gearbench.scene_file import parse_scene
from tests.support.force_curves import force_at

#: Spur rig gears of Kahraman and Blankenship, 50/50, with play.
RIG = {
    "pair": {
        "normal_module": 3.0,
        "face_width": 20.0,
        "centre_distance": 150.0,
        "backlash": 0.15,
        "pinion": {"teeth": 50, "dedendum": 1.4},
        "wheel": {"teeth": 50, "dedendum": 1.4},
    },
    "load": {"torque": 200.0},
    "effects": {"tooth_bending": {"model": "solid"}, "hertz": {}, "tip_relief": {"amount": 10.0, "length": 1.5}},
    "system": {"damping_ratio": 0.02},
}
BORED = RIG | {
    "effects": RIG["effects"] | {"gear_body": {}},
    "pair": RIG["pair"] | {g: {"teeth": 50, "dedendum": 1.4, "bore_diameter": 50.0} for g in ("pinion", "wheel")},
    "system": {"damping_ratio": 0.01},
}


@cache
def rig():
    return nonlinear_pair(Model(scene=parse_scene(BORED), rows=1), 128, np.inf)


def integrated(sweep, speeds, periods=600, steps=512, last=8):
    """RMS [µm] of the motion over the ``last`` periods by the method of Runge and Kutta, speed after speed."""
    numba = pytest.importorskip("numba")
    model, (curve,) = sweep.model, sweep.curves
    mass = 1 / np.diag(model.mechanics.mass).sum() * np.diag(model.mechanics.mass).prod()
    k, F = model.stiffness[0, 0], model.force[0]
    damping, n = 2 * model.scene.system.damping_ratio * np.sqrt(k * mass), curve.steps
    begin, table, back, play, spacing = curve.begin, curve.table, curve.back_phase, curve.backlash, curve.spacing

    @numba.njit
    def flank(row, x):
        at = max((x - begin[row]) / spacing, 0.0)
        j = min(int(at), table.shape[1] - 2)
        return table[row, j] + (at - j) * (table[row, j + 1] - table[row, j])

    @numba.njit
    def force(row, x):
        low = int(back[row])
        share = back[row] - low
        return flank(row, x) - (1 - share) * flank(low % n, -x - play) - share * flank((low + 1) % n, -x - play)

    @numba.njit
    def slope(phase, x, v):
        row, share = int(phase * n) % n, phase * n % 1.0
        f = (1 - share) * force(row, x) + share * force((row + 1) % n, x)
        return v, (F - f - damping * v) / mass

    @numba.njit
    def run(T, x, v):
        h, out = T / steps, np.zeros(last * steps)
        for i in range(periods * steps):
            if i >= (periods - last) * steps:
                out[i - (periods - last) * steps] = x
            t = i % steps / steps
            x1, v1 = slope(t, x, v)
            x2, v2 = slope(t + 0.5 / steps, x + h / 2 * x1, v + h / 2 * v1)
            x3, v3 = slope(t + 0.5 / steps, x + h / 2 * x2, v + h / 2 * v2)
            x4, v4 = slope(t + 1.0 / steps, x + h * x3, v + h * v3)
            x, v = x + h / 6 * (x1 + 2 * x2 + 2 * x3 + x4), v + h / 6 * (v1 + 2 * v2 + 2 * v3 + v4)
        return x, v, out

    x, v, found = float(sweep.mean[0][0]), 0.0, []
    for speed in speeds:
        x, v, motion = run(60 / speed / 50, x, v)
        found.append(1e3 * motion.std())
    return np.array(found)


@pytest.mark.slow
def test_sweeps_are_those_of_time_integration():
    """Backlash 0.15 mm, ζ 0.01: the same motion at 95 % of 96 speeds, up and down, and at all where periods double.

    Where doubled periods begin, they grow for thousands of periods: 600 are too few.
    """
    for speeds, periods, share in ((np.linspace(2400, 3320, 96), 600, 0.95), (np.linspace(6700, 7600, 24), 3000, 1.0)):
        for way in (speeds, speeds[::-1]):
            _, record = rig().over(way)
            rms = 1e3 * record[:, 0, 0].reshape(len(way), -1).std(axis=-1)
            assert np.mean(np.abs(rms / integrated(rig(), way, periods) - 1) < 0.02) >= share


def test_branches_bend_and_periods_double():
    """Softening: going down, contact is lost for longer; at twice the natural frequency motions of two periods grow."""
    up, down = (rig().over(way) for way in (np.linspace(1500, 3000, 16), np.linspace(3600, 1500, 22)))
    rms_up, rms_down = (1e3 * record[:, 0, 0].reshape(len(record), -1).std(axis=-1) for _, record in (up, down))
    assert (up[1][5:, 1, 0].min(axis=(1, 2)) > 0).all()
    assert (down[1][8:18, 1, 0].min(axis=(1, 2)) <= 0).all()
    assert (
        rms_down[6:20][::-1] > 3 * np.interp(np.linspace(1700, 3000, 14), np.linspace(1500, 3000, 16), rms_up)
    ).all()
    # the branch bends to lower speeds: its motion grows as the speed falls, and ends
    assert (np.diff(rms_down[:19]) > 0).all()
    assert rms_down[-1] < 0.1 * rms_down[18]
    periods, record = rig().over(np.array([6500.0, 7100.0, 7700.0]))
    assert list(periods) == [1, 2, 1]
    assert record[1, 0, 0].std() > 10 * record[0, 0, 0].std()


def test_compiled_steps_are_those_of_numpy():
    """Three periods from rest, with two modes of which one follows at once, and dampers."""
    sweep = rig()
    from gearbench.dynamics._kernels import MeanState, run

    (curve,), (table, balance), dt = sweep.curves, sweep.compiled, 1e-6
    k, c = balance.stiffness[0, 0], 0.2 / balance.stiffness[0, 0]
    motion, force, stiffness, _, unit = balance
    balance = MeanState(
        motion=motion, force=force, stiffness=stiffness, residual_compliance=np.array([[c]]), deflection=unit
    )
    r = np.array([2e4, 5e4])
    free = np.array([np.cos(r * dt), np.sin(r * dt) / r, -r * np.sin(r * dt), np.cos(r * dt), 1 / r])
    brake, reach = np.array([[0.99, 0.001], [0.001, 0.98]]), np.array([40.0, -25.0])
    record, state = np.zeros((2, 1, 3, curve.steps)), np.zeros((2, 2))
    limits = np.array([dt, 1, 3, 0.0, 0.0])
    assert run(state, free, brake, reach[None], table, balance, record, limits) == 0
    (mean_x,), (mean_f,) = sweep.mean
    p, v, x = np.zeros(2), np.zeros(2), np.full(curve.steps, mean_x)
    for i in range(3 * curve.steps):
        row, low = i % curve.steps, mean_x - reach @ p
        below, above = low - 1.0, low + 1.0
        for _ in range(60):  # bisection of what rises
            x[row] = (below + above) / 2
            f = force_at(curve, x)[row]
            rises = x[row] + c * (f - mean_f - k * (x[row] - mean_x)) > low
            below, above = (below, x[row]) if rises else (x[row], above)
        assert_allclose(record[:, 0, i // curve.steps, row], [x[row], f], rtol=1e-7, atol=1e-6 * mean_f)
        v = brake @ (v + reach * dt * (f - mean_f - k * (x[row] - mean_x)))
        p, v = free[0] * p + free[1] * v, free[2] * p + free[3] * v
    assert_allclose(state, [p, v], rtol=1e-6)


ENDS = [{"position": p, "radial_stiffness": 250.0, "axial_stiffness": 150.0} for p in (0.0, 150.0)]
SHAFT = {"sections": [{"length": 150.0, "diameter": 50.0}], "bearings": ENDS, "coupling": {"position": 0.0}}


@pytest.mark.parametrize("on_shafts", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["wheels", "shafts"])
def test_with_a_linear_law_and_contact_kept_it_is_the_linear_response(on_shafts):
    """A law linear in the load, no relief: F is linear in x while flanks touch, both answers solve one equation."""
    seats = ({"gears": [{"gear": name, "position": 50.0}], "name": name} for name in ("pinion", "wheel"))
    tables = RIG | {
        "pair": RIG["pair"] | {"helix_angle": 15.0, "centre_distance": 155.4},
        "effects": {"tooth_bending": {"model": "plate", "order": [3, 3]}, "hertz": {"law": "yang_sun"}},
        "system": {"damping_ratio": 0.1} | ({"shafts": [SHAFT | seat for seat in seats]} if on_shafts else {}),
    }
    scene = parse_scene(tables)
    speed = np.array([1200.0, 2300.0])
    one, two = (run(scene, speed=speed, harmonics=8) for run in (response, nonlinear_response))
    assert bool(two["contact_kept"].all())
    name = "dynamic_transmission_error_amplitude"
    linear, whole = one[name].values[:, 0], two[name].sel(sweep="up").values[:, 0]
    assert_allclose(whole[:, :4], linear[:, :4], atol=0.01 * linear.max())
    if on_shafts:
        name = "bearing_force_amplitude"
        assert_allclose(two[name].sel(sweep="up")[..., :4], one[name][..., :4], atol=0.02 * float(one[name].max()))


def test_force_curve_meets_the_contact():
    """F at the approach of the contact under the mean force; nothing apart; back flanks push back."""
    sweep = rig()
    (curve,), cycle = sweep.curves, sweep.model.loaded_meshes[0]
    scene = cycle.scene
    lines = scene_lines(scene, np.arange(curve.steps) / curve.steps)
    approach = solve(assemble(scene, lines, cycle.effects)).approach / np.cos(scene.pair.meshing.beta_b)
    assert_allclose(force_at(curve, approach), scene.F_bt, rtol=1e-4)
    assert_allclose(force_at(curve, curve.begin - 1e-3), 0.0, atol=1e-9)
    assert (force_at(curve, np.full(curve.steps, -curve.backlash - 0.02)) < 0).all()
